//! The positions of an export, and the position errors there.

use super::geometry::{Frame, coordinates};
use crate::accuracy::uncertainty::inside;
use crate::files::{InputError, Readings, RobotFile, Tooled};
use crate::geometry::centroid;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;

/// The largest number of fitted positions.
const FITTED: usize = 300;
/// The radius of the printed area as a fraction of the towers' distance from the z axis.
const BETWEEN_TOWERS: f64 = 0.85;
/// Fewer heights determine no plane.
const LEAST_HEIGHTS: usize = 3;

/// Where positions are.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// All over the workspace.
    Workspace,
    /// Only so far from the z axis, mm.
    Within(f64),
    /// Where this file states.
    Of(String),
}

/// Wanted positions in the calibrated robot's frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// The fitted positions with their weights.
    pub fitted: Vec<(Vector3<f64>, f64)>,
    /// The positions of the stated loss, including the fitted ones.
    pub evaluated: Vec<Vector3<f64>>,
    /// Where they are.
    pub place: Place,
}

impl Wanted {
    /// Positions all over the workspace of a robot: evenly spread in joint space, clear of singularities, and reached by a
    /// controller. With towers, only positions well between them: further out the rods are so flat that nobody works
    /// there.
    pub fn in_workspace(robot: &RobotFile) -> Self {
        let poses = inside(&robot.robot, &robot.reach());
        let positions = poses.into_iter().map(|pose| pose.position);
        let mut positions: Vec<_> = positions
            .filter(|at| controller_reaches(robot, at))
            .collect();
        let mut place = Place::Workspace;
        if robot.robot.drive() == Drive::Linear {
            let towers = robot.robot.arms().iter().map(|arm| arm.d().xy().norm());
            let out = (BETWEEN_TOWERS * towers.fold(f64::INFINITY, f64::min)).round();
            positions.retain(|at| at.xy().norm() <= out);
            place = Place::Within(out);
        }
        Self::at(place, positions)
    }

    /// The positions of a file.
    pub fn of(file: impl Into<String>, positions: Vec<Vector3<f64>>) -> Self {
        Self::at(Place::Of(file.into()), positions)
    }

    /// Of these positions at most 300, evenly spread, are fitted.
    fn at(place: Place, positions: Vec<Vector3<f64>>) -> Self {
        let step = positions.len().div_ceil(FITTED).max(1);
        let fitted = positions.iter().step_by(step);
        Self {
            fitted: fitted.map(|at| (*at, 1.0)).collect(),
            evaluated: positions,
            place,
        }
    }

    /// The lowest height, mm; 0 if none is below.
    pub(super) fn lowest(&self) -> f64 {
        self.evaluated.iter().fold(0.0, |low, at| low.min(at.z))
    }

    /// The largest distance from the z axis, mm.
    pub(super) fn reach(&self) -> f64 {
        let out = self.evaluated.iter().map(|at| at.xy().norm());
        out.fold(0.0, f64::max)
    }

    /// Their centre, mm.
    pub(super) fn centre(&self) -> Vector3<f64> {
        centroid(self.evaluated.iter().copied())
    }
}

/// Whether the elbows-out joint angles at a position, which controllers compute, lead there, are within the limits and,
/// with rotary arms, clear of singularities.
pub(super) fn controller_reaches(robot: &RobotFile, at: &Vector3<f64>) -> bool {
    let reach = robot.reach();
    let joints = reach.joints(&robot.robot, at);
    joints.is_ok_and(|joints| match robot.robot.drive() {
        Drive::Rotary => reach.clear_position(&robot.robot, &joints).is_ok(),
        Drive::Linear => true,
    })
}

/// The position, less the tool, of the calibrated robot's tool at the joint angles that a controller computes for a commanded
/// position.
pub(crate) fn reached(
    (calibrated, tool): Tooled<'_>,
    controller: &Robot<f64>,
    commanded: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let joints = controller.inverse(commanded).ok()?;
    Some(tool.position(calibrated, &joints).ok()? - tool.place)
}

