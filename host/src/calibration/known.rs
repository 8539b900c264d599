//! What the readings determine, what stays at the tolerance, and which poses would help most.

use super::credibility::in_tolerances;
use crate::accuracy::information::parameter_at;
use crate::accuracy::uncertainty::{ExpectedError, Sensitivities};
use crate::files::robot_file::RobotFile;
use crate::fit::Solution;
use crate::fit::solution::PARAMETERS;
use delta_cal::robot::{Parameter, ParameterKind};
use delta_cal::{Robot, Sample, Tolerance};
use nalgebra::{DVector, Matrix3, SMatrix, Vector3};
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
    let (absolute, relative) = (expected.absolute.rms, expected.intrinsic.rms);
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
    /// The expected position error with x, y and z of this pose and those before it, mm rms.
    pub expected_error_mm: f64,
}

/// Greedy choice among these poses of those whose positions would reduce the expected position error most; empty if nothing
/// is measured in the frame of the base.
pub(crate) fn next_poses(
    robot: &RobotFile,
    solution: &Solution,
    poses: &[Sample<f64>],
) -> Vec<NextPose> {
    if !solution.is_absolute() {
        return Vec::new();
    }
    let mut covariance = solution.of_parameters();
    let every = poses.len().div_ceil(CANDIDATES).max(1);
    let candidates = poses.iter().step_by(every).copied();
    let candidates = Sensitivities::<PARAMETERS>::of(&solution.robot, candidates);
    let sensitivity = candidates.mean_square();
    let axes = Vector3::from(solution.levels.position.position_by_axis());
    let noise = Matrix3::from_diagonal(&axes.component_mul(&axes));
    let mut found = Vec::new();
    for _ in 0..PROPOSED {
        let gain = |jacobian: &SMatrix<f64, 3, PARAMETERS>| {
            let shared = covariance * jacobian.transpose();
            let inverse = (jacobian * shared + noise).try_inverse()?;
            let reduction = shared * inverse * shared.transpose();
            Some((sensitivity.component_mul(&reduction).sum(), reduction))
        };
        let all = candidates.0.iter();
        let best = all
            .filter_map(|(pose, jacobian)| Some((pose, gain(jacobian)?)))
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some((pose, (_, reduction))) = best else {
            break;
        };
        covariance -= reduction;
        found.push(NextPose {
            joints: robot.convention.joints(&pose.joints),
            expected_error_mm: sensitivity.component_mul(&covariance).sum().max(0.0).sqrt(),
        });
    }
    found
}
