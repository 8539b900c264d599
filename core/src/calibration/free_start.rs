//! Free starts: the linear fit, and arms constructed from the spread of the samples alone.

use crate::Real;
use crate::robot::Drive;
use crate::samples::{ArmFactor, NominalArm};
use nalgebra::Vector3;

/// The mean sample of an arm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Means<T: Real> {
    pub(crate) x: Vector3<T>,
    /// The rms distance of the samples from x.
    pub(crate) spread: T,
    /// Mean sine of the joint angle; for a linear drive the mean travel, in internal units.
    pub(crate) sine: T,
    /// Mean cosine of the joint angle; for a linear drive the mean squared travel.
    pub(crate) cosine: T,
}

/// Minimises |R (δc, 1)| over free δc and derives the correction δP. `None` if the samples do not determine a
/// coefficient or the coefficients are not those of an arm.
pub(crate) fn free_start<T: Real>(factor: &ArmFactor<T>) -> Option<[T; 8]> {
    // A pivot of the size of its column's rounding carries no information.
    let rounding = T::from_f64(16.0) * T::EPSILON;
    let smallest = factor.triangle().column_norms().map(|norm| rounding * norm);
    let delta = factor.triangle().minimiser(&smallest)?;
    correction_of(factor.nominal(), &delta)
}

/// Derives the correction δP from the difference δc of the coefficients.
#[inline(never)]
pub(super) fn correction_of<T: Real>(nominal: &NominalArm<T>, delta: &[T; 12]) -> Option<[T; 8]> {
    if nominal.arm().drive() == Drive::Linear {
        return linear_correction_of(nominal, delta);
    }
    let half = T::HALF;
    let [d1, d2, d3, _, _, u1, u2, u3, v1, v2, v3, constant] = *delta;
    let delta_d = Vector3::new(d1, d2, d3) * -half;
    let u = nominal.u - Vector3::new(u1, u2, u3) * half;
    let v = nominal.v - Vector3::new(v1, v2, v3) * half;

    // u × v points along the motor axis, which determines both angles.
    let axis = u.cross(&v);
    let length_squared = axis.dot(&axis);
    if !(length_squared > T::ZERO && length_squared.finite()) {
        return None;
    }
    let theta = (-axis.x).angle_over(axis.y);
    let alpha = axis
        .z
        .angle_over((axis.x * axis.x + axis.y * axis.y).square_root());
    let (sin_theta, cos_theta) = theta.sine_cosine();
    let (sin_alpha, cos_alpha) = alpha.sine_cosine();
    let ex = Vector3::new(cos_theta, sin_theta, T::ZERO);
    let ez = Vector3::new(sin_theta * sin_alpha, -cos_theta * sin_alpha, cos_alpha);
    // Both u and v contain the upper arm: use the mean.
    let la_x = (u.dot(&ex) - v.dot(&ez)) * half;
    let la_y = (u.dot(&ez) + v.dot(&ex)) * half;

    let (la_x0, la_y0) = nominal.la;
    let upper_arm_gained = (la_x - la_x0) * (la_x + la_x0) + (la_y - la_y0) * (la_y + la_y0);
    let d_gained = delta_d.dot(&(nominal.d * T::TWO + delta_d));
    let lb_squared = nominal.lb * nominal.lb + d_gained + upper_arm_gained - constant;
    if !(lb_squared > T::ZERO && lb_squared.finite()) {
        return None;
    }
    let [_, _, _, theta0, alpha0, ..] = nominal.arm().parameters();
    Some([
        delta_d.x,
        delta_d.y,
        delta_d.z,
        nearest_turn(theta - theta0),
        alpha - alpha0,
        la_x - la_x0,
        la_y - la_y0,
        lb_squared.square_root() - nominal.lb,
    ])
}

