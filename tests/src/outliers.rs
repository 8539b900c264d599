//! Measurements of which some are wrong, and what a fit makes of them.

use crate::{
    Spread, generator, measurements, paper_robot, parameter_differences, perturbed, uniform,
};
use delta_cal::{Noise, Robot, Sample};
use nalgebra::Vector3;
use rand_pcg::Pcg32;

/// What is wrong with the wrong samples.
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
    /// Half of them as [`Anywhere`](Self::Anywhere), half as [`Joint`](Self::Joint).
    Mixed,
}

impl Wrong {
    /// Every kind.
    pub const ALL: [Self; 5] = [
        Self::Anywhere,
        Self::OneSide,
        Self::Cluster,
        Self::Joint,
        Self::Mixed,
    ];
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
    /// Which are wrong, for each sample.
    pub wrong: Vec<bool>,
}

impl Spoilt {
    /// Sixty samples, the first in `count` of some order wrong; the robot is up to 1 mm and 1° off.
    pub fn new(campaign: u64, robot: u64, count: usize, kind: Wrong, noise: &Noise<f64>) -> Self {
        let mut rng = generator(campaign, robot);
        let nominal = paper_robot();
        let truth = perturbed(&nominal, 1.0, 1f64.to_radians(), Spread::Uniform, &mut rng);
        let mut samples = measurements(&truth, 60, Some(noise), &mut rng);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        if kind == Wrong::Cluster {
            let centre = samples[0].position;
            order.sort_by(|a, b| {
                let from = |index: usize| (samples[index].position - centre).norm();
                from(*a).total_cmp(&from(*b))
            });
        }
        let mut wrong = vec![false; samples.len()];
        let common = direction(&mut rng);
        for (number, index) in order.into_iter().take(count).enumerate() {
            wrong[index] = true;
            let sample = &mut samples[index];
            let size = 27.5 + 22.5 * uniform(&mut rng);
            let joint = kind == Wrong::Joint || (kind == Wrong::Mixed && number % 2 == 0);
            if joint {
                let degrees = (5.5 + 4.5 * uniform(&mut rng)) * uniform(&mut rng).signum();
                sample.joints[number % 3] += degrees.to_radians();
            } else {
                sample.position += match kind {
                    Wrong::OneSide => Vector3::new(0.0, 0.0, -size),
                    Wrong::Cluster => common * 20.0,
                    _ => direction(&mut rng) * size,
                };
            }
        }
        Self {
            nominal,
            truth,
            samples,
            wrong,
        }
    }

    /// The samples that are not wrong.
    pub fn good(&self) -> Vec<Sample<f64>> {
        let good = self.samples.iter().zip(&self.wrong);
        good.filter(|(_, wrong)| !**wrong)
            .map(|(sample, _)| *sample)
            .collect()
    }

    /// Σ of the squared errors of the 24 parameters, mm², angles times the upper arm's length.
    pub fn parameter_error(&self, robot: &Robot<f64>) -> f64 {
        let differences = parameter_differences(robot, &self.truth);
        differences.iter().map(|error| error * error).sum()
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

fn direction(rng: &mut Pcg32) -> Vector3<f64> {
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
