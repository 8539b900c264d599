//! The surfaces that are touched or measured. The shape of a bed beyond a plane: radial and angular waves, of unit rms each over the disc that was
//! touched (Zernike 1934). The oversize of prints.

use super::Place;
use nalgebra::{Vector2, Vector3};

/// Waves of each order, from 2 on.
const WAVES: [usize; 3] = [3, 4, 5];

/// Number of waves.
pub(super) const COUNT: usize = 12;

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
pub(super) fn columns(position: &Vector3<f64>, largest: f64, touched: bool) -> Vec<Vector3<f64>> {
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
