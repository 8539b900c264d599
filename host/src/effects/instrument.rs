//! Effects of the instrument: its target, its scale, and its frame.

use super::{Effect, EffectKind, Place};
use nalgebra::Vector3;

/// Target: three coordinates on the platform. Scale: relative. Datum: a translation and a rotation vector about the
/// centre of the positions.
pub(super) fn columns(
    effect: &Effect,
    position: &Vector3<f64>,
    place: &Place,
    centre: &Vector3<f64>,
) -> Vec<Vector3<f64>> {
    let axes = |part: f64| [0, 1, 2].map(|axis| Vector3::ith(axis, part));
    match effect.kind {
        EffectKind::Target if place.target == effect.index => axes(1.0).into(),
        EffectKind::Target => axes(0.0).into(),
        EffectKind::Datum => motion(&(position - centre)).into(),
        _ => vec![(position - place.origin) * place.scaled],
    }
}

/// Displacement of a point by a small translation and rotation about a centre at this lever from it.
pub(crate) fn motion(lever: &Vector3<f64>) -> [Vector3<f64>; 6] {
    std::array::from_fn(|index| match index {
        0..3 => Vector3::ith(index, 1.0),
        _ => Vector3::ith(index - 3, 1.0).cross(lever),
    })
}
