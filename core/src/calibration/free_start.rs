//! The starts without a guess: the linear fit, and arms that only the spread of the samples decides.

use super::arm_problem::Means;
use crate::Real;
use crate::robot::Drive;
use crate::samples::{ArmFactor, NominalArm};
use nalgebra::Vector3;

/// Minimises |R (δc, 1)| over free δc and reads the correction δP off it. `None` if the samples leave a
/// coefficient free or the coefficients are not those of an arm.
pub(crate) fn free_start<T: Real>(factor: &ArmFactor<T>) -> Option<[T; 8]> {
    // A pivot of the size of its column's rounding error carries no information.
    let rounding = T::from_f64(16.0) * T::EPSILON;
    let smallest = factor.triangle().column_norms().map(|norm| rounding * norm);
    let delta = factor.triangle().minimiser(&smallest)?;
    correction_of(factor.nominal(), &delta)
}

/// Reads the correction δP off the difference δc of the coefficients.
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

    // u × v points along the motor axis, which gives both angles.
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
    // Both u and v hold the upper arm: the mean of the two readings.
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

/// The same of a linear drive. The forearm from |D|² − Lb², the tower from v.
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

/// Azimuths of the arms that [`spread_start`] gives.
pub(crate) const SPREAD_STARTS: u8 = 6;
/// Upper arm and forearm of these arms, in units of the rms distance of the samples from their mean.
const UPPER_ARM: f64 = 0.7;
const FOREARM: f64 = 1.2;

/// The correction to one of [`SPREAD_STARTS`] arms, for samples from which the linear fit finds none: few
/// distinct joint angles determine the eight parameters of an arm, but not twelve coefficients.
///
/// The arms' azimuths are a sixth of a turn apart, their motor axes horizontal. The lengths are in proportion to the
/// spread s of the samples, La = 0.7 s and Lb = 1.2 s, and the forearm hangs down to the mean sample at
/// the mean joint angle: D = X̄ + Lb ez − (u cos q + v sin q). With a linear drive an upright tower stands La
/// beside the mean sample, and its carriage is where the forearm reaches down to it. `None` if the samples have
/// no spread.
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

/// The same direction within half a turn.
fn nearest_turn<T: Real>(angle: T) -> T {
    let turn = T::TWO * T::PI;
    angle - (angle / turn).nearest_integer() * turn
}

#[cfg(test)]
mod tests;