/// The same for a linear drive: the forearm from |D|² − Lb², the tower from v.
fn linear_correction_of<T: Real>(nominal: &NominalArm<T>, delta: &[T; 12]) -> Option<[T; 8]> {
    let half = T::HALF;
    let [d1, d2, d3, _, _, _, _, _, v1, v2, v3, constant] = *delta;
    let delta_d = Vector3::new(d1, d2, d3) * -half;
    let v = nominal.v - Vector3::new(v1, v2, v3) * half;
    let scale = v.dot(&v).square_root();
    if !(scale > T::ZERO && scale.finite() && v.z > T::ZERO) {
        return None;
    }
    let direction = v / scale;
    let lean = |sine: T| sine.angle_over((T::ONE - sine * sine).square_root());
    let lb_squared =
        nominal.lb * nominal.lb + delta_d.dot(&(nominal.d * T::TWO + delta_d)) - constant;
    if !(lb_squared > T::ZERO && lb_squared.finite()) {
        return None;
    }
    let [_, _, _, lean_x0, lean_y0, scale0, ..] = nominal.arm().parameters();
    Some([
        delta_d.x,
        delta_d.y,
        delta_d.z,
        lean(direction.x) - lean_x0,
        lean(direction.y) - lean_y0,
        scale - scale0,
        T::ZERO,
        lb_squared.square_root() - nominal.lb,
    ])
}

/// Number of azimuths that [`spread_start`] offers.
pub(crate) const SPREAD_STARTS: u8 = 6;
/// Upper arm and forearm of these arms, divided by the rms distance of the samples from their mean.
const UPPER_ARM: f64 = 0.7;
const FOREARM: f64 = 1.2;

/// The correction to one of [`SPREAD_STARTS`] arms, for samples whose linear fit fails: a few distinct joint angles
/// determine the eight parameters of an arm, but not twelve coefficients.
///
/// The arms' azimuths are a sixth of a turn apart, their motor axes horizontal. The lengths are proportional to the
/// spread s of the samples, La = 0.7 s and Lb = 1.2 s, and the forearm hangs down to the mean sample at the mean joint
/// angle: D = X̄ + Lb ez − (u cos q + v sin q). With a linear drive, an upright tower stands at a distance La from the
/// mean sample, and the forearm reaches down from its carriage. `None` if the samples have no spread.
pub(crate) fn spread_start<T: Real>(
    nominal: &NominalArm<T>,
    means: &Means<T>,
    index: u8,
) -> Option<[T; 8]> {
    if !(means.spread > T::ZERO && means.spread.finite()) {
        return None;
    }
    let (la, lb) = (
        T::from_f64(UPPER_ARM) * means.spread,
        T::from_f64(FOREARM) * means.spread,
    );
    let turn = T::TWO * T::PI;
    let theta = turn / T::from_count(u64::from(SPREAD_STARTS)) * T::from_count(u64::from(index));
    let (sine, cosine) = theta.sine_cosine();
    if nominal.arm().drive() == Drive::Linear {
        let up = (lb * lb - la * la).square_root() - means.sine;
        let delta_d = means.x + Vector3::new(la * cosine, la * sine, up) - nominal.d;
        let [_, _, _, lean_x0, lean_y0, scale0, ..] = nominal.arm().parameters();
        return Some([
            delta_d.x,
            delta_d.y,
            delta_d.z,
            -lean_x0,
            -lean_y0,
            T::ONE - scale0,
            T::ZERO,
            lb - nominal.lb,
        ]);
    }
    let outwards = la * means.cosine;
    let up = lb + la * means.sine;
    let d = means.x + Vector3::new(-(outwards * cosine), -(outwards * sine), up);

    let [_, _, _, theta0, alpha0, ..] = nominal.arm().parameters();
    let delta_d = d - nominal.d;
    let (la_x0, la_y0) = nominal.la;
    Some([
        delta_d.x,
        delta_d.y,
        delta_d.z,
        nearest_turn(theta - theta0),
        -alpha0,
        la - la_x0,
        -la_y0,
        lb - nominal.lb,
    ])
}

