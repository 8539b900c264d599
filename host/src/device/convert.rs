//! Between what files hold, in `f64`, and what goes over the wire.

use super::error::DeviceError;
use super::number::Number;
use super::session::{Measurement, Solution};
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::SamplesFile;
use crate::fit::options::{Options, Streaming};
use crate::fit::outcome::Outcome;
use delta_cal::calibration::ArmOutcome;
use delta_cal::robot::Arm;
use delta_cal::stream::Estimator;
use delta_cal::{Parameter, Real, Robot, RobotOutcome};
use delta_cal_protocol::{ArmReport, Begin};
use nalgebra::{SMatrix, SVector};
use std::num::NonZeroU32;

/// What a session is begun with: what a robot file states of tolerance and noise, rounded to the controller's numbers, and the
/// options. The session is 0: it is drawn when it begins.
pub fn begin<T: Number>(robot: &RobotFile, options: Options) -> Begin<T> {
    let rounded = T::from_f64;
    let Streaming {
        gate,
        held_out,
        forget,
    } = options.streaming;
    Begin {
        session: 0,
        tolerance: robot.tolerance.map(|t| {
            (
                rounded(t.of(Parameter::Lb)),
                rounded(t.of(Parameter::Theta)),
            )
        }),
        noise: robot
            .noise
            .map(|n| (n.position_by_axis().map(rounded), rounded(n.joint()))),
        without_guess: options.no_guess,
        estimator: if options.method.separates_arms() {
            Estimator::Arms
        } else {
            Estimator::Joint
        },
        gate,
        held_out: held_out.map(NonZeroU32::get),
        forgetting: forget.map(|samples| rounded(f64::from(samples.get()))),
    }
}

/// The samples of a file, rounded to the controller's numbers.
pub fn measurements<T: Number>(samples: &SamplesFile) -> Vec<Measurement<T>> {
    samples
        .rows
        .iter()
        .map(|row| Measurement {
            joints: row.value.joints.map(T::from_f64),
            position: row.value.position.map(T::from_f64).data.0[0],
        })
        .collect()
}

/// The robot of these parameters, in another type.
///
/// # Errors
/// They are not the geometry of a robot.
pub fn robot<T: Real, U: Real>(arms: &[[T; 8]; 3]) -> Result<Robot<U>, DeviceError> {
    let parameters = arms.map(|arm| arm.map(|value| U::from_f64(value.to_f64())));
    Robot::from_parameters(parameters).map_err(|_| DeviceError::ImpossibleGeometry)
}

/// A controller's result in `f64`, which changes no number.
///
/// # Errors
/// The parameters are not the geometry of a robot, or another figure is impossible.
pub fn outcome<T: Number>(solution: &Solution<T>) -> Result<Outcome, DeviceError> {
    let blocks = solution.across.iter().flatten();
    let mut across = blocks.flat_map(|block| block.covariance.iter().flatten().flatten());
    if !(solution.arms.iter().all(possible) && across.all(|entry| entry.finite())) {
        return Err(DeviceError::ImpossibleOutcome);
    }
    let robot: Robot<f64> = robot(&solution.parameters())?;
    let [first, second, third] = &solution.arms;
    let [arm_1, arm_2, arm_3] = *robot.arms();
    let mut outcome = Outcome::from(RobotOutcome {
        robot,
        arms: [
            arm_outcome(first, arm_1),
            arm_outcome(second, arm_2),
            arm_outcome(third, arm_3),
        ],
    });
    for block in solution.across.iter().flatten() {
        outcome.covariance = outcome
            .covariance
            .zip(block.covariance)
            .map(|(mut all, own)| {
                let (row, column) = (8 * block.rows.index(), 8 * block.columns.index());
                let own = SMatrix::<f64, 8, 8>::from_fn(|row, column| own[column][row].to_f64());
                all.fixed_view_mut::<8, 8>(row, column).copy_from(&own);
                all.fixed_view_mut::<8, 8>(column, row)
                    .copy_from(&own.transpose());
                all
            });
    }
    Ok(outcome)
}

/// Whether every figure beside the parameters is finite, and none negative that cannot be. A frame can
/// be whole and hold anything.
fn possible<T: Real>(report: &ArmReport<T>) -> bool {
    let sizes = [
        report.residual_rms,
        report.degrees_of_freedom,
        report.condition,
    ];
    let variances = report
        .covariance
        .iter()
        .flat_map(|columns| (0..8).map(|index| columns[index][index]));
    let mut sizes = sizes
        .into_iter()
        .chain(report.estimated_noise)
        .chain(report.prior_share)
        .chain(variances);
    let mut entries = report.covariance.iter().flatten().flatten();
    sizes.all(|size| size.finite() && size >= T::ZERO) && entries.all(|entry| entry.finite())
}

fn arm_outcome<T: Real>(report: &ArmReport<T>, arm: Arm<f64>) -> ArmOutcome<f64> {
    ArmOutcome {
        arm,
        covariance: report
            .covariance
            .map(|columns| SMatrix::from_fn(|row, column| columns[column][row].to_f64())),
        residual_rms: report.residual_rms.to_f64(),
        estimated_noise: report.estimated_noise.map(Real::to_f64),
        degrees_of_freedom: report.degrees_of_freedom.to_f64(),
        samples: report.samples,
        iterations: report.iterations,
        termination: report.termination,
        start: report.start,
        condition: report.condition.to_f64(),
        prior_share: SVector::from(report.prior_share.map(Real::to_f64)),
    }
}
