//! The errors that the model does not hold, each as what it would do to the measured positions.

use super::cause::CauseKind;
use delta_cal::ArmIndex;
use delta_cal::robot::Drive;
use nalgebra::{Matrix3, Vector3};

/// Columns of all hypotheses together.
pub(super) fn columns(drive: Drive) -> usize {
    all(drive).iter().map(|own| own.columns.len()).sum()
}

/// One hypothesis: a cause, and its columns among all.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    pub(super) kind: CauseKind,
    /// `None` of a cause that is not one arm's.
    pub(super) arm: Option<ArmIndex>,
    pub(super) columns: Vec<usize>,
}

/// All of them, in the order of their columns.
pub(super) fn all(drive: Drive) -> Vec<Hypothesis> {
    let of_arms = CauseKind::of_joints(drive)
        .iter()
        .flat_map(|kind| ArmIndex::ALL.map(|arm| (*kind, Some(arm))));
    let of_platform = [(CauseKind::Sag, None), (CauseKind::Drift, None)];
    let mut next = 0;
    of_arms
        .chain(of_platform)
        .map(|(kind, arm)| {
            let first = next;
            next += kind.columns();
            Hypothesis {
                kind,
                arm,
                columns: (first..next).collect(),
            }
        })
        .collect()
}

/// What a sample's row says of the file as a whole.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// −1 or 1 for each joint: the direction of its last move; 0 before its first.
    pub(super) directions: [f64; 3],
    /// From −½ in the first row to ½ in the last.
    pub(super) part: f64,
    /// The square of the distance from the robot's axis, 1 at the largest of the file.
    pub(super) radius_squared: f64,
}

/// By how much a position moves for one unit of each column: mm per radian, 1, or mm.
pub(super) fn movements(
    drive: Drive,
    by_joints: &Matrix3<f64>,
    joints: &[f64; 3],
    ranges: &[[f64; 2]; 3],
    place: &Place,
) -> Vec<Vector3<f64>> {
    let mut movements = Vec::new();
    for kind in CauseKind::of_joints(drive) {
        for (arm, q) in joints.iter().enumerate() {
            let (shapes, count) = kind.shapes(*q, place.directions[arm], ranges[arm]);
            for shape in &shapes[..count] {
                movements.push(by_joints.column(arm) * *shape);
            }
        }
    }
    movements.push(Vector3::new(0.0, 0.0, -place.radius_squared));
    movements.extend([0, 1, 2].map(|axis| Vector3::ith(axis, place.part)));
    movements
}
