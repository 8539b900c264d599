#![allow(clippy::unwrap_used)]

use super::{WeighedSample, WeightedArm};
use crate::calibration::ArmProblem;
use crate::calibration::{Linearize, Normal};
use crate::robot::{Arm, ArmIndex};
use crate::samples::{ArmFactor, ArmSample, Displacement, Noise, NominalArm};
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const COUNT: usize = 21;
const ARM: ArmIndex = ArmIndex::Third;

fn nominal() -> NominalArm<f64> {
    let arm = Arm::new([150.0, 30.0, -5.0, 0.7, 0.2, 240.0, 35.0, 470.0]).unwrap();
    let noise = Some(Noise::new(0.5, 0.01).unwrap());
    NominalArm::new(&arm, &Vector3::new(10.0, -20.0, -430.0), noise)
}

/// Samples with roots of their factors, of which some are zero.
fn samples(nominal: &NominalArm<f64>) -> [WeighedSample<f64>; COUNT] {
    let mut rng = Pcg32::seed_from_u64(9);
    let mut uniform = move || f64::from(rng.next_u32()) / f64::from(u32::MAX);
    let mut places = [WeighedSample::vacant(); COUNT];
    for (index, place) in places.iter_mut().enumerate() {
        let x = Vector3::new(uniform(), uniform(), uniform() - 1.5) * 400.0;
        let sample = nominal.sample(&x, 1.2 * uniform(), ARM).unwrap();
        *place = WeighedSample::new([sample; 3]);
        place.of_mut(ARM).root = if index % 5 == 2 { 0.0 } else { 0.2 + uniform() };
    }
    places
}

/// The same problem, of samples whose own weights are multiplied by their roots.
fn plain(nominal: &NominalArm<f64>, samples: &[WeighedSample<f64>]) -> ArmFactor<f64> {
    let mut factor = ArmFactor::new(*nominal);
    for sample in samples {
        let own = sample.of(ARM);
        factor.absorb(&[ArmSample {
            weight: own.sample.weight * own.root,
            ..own.sample
        }]);
    }
    factor
}

fn same(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-9 * expected.abs()
}

#[test]
fn a_weighted_problem_is_the_plain_one_of_other_variances() {
    let nominal = nominal();
    let samples = samples(&nominal);
    let plain = plain(&nominal, &samples);
    let weighted = WeightedArm {
        nominal: &nominal,
        samples: &samples,
        arm: ARM,
        effective_samples: 12.5,
    };
    assert_eq!(weighted.samples(), 17);
    assert!(same(weighted.effective_samples(), 12.5));
    let at = Displacement::new(
        &nominal,
        &[0.01, -0.02, 0.005, 0.01, -0.02, 0.03, -0.01, 0.02],
    );
    let mut normals = [Normal::zero(); 2];
    let sum = plain.linearize(&at, &mut normals[0]);
    assert!(same(weighted.linearize(&at, &mut normals[1]), sum));
    assert!(same(weighted.sum_of_squares(&at), sum));
    let [expected, found] = normals;
    for (expected, found) in expected
        .column_norms()
        .iter()
        .zip(found.column_norms())
        .take(8)
    {
        assert!(same(found, *expected));
    }
    let (found, expected): ([f64; 8], [f64; 8]) = (
        found.minimiser(&[0.0; 9]).unwrap(),
        expected.minimiser(&[0.0; 9]).unwrap(),
    );
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()));
    }
    let (found, expected) = (weighted.means(), plain.means());
    assert!((found.x - expected.x).norm() < 1e-11);
    assert!(same(found.sine, expected.sine) && same(found.cosine, expected.cosine));
    assert!(same(weighted.rows_squared(), plain.rows_squared()));
    assert!(same(weighted.terms_squared(), plain.rows_squared()));
    assert!(same(
        weighted.least_sum_of_squares(),
        plain.least_sum_of_squares()
    ));
    let (found, expected) = (weighted.free_start(), plain.free_start());
    assert_eq!(found.is_some(), expected.is_some());
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 1e-7 * (1.0 + expected.abs()));
    }
}

#[test]
fn a_sample_counts_what_its_worst_arm_lets_it() {
    let nominal = nominal();
    let mut sample = samples(&nominal)[0];
    for worst in ArmIndex::ALL {
        for arm in ArmIndex::ALL {
            sample.of_mut(arm).weight = if arm == worst { 0.25 } else { 0.75 };
            sample.of_mut(arm).residual = if arm == worst { -7.0 } else { 3.0 };
        }
        assert!(same(sample.weight(), 0.25));
        assert_eq!(sample.residual(), (worst, 7.0));
    }
    assert!(!sample.suspected());
    sample.suspected = true;
    assert!(sample.suspected());
}
