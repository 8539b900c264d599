//! The result of a calibration.

use super::Real;
use crate::error::Error;
use crate::memory::plain;
use crate::plain::{GRADIENT_VANISHED, ROUNDING_REACHED, USED_FREE, USED_NOMINAL, USED_SEARCH};
use crate::status;
use core::array;
use delta_cal::calibration::{
    ArmOutcome, Estimate, Estimator, Ikm, Joint, JointOutcome, Start, Termination,
};
use delta_cal::observations::ObservationOutcome;
use delta_cal::{ArmIndex, Real as _, RobotOutcome};

plain! {
    /// How well one arm is known.
    pub struct ArmSummary {
        /// Number of samples.
        pub samples: u64,
        /// Linearisations of all starts together.
        pub iterations: u32,
        /// `DCAL_GRADIENT_VANISHED` or `DCAL_ROUNDING_REACHED`.
        pub termination: i32,
        /// The start that led to the result: `DCAL_USED_NOMINAL` and so on.
        pub start: i32,
        /// 1 if there is a covariance, 0 if the noise is not stated and there are too few redundant samples to estimate it.
        pub has_covariance: i32,
        /// 1 if `estimated_noise` was estimated, 0 if the noise is stated or no sample is redundant.
        pub has_estimated_noise: i32,
        /// 0.
        pub reserved: i32,
        /// Root mean square of the residuals: in sigma with a stated noise, otherwise length.
        pub residual_rms: Real,
        /// One sigma of a residual, 0 if not estimated. Length.
        pub estimated_noise: Real,
        /// Number of samples minus number of parameters, as far as the samples and not the tolerance determine them.
        pub degrees_of_freedom: Real,
        /// Condition number of the weighted Jacobian with columns scaled to unit length; 1 is best.
        pub condition: Real,
        /// The share of each parameter that comes from the tolerance rather than the samples, 0 to 1.
        pub prior_share: [Real; 8],
    }
}

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
                Start::Nominal => USED_NOMINAL,
                Start::Free => USED_FREE,
                Start::Search => USED_SEARCH,
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
    let number = usize::try_from(number).unwrap_or(usize::MAX);
    let arm = ArmIndex::ALL.get(number).copied();
    arm.ok_or(status::NO_SUCH_ARM.into())
}

/// What a calibrator has found.
pub(crate) trait Found {
    fn arm(&self, arm: ArmIndex) -> ArmOutcome<Real>;

    /// The covariance of all 24 parameters, by row and column.
    fn covariance(&self) -> Option<impl Fn(usize, usize) -> Real>;
}

impl Found for RobotOutcome<Real> {
    fn arm(&self, arm: ArmIndex) -> ArmOutcome<Real> {
        Ikm::arm(self, arm)
    }

    fn covariance(&self) -> Option<impl Fn(usize, usize) -> Real> {
        let [first, second, third] = &self.arms;
        let arms = [first, second, third].map(|arm| arm.covariance.as_ref());
        let known = arms.iter().all(Option::is_some);
        known.then_some(move |row: usize, column: usize| {
            let own = arms.get(row / 8).filter(|_| row / 8 == column / 8);
            let entry = own.and_then(|own| own.as_ref()?.get((row % 8, column % 8)));
            entry.copied().unwrap_or(0.0)
        })
    }
}

impl Found for JointOutcome<Real> {
    fn arm(&self, arm: ArmIndex) -> ArmOutcome<Real> {
        Joint::arm(self, arm)
    }

    fn covariance(&self) -> Option<impl Fn(usize, usize) -> Real> {
        entries(&self.estimate)
    }
}

impl<const N: usize> Found for ObservationOutcome<Real, N> {
    fn arm(&self, arm: ArmIndex) -> ArmOutcome<Real> {
        self.of_robot().arm(arm)
    }

    fn covariance(&self) -> Option<impl Fn(usize, usize) -> Real> {
        entries(&self.estimate)
    }
}

/// The entries of a covariance in its place: a copy would take 2.3 kB of stack, or twice that.
fn entries<const N: usize>(estimate: &Estimate<Real, N>) -> Option<impl Fn(usize, usize) -> Real> {
    let covariance = estimate.covariance.as_ref()?;
    Some(|row: usize, column: usize| covariance.get((row, column)).copied().unwrap_or(0.0))
}

/// The standard uncertainty of each parameter.
pub(crate) fn deviations_of(outcome: &impl Found) -> Result<[[Real; 8]; 3], Error> {
    let entry = outcome.covariance().ok_or(status::NO_COVARIANCE)?;
    let of = |index: usize| entry(index, index).square_root();
    Ok([0, 8, 16].map(|first| array::from_fn(|parameter| of(first + parameter))))
}
