#![allow(clippy::unwrap_used)]

use super::JointFactor;
use crate::fixtures::{assert_close, changed, empty, filled, gram, noises, robot, samples};
use crate::robot::{ArmIndex, Robot};
use crate::samples::{Noise, Sample};
use nalgebra::{Matrix3, Vector3};

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

/// Σ |W f(P)|² over all samples; without a stated noise in units of [`unit`](JointFactor::unit) squared.
fn sum_of_squares(factor: &JointFactor<f64>, robot: &Robot<f64>) -> f64 {
    let mut arms = robot.arms().iter();
    let corrections = factor.nominal_arms().each_ref();
    let corrections = corrections.map(|nominal| nominal.correction_to(arms.next().unwrap()));
    factor.residual_sum(&factor.displaced(&corrections))
}

fn assert_same(a: &JointFactor<f64>, b: &JointFactor<f64>, close: f64) {
    let [one, other] = [a, b].map(|own| gram::<_, 37>(&own.triangle));
    assert_close(&one, &other, close);
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
            let found = sum_of_squares(&factor, &other);
            assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
            assert!(found * unit * unit > 0.0);
            assert!(factor.least_sum_of_squares() <= found);
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
        for factor in [&singly, &fours, &pairs] {
            assert_eq!(factor.samples(), 24);
            assert_eq!(factor.effective_samples().to_bits(), 24_f64.to_bits());
        }
        let mut rest = empty(noise);
        rest.absorb_many(&measured[..7]);
        assert_same(&rest, &filled(noise, &measured[..7]), 1e-12);
    }
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
        others.absorb_one(&others.prepare(sample));
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
