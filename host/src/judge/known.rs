//! What the readings determine, what stays at the tolerance, and which poses would help most.

use super::credibility::in_tolerances;
use crate::accuracy::information::parameter_at;
use crate::accuracy::uncertainty::{self, ExpectedError, jacobian};
use crate::effects::{At, Course, Platform};
use crate::files::robot_file::{RobotFile, Tool};
use crate::files::samples_file::Kind;
use crate::fit::solution::PARAMETERS;
use crate::fit::{Frame, Solution};
use delta_cal::robot::{Parameter, ParameterKind};
use delta_cal::{Robot, Sample, Tolerance};
use nalgebra::{DMatrix, DVector, Matrix3, MatrixXx3, SMatrix, Vector3};
use serde::Serialize;

/// Degrees of freedom of the robot's place in space.
const PLACE_IN_SPACE: usize = 6;
/// The place in space is known if the rigid motion's part of the position error is below this fraction of what the
/// tolerance allows.
const PLACE_KNOWN: f64 = 0.5;

/// What the readings determine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Known {
    /// Number of parameter combinations that the readings determine better than the tolerance. Without a tolerance all,
    /// because a calibration is refused otherwise.
    pub combinations: usize,
    /// Number of combinations that affect relative positions.
    pub of: usize,
    /// Whether the readings determine where the robot stands in the frame of its parameters.
    pub place: bool,
    /// Whether the readings determine the robot's size.
    pub scale: bool,
}

/// The part of the position error that is a rigid motion: mm.
fn place(expected: &ExpectedError) -> f64 {
    let (absolute, relative) = (expected.absolute_rms_mm, expected.relative_rms_mm);
    (absolute * absolute - relative * relative).max(0.0).sqrt()
}

impl Known {
    /// Whether everything that relative positions depend on is known better than the tolerance.
    pub const fn relative_positions(&self) -> bool {
        self.scale && self.combinations >= self.of
    }

    /// `covariance`: of the robot's parameters given the readings and the tolerance, mm and radians. `before` and
    /// `after`: the robot's expected position errors.
    pub fn of(
        robot: &Robot<f64>,
        tolerance: Option<&Tolerance<f64>>,
        covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
        before: Option<&ExpectedError>,
        after: Option<&ExpectedError>,
    ) -> Self {
        let parameters = 3 * robot.drive().parameters().len();
        let of = parameters - PLACE_IN_SPACE;
        let found = tolerance.and_then(|own| in_tolerances(robot, own, covariance));
        let found = found.and_then(|(used, rows, own)| Some((used, rows, own.try_inverse()?)));
        let Some((used, rows, information)) = found else {
            return Self {
                of,
                combinations: parameters,
                place: true,
                scale: true,
            };
        };
        let larger = DVector::from_fn(used.len(), |index, _| {
            match parameter_at(robot, used[index]) {
                // If the scale of the travel grows, so does everything else.
                Some((_, Parameter::Scale)) => 1.0,
                Some((arm, parameter)) if parameter.kind() == ParameterKind::Length => {
                    robot.arm(arm).get(parameter)
                }
                _ => 0.0,
            }
        });
        let larger = rows * larger;
        // Of the information in tolerances, the tolerance's own is 1 for every combination.
        let eigenvalues = information.symmetric_eigenvalues();
        Self {
            of,
            combinations: eigenvalues.iter().filter(|value| **value > 2.0).count(),
            place: before
                .zip(after)
                .is_none_or(|(before, after)| place(after) < PLACE_KNOWN * place(before)),
            scale: larger.dot(&(&information * &larger)) > 2.0 * larger.norm_squared(),
        }
    }
}

/// Number of poses proposed.
const PROPOSED: usize = 3;
/// Number of candidate poses, over which the error is also averaged.
const CANDIDATES: usize = 250;

/// A pose to measure next and its benefit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NextPose {
    /// Joint angles or travels, in the unit and direction of the robot file.
    pub joints: [f64; 3],
    /// The expected position error with x, y and z of this pose and those before it, mm rms: relative where a sensor's frame
    /// is fitted.
    pub expected_error_mm: f64,
}

