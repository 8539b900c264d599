//! Effects of time: the sensor, the plate or the robot's base moves, evenly or at one row.

use super::{Course, Effect, EffectKind};
use nalgebra::{Rotation3, Vector3};

/// Drift: three coordinates, from the first row to the last. Move: a translation and a rotation vector about the centre of
/// the positions, from a row on.
pub(super) fn columns(
    effect: &Effect,
    position: &Vector3<f64>,
    course: &Course,
    row: usize,
) -> Vec<Vector3<f64>> {
    let part = match effect.kind {
        EffectKind::Drift => course.places[row].part,
        _ if row >= effect.index => 1.0,
        _ => 0.0,
    };
    let axes = [0, 1, 2].map(|axis| Vector3::ith(axis, part));
    if effect.kind == EffectKind::Drift {
        return axes.into();
    }
    let lever = position - course.centre;
    let turns = axes.map(|axis| axis.cross(&lever));
    axes.into_iter().chain(turns).collect()
}

/// A point after a move by a translation and a rotation vector about a centre.
pub(crate) fn moved(point: &Vector3<f64>, centre: &Vector3<f64>, by: &[f64]) -> Vector3<f64> {
    let [shift, turn] = [0, 3].map(|first| Vector3::from_fn(|axis, _| by[first + axis]));
    Rotation3::new(turn) * (point - centre) + centre + shift
}
