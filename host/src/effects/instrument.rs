//! Effects of the instrument: its target, its scale, its frame; of time, in which it, the plate or the robot's base moves,
//! evenly or at one row; and of what is touched or measured. The shape of a bed beyond a plane: radial and angular waves, of unit
//! rms each over the disc that was touched (Zernike 1934). The oversize of prints.

use super::{Course, Effect, EffectKind, Place};
use nalgebra::{Rotation3, Vector2, Vector3, Vector6};

/// Waves of each order, from 2 on.
const WAVES: [usize; 3] = [3, 4, 5];

/// Number of waves.
pub(super) const COUNT: usize = 12;

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
        EffectKind::Drift => axes(place.part).into(),
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

/// σ of each wave of a surface that is uneven by this much, rms: each order as much as another.
pub(crate) fn sigmas(uneven: f64) -> Vec<f64> {
    let sigma = |waves: usize| uneven / ((WAVES.len() * waves) as f64).sqrt();
    let orders = WAVES.into_iter();
    orders
        .flat_map(|waves| std::iter::repeat_n(sigma(waves), waves))
        .collect()
}

/// The height of each wave at a place, in parts of the disc's radius.
pub(crate) fn waves(at: Vector2<f64>) -> [f64; COUNT] {
    let (x, y, square) = (at.x, at.y, at.norm_squared());
    let [two, three, four] = [2, 3, 4].map(|times| turned(at, times));
    let [astigmatic, coma] = [4.0 * square - 3.0, 3.0 * square - 2.0];
    let [by_2, by_3] = [6.0_f64.sqrt(), 8.0_f64.sqrt()];
    let [by_4, by_4_2] = [5.0_f64.sqrt(), 10.0_f64.sqrt()];
    [
        3.0_f64.sqrt() * (2.0 * square - 1.0),
        by_2 * two[0],
        by_2 * two[1],
        by_3 * coma * x,
        by_3 * coma * y,
        by_3 * three[0],
        by_3 * three[1],
        by_4 * (6.0 * square * square - 6.0 * square + 1.0),
        by_4_2 * astigmatic * two[0],
        by_4_2 * astigmatic * two[1],
        by_4_2 * four[0],
        by_4_2 * four[1],
    ]
}

/// Real and imaginary part of (x + iy)ⁿ.
fn turned(at: Vector2<f64>, times: i32) -> [f64; 2] {
    let own = (1..times).fold(at, |own, _| {
        Vector2::new(own.x * at.x - own.y * at.y, own.x * at.y + own.y * at.x)
    });
    [own.x, own.y]
}

/// Where the surface is higher, a touch reads less.
pub(super) fn unevenness(
    position: &Vector3<f64>,
    largest: f64,
    touched: bool,
) -> Vec<Vector3<f64>> {
    if !touched || !(largest > 0.0) {
        return vec![Vector3::zeros(); COUNT];
    }
    let waves = waves(position.xy() / largest.sqrt());
    waves.map(|own| Vector3::new(0.0, 0.0, -own)).into()
}

/// A print is longer by half of its oversize at either end.
pub(super) fn apart(position: &Vector3<f64>, place: &Place) -> Vec<Vector3<f64>> {
    let half = place.between.map(|[along, middle]| {
        let side = along.dot(&(position - middle)).signum();
        0.5 * side * along
    });
    vec![half.unwrap_or_default()]
}
