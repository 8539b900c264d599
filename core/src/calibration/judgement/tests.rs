#![allow(clippy::unwrap_used)]

use super::{Identifiability, Judgement, Point};
use crate::calibration::Refusal;
use crate::robot::{ArmIndex, Parameter, ParameterKind};
use crate::samples::joint_factor_tests::{empty, robot};
use nalgebra::SMatrix;

/// A tenth of the own upper arm is the limit of a length's σ, and a tenth of a radian that of an angle's; the arms'
/// lengths differ.
#[test]
fn every_parameter_is_judged_by_its_own_upper_arm() {
    let factor = empty(None);
    let (point, identifiability) = (Point::unstarted(), Identifiability::unstarted());
    let judgement = Judgement::<f64, [f64; 24], 24, 25, 325> {
        first_arm: ArmIndex::First,
        point: &point,
        identifiability: &identifiability,
        end: None,
        prior: &[0.0; 24],
        residual_sigma: 1.0,
        iterations: 0,
    };
    for (number, arm) in ArmIndex::ALL.into_iter().enumerate() {
        for (place, parameter) in Parameter::ROTARY.into_iter().enumerate() {
            let limit = match parameter.kind() {
                ParameterKind::Length => 0.1 * robot().arm(arm).upper_arm_length(),
                _ => 0.1,
            };
            let judged = |sigma: f64| {
                let mut covariance = SMatrix::<f64, 24, 24>::zeros();
                let index = 8 * number + place;
                covariance[(index, index)] = sigma * sigma;
                judgement.check_sigmas(&covariance, &factor)
            };
            assert_eq!(judged(0.999 * limit), Ok(()));
            let refusal = judged(1.001 * limit).unwrap_err();
            assert!(
                matches!(refusal, Refusal::Uncertain { arm: named, parameter: of, sigma }
                    if named == arm && of == parameter && (f64::from(sigma) / limit - 1.001).abs() < 1e-6),
                "{refusal:?}"
            );
        }
    }
}
