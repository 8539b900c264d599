//! The joint calibration: exact data give the robot back, the optimum is an independent program's, and the
//! error of noisy data is at the Cramér–Rao bound of all 24 parameters, for robots of eight geometries.

mod exact;
mod goldens;
mod noisy;
mod stream;

use delta_cal::calibration::{JointCalibrator, JointOutcome};
use delta_cal::{Real, Refusal, Robot, Sample, Settings};

pub(crate) fn joint<T: Real>(
    nominal: &Robot<T>,
    samples: &[Sample<T>],
    settings: &Settings<T>,
) -> Result<JointOutcome<T>, Refusal> {
    let mut calibrator = JointCalibrator::new(nominal, settings);
    calibrator.add_many(samples).unwrap();
    calibrator.solve()
}
