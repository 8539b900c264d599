//! Measurements of which some are wrong, and what a fit makes of them.

use crate::{Spread, generator, measurements, paper_robot, perturbed, uniform};
use delta_cal::{Noise, Robot, Sample};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// What is wrong with the wrong samples. Each of them lies at least 5 mm from where the robot is at
/// its joint angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    /// The position, by 5 to 50 mm in any direction.
    Anywhere,
    /// The position, by 5 to 50 mm downwards.
    OneSide,
    /// The position, by 20 mm in one direction, of the poses nearest to one of them.
    Cluster,
    /// One joint angle, by 1° to 10°.
    Joint,
    /// The position, by 50 to 200 mm in any direction.
    Far,
    /// Two joint angles are exchanged.
    Exchanged,
    /// Two coordinates of the position are exchanged.
    ExchangedCoordinates,
    /// One digit of the six numbers, in the tens or hundreds of mm, the units or tens of degrees.
    Digit,
    /// All of these but the cluster, in turn.
    Mixed,
}

impl Wrong {
    /// Every kind.
    pub const ALL: [Self; 9] = [
        Self::Anywhere,
        Self::OneSide,
        Self::Cluster,
        Self::Joint,
        Self::Far,
        Self::Exchanged,
        Self::ExchangedCoordinates,
        Self::Digit,
        Self::Mixed,
    ];

    const MIXED: [Self; 7] = [
        Self::Anywhere,
        Self::OneSide,
        Self::Joint,
        Self::Far,
        Self::Exchanged,
        Self::ExchangedCoordinates,
        Self::Digit,
    ];

    /// Spoils a sample, the `number`-th.
    fn spoil(
        self,
        sample: &mut Sample<f64>,
        number: usize,
        common: &Vector3<f64>,
        rng: &mut Pcg32,
    ) {
        let (column, size) = (number % 3, 27.5 + 22.5 * uniform(rng));
        let other = (column + 1) % 3;
        match self {
            Self::Anywhere => sample.position += direction(rng) * size,
            Self::OneSide => sample.position.z -= size,
            Self::Cluster => sample.position += common * 20.0,
            Self::Joint => {
                let degrees = (5.5 + 4.5 * uniform(rng)) * uniform(rng).signum();
                sample.joints[column] += degrees.to_radians();
            }
            Self::Far => {
                sample.position += direction(rng) * (125.0 + 75.0 * uniform(rng));
            }
            Self::Exchanged => sample.joints.swap(column, other),
            Self::ExchangedCoordinates => sample.position.swap_rows(column, other),
            Self::Digit => {
                let digit = (4.5 + 4.5 * uniform(rng)).ceil().copysign(uniform(rng));
                let tens = if uniform(rng) < 0.0 { 1.0 } else { 10.0 };
                if number.is_multiple_of(2) {
                    sample.position[column] += 10.0 * tens * digit;
                } else {
                    sample.joints[column] += (tens * digit).to_radians();
                }
            }
            Self::Mixed => {
                let kind = Self::MIXED[number % Self::MIXED.len()];
                kind.spoil(sample, number, common, rng);
            }
        }
    }
}

/// One robot and its measurements.
#[derive(Debug)]
pub struct Spoilt {
    /// Before calibration.
    pub nominal: Robot<f64>,
    /// As it is.
    pub truth: Robot<f64>,
    /// All of them, the wrong ones among the others.
    pub samples: Vec<Sample<f64>>,
    /// All of them before any was spoilt.
    pub unspoilt: Vec<Sample<f64>>,
    /// Which are wrong, for each sample.
    pub wrong: Vec<bool>,
}

/// What a wrong sample is off by at least, mm.
const GROSS: f64 = 5.0;

impl Spoilt {
    /// So many samples, none wrong; the robot is up to 1 mm and 1° off.
    pub fn unspoilt(campaign: u64, robot: u64, count: usize, noise: &Noise<f64>) -> Self {
        Self::drawn(count, noise, &mut generator(campaign, robot))
    }

