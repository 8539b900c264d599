//! Free starts: the linear fit, and arms constructed from the spread of the samples alone.

use crate::Real;
use crate::robot::Drive;
use crate::samples::{ArmFactor, NominalArm, nearest_turn};
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
    T::correction(factor.nominal(), &delta)
}

/// Derives the correction δP from the difference δc of the coefficients.
pub(crate) fn correction_of<T: Real>(nominal: &NominalArm<T>, delta: &[T; 12]) -> Option<[T; 8]> {
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
    let [_, _, _, theta0, alpha0, ..] = nominal.arm().parameters();
    let (la_x0, la_y0) = nominal.la;
    Some([
        means.x.x - outwards * cosine - nominal.d.x,
        means.x.y - outwards * sine - nominal.d.y,
        means.x.z + up - nominal.d.z,
        nearest_turn(theta - theta0),
        -alpha0,
        la - la_x0,
        -la_y0,
        lb - nominal.lb,
    ])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{SPREAD_STARTS, free_start, spread_start};
    use crate::fixtures::uniform;
    use crate::robot::{Arm, ArmIndex, Drive};
    use crate::samples::{ArmFactor, Noise, NominalArm, corrected_arm};
    use core::f64::consts::{PI, TAU};
    use nalgebra::Vector3;

    const TRUTH: [f64; 8] = [150.0, 30.0, -5.0, 0.7, 0.2, 240.0, 35.0, 470.0];

    fn truth() -> Arm<f64> {
        Arm::new(TRUTH).unwrap()
    }

    /// Points at the forearm's length from the elbow, in all directions, and their joint angles or travels.
    fn exact_samples(arm: &Arm<f64>, count: usize) -> impl Iterator<Item = (Vector3<f64>, f64)> {
        let mut uniform = uniform(7);
        (0..count).map(move |_| {
            let q = match arm.drive() {
                Drive::Rotary => 1.5 * uniform(),
                Drive::Linear => 350.0 + 150.0 * uniform(),
            };
            let direction = Vector3::new(uniform(), uniform(), uniform() - 1.5).normalize();
            (arm.elbow(q) + direction * arm.lb(), q)
        })
    }

    fn factor(
        nominal: &Arm<f64>,
        noise: Option<Noise<f64>>,
        samples: impl Iterator<Item = (Vector3<f64>, f64)>,
    ) -> ArmFactor<f64> {
        let centre = Vector3::new(10.0, -20.0, -430.0);
        let mut factor = ArmFactor::new(NominalArm::new(nominal, &centre, noise));
        for (x, q) in samples {
            factor.add(&x, q, ArmIndex::First).unwrap();
        }
        factor
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
            (3.1, -3.1, TAU - 6.2),
            (-3.1, 3.1, 6.2 - TAU),
            (6.2, 0.1, TAU - 6.1),
            (-6.2, -0.2, 6.0 - TAU),
            (0.5, 3.0, 2.5),
        ] {
            let factor = factor(&at(nominal), None, exact_samples(&at(truth), 40));
            let correction = free_start(&factor).unwrap();
            assert!((correction[3] - expected).abs() < 1e-9, "{correction:?}");
        }
    }

    /// Too few samples, a joint that never moves, samples in one place. The scale of the weights does not matter.
    #[test]
    fn samples_that_leave_a_coefficient_free_give_no_start() {
        let truth = truth();
        for count in [0, 1, 8, 11] {
            let few = factor(&truth, None, exact_samples(&truth, count));
            assert!(free_start(&few).is_none());
        }
        for sigma in [1e-7, 1e-3, 1e3, 1e9] {
            let noise = Noise::new(sigma, 0.0).ok();
            let correction = free_start(&factor(&truth, noise, exact_samples(&truth, 12)));
            assert!(correction.unwrap().iter().all(|delta| delta.abs() < 1e-9));
            let still = exact_samples(&truth, 40).map(|(x, _)| (x, 0.3));
            assert!(
                free_start(&factor(&truth, noise, still)).is_none(),
                "{sigma:e}"
            );
        }
        for count in [0, 12] {
            let one_place = core::iter::repeat_n((Vector3::new(0.0, 0.0, -500.0), 0.3), count);
            let factor = factor(&truth, None, one_place);
            let means = factor.means();
            // Rounding may leave a spread of up to √ε units.
            assert!(spread_start(factor.nominal(), &means, 0).is_none() || means.spread < 1e-7);
        }
    }

    /// Travels counted downwards belong to no tower.
    #[cfg(feature = "linear")]
    #[test]
    fn a_tower_that_points_down_is_no_start() {
        let truth = Arm::linear(TOWER).unwrap();
        let downwards = exact_samples(&truth, 40).map(|(x, travel)| (x, -travel));
        assert!(free_start(&factor(&truth, None, downwards)).is_none());
    }

    #[cfg(feature = "linear")]
    const TOWER: [f64; 7] = [140.0, 30.0, -5.0, 0.1, -0.2, 1.1, 330.0];

    /// Level upper arms of 0.7 and forearms of 1.2 times the samples' spread, at azimuths a sixth of a turn apart: the
    /// mean sample is a forearm below the mean elbow. Upright towers stand as far from the mean sample, which their
    /// forearms reach from above at the mean travel.
    fn follow_the_samples_alone(truth: &Arm<f64>, nominal: &Arm<f64>) {
        let samples = factor(nominal, None, exact_samples(truth, 12));
        let mean: Vector3<f64> = exact_samples(truth, 12).map(|(x, _)| x / 12.0).sum();
        let squares = exact_samples(truth, 12).map(|(x, _)| (x - mean).norm_squared() / 12.0);
        let spread = libm::sqrt(squares.sum());
        for index in 0..SPREAD_STARTS {
            let correction = spread_start(samples.nominal(), &samples.means(), index).unwrap();
            let arm = corrected_arm(samples.nominal(), &correction).unwrap();
            let elbows = exact_samples(truth, 12).map(|(_, q)| arm.elbow(q) / 12.0);
            let forearm = elbows.sum::<Vector3<f64>>() - mean;
            let (sine, cosine) = libm::sincos(PI / 3.0 * f64::from(index));
            let expected = match arm.drive() {
                Drive::Rotary => {
                    assert!((arm.upper_arm_length() - 0.7 * spread).abs() < 1e-9);
                    assert!((arm.basis().ex - Vector3::new(cosine, sine, 0.0)).norm() < 1e-12);
                    assert!(arm.basis().ey.z.abs() < 1e-12);
                    Vector3::new(0.0, 0.0, 1.2)
                }
                Drive::Linear => {
                    assert!((arm.basis().v - Vector3::z()).norm() < 1e-12);
                    let up = libm::sqrt(1.2 * 1.2 - 0.7 * 0.7);
                    Vector3::new(0.7 * cosine, 0.7 * sine, up)
                }
            };
            // ε times lengths of some hundreds.
            assert!((arm.lb() - 1.2 * spread).abs() < 1e-9);
            assert!((forearm - expected * spread).norm() < 1e-9);
        }
    }

    #[test]
    fn the_arms_of_the_spread_follow_the_samples_alone() {
        for nominal in [TRUTH, [50.0, -80.0, 60.0, -1.5, -0.7, 100.0, -90.0, 900.0]] {
            follow_the_samples_alone(&truth(), &Arm::new(nominal).unwrap());
        }
        #[cfg(feature = "linear")]
        for nominal in [TOWER, [-200.0, 10.0, 90.0, -0.4, 0.3, 0.8, 500.0]] {
            let [truth, nominal] = [TOWER, nominal].map(|own| Arm::linear(own).unwrap());
            follow_the_samples_alone(&truth, &nominal);
        }
    }
}
