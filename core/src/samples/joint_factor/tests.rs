#![allow(
    clippy::cast_precision_loss,
    clippy::float_cmp,
    clippy::large_stack_arrays,
    clippy::unwrap_used
)]

use super::{JointFactor, WhitenedSample};
use crate::Real;
use crate::robot::{Arm, ArmIndex, Robot};
use crate::samples::{MergeError, Noise, Sample, SampleError};
use nalgebra::{Matrix3, SMatrix, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Three different arms, one with a tilted axis.
pub(crate) fn robot() -> Robot<f64> {
    Robot::new([
        Arm::new([164.0, 3.0, -5.0, 0.02, 0.0, 260.0, 4.0, 480.0]).unwrap(),
        Arm::new([-80.0, 140.0, 2.0, 2.1, 0.2, 240.0, -6.0, 500.0]).unwrap(),
        Arm::new([-85.0, -142.0, 0.0, 4.2, -0.1, 275.0, 0.0, 470.0]).unwrap(),
    ])
    .unwrap()
}

/// The robot with every parameter changed by up to half a millimetre or two thousandths of a radian.
pub(crate) fn changed(seed: u64) -> Robot<f64> {
    let mut uniform = uniform(seed);
    let parameters = robot().parameters().map(|mut arm| {
        for (index, value) in arm.iter_mut().enumerate() {
            let spread = if matches!(index, 3 | 4) { 0.002 } else { 0.5 };
            *value += spread * uniform();
        }
        arm
    });
    Robot::from_parameters(parameters).unwrap()
}

/// Measurements of a robot with errors of up to 0.05 mm.
pub(crate) fn samples<const N: usize>(of: &Robot<f64>, seed: u64) -> [Sample<f64>; N] {
    let mut uniform = uniform(seed);
    [(); N].map(|()| {
        let joints = [(); 3].map(|()| 0.25 + 0.7 * uniform());
        let error = Vector3::new(uniform(), uniform(), uniform()) * 0.05;
        let position = of.forward(&joints).unwrap() + error;
        Sample { joints, position }
    })
}

/// Uniform in (−1, 1).
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = Pcg32::seed_from_u64(seed);
    move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// None, isotropic and by axis, without and with joint noise.
pub(crate) fn noises() -> [Option<Noise<f64>>; 4] {
    [
        None,
        Noise::new(0.02, 0.0).ok(),
        Noise::new(0.02, 4e-5).ok(),
        Noise::by_axis([0.02, 0.02, 0.1], 4e-5).ok(),
    ]
}

impl<T: Real> JointFactor<T> {
    pub(crate) fn add(&mut self, sample: &Sample<T>) -> Result<(), SampleError> {
        self.check(sample)?;
        self.absorb_one(&self.prepare(sample));
        Ok(())
    }
}

pub(crate) fn empty(noise: Option<Noise<f64>>) -> JointFactor<f64> {
    JointFactor::new(&robot(), &Vector3::new(0.0, 0.0, -450.0), noise)
}

fn filled(noise: Option<Noise<f64>>, samples: &[Sample<f64>]) -> JointFactor<f64> {
    let mut factor = empty(noise);
    for sample in samples {
        factor.add(sample).unwrap();
    }
    factor
}

/// f₁, f₂, f₃ of a robot, mm².
fn closures(of: &Robot<f64>, sample: &Sample<f64>) -> Vector3<f64> {
    Vector3::from(ArmIndex::ALL.map(|arm| {
        of.arm(arm)
            .constraint(&sample.position, sample.joints[arm.index()])
    }))
}

/// cov(f) by definition, mm⁴; without a noise, that of a unit of length.
fn covariance(factor: &JointFactor<f64>, sample: &Sample<f64>) -> Matrix3<f64> {
    let (sigmas, joint) = match factor.noise() {
        Some(noise) => (noise.position_by_axis(), noise.joint()),
        None => ([factor.unit(); 3], 0.0),
    };
    let variances = Vector3::from(sigmas.map(|sigma| sigma * sigma));
    let forearms = ArmIndex::ALL
        .map(|arm| sample.position - robot().arm(arm).elbow(sample.joints[arm.index()]));
    let mut covariance = Matrix3::zeros();
    for (row, first) in forearms.iter().enumerate() {
        for (column, second) in forearms.iter().enumerate() {
            covariance[(row, column)] = 4.0 * first.component_mul(&variances).dot(second);
        }
        let arm = robot().arms()[row];
        let by_joint = arm.constraint_by_joint(&sample.position, sample.joints[row]) * joint;
        // The direction of the forearm is known to a hundredth of a radian.
        let direction = (0.02 * arm.lb()) * (0.02 * arm.lb()) * variances.sum() / 3.0;
        covariance[(row, row)] += by_joint * by_joint + direction;
    }
    covariance
}

fn whitening(sample: &WhitenedSample<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| sample.rows[row][column])
}

