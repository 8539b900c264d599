//! Accessors of an outcome, compiled for each kind: `ikm`, `joint` and `fkm`.
#![allow(unsafe_code)] // naming symbols

use super::super::Real;
use super::super::outcome::{ArmSummary, by_rows, index_of};
use super::{Outcome, arm_of, robot_of};
use crate::error::status_of;
use crate::memory::{Held, New, Out};
use crate::status::{self, Status};
use delta_cal::{ArmIndex, Parameter, Robot};

/// Makes the calibrated robot, in `size` bytes of memory: write `sizeof *robot`. `robot` may be the robot in use, which
/// is then replaced.
#[unsafe(export_name = family!("outcome_robot"))]
pub extern "C" fn outcome_robot(
    outcome: Held<Outcome>,
    mut robot: New<Robot<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        let found = *robot_of(outcome.get()?);
        robot.put(size, &found)?;
        Ok(status::OK)
    })
}

/// Writes how well an arm is known; `arm` is 0, 1 or 2. Solved together, residual and noise are the whole robot's.
///
/// Errors: `DCAL_NO_SUCH_ARM`.
#[unsafe(export_name = family!("outcome_arm"))]
pub extern "C" fn outcome_arm(
    outcome: Held<Outcome>,
    arm: i32,
    mut summary: Out<ArmSummary>,
) -> Status {
    status_of(|| {
        let found = ArmSummary::from(&arm_of(outcome.get()?, index_of(arm)?));
        summary.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
///
/// Errors: `DCAL_NO_COVARIANCE`.
#[unsafe(export_name = family!("outcome_deviations"))]
pub extern "C" fn outcome_deviations(
    outcome: Held<Outcome>,
    mut sigma: Out<[[Real; 8]; 3]>,
) -> Status {
    status_of(|| {
        let outcome = outcome.get()?;
        let mut found = [[0.0; 8]; 3];
        for (row, arm) in found.iter_mut().zip(ArmIndex::ALL) {
            let arm = arm_of(outcome, arm);
            for (sigma, parameter) in row.iter_mut().zip(Parameter::ROTARY) {
                *sigma = arm
                    .standard_deviation(parameter)
                    .ok_or(status::NO_COVARIANCE)?;
            }
        }
        sigma.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. `arm` is 0, 1 or 2.
///
/// Errors: `DCAL_NO_SUCH_ARM`, `DCAL_NO_COVARIANCE`.
#[unsafe(export_name = family!("outcome_arm_covariance"))]
pub extern "C" fn outcome_arm_covariance(
    outcome: Held<Outcome>,
    arm: i32,
    mut covariance: Out<[[Real; 8]; 8]>,
) -> Status {
    status_of(|| {
        let arm = arm_of(outcome.get()?, index_of(arm)?);
        let found = by_rows(&arm.covariance.ok_or(status::NO_COVARIANCE)?);
        covariance.put(found)?;
        Ok(status::OK)
    })
}
