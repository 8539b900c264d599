//! How far a pose is from the nearest singular one.
//!
//! Type 1 in closed form: seen in the plane through the motor axis and X, with r the distance from
//! the axis and h along it, the elbow's circle is the points (±La, 0). X is singular where its
//! forearm and upper arm are in line: on the arc of radius Lb about (La, 0) (stretched) or about
//! (−La, 0) (folded), r ≥ 0 on both. Type 2, det(w₁, w₂, w₃) = 0, is searched for on rays from X, out
//! to the nearest singularity of type 1; the rays with the nearest hits are then turned as long as
//! that brings the hit nearer.

use super::boundary::bisect;
use super::face::{determinant, flattest};
use crate::geometry::reach::Limit;
use delta_cal::robot::Arm;
use delta_cal::{ArmIndex, Robot};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Directions in which a parallel singularity is searched for.
const RAYS: u32 = 96;
/// Steps on a ray.
const STEPS: u32 = 24;
/// So many of the nearest hits are brought nearer.
const REFINED: usize = 4;
/// By how much a ray is turned, at first and at last, radians.
const FIRST_TURN: f64 = 0.2;
const LAST_TURN: f64 = 1e-5;
/// Of the distance, mm.
const PRECISION: f64 = 1e-7;

/// The singular configuration nearest to a pose, within the pose's branch of the kinematics. Joint
/// limits are ignored.
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
    // Where a ray first meets it, if nearer than `far`.
    let hit = |direction: &Vector3<f64>, far: f64| {
        let step = far / f64::from(STEPS);
        let ways = (1..=STEPS).map(|number| step * f64::from(number));
        let beyond = ways
            .into_iter()
            .find(|way| crossed(&(x + direction * *way)))?;
        let ends = (x + direction * (beyond - step), x + direction * beyond);
        let (_, at) = bisect(|at| !crossed(at), ends, PRECISION);
        Some((at - x).norm())
    };
    let rays = (0..RAYS).map(direction);
    let mut hits: Vec<(f64, Vector3<f64>)> = rays
        .filter_map(|ray| Some((hit(&ray, limit)?, ray)))
        .collect();
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, Vector3<f64>)> = None;
    for (mut distance, mut ray) in hits.into_iter().take(REFINED) {
        let mut turn = FIRST_TURN;
        while turn > LAST_TURN {
            let mut neighbours = around(&ray, turn).into_iter();
            let nearer = neighbours.find_map(|ray| Some((hit(&ray, distance)?, ray)));
            match nearer.filter(|(nearer, _)| *nearer < distance - PRECISION) {
                Some(found) => (distance, ray) = found,
                None => turn *= 0.5,
            }
        }
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, ray));
        }
    }
    let (distance, ray) = best?;
    Some(NearestSingularity {
        kind: Limit::Parallel(flattest(robot, x, q)),
        distance,
        position: x + ray * distance,
    })
}

/// Eight directions turned from one by this angle, radians.
fn around(ray: &Vector3<f64>, turn: f64) -> [Vector3<f64>; 8] {
    let side = ray.cross(&Vector3::ith(ray.iamin(), 1.0)).normalize();
    let other = ray.cross(&side);
    [0.0, 4.0, 2.0, 6.0, 1.0, 5.0, 3.0, 7.0].map(|eighth| {
        let (sin, cos) = (eighth * PI / 4.0).sin_cos();
        (ray + (side * cos + other * sin) * turn).normalize()
    })
}

/// Directions evenly spread over the sphere (Fibonacci's lattice).
fn direction(ray: u32) -> Vector3<f64> {
    let z = 1.0 - (2.0 * f64::from(ray) + 1.0) / f64::from(RAYS);
    let (sin, cos) = (f64::from(ray) * PI * (3.0 - 5f64.sqrt())).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vector3::new(across * cos, across * sin, z)
}