/// The same direction, within half a turn.
fn nearest_turn<T: Real>(angle: T) -> T {
    let turn = T::TWO * T::PI;
    angle - (angle / turn).nearest_integer() * turn
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{SPREAD_STARTS, free_start, spread_start};
    use crate::robot::{Arm, ArmIndex};
    use crate::samples::{ArmFactor, Noise, NominalArm};
    use nalgebra::Vector3;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    /// Points at the forearm's length from the elbow, in all directions, and their joint angles.
    fn exact_samples(arm: &Arm<f64>, count: usize) -> impl Iterator<Item = (Vector3<f64>, f64)> {
        let mut rng = Pcg32::seed_from_u64(7);
        let mut uniform = move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        (0..count).map(move |_| {
            let q = 1.5 * uniform();
            let direction = Vector3::new(uniform(), uniform(), uniform() - 1.5).normalize();
            (arm.elbow(q) + direction * arm.lb(), q)
        })
    }

    fn factor(nominal: &Arm<f64>, truth: &Arm<f64>, count: usize) -> ArmFactor<f64> {
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let mut factor = ArmFactor::new(NominalArm::new(nominal, &centre, None));
        for (x, q) in exact_samples(truth, count) {
            factor.add(&x, q, ArmIndex::First).unwrap();
        }
        factor
    }

    const TRUTH: [f64; 8] = [150.0, 30.0, -5.0, 0.7, 0.2, 240.0, 35.0, 470.0];

    /// For any nominal arm, the linear fit of exact samples is the true arm.
    #[test]
    fn exact_samples_give_the_arm_from_any_nominal_arm() {
        let truth = Arm::new(TRUTH).unwrap();
        for nominal in [
            TRUTH,
            [164.0, 0.0, 0.0, 0.0, 0.0, 260.0, 0.0, 480.0],
            [50.0, -80.0, 60.0, -1.5, -0.7, 100.0, -90.0, 900.0],
            [0.0, 0.0, 0.0, 3.0, 0.9, 10.0, 300.0, 300.0],
        ] {
            let nominal = Arm::new(nominal).unwrap();
            let factor = factor(&nominal, &truth, 40);
            let correction = free_start(&factor).unwrap();
            let expected = factor.nominal().correction_to(&truth);
            for (found, expected) in correction.iter().zip(expected) {
                // ε times a condition number of some thousands.
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }

    /// A full turn does not change an azimuth: the correction takes the shorter way round.
    #[test]
    fn the_azimuth_is_corrected_the_shorter_way_round() {
        let at = |theta: f64| {
            let mut parameters = TRUTH;
            parameters[3] = theta;
            Arm::new(parameters).unwrap()
        };
        for (nominal, truth, expected) in [
            (3.1, -3.1, 2.0 * core::f64::consts::PI - 6.2),
            (-3.1, 3.1, 6.2 - 2.0 * core::f64::consts::PI),
            (6.2, 0.1, 2.0 * core::f64::consts::PI - 6.1),
            (-6.2, -0.2, 6.0 - 2.0 * core::f64::consts::PI),
            (0.5, 3.0, 2.5),
        ] {
            let correction = free_start(&factor(&at(nominal), &at(truth), 40)).unwrap();
            assert!((correction[3] - expected).abs() < 1e-9, "{correction:?}");
        }
    }

    /// With noise, the two values of the upper arm, from u and from v, are equally accurate and are averaged.
    #[test]
    fn noise_is_averaged_over_both_readings_of_the_upper_arm() {
        let truth = Arm::new(TRUTH).unwrap();
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let (mut sum, mut squares) = (0.0, 0.0);
        for seed in 0..200 {
            let mut rng = Pcg32::seed_from_u64(1000 + seed);
            let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
            let mut factor = ArmFactor::new(NominalArm::new(&truth, &centre, None));
            for (x, q) in exact_samples(&truth, 40) {
                let noise = Vector3::new(uniform(), uniform(), uniform()) * 0.1;
                factor.add(&(x + noise), q, ArmIndex::First).unwrap();
            }
            let correction = free_start(&factor).unwrap();
            sum += correction[5];
            squares += correction[5] * correction[5];
        }
        // Unbiased: the mean of 200 is within five of its own σ.
        let sigma = libm::sqrt(squares / 200.0);
        assert!((sum / 200.0).abs() < 5.0 * sigma / libm::sqrt(200.0));
    }

    #[test]
    fn samples_that_leave_a_coefficient_free_give_no_start() {
        let truth = Arm::new(TRUTH).unwrap();
        for count in [0, 1, 8, 11] {
            assert!(free_start(&factor(&truth, &truth, count)).is_none());
        }
        assert!(free_start(&factor(&truth, &truth, 12)).is_some());
        // A joint that never moves.
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let mut still = ArmFactor::new(NominalArm::new(&truth, &centre, None));
        for (x, _) in exact_samples(&truth, 40) {
            still.add(&x, 0.3, ArmIndex::First).unwrap();
        }
        assert!(free_start(&still).is_none());
    }

    /// The start does not depend on the scale of the weights.
    #[test]
    fn weights_of_any_size_leave_the_start_as_it_is() {
        let truth = Arm::new(TRUTH).unwrap();
        let centre = Vector3::new(10.0, -20.0, -430.0);
        for sigma in [1e-7, 1e-3, 1e3, 1e9] {
            let nominal = NominalArm::new(&truth, &centre, Some(Noise::new(sigma, 0.0).unwrap()));
            let (mut free, mut still) = (ArmFactor::new(nominal), ArmFactor::new(nominal));
            for (x, q) in exact_samples(&truth, 40) {
                free.add(&x, q, ArmIndex::First).unwrap();
                still.add(&x, 0.3, ArmIndex::First).unwrap();
            }
            let correction = free_start(&free).unwrap();
            assert!(correction.iter().all(|delta| delta.abs() < 1e-9));
            assert!(free_start(&still).is_none(), "{sigma:e}");
        }
    }

    /// Positions that belong to no arm give a finite start or none.
    #[test]
    fn samples_of_no_arm_never_give_a_start_that_is_no_number() {
        let truth = Arm::new(TRUTH).unwrap();
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let (mut none, mut some) = (0, 0);
        for seed in 0..500 {
            let mut rng = Pcg32::seed_from_u64(seed);
            let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
            let mut factor = ArmFactor::new(NominalArm::new(&truth, &centre, None));
            for _ in 0..14 {
                let x = Vector3::new(uniform(), uniform(), uniform()) * 400.0;
                factor.add(&x, uniform(), ArmIndex::First).unwrap();
            }
            match free_start(&factor) {
                Some(correction) => {
                    some += 1;
                    assert!(correction.iter().all(|delta| delta.is_finite()), "{seed}");
                }
                None => none += 1,
            }
        }
        assert!(none > 0 && some > 100, "{none} {some}");
    }

    /// The arms follow only the samples: they do not depend on the nominal arm, and move and scale with the samples.
    /// The mean sample is a forearm below the mean elbow.
    #[test]
    fn the_arms_of_the_spread_follow_the_samples_alone() {
        let truth = Arm::new(TRUTH).unwrap();
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let nominals = [TRUTH, [50.0, -80.0, 60.0, -1.5, -0.7, 100.0, -90.0, 900.0]];
        let arms = |factor: f64, shift: Vector3<f64>, nominal: [f64; 8]| {
            let nominal = NominalArm::new(&Arm::new(nominal).unwrap(), &centre, None);
            let mut samples = ArmFactor::new(nominal);
            for (x, q) in exact_samples(&truth, 12) {
                samples
                    .add(&(x * factor + shift), q, ArmIndex::First)
                    .unwrap();
            }
            let means = samples.means();
            core::array::from_fn::<_, { SPREAD_STARTS as usize }, _>(|index| {
                let index = u8::try_from(index).unwrap();
                let correction = spread_start(&nominal, &means, index).unwrap();
                crate::samples::corrected_arm(&nominal, &correction).unwrap()
            })
        };
        let shift = Vector3::new(40.0, -30.0, 20.0);
        let expected = arms(1.0, Vector3::zeros(), nominals[0]);
        let (mut mean, mut squares) = (Vector3::zeros(), 0.0);
        for (x, _) in exact_samples(&truth, 12) {
            mean += x / 12.0;
        }
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (x, q) in exact_samples(&truth, 12) {
            squares += (x - mean).norm_squared() / 12.0;
            cosine += libm::cos(q) / 12.0;
            sine += libm::sin(q) / 12.0;
        }
        let spread = libm::sqrt(squares);
        for (index, arm) in expected.iter().enumerate() {
            let basis = arm.basis();
            // ε times lengths of some hundreds.
            assert!((arm.upper_arm_length() - 0.7 * spread).abs() < 1e-9);
            assert!((arm.lb() - 1.2 * spread).abs() < 1e-9);
            assert!(basis.ey.z.abs() < 1e-12);
            let elbow = arm.d() + basis.u * cosine + basis.v * sine;
            let below = elbow - Vector3::new(0.0, 0.0, arm.lb());
            assert!((below - mean).norm() < 1e-9);
            // Azimuths a sixth of a turn apart.
            let next = expected[(index + 1) % expected.len()].basis().ex;
            assert!((basis.ex.dot(&next) - 0.5).abs() < 1e-12);
        }
        for nominal in nominals {
            for (found, expected) in arms(2.0, shift, nominal).iter().zip(&expected) {
                assert!((found.d() - (expected.d() * 2.0 + shift)).norm() < 1e-9);
                assert!((found.lb() - 2.0 * expected.lb()).abs() < 1e-9);
                assert!((found.basis().ex - expected.basis().ex).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn samples_in_one_place_give_no_arm() {
        let truth = Arm::new(TRUTH).unwrap();
        let centre = Vector3::new(0.0, 0.0, -500.0);
        let mut factor = ArmFactor::new(NominalArm::new(&truth, &centre, None));
        assert!(spread_start(factor.nominal(), &factor.means(), 0).is_none());
        for _ in 0..12 {
            factor.add(&centre, 0.3, ArmIndex::First).unwrap();
        }
        let means = factor.means();
        let correction = spread_start(factor.nominal(), &means, 0);
        // Rounding may leave a spread of up to √ε units.
        assert!(correction.is_none() || means.spread < 1e-7);
    }

    #[cfg(feature = "linear")]
    mod towers {
        use super::*;

        const TOWER: [f64; 7] = [140.0, 30.0, -5.0, 0.1, -0.2, 1.1, 330.0];
        const CENTRE: Vector3<f64> = Vector3::new(10.0, -20.0, 60.0);

        /// Points at the forearm's length from the carriage, in all directions, and its travel.
        fn tower_samples(
            arm: &Arm<f64>,
            count: usize,
        ) -> impl Iterator<Item = (Vector3<f64>, f64)> {
            let mut rng = Pcg32::seed_from_u64(7);
            let mut uniform = move || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
            (0..count).map(move |_| {
                let travel = 350.0 + 150.0 * uniform();
                let direction = Vector3::new(uniform(), uniform(), uniform() - 1.5).normalize();
                (arm.elbow(travel) + direction * arm.lb(), travel)
            })
        }

        fn nominal_towers() -> [NominalArm<f64>; 3] {
            [
                TOWER,
                [120.0, 70.0, 10.0, 0.0, 0.0, 1.0, 300.0],
                [-200.0, 10.0, 90.0, -0.4, 0.3, 0.8, 500.0],
            ]
            .map(|parameters| NominalArm::new(&Arm::linear(parameters).unwrap(), &CENTRE, None))
        }

        #[test]
        fn exact_samples_give_the_tower_from_any_nominal_tower() {
            let truth = Arm::linear(TOWER).unwrap();
            for nominal in nominal_towers() {
                let mut factor = ArmFactor::new(nominal);
                for (x, travel) in tower_samples(&truth, 40) {
                    factor.add(&x, travel, ArmIndex::First).unwrap();
                }
                let correction = free_start(&factor).unwrap();
                for (found, expected) in correction.iter().zip(nominal.correction_to(&truth)) {
                    // ε times a condition number of about 1e5: the travels are far from 0 compared to their spread.
                    assert!((found - expected).abs() < 1e-8, "{found} {expected}");
                }
            }
        }

        /// Travels counted downwards belong to no tower.
        #[test]
        fn a_tower_that_points_down_is_no_start() {
            let truth = Arm::linear(TOWER).unwrap();
            let mut factor = ArmFactor::new(nominal_towers()[0]);
            for (x, travel) in tower_samples(&truth, 40) {
                factor.add(&x, -travel, ArmIndex::First).unwrap();
            }
            assert!(free_start(&factor).is_none());
        }

        #[test]
        fn samples_of_no_tower_never_give_a_start_that_is_no_number() {
            let (mut none, mut some) = (0, 0);
            for seed in 0..500 {
                let mut rng = Pcg32::seed_from_u64(seed);
                let mut uniform = || f64::from(rng.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
                let mut factor = ArmFactor::new(nominal_towers()[0]);
                for _ in 0..14 {
                    let x = Vector3::new(uniform(), uniform(), uniform()) * 400.0;
                    let travel = 350.0 + 150.0 * uniform();
                    factor.add(&x, travel, ArmIndex::First).unwrap();
                }
                match free_start(&factor) {
                    Some(correction) => {
                        some += 1;
                        assert!(correction.iter().all(|delta| delta.is_finite()), "{seed}");
                    }
                    None => none += 1,
                }
            }
            assert!(none > 100 && some > 100, "{none} {some}");
        }

        /// Upright towers with unit scale, 0.7 of the samples' spread from the mean sample, a sixth of a turn apart; at
        /// the mean travel the forearm, 1.2 times the spread, reaches the mean sample from above.
        #[test]
        fn the_towers_of_the_spread_follow_the_samples_alone() {
            let truth = Arm::linear(TOWER).unwrap();
            let (mut mean, mut mean_travel, mut squares) = (Vector3::zeros(), 0.0, 0.0);
            for (x, travel) in tower_samples(&truth, 12) {
                mean += x / 12.0;
                mean_travel += travel / 12.0;
            }
            for (x, _) in tower_samples(&truth, 12) {
                squares += (x - mean).norm_squared() / 12.0;
            }
            let spread = libm::sqrt(squares);
            for nominal in nominal_towers() {
                let mut samples = ArmFactor::new(nominal);
                for (x, travel) in tower_samples(&truth, 12) {
                    samples.add(&x, travel, ArmIndex::First).unwrap();
                }
                for index in 0..SPREAD_STARTS {
                    let correction = spread_start(&nominal, &samples.means(), index).unwrap();
                    let arm = crate::samples::corrected_arm(&nominal, &correction).unwrap();
                    // ε times lengths of some hundreds.
                    assert!((arm.lb() - 1.2 * spread).abs() < 1e-9);
                    assert!((arm.basis().v - Vector3::z()).norm() < 1e-12);
                    let azimuth = core::f64::consts::PI / 3.0 * f64::from(index);
                    let up = libm::sqrt(1.2 * 1.2 - 0.7 * 0.7);
                    let (sine, cosine) = libm::sincos(azimuth);
                    let forearm = Vector3::new(0.7 * cosine, 0.7 * sine, up) * spread;
                    assert!((arm.elbow(mean_travel) - mean - forearm).norm() < 1e-9);
                }
            }
        }
    }
}
