//! The poses that would help most, had they been measured too.

use super::judge::Judged;
use crate::accuracy::position_uncertainty::PositionUncertainty;
use crate::accuracy::workspace_poses::inside;
use crate::files::robot_file::RobotFile;
use crate::fit::covariance::PARAMETERS;
use crate::text::joint;
use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::Serialize;

/// Poses that are proposed.
const PROPOSED: usize = 3;
/// Poses among which they are chosen, and over which the error is averaged.
const CANDIDATES: usize = 250;

/// A pose to measure next, and what it would bring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NextPose {
    /// Joint angles in degrees; with linear drives travels in mm.
    pub joints: [f64; 3],
    /// The expected position error with x, y and z of this pose and those before it, mm rms.
    pub expected_error_mm: f64,
}

/// Greedily the poses whose positions would lower the expected position error most; none where the frame of the base is not
/// measured.
pub(crate) fn next_poses(robot: &RobotFile, judged: &Judged) -> Vec<NextPose> {
    let solution = &judged.solution;
    if !solution.is_absolute() {
        return Vec::new();
    }
    let mut covariance = solution.of_parameters();
    let uncertainty = PositionUncertainty {
        robot: &solution.robot,
        covariance: &covariance,
    };
    let poses = inside(&solution.robot, &robot.reach());
    let every = poses.len().div_ceil(CANDIDATES).max(1);
    let candidates: Vec<_> = poses
        .iter()
        .step_by(every)
        .filter_map(|pose| {
            Some((
                pose.joints,
                uncertainty.jacobian(&pose.position, &pose.joints)?,
            ))
        })
        .collect();
    let mut sensitivity = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut count = 0.0;
    for (_, jacobian) in &candidates {
        sensitivity.gemm_tr(1.0, jacobian, jacobian, 1.0);
        count += 1.0;
    }
    sensitivity /= f64::max(count, 1.0);
    let axes = Vector3::from(solution.levels.position.position_by_axis());
    let noise = Matrix3::from_diagonal(&axes.component_mul(&axes));
    let drive = robot.robot.drive();
    let mut found = Vec::new();
    for _ in 0..PROPOSED {
        let gain = |jacobian: &SMatrix<f64, 3, PARAMETERS>| {
            let shared = covariance * jacobian.transpose();
            let inverse = (jacobian * shared + noise).try_inverse()?;
            let reduction = shared * inverse * shared.transpose();
            Some((sensitivity.component_mul(&reduction).sum(), reduction))
        };
        let best = candidates
            .iter()
            .filter_map(|(joints, jacobian)| Some((joints, gain(jacobian)?)))
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some((joints, (_, reduction))) = best else {
            break;
        };
        covariance -= reduction;
        found.push(NextPose {
            joints: joints.map(|q| joint::in_file(drive, q)),
            expected_error_mm: sensitivity.component_mul(&covariance).sum().max(0.0).sqrt(),
        });
    }
    found
}
