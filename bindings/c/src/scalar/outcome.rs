//! What a calibration found.
#![allow(unsafe_code)] // naming symbols

use super::Real;
use crate::error::{Error, status_of};
use crate::memory::{Held, New, Out, Plain};
use crate::plain::{
    GRADIENT_VANISHED, ROUNDING_REACHED, USED_FREE, USED_JOINT, USED_NOMINAL, USED_SEARCH,
};
use crate::status::{self, Status};
use delta_cal::calibration::{ArmOutcome, JointOutcome, StartUsed, Termination};
use delta_cal::nalgebra::SMatrix;
use delta_cal::{ArmIndex, Parameter, Robot, RobotOutcome};

/// How well one arm is known.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSummary {
    /// Samples taken in.
    pub samples: u64,
    /// Linearisations of all starts together.
    pub iterations: u32,
    /// `DELTA_CAL_GRADIENT_VANISHED` or `DELTA_CAL_ROUNDING_REACHED`.
    pub termination: i32,
    /// Where the result comes from: `DELTA_CAL_USED_NOMINAL` and so on.
    pub start: i32,
    /// 1 if there is a covariance, 0 if the noise is not stated and too few samples are left over to estimate it.
    pub has_covariance: i32,
    /// 1 if `estimated_noise` was estimated, 0 with a stated noise, or if no sample is left over.
    pub has_estimated_noise: i32,
    /// 0.
    pub reserved: i32,
    /// Root mean square of the residuals: in sigma with a stated noise, otherwise length.
    pub residual_rms: Real,
    /// One sigma of a residual, 0 if not estimated. Length.
    pub estimated_noise: Real,
    /// Samples less parameters, as far as the samples and not the tolerance determine them.
    pub degrees_of_freedom: Real,
    /// Condition number of the weighted Jacobian, its columns scaled to unit length; 1 is best.
    pub condition: Real,
    /// For each parameter the share of the result that the tolerance decided and not the samples, 0 to 1.
    pub prior_share: [Real; 8],
}

impl Plain for ArmSummary {}

impl From<&ArmOutcome<Real>> for ArmSummary {
    fn from(arm: &ArmOutcome<Real>) -> Self {
        Self {
            samples: arm.samples,
            iterations: u32::from(arm.iterations),
            termination: match arm.termination {
                Termination::GradientVanished => GRADIENT_VANISHED,
                Termination::RoundingReached => ROUNDING_REACHED,
            },
            start: match arm.start {
                StartUsed::Nominal => USED_NOMINAL,
                StartUsed::Free => USED_FREE,
                StartUsed::Search => USED_SEARCH,
                StartUsed::Joint => USED_JOINT,
            },
            has_covariance: i32::from(arm.covariance.is_some()),
            has_estimated_noise: i32::from(arm.estimated_noise.is_some()),
            reserved: 0,
            residual_rms: arm.residual_rms,
            estimated_noise: arm.estimated_noise.unwrap_or(0.0),
            degrees_of_freedom: arm.degrees_of_freedom,
            condition: arm.condition,
            prior_share: arm.prior_share.into(),
        }
    }
}

fn arm_of(number: i32) -> Result<ArmIndex, Error> {
    match number {
        0 => Ok(ArmIndex::First),
        1 => Ok(ArmIndex::Second),
        2 => Ok(ArmIndex::Third),
        _ => Err(status::NO_SUCH_ARM.into()),
    }
}

fn by_rows<const N: usize>(matrix: &SMatrix<Real, N, N>) -> [[Real; N]; N] {
    matrix.transpose().into()
}

/// One sigma of every parameter, or that there is none.
fn deviations(of: impl Fn(ArmIndex, Parameter) -> Option<Real>) -> Result<[[Real; 8]; 3], Error> {
    let mut found = [[0.0; 8]; 3];
    for (row, arm) in found.iter_mut().zip(ArmIndex::ALL) {
        for (sigma, parameter) in row.iter_mut().zip(Parameter::ROTARY) {
            *sigma = of(arm, parameter).ok_or(Error::from(status::NO_COVARIANCE))?;
        }
    }
    Ok(found)
}

/// Makes the calibrated robot, in `size` bytes of memory: write `sizeof *robot`. `robot` may be the robot in use, which
/// is then replaced.
#[unsafe(export_name = name!("outcome_robot"))]
pub extern "C" fn outcome_robot(
    outcome: Held<RobotOutcome<Real>>,
    mut robot: New<Robot<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        let found = outcome.get()?.robot;
        robot.put(size, &found)?;
        Ok(status::OK)
    })
}