/// RᵀR.
fn gram(factor: &JointFactor<f64>) -> SMatrix<f64, 37, 37> {
    let mut gram = SMatrix::<f64, 37, 37>::zeros();
    for (index, row) in factor.triangle.rows().enumerate() {
        for (i, a) in row.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                gram[(index + i, index + j)] += a * b;
            }
        }
    }
    gram
}

/// Checks that sums of products agree to a fraction `close` of the product of their columns' lengths.
fn assert_same(a: &JointFactor<f64>, b: &JointFactor<f64>, close: f64) {
    let (a, b) = (gram(a), gram(b));
    for row in 0..37 {
        for column in 0..37 {
            let unit = (b[(row, row)] * b[(column, column)]).max(f64::MIN_POSITIVE);
            let off = (a[(row, column)] - b[(row, column)]).abs();
            assert!(off < close * libm::sqrt(unit), "{row} {column} {off:e}");
        }
    }
}

/// W cov(f) Wᵀ = 1 with W upper triangular and its diagonal positive, which has a unique solution.
#[test]
fn the_closures_are_whitened() {
    for noise in noises() {
        let factor = empty(noise);
        for sample in samples::<50>(&robot(), 1) {
            let prepared = factor.prepare(&sample);
            let whitening = whitening(&prepared);
            let unit = factor.unit() * factor.unit();
            let covariance = covariance(&factor, &sample) / (unit * unit);
            let product = whitening * covariance * whitening.transpose();
            // ε times the condition number of the covariance, at most about 1e4.
            assert!((product - Matrix3::identity()).amax() < 1e-10, "{product}");
            for row in 0..3 {
                assert!(whitening[(row, row)] > 0.0);
                for column in 0..row {
                    assert!(whitening[(row, column)].to_bits() == 0);
                }
            }
            let inverse = covariance.cholesky().unwrap().inverse();
            let information = whitening.transpose() * whitening;
            assert!((information - inverse).amax() < 1e-10 * inverse.amax());
        }
    }
}

/// If the forearms are coplanar, the covariance of the closures of exact joints has no inverse.
#[test]
fn a_singular_pose_claims_no_more_than_its_direction_allows() {
    let noise = Noise::new(0.02_f32, 0.0).ok();
    let robot = robot().cast::<f32>().unwrap();
    let factor = JointFactor::new(&robot, &Vector3::new(0.0, 0.0, -450.0), noise);
    let arms = robot.arms();
    // The pose is in the plane of the elbows.
    let joints = [0.3; 3];
    let position = (arms[0].elbow(0.3) + arms[1].elbow(0.3) + arms[2].elbow(0.3)) / 3.0;
    let prepared = factor.prepare(&Sample { joints, position });
    let unit = factor.unit();
    for entry in prepared.rows.iter().flatten() {
        // 1/σ of a closure known only by its direction: 1/(2 Lb σ 0.01), in internal units.
        let most = unit * unit / (2.0 * 470.0 * 0.02 * 0.01);
        assert!(entry.is_finite() && entry.abs() < 1.01 * most, "{entry}");
    }
}

