//! What an accepted result is never without.

use delta_cal::{Parameter, Real, Robot, RobotOutcome};

/// Every parameter is a finite number.
pub(crate) fn finite_robot<T: Real>(robot: &Robot<T>) {
    for arm in robot.arms() {
        assert!(
            arm.parameters().iter().all(|value| value.finite()),
            "{robot:?}"
        );
    }
}

/// Every figure of a calibration is a number, and of the size that its meaning allows.
pub(crate) fn finite_outcome<T: Real>(outcome: &RobotOutcome<T>) {
    finite_robot(&outcome.robot);
    for arm in &outcome.arms {
        let figures = [arm.residual_rms, arm.condition, arm.degrees_of_freedom];
        let all = figures.iter().chain(&arm.estimated_noise);
        for figure in all {
            assert!(figure.finite() && *figure >= T::ZERO, "{outcome:?}");
        }
        for share in &arm.prior_share {
            let most = T::ONE + T::EPSILON.square_root();
            assert!(*share >= T::ZERO && *share <= most, "{outcome:?}");
        }
        if let Some(covariance) = &arm.covariance {
            assert!(covariance.iter().all(|entry| entry.finite()), "{outcome:?}");
            for parameter in Parameter::ROTARY {
                let sigma = arm.standard_deviation(parameter);
                assert!(
                    sigma.is_some_and(|sigma| sigma.finite() && sigma >= T::ZERO),
                    "{outcome:?}"
                );
            }
        }
    }
}