/// Position errors over many positions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Loss {
    /// Root of the mean square, mm.
    #[serde(rename = "rms_mm")]
    pub rms: f64,
    /// The largest, mm.
    #[serde(rename = "worst_mm")]
    pub worst: f64,
    /// The wanted position with the largest error, in the robot's frame, mm.
    #[serde(rename = "worst_at_mm", serialize_with = "coordinates")]
    pub at: Vector3<f64>,
    /// The number of compared positions.
    pub positions: usize,
    /// The number of positions that the controller's kinematics does not reach.
    pub unreached: usize,
}

impl Loss {
    /// The loss over wanted positions, each with the reached one if there is one.
    pub(super) fn of<'a>(
        pairs: impl Iterator<Item = (&'a Vector3<f64>, Option<Vector3<f64>>)>,
    ) -> Self {
        let mut loss = Self::default();
        let mut sum = 0.0;
        for (at, is) in pairs {
            let Some(is) = is else {
                loss.unreached += 1;
                continue;
            };
            let distance = (is - at).norm();
            loss.positions += 1;
            sum += distance * distance;
            if distance >= loss.worst {
                (loss.worst, loss.at) = (distance, *at);
            }
        }
        loss.rms = f64::sqrt(sum / loss.positions.max(1) as f64);
        loss
    }

    /// The errors of the calibrated robot if a controller with the kinematics of `controller` is commanded to each
    /// position; `frame` transforms the robot's frame to the controller's.
    pub(super) fn of_controller(
        calibrated: Tooled<'_>,
        controller: &Robot<f64>,
        frame: &RigidTransform<f64>,
        wanted: &Wanted,
    ) -> Self {
        let is = |at| reached(calibrated, controller, &frame.apply(at));
        Self::of(wanted.evaluated.iter().map(|at| (at, is(at))))
    }

    /// The same after the best rigid motion.
    pub(super) fn after_rigid_motion(
        calibrated: Tooled<'_>,
        controller: &Robot<f64>,
        wanted: &Wanted,
    ) -> Self {
        let each = wanted.evaluated.iter();
        let found = each.map(|at| (at, reached(calibrated, controller, at)));
        let found: Vec<_> = found.collect();
        let pairs = found.iter().filter_map(|(at, is)| Some(((*is)?, **at)));
        let motion = RigidTransform::align(pairs).unwrap_or_default();
        let moved = |(at, is): (_, Option<_>)| (at, is.map(|is| motion.apply(&is)));
        Self::of(found.into_iter().map(moved))
    }
}

/// The motion after which z is the height above the measured bed: by least squares over the heights,
/// `n · x − o = height` with a unit vector n.
///
/// # Errors
/// The heights are too few, or on one line.
pub fn bed(robot: &Robot<f64>, samples: &Readings) -> Result<Frame, InputError> {
    plane(robot, samples).ok_or_else(|| {
        let cause = "the file does not hold three heights that are not on one line";
        let error = InputError::new(&samples.name, cause);
        error.with_remedy("measure more heights, or export without them")
    })
}

fn plane(robot: &Robot<f64>, samples: &Readings) -> Option<Frame> {
    let mut rows = Vec::new();
    for row in &samples.rows {
        if let (Some((_, height)), Ok(at)) = (row.value.height, robot.forward(&row.value.joints)) {
            rows.push((at, height));
        }
    }
    if rows.len() < LEAST_HEIGHTS {
        return None;
    }
    let design = DMatrix::from_fn(rows.len(), 3, |row, column| {
        [rows[row].0.x, rows[row].0.y, 1.0][column]
    });
    let normal = design.tr_mul(&design).cholesky()?;
    // z + a x + b y − c is the height times the length of (a, b, 1), found by iteration.
    let mut solution = DVector::zeros(3);
    for _ in 0..20 {
        let length = Vector3::new(solution[0], solution[1], 1.0).norm();
        let off = rows.iter().map(|(at, height)| height * length - at.z);
        solution = normal.solve(&design.tr_mul(&DVector::from_iterator(rows.len(), off)));
    }
    let plane = Vector3::new(solution[0], solution[1], 1.0);
    Some(Frame::on_plane(
        &plane.normalize(),
        -solution[2] / plane.norm(),
    ))
}
