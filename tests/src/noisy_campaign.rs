//! Many robots measured with noise: what a method's errors are beside its own predictions.

use crate::{Spread, generator, measurements, paper_robot, perturbed};
use delta_cal::{Noise, Robot, Sample, Settings, Tolerance};

/// Robots about the paper's, measured at random poses; the same numbers give the same robots.
#[derive(Debug, Clone, Copy)]
pub struct NoisyCampaign {
    /// Campaigns of different numbers share nothing.
    pub number: u64,
    /// How many robots.
    pub robots: u64,
    /// Samples of each.
    pub poses: usize,
    /// By how much the robots differ from nominal, mm and radians; with a prior also the tolerance.
    pub start_error: (f64, f64),
    /// One σ of position and joint angle, mm and radians.
    pub noise: (f64, f64),
    /// How the robots are spread.
    pub spread: Spread,
    /// Whether the tolerance is stated.
    pub prior: bool,
}

/// One robot of a campaign.
#[derive(Debug)]
pub struct Trial<'a> {
    /// Before calibration.
    pub nominal: &'a Robot<f64>,
    /// As it is.
    pub truth: &'a Robot<f64>,
    /// Measured with the noise.
    pub samples: &'a [Sample<f64>],
    /// The noise.
    pub noise: &'a Noise<f64>,
    /// With noise, and tolerance if there is a prior.
    pub settings: &'a Settings<f64>,
}

/// What a method made of it. Angles times the upper arm's length.
#[derive(Debug)]
pub struct Calibrated {
    /// (4.1), percent.
    pub gain: f64,
    /// Of the 24 parameters, mm.
    pub errors: Vec<f64>,
    /// Their predicted σ, mm.
    pub sigmas: Vec<f64>,
    /// The Cramér–Rao bound of Σ errors², mm².
    pub bound_squared: f64,
}

/// Over all robots of a campaign.
#[derive(Debug, Default)]
pub struct Statistics {
    /// The gains, the worst first, percent.
    pub gains: Vec<f64>,
    /// Robots that were refused; the other figures are without them.
    pub refused: usize,
    z_squared: Vec<f64>,
    error_squared: f64,
    bound_squared: f64,
}

impl NoisyCampaign {
    /// Calibrates every robot; `None` is a refusal.
    pub fn run(&self, calibrate: impl Fn(&Trial<'_>) -> Option<Calibrated>) -> Statistics {
        let nominal = paper_robot::<f64>();
        let (length, angle) = self.start_error;
        let noise = Noise::new(self.noise.0, self.noise.1).expect("the noise is valid");
        let tolerance = Tolerance::new(length, angle).expect("the tolerance is valid");
        let settings = Settings::default()
            .with_noise(noise)
            .with_tolerance(self.prior.then_some(tolerance));
        let mut statistics = Statistics::default();
        for robot in 0..self.robots {
            let mut rng = generator(self.number, robot);
            let truth = perturbed(&nominal, length, angle, self.spread, &mut rng);
            let samples = measurements(&truth, self.poses, Some(&noise), &mut rng);
            let trial = Trial {
                nominal: &nominal,
                truth: &truth,
                samples: &samples,
                noise: &noise,
                settings: &settings,
            };
            match calibrate(&trial) {
                None => statistics.refused += 1,
                Some(calibrated) => statistics.add(&calibrated),
            }
        }
        statistics.gains.sort_by(f64::total_cmp);
        statistics
    }
}

impl Statistics {
    fn add(&mut self, calibrated: &Calibrated) {
        self.gains.push(calibrated.gain);
        for (error, sigma) in calibrated.errors.iter().zip(&calibrated.sigmas) {
            self.z_squared.push((error / sigma).powi(2));
            self.error_squared += error * error;
        }
        self.bound_squared += calibrated.bound_squared;
    }

    /// rms of the errors over their predicted σ: 1 where the covariance is right.
    #[allow(clippy::cast_precision_loss)] // thousands
    pub fn z_rms(&self) -> f64 {
        (self.z_squared.iter().sum::<f64>() / self.z_squared.len() as f64).sqrt()
    }

    /// rms error over the Cramér–Rao bound: 1 is the limit.
    pub fn error_over_bound(&self) -> f64 {
        (self.error_squared / self.bound_squared).sqrt()
    }

    /// The median robot's gain, percent; NaN without robots.
    pub fn median_gain(&self) -> f64 {
        let middle = self.gains.get(self.gains.len() / 2);
        middle.copied().unwrap_or(f64::NAN)
    }
}
