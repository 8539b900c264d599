//! Effects of the instrument: its target, its scale, its frame; and of time, in which it, the plate or the robot's base moves,
//! evenly or at one row.

use super::{Course, Effect, EffectKind};
use nalgebra::{Rotation3, Vector3, Vector6};

/// Target: three coordinates on the platform. Scale: relative. Datum, and from a row on a move: a translation and a rotation
/// vector about the centre of the positions. Drift: three coordinates, from the first row to the last.
pub(super) fn columns(
    effect: &Effect,
    position: &Vector3<f64>,
    course: &Course,
    row: usize,
) -> Vec<Vector3<f64>> {
    let (place, lever) = (&course.places[row], position - course.centre);
    let axes = |part: f64| [0, 1, 2].map(|axis| Vector3::ith(axis, part));
    match effect.kind {
        EffectKind::Target if place.target == effect.index => axes(1.0).into(),
        EffectKind::Target => axes(0.0).into(),
        EffectKind::Datum => motion(&lever).into(),
        EffectKind::Drift => axes(drifted(place.part, effect.index)).into(),
        EffectKind::Move => {
            let part = if row >= effect.index { 1.0 } else { 0.0 };
            // A plane that is touched is seen to move up and to tilt.
            let along = if place.touched { 0.0 } else { part };
            let parts = Vector6::new(along, along, part, part, part, along);
            let moved = motion(&lever).into_iter().zip(&parts);
            moved.map(|(own, part)| own * *part).collect()
        }
        _ => vec![(position - place.origin) * place.scaled],
    }
}

/// The part of a drift that is over at this part of a file of so many of its time constants.
fn drifted(part: f64, constants: usize) -> f64 {
    if constants == 0 {
        return part;
    }
    // e⁻ˣ = (1 − x/64)⁶⁴
    let left = |part| (0..6).fold(1.0 - part * constants as f64 / 64.0, |own, _| own * own);
    (1.0 - left(part)) / (1.0 - left(1.0))
}

/// Displacement of a point by a small translation and rotation about a centre at this lever from it.
pub(crate) fn motion(lever: &Vector3<f64>) -> [Vector3<f64>; 6] {
    std::array::from_fn(|index| match index {
        0..3 => Vector3::ith(index, 1.0),
        _ => Vector3::ith(index - 3, 1.0).cross(lever),
    })
}

/// A point after a move by a translation and a rotation vector about a centre.
pub(crate) fn moved(point: &Vector3<f64>, centre: &Vector3<f64>, by: &[f64]) -> Vector3<f64> {
    let [shift, turn] = [0, 3].map(|first| Vector3::from_fn(|axis, _| by[first + axis]));
    Rotation3::new(turn) * (point - centre) + centre + shift
}
