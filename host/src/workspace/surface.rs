//! The smooth surfaces that form the boundary, one per limit.
//!
//! | limit of arm i | the surface g(X, P) = 0, g > 0 outside |
//! | --- | --- |
//! | a joint at its end q̄ | sphere of radius Lb about B(q̄): ± (\|w\| − Lb), w = X − B, the sign of w·B′ |
//! | serial singularity | envelope of these spheres over q: w·B′ = 0, about a tower a cylinder |
//! | forearm at its largest angle β | planes \|(X − D)·ey\| = Lb sin β |
//! | parallel singularity | det(w₁, w₂, w₃) = 0, qᵢ(X) on their branches |
//! | elbows' plane upright | ((B₂ − B₁) × (B₃ − B₁))·up = 0, the same |
//!
//! Derivatives are central differences: with lengths of some 100 mm, steps of 1e-4 mm give nine digits.

use super::grid::PART;
use super::{Workspace, surface};
use crate::cores;
use crate::geometry::{Limit, Reach, other_elbow};
use delta_cal::kinematics::KinematicsError;
use delta_cal::robot::{Drive, ParameterKind};
use delta_cal::{ArmIndex, Parameter, Robot};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Step of a length, mm.
const STEP: f64 = 1e-4;
/// Step of an angle, radians: the same displacement on an arm of 100 mm.
const TURN: f64 = 1e-6;

/// A limit's surface near a pose.
pub(super) struct Surface<'a> {
    reach: &'a Reach,
    limit: Limit,
    /// Joint angles nearby (radians), to select the branch of the inverse.
    q: [f64; 3],
    /// Sign, outside, of the function that vanishes at the last two limits.
    sign: f64,
}

impl<'a> Surface<'a> {
    /// The surface of a limit near a pose inside, given by its joint angles.
    pub(super) fn new(robot: &Robot<f64>, reach: &'a Reach, limit: Limit, q: [f64; 3]) -> Self {
        // Inside, the elbows' plane faces up and the platform is below it:
        let side = upright(robot, &q).signum();
        let sign = if matches!(limit, Limit::Assembly(_)) {
            -side
        } else {
            side
        };
        Self {
            reach,
            limit,
            q,
            sign,
        }
    }

