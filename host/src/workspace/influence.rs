//! How the boundary moves with the 24 parameters, to first order.

use super::{BoundaryPoint, Workspace};
use crate::accuracy::information::parameters;
use delta_cal::{ArmIndex, Parameter};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// What one parameter does to the boundary. Per mm for a length, per degree for an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfluence {
    /// Whose parameter.
    pub arm: ArmIndex,
    /// Which.
    pub parameter: Parameter,
    /// rms displacement of the boundary along its normal, over its area, mm.
    pub rms: f64,
    /// The largest outwards, mm.
    pub outwards: f64,
    /// The largest inwards, mm (negative).
    pub inwards: f64,
    /// Change of the volume: the displacement's integral over the boundary, mm³.
    pub volume: f64,
}

/// Displacement of each point along its outward normal for each parameter, arm by arm at its place: mm per mm,
/// and mm per radian.
pub fn displacements(workspace: &Workspace, points: &[BoundaryPoint]) -> Vec<Option<[f64; 24]>> {
    let of = |point: &BoundaryPoint| {
        let arms = point.displacement(&workspace.robot, &workspace.reach)?;
        let mut all = [0.0; 24];
        for (all, value) in all.iter_mut().zip(arms.iter().flat_map(|arm| arm.iter())) {
            *all = *value;
        }
        Some(all)
    };
    points.par_iter().map(of).collect()
}

/// A millimetre, or a degree in radians.
pub fn unit(parameter: Parameter) -> f64 {
    match parameter.kind() {
        delta_cal::robot::ParameterKind::Length | delta_cal::robot::ParameterKind::Ratio => 1.0,
        delta_cal::robot::ParameterKind::Angle => 1f64.to_radians(),
    }
}

/// All 24, arm by arm.
pub fn influence(workspace: &Workspace) -> Vec<ParameterInfluence> {
    let displacements = displacements(workspace, &workspace.points);
    parameters(&workspace.robot)
        .map(|(arm, parameter)| {
            let index = 8 * arm.index() + parameter.index();
            let (mut square, mut volume, mut area) = (0.0, 0.0, 0.0);
            let (mut outwards, mut inwards) = (0.0_f64, 0.0_f64);
            for (point, moved) in workspace.points.iter().zip(&displacements) {
                let Some(moved) = moved else { continue };
                let moved = moved[index] * unit(parameter);
                area += point.area;
                square += moved * moved * point.area;
                volume += moved * point.area;
                outwards = outwards.max(moved);
                inwards = inwards.min(moved);
            }
            ParameterInfluence {
                arm,
                parameter,
                rms: (square / area).sqrt(),
                outwards,
                inwards,
                volume,
            }
        })
        .collect()
}