/// Σ fᵀ cov(f)⁻¹ f from the constraints, at robots near and far.
#[test]
fn the_factor_keeps_the_sum_of_squares_of_any_robot() {
    for noise in noises() {
        let truth = changed(7);
        let measured = samples::<40>(&truth, 2);
        let factor = filled(noise, &measured);
        let unit = if noise.is_some() { 1.0 } else { factor.unit() };
        for other in [robot(), truth, changed(8), changed(9)] {
            let mut expected = 0.0;
            for sample in &measured {
                let closures = closures(&other, sample);
                let inverse = covariance(&factor, sample).try_inverse().unwrap();
                expected += closures.dot(&(inverse * closures));
            }
            // Without a noise the covariance is for a unit of length, and so is the sum.
            let found = factor.sum_of_squares(&other);
            assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
            assert!(found * unit * unit > 0.0);
            assert!(factor.least_sum_of_squares() <= found);
        }
    }
}

/// At a displacement, and differentiated by each parameter.
#[test]
fn residuals_and_their_derivatives_are_those_of_the_constraints() {
    let noise = noises()[2];
    let factor = empty(noise);
    let truth = changed(5);
    let corrections = |by: f64, index: usize| {
        let mut place = 0;
        factor.nominal_arms().each_ref().map(|nominal| {
            let mut correction = nominal.correction_to(truth.arm(ArmIndex::ALL[place]));
            if index / 8 == place {
                correction[index % 8] += by;
            }
            place += 1;
            correction
        })
    };
    for sample in samples::<10>(&truth, 4) {
        let prepared = factor.prepare(&sample);
        let at = factor.displaced(&corrections(0.0, 0));
        let unit = factor.unit();
        let expected = whitening(&prepared) * closures(&truth, &sample) / (unit * unit);
        let rows = prepared.linearized(&at);
        for ((row, residual), expected) in rows
            .iter()
            .zip(prepared.residuals(&at))
            .zip(expected.iter())
        {
            // The constraint is a difference of numbers a million times larger.
            assert!((residual - expected).abs() < 1e-8);
            assert!((row[24] - residual).abs() < 1e-15);
        }
        for index in 0..24 {
            let step = 1e-6;
            let ahead = prepared.residuals(&factor.displaced(&corrections(step, index)));
            let behind = prepared.residuals(&factor.displaced(&corrections(-step, index)));
            for ((row, ahead), behind) in rows.iter().zip(ahead).zip(behind) {
                let expected = (ahead - behind) / (2.0 * step);
                // Residuals of about 1e4 σ in a unit: ε of that divided by the step.
                assert!((row[index] - expected).abs() < 1e-3, "{index}");
            }
        }
    }
}

#[test]
fn blocks_of_one_two_and_four_agree() {
    for noise in noises() {
        let measured = samples::<24>(&changed(3), 3);
        let singly = filled(noise, &measured);
        let mut fours = empty(noise);
        fours.absorb_many(&measured);
        let mut pairs = empty(noise);
        for pair in measured.as_chunks::<2>().0 {
            let pair = pair.each_ref().map(|sample| pairs.prepare(sample));
            let left = pairs.absorb_first::<2>(&pair);
            pairs.absorb_others::<2, 4, 6>(&pair, &left);
        }
        // About a thousand roundings.
        assert_same(&fours, &singly, 1e-12);
        assert_same(&pairs, &singly, 1e-12);
        for factor in [singly, fours, pairs] {
            assert_eq!(factor.samples(), 24);
            assert_eq!(factor.effective_samples().to_bits(), 24_f64.to_bits());
        }
        let mut rest = empty(noise);
        rest.absorb_many(&measured[..7]);
        assert_same(&rest, &filled(noise, &measured[..7]), 1e-12);
    }
}

#[test]
fn merging_is_adding_all() {
    for noise in noises() {
        let measured = samples::<30>(&changed(3), 5);
        let (left, right) = measured.split_at(13);
        let mut merged = filled(noise, left);
        merged.merge(&filled(noise, right)).unwrap();
        assert_same(&merged, &filled(noise, &measured), 1e-12);
        assert_eq!(merged.samples(), 30);
        let unchanged = merged.clone();
        let other = JointFactor::new(&changed(1), &Vector3::new(0.0, 0.0, -450.0), noise);
        assert_eq!(merged.merge(&other), Err(MergeError::DifferentNominal));
        assert_eq!(merged, unchanged);
    }
}