/// Writes how well an arm is known; `arm` is 0, 1 or 2.
///
/// Errors: `DELTA_CAL_NO_SUCH_ARM`.
#[unsafe(export_name = name!("outcome_arm"))]
pub extern "C" fn outcome_arm(
    outcome: Held<RobotOutcome<Real>>,
    arm: i32,
    mut summary: Out<ArmSummary>,
) -> Status {
    status_of(|| {
        let found = ArmSummary::from(&outcome.get()?.arms[arm_of(arm)?.index()]);
        summary.put(found)?;
        Ok(status::OK)
    })
}

/// Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
///
/// Errors: `DELTA_CAL_NO_COVARIANCE`.
#[unsafe(export_name = name!("outcome_deviations"))]
pub extern "C" fn outcome_deviations(
    outcome: Held<RobotOutcome<Real>>,
    mut sigma: Out<[[Real; 8]; 3]>,
) -> Status {
    status_of(|| {
        let outcome = outcome.get()?;
        let found =
            deviations(|arm, parameter| outcome.arms[arm.index()].standard_deviation(parameter))?;
        sigma.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. `arm` is 0, 1 or 2.
///
/// Errors: `DELTA_CAL_NO_SUCH_ARM`, `DELTA_CAL_NO_COVARIANCE`.
#[unsafe(export_name = name!("outcome_covariance"))]
pub extern "C" fn outcome_covariance(
    outcome: Held<RobotOutcome<Real>>,
    arm: i32,
    mut covariance: Out<[[Real; 8]; 8]>,
) -> Status {
    status_of(|| {
        let arm = &outcome.get()?.arms[arm_of(arm)?.index()];
        let found = arm
            .covariance
            .as_ref()
            .ok_or(Error::from(status::NO_COVARIANCE))?;
        let found = by_rows(found);
        covariance.put(found)?;
        Ok(status::OK)
    })
}

/// Makes the calibrated robot, in `size` bytes of memory: write `sizeof *robot`. `robot` may be the robot in use, which
/// is then replaced.
#[unsafe(export_name = name!("joint_outcome_robot"))]
pub extern "C" fn joint_outcome_robot(
    outcome: Held<JointOutcome<Real>>,
    mut robot: New<Robot<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        let found = outcome.get()?.robot;
        robot.put(size, &found)?;
        Ok(status::OK)
    })
}

/// Writes how well an arm is known; `arm` is 0, 1 or 2. Residual and noise are the whole robot's.
///
/// Errors: `DELTA_CAL_NO_SUCH_ARM`.
#[unsafe(export_name = name!("joint_outcome_arm"))]
pub extern "C" fn joint_outcome_arm(
    outcome: Held<JointOutcome<Real>>,
    arm: i32,
    mut summary: Out<ArmSummary>,
) -> Status {
    status_of(|| {
        let found = ArmSummary::from(&outcome.get()?.arm(arm_of(arm)?));
        summary.put(found)?;
        Ok(status::OK)
    })
}

/// Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
///
/// Errors: `DELTA_CAL_NO_COVARIANCE`.
#[unsafe(export_name = name!("joint_outcome_deviations"))]
pub extern "C" fn joint_outcome_deviations(
    outcome: Held<JointOutcome<Real>>,
    mut sigma: Out<[[Real; 8]; 3]>,
) -> Status {
    status_of(|| {
        let outcome = outcome.get()?;
        let found = deviations(|arm, parameter| outcome.standard_deviation(arm, parameter))?;
        sigma.put(found)?;
        Ok(status::OK)
    })
}

/// Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian, radian^2.
///
/// Errors: `DELTA_CAL_NO_COVARIANCE`.
#[unsafe(export_name = name!("joint_outcome_covariance"))]
pub extern "C" fn joint_outcome_covariance(
    outcome: Held<JointOutcome<Real>>,
    mut covariance: Out<[[Real; 24]; 24]>,
) -> Status {
    status_of(|| {
        let all = &outcome.get()?.estimate.covariance;
        let found = all.as_ref().ok_or(Error::from(status::NO_COVARIANCE))?;
        let found = by_rows(found);
        covariance.put(found)?;
        Ok(status::OK)
    })
}

/// Makes the outcome of each arm by itself, in `size` bytes of memory: write `sizeof *arms`. What the joint outcome says
/// of two arms together is left out.
#[unsafe(export_name = name!("joint_outcome_arms"))]
pub extern "C" fn joint_outcome_arms(
    outcome: Held<JointOutcome<Real>>,
    mut arms: New<RobotOutcome<Real>>,
    size: usize,
) -> Status {
    status_of(|| {
        arms.usable(size)?;
        let found = RobotOutcome::from(outcome.get()?);
        arms.put(size, &found)?;
        Ok(status::OK)
    })
}
