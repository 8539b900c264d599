//! A fit by any method, of samples that count alike or as they were weighed.

use crate::fit::options::{CalibrationMethod, Frame};
use crate::fit::outcome::Outcome;
use crate::fit::samples::Samples;
use crate::fit::weights::Weights;
use crate::fit::{fkm, ikm, joint};
use delta_cal::{Refusal, Robot, Settings};

/// Calibrates a robot, which is the nominal of the tolerance and the start of the iteration. The frame is
/// that of the measured positions: in the sensor's the robot's place is estimated too, but for the IKM
/// method, which knows one arm at a time and takes the place that was found for granted.
///
/// # Errors
/// Every [`Refusal`] of the method.
pub fn calibrate(
    method: CalibrationMethod,
    robot: &Robot<f64>,
    samples: Samples<'_>,
    weights: Option<&Weights>,
    settings: &Settings<f64>,
    frame: Frame,
) -> Result<Outcome, Refusal> {
    match method {
        CalibrationMethod::Joint => {
            joint::calibrate_weighted(robot, samples, weights, settings, frame)
        }
        CalibrationMethod::Fkm => {
            fkm::calibrate_weighted(robot, &samples.in_memory(), weights, settings, frame)
        }
        CalibrationMethod::Ikm => ikm::calibrate_weighted(robot, samples, weights, settings),
    }
}
