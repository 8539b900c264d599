//! The result of a calibration.
#![allow(unsafe_code)] // naming symbols, and promises about plain numbers

use super::Real;
use crate::error::{Error, status_of};
use crate::memory::{Held, Out, Plain};
use crate::plain::{GRADIENT_VANISHED, ROUNDING_REACHED, USED_FREE, USED_NOMINAL, USED_SEARCH};
use crate::status::{self, Status};
use delta_cal::ArmIndex;
use delta_cal::calibration::{ArmOutcome, JointOutcome, StartUsed, Termination};
use delta_cal::nalgebra::SMatrix;

/// How well one arm is known.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSummary {
    /// Samples taken in.
    pub samples: u64,
    /// Linearisations of all starts together.
    pub iterations: u32,
    /// `DCAL_GRADIENT_VANISHED` or `DCAL_ROUNDING_REACHED`.
    pub termination: i32,
    /// Where the result comes from: `DCAL_USED_NOMINAL` and so on.
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

// SAFETY: C layout, only numbers, no padding (checked by the header's test).
unsafe impl Plain for ArmSummary {}

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

/// The arm of this number in C.
pub(crate) fn index_of(number: i32) -> Result<ArmIndex, Error> {
    match number {
        0 => Ok(ArmIndex::First),
        1 => Ok(ArmIndex::Second),
        2 => Ok(ArmIndex::Third),
        _ => Err(status::NO_SUCH_ARM.into()),
    }
}

/// Row by row, as C has a matrix.
pub(crate) fn by_rows<const N: usize>(matrix: &SMatrix<Real, N, N>) -> [[Real; N]; N] {
    matrix.transpose().into()
}

/// Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian, radian^2.
///
/// Errors: `DCAL_NO_COVARIANCE`.
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