    /// The distance of a position outside the surface: in mm for the first three limits, otherwise a volume or an area
    /// that vanishes on the surface. `None` where the surface is undefined.
    pub(super) fn outside(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Option<f64> {
        let arm = robot.arm(self.limit.arm());
        let w = x - arm.d();
        let (q, sign) = match self.limit {
            Limit::JointMinimum(_) | Limit::JointMaximum(_) => {
                let (q, sign) = match self.limit {
                    Limit::JointMinimum(_) => (self.reach.limits.minimum(), -1.0),
                    _ => (self.reach.limits.maximum(), 1.0),
                };
                let along = (x - arm.elbow(q)).dot(&arm.elbow_derivative(q));
                (q, sign * along.signum())
            }
            Limit::Forearm(_) => {
                let out = w.dot(&arm.basis().ey).abs();
                return Some(out - arm.lb() * self.reach.forearm_limit?.sin());
            }
            Limit::Parallel(_) | Limit::Assembly(_) => {
                let q = branch(robot, x, &self.q)?;
                let value = if let Limit::Assembly(_) = self.limit {
                    upright(robot, &q)
                } else {
                    let [w1, w2, w3] = forearms(robot, x, &q);
                    w1.dot(&w2.cross(&w3))
                };
                return value.is_finite().then_some(self.sign * value);
            }
            _ => {
                let (u, v) = (arm.basis().u.dot(&w), arm.basis().v.dot(&w));
                let stretched = match arm.drive() {
                    Drive::Linear => v / arm.basis().v.norm_squared(),
                    Drive::Rotary => v.atan2(u),
                };
                let folded = arm.drive() == Drive::Rotary
                    && apart(stretched, self.q[self.limit.arm().index()]) > PI / 2.0;
                if folded {
                    (stretched + PI, -1.0)
                } else {
                    (stretched, 1.0)
                }
            }
        };
        Some(sign * ((x - arm.elbow(q)).norm() - arm.lb()))
    }

    fn gradient(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Option<Vector3<f64>> {
        let mut gradient = Vector3::zeros();
        for axis in 0..3 {
            let step = Vector3::ith(axis, STEP);
            let [ahead, back] = [x + step, x - step].map(|x| self.outside(robot, &x));
            gradient[axis] = (ahead? - back?) / (2.0 * STEP);
        }
        (gradient.norm() > 0.0).then_some(gradient)
    }

    pub(super) fn normal(&self, robot: &Robot<f64>, x: &Vector3<f64>) -> Option<Vector3<f64>> {
        self.gradient(robot, x).map(|gradient| gradient.normalize())
    }

    /// Displacement of the surface along its outward normal at `x` for each of the 24 parameters, mm per mm or mm per
    /// radian: −∂g/∂p / |∂g/∂X|. `x` must be on the surface.
    pub(super) fn displacement(&self, varied: &Varied, x: &Vector3<f64>) -> Option<[f64; 24]> {
        let steep = self.gradient(&varied.robot, x)?.norm();
        let own = self.limit.arm().index();
        let of_all = matches!(self.limit, Limit::Parallel(_) | Limit::Assembly(_));
        let mut moved = [0.0; 24];
        for (number, variation) in varied.variations.iter().enumerate() {
            let Some((step, robots)) = variation else {
                continue;
            };
            if of_all || number / 8 == own {
                let [more, less] = robots.each_ref().map(|robot| self.outside(robot, x));
                moved[number] = (less? - more?) / (2.0 * step * steep);
            }
        }
        Some(moved)
    }
}

/// A robot, and the robots with each parameter one step larger and one step smaller.
pub(super) struct Varied {
    robot: Robot<f64>,
    variations: Vec<Option<(f64, [Robot<f64>; 2])>>,
}

impl Varied {
    pub(super) fn of(robot: &Robot<f64>) -> Self {
        let places = robot.drive().places();
        let variation = |number: usize| {
            let step = match places[number % 8].map(Parameter::kind)? {
                ParameterKind::Length => STEP,
                ParameterKind::Angle | ParameterKind::Ratio => TURN,
            };
            let [more, less] = [step, -step].map(|step| {
                let mut parameters = robot.parameters();
                parameters[number / 8][number % 8] += step;
                robot.with_parameters(parameters).ok()
            });
            Some((step, [more?, less?]))
        };
        Self {
            robot: robot.clone(),
            variations: (0..24).map(variation).collect(),
        }
    }
}

/// The distance between two angles, 0 to π.
fn apart(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    turn.min(TAU - turn)
}

/// The joint angles at `x` on the branch nearest to `near`.
pub(super) fn branch(robot: &Robot<f64>, x: &Vector3<f64>, near: &[f64; 3]) -> Option<[f64; 3]> {
    let mut q = robot.inverse(x).ok()?;
    if robot.drive() == Drive::Linear {
        return Some(q);
    }
    for ((arm, q), near) in robot.arms().iter().zip(&mut q).zip(near) {
        let other = other_elbow(arm, x, *q);
        if apart(other, *near) < apart(*q, *near) {
            *q = other;
        }
    }
    Some(q)
}

fn forearms(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> [Vector3<f64>; 3] {
    ArmIndex::ALL.map(|arm| x - robot.arm(arm).elbow(q[arm.index()]))
}

/// The area spanned by the elbows as seen from above, mm²: 0 if their plane is vertical.
fn upright(robot: &Robot<f64>, q: &[f64; 3]) -> f64 {
    let [w1, w2, w3] = forearms(robot, &Vector3::zeros(), q);
    (w2 - w1).cross(&(w3 - w1)).dot(&robot.up())
}

/// Whether the elbows' plane is flipped between two sets of joint angles.
pub(super) fn elbows_turned_over(robot: &Robot<f64>, q: &[f64; 3], other: &[f64; 3]) -> bool {
    (upright(robot, q) > 0.0) != (upright(robot, other) > 0.0)
}

/// The arm whose forearm is closest to the plane of the other two.
pub(super) fn flattest(robot: &Robot<f64>, x: &Vector3<f64>, q: &[f64; 3]) -> ArmIndex {
    let w = forearms(robot, x, q);
    let flatness = |arm: &ArmIndex| {
        let index = arm.index();
        let plane = w[(index + 1) % 3].cross(&w[(index + 2) % 3]);
        plane.norm() * robot.arm(*arm).lb()
    };
    ArmIndex::ALL
        .into_iter()
        .max_by(|a, b| flatness(a).total_cmp(&flatness(b)))
        .unwrap_or(ArmIndex::First)
}

/// A point of the boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Position, mm; reachable.
    pub position: Vector3<f64>,
    /// The limit that stops the platform there.
    pub limit: Limit,
    /// Outward normal of the boundary.
    pub outward: Vector3<f64>,
    /// The area that the point represents, mm²: spacing² · |normal along its line|. The sum over all points is the area
    /// of the boundary.
    pub area: f64,
    /// Joint angles, radians.
    pub q: [f64; 3],
    /// The middle of the edge of the grid that it is on, in half spacings from the first node.
    pub(super) edge: [usize; 3],
}

/// Both ends of each reachable interval of each line along x, y and z, in this order.
pub(super) fn points(workspace: &Workspace) -> Vec<BoundaryPoint> {
    let along = |axis: usize| {
        let of_line = move |(line, pieces): (usize, &Vec<(f64, f64)>)| {
            let first = workspace.grid.beginning(line, axis);
            let ends = pieces
                .iter()
                .flat_map(|(from, to)| [(*from, -1.0), (*to, 1.0)]);
            let point = |(way, sign)| point(workspace, first, axis, way, sign);
            ends.map(point).collect::<Vec<_>>()
        };
        let lines = workspace.lines[axis].iter().enumerate();
        cores::map(lines, of_line).into_iter().flatten()
    };
    [0, 1, 2].into_iter().flat_map(along).collect()
}

/// The boundary point at the last reachable position, `way` from the first node of a line along an axis, in the direction of
/// `sign`.
fn point(
    workspace: &Workspace,
    first: [usize; 3],
    axis: usize,
    way: f64,
    sign: f64,
) -> BoundaryPoint {
    let Workspace {
        robot, reach, grid, ..
    } = workspace;
    let position = grid.node(first) + Vector3::ith(axis, way);
    let joints = reach.any_joints(robot, &position);
    let q = joints.unwrap_or([reach.limits.at(0.5); 3]);
    let direction = Vector3::ith(axis, sign);
    // Twice as far as the last position found unreachable, which rounding may have decided.
    let outside = position + direction * (2.0 * PART * workspace.tolerance);
    let limit = what_stops(workspace, &q, &outside);
    let normal = Surface::new(robot, reach, limit, q).normal(robot, &position);
    let outward = normal.unwrap_or(direction);
    // From the last node inside to the next one.
    let inside = sign * (sign * way / grid.spacing).floor();
    let mut edge = first.map(|node| 2 * node);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // some hundreds
    let middle = (2.0 * inside + sign) as usize;
    edge[axis] = middle;
    BoundaryPoint {
        position,
        limit,
        outward,
        area: grid.spacing.powi(2) * outward[axis].abs(),
        q,
        edge,
    }
}

/// The limit that keeps the platform from `outside`, starting from a nearby pose with joint angles `q`.
fn what_stops(workspace: &Workspace, q: &[f64; 3], outside: &Vector3<f64>) -> Limit {
    let Workspace { robot, reach, .. } = workspace;
    if let Err(error) = robot.inverse(outside) {
        return match error {
            KinematicsError::Unreachable(arm) => Limit::Serial(arm),
            error => error.into(),
        };
    }
    let Some(there) = surface::branch(robot, outside, q) else {
        return Limit::NonFinite(ArmIndex::First);
    };
    let there = there.map(|q| reach.in_turn(q));
    match reach.allows(robot, outside, &there) {
        Err(Limit::Parallel(arm)) if surface::elbows_turned_over(robot, q, &there) => {
            Limit::Assembly(arm)
        }
        Err(Limit::Parallel(_)) | Ok(()) => {
            Limit::Parallel(surface::flattest(robot, outside, &there))
        }
        Err(limit) => limit,
    }
}