    fn drawn(count: usize, noise: &Noise<f64>, rng: &mut Pcg32) -> Self {
        let nominal = paper_robot();
        let truth = perturbed(&nominal, 1.0, 1f64.to_radians(), Spread::Uniform, rng);
        let samples = measurements(&truth, count, Some(noise), rng);
        Self {
            nominal,
            truth,
            unspoilt: samples.clone(),
            wrong: vec![false; samples.len()],
            samples,
        }
    }

    /// Sixty samples, `wrong` of them wrong.
    pub fn new(campaign: u64, robot: u64, wrong: usize, kind: Wrong, noise: &Noise<f64>) -> Self {
        Self::of_samples(60, campaign, robot, wrong, kind, noise)
    }

    /// So many samples, `wrong` of them wrong.
    pub fn of_samples(
        samples: usize,
        campaign: u64,
        robot: u64,
        wrong: usize,
        kind: Wrong,
        noise: &Noise<f64>,
    ) -> Self {
        let mut rng = generator(campaign, robot);
        let mut spoilt = Self::drawn(samples, noise, &mut rng);
        let mut order: Vec<usize> = (0..spoilt.samples.len()).collect();
        if kind == Wrong::Cluster {
            let centre = spoilt.samples[0].position;
            order.sort_by(|a, b| {
                let from = |index: usize| (spoilt.samples[index].position - centre).norm();
                from(*a).total_cmp(&from(*b))
            });
        }
        let common = direction(&mut rng);
        let mut number = 0;
        for index in order {
            if number == wrong {
                break;
            }
            let mut sample = spoilt.samples[index];
            kind.spoil(&mut sample, number, &common, &mut rng);
            // Exchanged numbers may be nearly equal.
            if spoilt.off_by(&sample) >= GROSS {
                spoilt.samples[index] = sample;
                spoilt.wrong[index] = true;
                number += 1;
            }
        }
        spoilt
    }

    /// How far a sample lies from where the robot is.
    fn off_by(&self, sample: &Sample<f64>) -> f64 {
        let position = self.truth.forward(&sample.joints);
        position.map_or(f64::INFINITY, |position| {
            (position - sample.position).norm()
        })
    }

    /// The samples that are not wrong.
    pub fn good(&self) -> Vec<Sample<f64>> {
        let good = self.samples.iter().zip(&self.wrong);
        good.filter(|(_, wrong)| !**wrong)
            .map(|(sample, _)| *sample)
            .collect()
    }

    /// Σ of the squared position errors over poses that no fit has seen, mm².
    pub fn position_error(&self, robot: &Robot<f64>, campaign: u64) -> f64 {
        let mut rng = generator(campaign ^ 0x5eed, 0);
        let unseen = measurements(&self.truth, 40, None, &mut rng);
        let off = unseen.iter().map(|sample| {
            let position = robot
                .forward(&sample.joints)
                .map_or(1e3, |computed| (computed - sample.position).norm());
            position * position
        });
        off.sum()
    }
}

/// Any direction, each as likely.
pub fn direction(rng: &mut Pcg32) -> Vector3<f64> {
    loop {
        let vector = Vector3::new(uniform(rng), uniform(rng), uniform(rng));
        if (0.1..=1.0).contains(&vector.norm()) {
            return vector.normalize();
        }
    }
}

/// How well wrong samples are told from right ones, over many robots.
#[derive(Debug, Clone, Copy, Default)]
pub struct Found {
    /// Wrong and named.
    pub found: u32,
    /// Wrong and not named.
    pub missed: u32,
    /// Named and not wrong.
    pub falsely: u32,
}

impl Found {
    /// Adds one robot.
    pub fn add(&mut self, wrong: &[bool], named: impl Iterator<Item = bool>) {
        for (wrong, named) in wrong.iter().zip(named) {
            match (wrong, named) {
                (true, true) => self.found += 1,
                (true, false) => self.missed += 1,
                (false, true) => self.falsely += 1,
                (false, false) => {}
            }
        }
    }

    /// Of the wrong ones, the part that is named.
    pub fn recall(&self) -> f64 {
        f64::from(self.found) / f64::from((self.found + self.missed).max(1))
    }

    /// Of the named ones, the part that is wrong.
    pub fn precision(&self) -> f64 {
        f64::from(self.found) / f64::from((self.found + self.falsely).max(1))
    }
}
