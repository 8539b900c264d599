//! Where the robot is wanted, and how far it is from there.

use super::geometry::Frame;
use crate::accuracy::uncertainty::inside;
use crate::files::robot_file::RobotFile;
use crate::files::samples_file::Readings;
use delta_cal::Robot;
use delta_cal::frame::RigidTransform;
use delta_cal::robot::Drive;
use nalgebra::{DMatrix, DVector, Vector3};
use serde::{Serialize, Serializer};

/// At most so many positions are fitted.
const FITTED: usize = 300;
/// So far out, as a part of the towers' distance from the z axis, printers print.
const BETWEEN_TOWERS: f64 = 0.85;
/// Fewer heights determine no plane.
const LEAST_HEIGHTS: usize = 3;

/// Wanted positions in the calibrated robot's frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Those of the fit, and how many times each counts.
    pub fitted: Vec<(Vector3<f64>, f64)>,
    /// Those of the stated loss, the fitted ones among them.
    pub evaluated: Vec<Vector3<f64>>,
    /// Within so far of the z axis, if that was not the whole workspace, mm.
    pub within: Option<f64>,
}

impl Wanted {
    /// All over the workspace of a robot: evenly spread in joint space, clear of singularities, where a controller
    /// reaches them. Of a robot with towers only what is well between them: further out the rods hang so flat that
    /// nobody works there.
    pub fn in_workspace(robot: &RobotFile) -> Self {
        let poses = inside(&robot.robot, &robot.reach());
        let positions = poses.into_iter().map(|pose| pose.position);
        let mut positions: Vec<_> = positions
            .filter(|at| controller_reaches(robot, at))
            .collect();
        let mut within = None;
        if robot.robot.drive() == Drive::Linear {
            let towers = robot.robot.arms().iter().map(|arm| arm.d().xy().norm());
            let out = (BETWEEN_TOWERS * towers.fold(f64::INFINITY, f64::min)).round();
            positions.retain(|at| at.xy().norm() <= out);
            within = Some(out);
        }
        Self {
            within,
            ..Self::of(positions)
        }
    }

    /// These.
    pub fn of(positions: Vec<Vector3<f64>>) -> Self {
        let step = positions.len().div_ceil(FITTED).max(1);
        Self {
            fitted: positions
                .iter()
                .step_by(step)
                .map(|at| (*at, 1.0))
                .collect(),
            evaluated: positions,
            within: None,
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
        let count = self.evaluated.len().max(1) as f64;
        self.evaluated.iter().sum::<Vector3<f64>>() / count
    }
}

/// Whether the elbows-out joint angles at a position, which are those that controllers compute, lead there, are within
/// the limits and, with motors that turn the arms, clear of singularities.
pub(super) fn controller_reaches(robot: &RobotFile, at: &Vector3<f64>) -> bool {
    let reach = robot.reach();
    let joints = reach.joints(&robot.robot, at);
    joints.is_ok_and(|joints| match robot.robot.drive() {
        Drive::Rotary => reach.clear_position(&robot.robot, &joints).is_ok(),
        Drive::Linear => true,
    })
}

/// Where the calibrated robot is at the joint angles that a controller computes for a commanded position.
pub(super) fn reached(
    calibrated: &Robot<f64>,
    controller: &Robot<f64>,
    commanded: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let joints = controller.inverse(commanded).ok()?;
    calibrated.forward(&joints).ok()
}

/// Distances between where the platform was wanted and where it is, over many positions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Loss {
    /// Root of the mean square, mm.
    #[serde(rename = "rms_mm")]
    pub rms: f64,
    /// The largest, mm.
    #[serde(rename = "worst_mm")]
    pub worst: f64,
    /// Where it is the largest: the wanted position in the robot's frame, mm.
    #[serde(rename = "worst_at_mm", serialize_with = "coordinates")]
    pub at: Vector3<f64>,
    /// How many positions were compared.
    pub positions: usize,
    /// How many were left out because the controller's kinematics does not reach them.
    pub unreached: usize,
}

fn coordinates<S: Serializer>(at: &Vector3<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    [at.x, at.y, at.z].serialize(serializer)
}

impl Loss {
    /// Of wanted positions and where the robot is at each, if that is known.
    pub(super) fn of<'a>(
        pairs: impl Iterator<Item = (&'a Vector3<f64>, Option<Vector3<f64>>)>,
    ) -> Self {
        let mut loss = Self::default();
        let (mut sum, mut count) = (0.0, 0.0);
        for (at, is) in pairs {
            let Some(is) = is else {
                loss.unreached += 1;
                continue;
            };
            let distance = (is - at).norm();
            loss.positions += 1;
            count += 1.0;
            sum += distance * distance;
            if distance >= loss.worst {
                (loss.worst, loss.at) = (distance, *at);
            }
        }
        if loss.positions > 0 {
            loss.rms = f64::sqrt(sum / count);
        }
        loss
    }

    /// Where the calibrated robot is if a controller with the kinematics of `controller` is told to go to each
    /// position; `frame` takes the robot's frame to the controller's.
    pub(super) fn of_controller(
        calibrated: &Robot<f64>,
        controller: &Robot<f64>,
        frame: &RigidTransform<f64>,
        wanted: &Wanted,
    ) -> Self {
        let is = |at| reached(calibrated, controller, &frame.apply(at));
        Self::of(wanted.evaluated.iter().map(|at| (at, is(at))))
    }

    /// The same after the rigid motion that explains most of it.
    pub(super) fn after_rigid_motion(
        calibrated: &Robot<f64>,
        controller: &Robot<f64>,
        wanted: &Wanted,
    ) -> Self {
        let each = wanted.evaluated.iter();
        let found: Vec<_> = each
            .map(|at| (at, reached(calibrated, controller, at)))
            .collect();
        let pairs: Vec<_> = found
            .iter()
            .filter_map(|(at, is)| Some(((*is)?, **at)))
            .collect();
        let motion = RigidTransform::align(pairs.iter().copied()).unwrap_or_default();
        Self::of(
            found
                .into_iter()
                .map(|(at, is)| (at, is.map(|is| motion.apply(&is)))),
        )
    }
}

/// The motion after which z is the height above the bed of these measurements: by least squares over the heights,
/// `n · x − o = height` with n of length 1. `None` if they are too few or on one line.
pub fn bed(robot: &Robot<f64>, samples: &Readings) -> Option<Frame> {
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
    // z + a x + b y − c is the height times the length of (a, b, 1), which a few rounds find.
    let mut solution = Vector3::zeros();
    for _ in 0..20 {
        let length = Vector3::new(solution.x, solution.y, 1.0).norm();
        let off = rows.iter().map(|(at, height)| height * length - at.z);
        let right = design.tr_mul(&DVector::from_iterator(rows.len(), off));
        let next = Vector3::from_iterator(normal.solve(&right).iter().copied());
        let change = (next - solution).amax();
        solution = next;
        if change < 1e-13 {
            break;
        }
    }
    let plane = Vector3::new(solution.x, solution.y, 1.0);
    Some(Frame::on_plane(
        &plane.normalize(),
        -solution.z / plane.norm(),
    ))
}
