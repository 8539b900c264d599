//! Fits that samples which disagree with all others do not spoil, by either method.

use crate::{CalibrationMethod, Outcome, fkm};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::{Robot, Sample, Settings};

/// What a fit makes of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleWeight {
    /// What it counts, 0 to 1; of the IKM method the least of the three arms' weights.
    pub weight: f64,
    /// Whether it disagrees so much with the others that it does not count at all.
    pub suspected: bool,
}

impl SampleWeight {
    /// As the squared loss counts every sample.
    pub(crate) const FULL: Self = Self {
        weight: 1.0,
        suspected: false,
    };
}

/// A robust fit's result.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustFit {
    /// As of the plain fit.
    pub outcome: Outcome,
    /// Every sample by itself, in their order.
    pub samples: Vec<SampleWeight>,
    /// Whether the weights settled.
    pub settled: bool,
}

/// Calibrates a robot from samples of which some may be wrong.
///
/// # Errors
/// As [`robust_fit`].
pub fn calibrate_robust(
    robot: &Robot<f64>,
    samples: &[Sample<f64>],
    settings: &Settings<f64>,
    method: CalibrationMethod,
    loss: Loss,
) -> Result<RobustFit, RobustRefusal> {
    let mut work = vec![WeighedSample::vacant(); samples.len()];
    let ikm = robust_fit(robot, settings, samples, loss, &mut work)?;
    match method {
        CalibrationMethod::Ikm => Ok(RobustFit {
            outcome: Outcome::from(ikm.fit),
            samples: work
                .iter()
                .map(|sample| SampleWeight {
                    weight: sample.weight(),
                    suspected: sample.suspected(),
                })
                .collect(),
            settled: ikm.settled,
        }),
        CalibrationMethod::Fkm => {
            fkm::robust::calibrate_robust(robot, samples, settings, loss, &ikm.fit)
        }
    }
}
