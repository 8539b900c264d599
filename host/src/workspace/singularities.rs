//! How far a pose is from the nearest singular one.
//!
//! Type 1 in closed form: seen in the plane through the motor axis and X, with r the distance from
//! the axis and h along it, the elbow's circle is the points (±La, 0). X is singular where its
//! forearm and upper arm are in line: on the arc of radius Lb about (La, 0) (stretched) or about
//! (−La, 0) (folded), r ≥ 0 on both. Type 2, det(w₁, w₂, w₃) = 0, is searched for on rays from X, out
//! to the nearest singularity of type 1, and the nearest hit is moved to the foot of the
//! perpendicular.

use super::face::{determinant, flattest};
use crate::reach::Limit;
use delta_cal::{Arm, ArmIndex, Robot};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Directions in which a parallel singularity is searched for.
const RAYS: u32 = 96;
/// Steps on a ray.
const STEPS: u32 = 24;
/// Steps towards the foot of the perpendicular.
const ITERATIONS: usize = 30;

/// The singular configuration nearest to a pose, within the pose's branch of the kinematics. Joint
/// limits are not looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestSingularity {
    /// [`Limit::Serial`] or [`Limit::Parallel`].
    pub kind: Limit,
    /// How far it is, mm.
    pub distance: f64,
    /// Where it is, mm.
    pub position: Vector3<f64>,
}

/// The singularity nearest to the pose (`x`, `q`), mm and radians.
pub fn nearest_singularity(
    robot: &Robot<f64>,
    x: &Vector3<f64>,
    q: &[f64; 3],
) -> NearestSingularity {
    let [first, second, third] = ArmIndex::ALL.map(|arm| {
        let position = nearest_serial(robot.arm(arm), x);
        NearestSingularity {
            kind: Limit::Serial(arm),
            distance: (position - x).norm(),
            position,
        }
    });
    let nearer = |a: NearestSingularity, b: NearestSingularity| {
        if b.distance < a.distance { b } else { a }
    };
    let serial = nearer(nearer(first, second), third);
    match nearest_parallel(robot, x, q, serial.distance) {
        Some(parallel) => nearer(serial, parallel),
        None => serial,
    }
}

/// The nearest point at which the arm is stretched or folded.
fn nearest_serial(arm: &Arm<f64>, x: &Vector3<f64>) -> Vector3<f64> {
    let axis = arm.basis().ey;
    let w = x - arm.d();
    let h = w.dot(&axis);
    let across = w - axis * h;
    let r = across.norm();
    // On the axis every direction is as near.
    let radial = if r > 0.0 { across / r } else { arm.basis().ex };
    let (la, lb) = (arm.upper_arm_length(), arm.lb());
    let on_arc = |centre: f64| {
        let (along, up) = (r - centre, h);
        let length = along.hypot(up);
        let (along, up) = if length > 0.0 {
            (along / length, up / length)
        } else {
            (1.0, 0.0)
        };
        let foot = (centre + lb * along, lb * up);
        // The arc ends on the axis, where both arcs meet; without an end it does not reach it.
        let end = (lb * lb - la * la).max(0.0).sqrt().copysign(up);
        if foot.0 >= 0.0 {
            Some(foot)
        } else {
            (lb >= la).then_some((0.0, end))
        }
    };
    let distance = |foot: &(f64, f64)| (foot.0 - r).hypot(foot.1 - h);
    let foot = [on_arc(la), on_arc(-la)]
        .into_iter()
        .flatten()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    // Folded arms with a forearm shorter than the upper arm: the arc about (La, 0) is a whole
    // circle, and its other side is nearer.
    let foot = foot.unwrap_or((la - lb, 0.0));
    arm.d() + radial * foot.0 + axis * foot.1
}

/// The nearest point at which the forearms lie in one plane, if it is within `limit`.
fn nearest_parallel(
    robot: &Robot<f64>,
    x: &Vector3<f64>,
    q: &[f64; 3],
    limit: f64,
) -> Option<NearestSingularity> {
    let value = |at: &Vector3<f64>| determinant(robot, at, q).map(|(value, _)| value);
    let sign = value(x)?.signum();
    let crossed = |at: &Vector3<f64>| value(at).is_some_and(|value| value * sign <= 0.0);
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for ray in 0..RAYS {
        let direction = direction(ray);
        let mut far = best.map_or(limit, |(distance, _)| distance);
        let step = far / f64::from(STEPS);
        for number in 1..=STEPS {
            let way = step * f64::from(number);
            if crossed(&(x + direction * way)) {
                let (mut near, mut beyond) = (way - step, way);
                for _ in 0..40 {
                    let middle = f64::midpoint(near, beyond);
                    if crossed(&(x + direction * middle)) {
                        beyond = middle;
                    } else {
                        near = middle;
                    }
                }
                far = beyond;
                best = Some((far, x + direction * far));
                break;
            }
        }
    }
    let (mut distance, mut position) = best?;
    // x′ = X − ∇g (g + ∇g·(X − x′))/|∇g|²: where it settles is the foot of the perpendicular.
    let mut place = position;
    for _ in 0..ITERATIONS {
        let Some((value, gradient)) = determinant(robot, &place, q) else {
            break;
        };
        let off = (value + gradient.dot(&(x - place))) / gradient.norm_squared();
        let next = x - gradient * off;
        if !(next - x).norm().is_finite() {
            break;
        }
        let settled = (next - place).norm() <= 1e-9 * distance;
        place = next;
        if settled {
            if (place - x).norm() < distance {
                (distance, position) = ((place - x).norm(), place);
            }
            break;
        }
    }
    Some(NearestSingularity {
        kind: Limit::Parallel(flattest(robot, x, q)),
        distance,
        position,
    })
}

/// Directions evenly spread over the sphere (Fibonacci's lattice).
fn direction(ray: u32) -> Vector3<f64> {
    let z = 1.0 - (2.0 * f64::from(ray) + 1.0) / f64::from(RAYS);
    let (sin, cos) = (f64::from(ray) * PI * (3.0 - 5f64.sqrt())).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cos, across * sin, z)
}