#[test]
fn forgetting_multiplies_what_was_seen() {
    let measured = samples::<20>(&changed(3), 6);
    let mut forgotten = filled(noises()[2], &measured[..12]);
    let before = gram(&forgotten);
    forgotten.forget(0.25);
    assert!((gram(&forgotten) - before * 0.25).amax() < 1e-12 * before.amax());
    assert_eq!(forgotten.effective_samples().to_bits(), 3_f64.to_bits());
    assert_eq!(forgotten.samples(), 12);
    for sample in &measured[12..] {
        forgotten.add(sample).unwrap();
    }
    let expected = before * 0.25 + gram(&filled(noises()[2], &measured[12..]));
    assert!((gram(&forgotten) - expected).amax() < 1e-12 * expected.amax());
    assert_eq!(forgotten.effective_samples().to_bits(), 11_f64.to_bits());
    // Above 1 or NaN: nothing is forgotten; below 0: everything.
    for (lambda, left) in [(1.5, 11.0), (f64::NAN, 11.0), (-1.0, 0.0)] {
        let mut factor = forgotten.clone();
        factor.forget(lambda);
        assert!((factor.effective_samples() - left).abs() < 1e-12);
    }
}

#[test]
fn a_faulty_sample_changes_nothing() {
    let measured = samples::<6>(&changed(3), 7);
    let mut factor = filled(noises()[2], &measured);
    let before = factor.clone();
    let mut spoilt = measured;
    spoilt[4].joints[1] = f64::NAN;
    assert!(factor.add(&spoilt[4]).is_err());
    assert_eq!(factor, before);
}

/// The mean pose after adding singly, adding in blocks, merging and forgetting.
#[test]
fn the_mean_pose_is_that_of_the_samples() {
    let measured = samples::<20>(&changed(3), 8);
    let weight = |index: usize| if index < 11 { 0.3 } else { 1.0 };
    let mut forgotten = empty(None);
    forgotten.absorb_many(&measured[..11]);
    forgotten.forget(0.3);
    let mut others = empty(None);
    for sample in &measured[11..] {
        others.add(sample).unwrap();
    }
    forgotten.merge(&others).unwrap();
    let [.., third] = forgotten.nominal_arms();
    let total: f64 = (0..20).map(weight).sum();
    let found = forgotten.mean();
    let mut position = Vector3::zeros();
    let mut cosines = [0.0; 3];
    for (index, sample) in measured.iter().enumerate() {
        let share = weight(index) / total;
        position += sample.position * share;
        for (sum, q) in cosines.iter_mut().zip(sample.joints) {
            *sum += libm::cos(q) * share;
        }
    }
    let found_position = found.position * third.scale() + third.centre();
    assert!((found_position - position).norm() < 1e-10);
    for (found, cosine) in found.cosines.iter().zip(cosines) {
        assert!((found - cosine).abs() < 1e-13);
    }
}

/// Far from the origin of its frame, the rounding of a position exceeds that of a closure; no stated noise is too small
/// for it.
#[test]
fn the_rounding_of_a_far_position_is_a_noise() {
    let far = Robot::from_parameters(robot().parameters().map(|mut arm| {
        arm[1] += 4e4;
        arm
    }));
    let far = far.unwrap();
    let joints = [0.2, 0.3, 0.1];
    let position = far.forward(&joints).unwrap().map(f32::from_f64);
    let centre = Vector3::new(0.0, 4e4, -450.0);
    let noise = Noise::new(1e-12, 0.0).ok();
    let mut factor = JointFactor::<f32>::new(&far.cast().unwrap(), &centre, noise);
    let joints = joints.map(f32::from_f64);
    factor.add(&Sample { joints, position }).unwrap();
    let norms = factor.triangle().column_norms();
    assert!(norms.iter().all(|norm| norm.is_finite()));
    // The feature 1 of each arm: squares that underflow would have left nothing.
    assert!([11, 23, 35].iter().all(|column| norms[*column] > 0.0));
}
