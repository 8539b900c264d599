//! Corrections at nodes that the robot does not reach, beside nodes that it does: so that a position near the edge
//! of the workspace has all eight nodes of its cell.

use super::grid::Grid;
use nalgebra::{Matrix4, RowVector3, SMatrix, Vector3, Vector4};

/// Nodes so far away, along each axis, are fitted.
const AROUND: usize = 2;

/// The correction at a node from those at the nodes around it, by the plane of least squares through them; a node counts
/// by the inverse of its squared distance. `None` if no direct neighbour has a correction.
pub(super) fn extrapolated(
    grid: &Grid,
    computed: &[Option<Vector3<f64>>],
    node: usize,
) -> Option<Vector3<f64>> {
    let at = grid.indices(node);
    let mut normal = Matrix4::zeros();
    let mut right = SMatrix::<f64, 4, 3>::zeros();
    let (mut beside, mut weights) = (false, 0.0);
    let range = |axis: usize| {
        at[axis].saturating_sub(AROUND)..=(at[axis] + AROUND).min(grid.counts[axis] - 1)
    };
    for x in range(0) {
        for y in range(1) {
            for z in range(2) {
                let other = grid.node([x, y, z]);
                let Some(correction) = computed.get(other).copied().flatten() else {
                    continue;
                };
                let off = (grid.position(other) - grid.position(node)) / grid.spacing;
                beside |= off.amax() < 1.5;
                let weight = 1.0 / off.norm_squared();
                let row = Vector4::new(1.0, off.x, off.y, off.z);
                normal += weight * row * row.transpose();
                right += weight * row * RowVector3::from(correction.transpose());
                weights += weight;
            }
        }
    }
    if !beside {
        return None;
    }
    // A slope that the nodes do not determine is none.
    for axis in 1..4 {
        normal[(axis, axis)] += 1e-6 * weights;
    }
    let solution = normal.cholesky()?.solve(&right);
    Some(solution.row(0).transpose())
}