/// Greedy choice among these poses of those whose positions would reduce the expected position error most; empty if no
/// position is measured.
///
/// Frame, target, scale and datum points are unknowns, and the joints have noise: C ← C − C Aᵀ (A C Aᵀ + N)⁻¹ A C, with A
/// the derivatives of x, y and z at the pose by all unknowns, N = diag(σ²) + σq² Jq Jqᵀ.
pub(crate) fn next_poses(
    robot: &RobotFile,
    solution: &Solution,
    poses: &[Sample<f64>],
) -> Vec<NextPose> {
    if !solution.readings.holds(Kind::Position) {
        return Vec::new();
    }
    let every = poses.len().div_ceil(CANDIDATES).max(1);
    let candidates: Vec<_> = poses.iter().step_by(every).copied().collect();
    let tooled = (&solution.robot, &robot.tool());
    let Some([absolute, relative]) =
        uncertainty::weights(tooled, &candidates, !solution.is_of_parameters())
    else {
        return Vec::new();
    };
    let of_robot = if solution.is_absolute() {
        absolute
    } else {
        relative
    };
    let mut covariance = solution.covariance.clone();
    let places = solution.robot_places();
    let mut weights = DMatrix::zeros(covariance.nrows(), covariance.ncols());
    for (own, column) in places.iter().zip(of_robot.column_iter()) {
        for (other, weight) in places.iter().zip(&column) {
            if let (Some(own), Some(other)) = (own, other) {
                weights[(*other, *own)] = *weight;
            }
        }
    }
    let readings = &solution.readings;
    let platform = Platform::of(robot, &readings.targets);
    let course = Course::of(&solution.robot, platform, &solution.places, readings);
    let all = candidates.iter();
    let all: Vec<_> = all
        .filter_map(|pose| measured(solution, &course, pose))
        .collect();
    let error = |covariance: &DMatrix<f64>| weights.dot(covariance).max(0.0);
    // No pose shows what causes did to the place of the base.
    let mut left = 0.0;
    if let Some(of_causes) = &solution.of_causes {
        covariance -= of_causes;
        left = error(of_causes);
    }
    let mut found = Vec::new();
    for _ in 0..PROPOSED {
        // C Aᵀ and (A C Aᵀ + N)⁻¹.
        let updating = |(_, rows, noise): &Measured| {
            let shared = &covariance * rows;
            let inverse = (rows.tr_mul(&shared) + noise).try_inverse()?;
            Some((shared, inverse))
        };
        let gain = |measured: &Measured| {
            let (shared, inverse) = updating(measured)?;
            Some((&weights * &shared).dot(&(&shared * inverse)))
        };
        let gains = all.iter().filter_map(|own| Some((gain(own)?, own)));
        let best = gains.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((best, (shared, inverse))) = best.and_then(|(_, own)| Some((own, updating(own)?)))
        else {
            break;
        };
        covariance -= &shared * inverse * shared.transpose();
        found.push(NextPose {
            joints: robot.convention.joints(&best.0),
            expected_error_mm: (error(&covariance) + left).sqrt(),
        });
    }
    found
}

/// Joints, Aᵀ and N of a pose.
type Measured = ([f64; 3], MatrixXx3<f64>, Matrix3<f64>);

fn measured(solution: &Solution, course: &Course, pose: &Sample<f64>) -> Option<Measured> {
    let (robot, exact) = (&solution.robot, Tool::default());
    let jacobian = jacobian::<PARAMETERS>(robot, &exact, &pose.position, &pose.joints)?;
    let at = At::new(robot, &pose.joints)?;
    let turn = solution
        .places
        .frame
        .map_or_else(Matrix3::identity, |own| own.rotation);
    let mut rows = MatrixXx3::zeros(solution.covariance.nrows());
    rows.rows_mut(0, PARAMETERS)
        .copy_from(&(turn * jacobian).transpose());
    if solution.frame == Frame::Sensor {
        // Its shift, and its turn about the sensor's origin.
        let first = solution.robot_unknowns();
        let about = -(turn * pose.position).cross_matrix();
        rows.rows_mut(first, 3).fill_with_identity();
        rows.rows_mut(first + 3, 3).copy_from(&about.transpose());
    }
    let here = course.anywhere(&at, [0.0; 3]);
    for own in &solution.effects {
        for (place, moved) in own.places().zip(own.effect.columns(&at, &here, 0)) {
            rows.set_row(place, &(turn * moved).transpose());
        }
    }
    let noise = solution.levels.position;
    let axes = Vector3::from(noise.position_by_axis());
    let of_joints = turn * at.by_joints * noise.joint();
    let noise =
        Matrix3::from_diagonal(&axes.component_mul(&axes)) + of_joints * of_joints.transpose();
    Some((pose.joints, rows, noise))
}
