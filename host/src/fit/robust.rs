//! Fits that samples which disagree with all others do not spoil, by either method.

use crate::fit::fkm;
use crate::fit::options::CalibrationMethod;
use crate::fit::outcome::Outcome;
use crate::fit::weights::{Fit, SampleWeight};
use delta_cal::robust::{Loss, RobustRefusal, WeighedSample, robust_fit};
use delta_cal::{Robot, Sample, Settings};

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
) -> Result<Fit, RobustRefusal> {
    let mut work = vec![WeighedSample::vacant(); samples.len()];
    let ikm = robust_fit(robot, settings, samples, loss, &mut work)?;
    match method {
        CalibrationMethod::Ikm => Ok(Fit {
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
