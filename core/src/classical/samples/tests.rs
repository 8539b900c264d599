#![allow(clippy::unwrap_used)]

use super::StoredArmSamples;
use crate::calibration::{Linearize, Normal};
use crate::robot::{Arm, ArmIndex};
use crate::samples::{ArmFactor, Displacement, Noise, NominalArm};
use nalgebra::{SMatrix, SVector, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const COUNT: usize = 23;
const ARM: ArmIndex = ArmIndex::Second;

/// Any positions at any joint angles: they need not fit.
fn samples(seed: u64) -> [(Vector3<f64>, f64); COUNT] {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut uniform = move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    [(); COUNT].map(|()| {
        let x = Vector3::new(uniform(), uniform(), uniform() - 1.0) * 400.0;
        (x, 0.6 + 0.8 * uniform())
    })
}

fn nominal(noise: Option<Noise<f64>>) -> NominalArm<f64> {
    let arm = Arm::new([150.0, 30.0, -5.0, 0.7, 0.2, 240.0, 35.0, 470.0]).unwrap();
    NominalArm::new(&arm, &Vector3::new(10.0, -20.0, -430.0), noise)
}

/// σf by its definition, in length², or 2 Lb without a stated noise.
fn deviation(nominal: &NominalArm<f64>, x: &Vector3<f64>, q: f64) -> f64 {
    let arm = nominal.arm();
    nominal.noise().map_or(2.0 * arm.lb(), |noise| {
        libm::hypot(
            2.0 * arm.lb() * noise.position(),
            arm.constraint_by_joint(x, q) * noise.joint(),
        )
    })
}

struct Case {
    nominal: NominalArm<f64>,
    samples: [(Vector3<f64>, f64); COUNT],
    factor: ArmFactor<f64>,
    stored: StoredArmSamples<f64, COUNT>,
}

fn cases() -> impl Iterator<Item = Case> {
    (0..20).map(|seed| {
        let noise = (seed % 2 == 0).then(|| Noise::new(0.5, 0.01).unwrap());
        let nominal = nominal(noise);
        let samples = samples(seed);
        let mut factor = ArmFactor::new(nominal);
        let mut stored = StoredArmSamples::new(nominal);
        for (x, q) in &samples {
            factor.add(x, *q, ARM).unwrap();
            stored.add(x, *q, ARM).unwrap();
        }
        Case {
            nominal,
            samples,
            factor,
            stored,
        }
    })
}

/// Both forms, as what a solver sees.
fn both(case: &Case) -> [&dyn Linearize<f64>; 2] {
    [&case.factor, &case.stored]
}

#[test]
fn means_are_weighted_by_the_inverse_variances() {
    for case in cases() {
        let (mut x_sum, mut sine, mut cosine, mut weights) = (Vector3::zeros(), 0.0, 0.0, 0.0);
        for (x, q) in &case.samples {
            let sigma = deviation(&case.nominal, x, *q);
            let weight = 1.0 / (sigma * sigma);
            x_sum += x * weight;
            sine += libm::sin(*q) * weight;
            cosine += libm::cos(*q) * weight;
            weights += weight;
        }
        for problem in both(&case) {
            let means = problem.means();
            let x = means.x * case.nominal.scale() + case.nominal.centre();
            assert!((x - x_sum / weights).norm() < 1e-9);
            assert!((means.sine - sine / weights).abs() < 1e-12);
            assert!((means.cosine - cosine / weights).abs() < 1e-12);
            let squares = case.samples.iter().map(|(x, q)| {
                let sigma = deviation(&case.nominal, x, *q);
                (x - x_sum / weights).norm_squared() / (sigma * sigma)
            });
            let spread = libm::sqrt(squares.sum::<f64>() / weights);
            assert!((means.spread * case.nominal.scale() - spread).abs() < 1e-9);
        }
        assert_eq!(Linearize::taken_in(&case.factor), COUNT as u64);
        assert_eq!(Linearize::taken_in(&case.stored), COUNT as u64);
    }
}

/// Σ (1 + f²)/σf² in internal units.
#[test]
fn rows_are_as_large_as_the_constraint_and_its_unit() {
    for case in cases() {
        let square = case.nominal.scale() * case.nominal.scale();
        let (mut rows, mut constraints) = (0.0, 0.0);
        for (x, q) in &case.samples {
            // In the nominal arm's unit the weight is the unit's square over σf, or, without a stated
            // noise, the unit over 2 Lb.
            let unit = if case.nominal.noise().is_some() {
                square
            } else {
                case.nominal.scale()
            };
            let weight = unit / deviation(&case.nominal, x, *q);
            let constraint = case.nominal.arm().constraint(x, *q) / square;
            rows += weight * weight * (1.0 + constraint * constraint);
            constraints += weight * weight * constraint * constraint;
        }
        for problem in both(&case) {
            assert!((problem.rows_squared() / rows - 1.0).abs() < 1e-9);
        }
        // A stored sample's residual is |X − B|² − Lb², the factor's f(P₀) and a difference.
        assert!((case.stored.terms_squared() / rows - 1.0).abs() < 1e-9);
        assert!((case.factor.terms_squared() / constraints - 1.0).abs() < 1e-9);
    }
}

/// The rows of the linearised problem against central differences of the residuals.
#[test]
fn the_linearised_problem_is_the_residuals_tangent() {
    for case in cases() {
        let correction = [0.01, -0.02, 0.005, 0.01, -0.02, 0.03, -0.01, 0.02];
        let residuals = |correction: &[f64; 8]| {
            let mut parameters = case.nominal.arm().parameters();
            for ((value, delta), parameter) in parameters
                .iter_mut()
                .zip(correction)
                .zip(crate::Parameter::ROTARY)
            {
                *value += delta * case.nominal.unit_of(parameter);
            }
            let arm = Arm::new(parameters).unwrap();
            let unit = if case.nominal.noise().is_some() {
                1.0
            } else {
                case.nominal.scale()
            };
            SVector::<f64, COUNT>::from_iterator(
                case.samples
                    .iter()
                    .map(|(x, q)| arm.constraint(x, *q) / deviation(&case.nominal, x, *q) / unit),
            )
        };
        let mut jacobian = SMatrix::<f64, COUNT, 9>::zeros();
        for parameter in 0..8 {
            let moved = |by: f64| {
                let mut moved = correction;
                moved[parameter] += by;
                residuals(&moved)
            };
            let step = 1e-5;
            jacobian.set_column(parameter, &((moved(step) - moved(-step)) / (2.0 * step)));
        }
        jacobian.set_column(8, &residuals(&correction));
        let expected = jacobian.transpose() * jacobian;
        let squares = jacobian.column(8).norm_squared();
        let at = Displacement::new(&case.nominal, &correction);
        for problem in both(&case) {
            let mut normal = Normal::zero();
            let sum = problem.linearize(&at, &mut normal);
            assert!((sum / squares - 1.0).abs() < 1e-9);
            assert!((problem.sum_of_squares(&at) / squares - 1.0).abs() < 1e-9);
            let mut triangle = SMatrix::<f64, 9, 9>::zeros();
            for (row, entries) in normal.rows().enumerate() {
                for (offset, entry) in entries.iter().enumerate() {
                    triangle[(row, row + offset)] = *entry;
                }
            }
            let mut found = triangle.transpose() * triangle;
            let mut expected = expected;
            // What no parameters reduce is not the linearised problem's: the factor leaves it out.
            found[(8, 8)] = 0.0;
            expected[(8, 8)] = 0.0;
            assert!((found - expected).norm() < 1e-7 * expected.norm());
        }
    }
}

/// The start without a guess is that of the factor, wherever the linear fit gives one.
#[test]
fn the_start_without_a_guess_is_that_of_the_factor() {
    let mut found = 0;
    for case in cases() {
        let expected = Linearize::free_start(&case.factor);
        let start = Linearize::free_start(&case.stored);
        assert_eq!(start.is_some(), expected.is_some());
        for (start, expected) in start
            .into_iter()
            .flatten()
            .zip(expected.into_iter().flatten())
        {
            // Another order of the rows: ε times a condition of some thousands.
            assert!((start - expected).abs() < 1e-9 * expected.abs().max(1.0));
            found += 1;
        }
    }
    assert!(found > 8);
}
