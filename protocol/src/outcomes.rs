//! Results as messages: the same on the controller and on whoever compares with it.

use crate::messages::{ArmReport, CovarianceBlock};
use delta_cal::calibration::{ArmOutcome, JointOutcome};
use delta_cal::robot::Transmission;
use delta_cal::stream::Validation;
use delta_cal::{ArmIndex, Real};

impl<T: Real> ArmReport<T> {
    /// Of one arm's outcome, and of how well all three agree with the held-out samples.
    pub fn new(
        arm: ArmIndex,
        outcome: &ArmOutcome<T>,
        validations: Option<&[Validation<T>; 3]>,
    ) -> Self {
        let [prior_share] = outcome.prior_share.data.0;
        Self {
            arm,
            parameters: outcome.arm.parameters(),
            transmission: outcome.arm.transmission().map(Transmission::numbers),
            covariance: outcome.covariance.map(|covariance| covariance.data.0),
            residual_rms: outcome.residual_rms,
            estimated_noise: outcome.estimated_noise,
            degrees_of_freedom: outcome.degrees_of_freedom,
            samples: outcome.samples,
            iterations: outcome.iterations,
            termination: outcome.termination,
            start: outcome.start,
            condition: outcome.condition,
            prior_share,
            held_out: validations.and_then(|all| all.get(arm.index()).copied()),
        }
    }
}

impl<T: Real> CovarianceBlock<T> {
    /// Of a joint outcome.
    pub fn new(outcome: &JointOutcome<T>, rows: ArmIndex, columns: ArmIndex) -> Self {
        let block = |all: &delta_cal::nalgebra::SMatrix<T, 24, 24>| {
            let mut block = [[T::ZERO; 8]; 8];
            for (column, entries) in (8 * columns.index()..).zip(&mut block) {
                for (row, entry) in (8 * rows.index()..).zip(entries) {
                    *entry = all.get((row, column)).copied().unwrap_or(T::ZERO);
                }
            }
            block
        };
        Self {
            rows,
            columns,
            covariance: outcome.estimate.covariance.as_ref().map(block),
        }
    }
}
