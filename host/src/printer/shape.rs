//! The shape of the bed itself, which no parameter of a printer makes flat.

use crate::fit::Solution;
use crate::import::Imported;
use nalgebra::{DMatrix, DVector};

/// Touches that show a shape.
const LEAST_TOUCHES: usize = 30;
/// σ of what beds are uneven by, mm; four maps of real beds have 0.02 to 0.03 mm.
const UNEVEN: f64 = 0.025;
/// Degrees of the polynomials in x and y beyond a plane.
const DEGREES: std::ops::RangeInclusive<i32> = 2..=4;
/// A shape that leaves more than this part of the scatter is none.
const SHOWN: f64 = 0.85;

/// What the touches say of the bed's shape, if there are enough: how uneven it is, and how much they scatter beyond that.
pub(super) fn note(imported: &Imported, solution: &Solution) -> Option<String> {
    let plane = solution.places.planes.first()?;
    let touches = imported.readings.rows.iter().filter_map(|row| {
        let (_, height) = row.value.height.filter(|(plane, _)| *plane == 0)?;
        let at = solution.robot.forward(&row.value.joints).ok()?;
        Some((at.xy(), plane.normal.dot(&at) - plane.offset - height))
    });
    let touches: Vec<_> = touches.collect();
    if touches.len() < LEAST_TOUCHES {
        return None;
    }
    let radius = touches.iter().map(|own| own.0.norm()).fold(1.0, f64::max);
    let powers = DEGREES.flat_map(|degree| (0..=degree).map(move |x| (x, degree - x)));
    let powers: Vec<_> = powers.collect();
    let columns = DMatrix::from_fn(touches.len(), powers.len(), |row, column| {
        let at = touches[row].0 / radius;
        let (x, y) = powers[column];
        at.x.powi(x) * at.y.powi(y)
    });
    let heights = DVector::from_iterator(touches.len(), touches.iter().map(|own| own.1));
    // Ridge: every coefficient is within the prior.
    let weight = (solution.levels.height / UNEVEN).powi(2);
    let normal = columns.tr_mul(&columns) + DMatrix::identity(powers.len(), powers.len()) * weight;
    let shape = &columns * normal.cholesky()?.solve(&columns.tr_mul(&heights));
    let rms = |own: &DVector<f64>, freedom: usize| (own.norm_squared() / freedom as f64).sqrt();
    let scatter = rms(&heights, touches.len());
    let left = rms(&(heights - &shape), touches.len() - powers.len());
    (left < SHOWN * scatter).then(|| {
        format!(
            "The bed itself is uneven: {:.3} mm rms, smooth over {} touches, which scatter by {left:.3} mm about it. No line \
             removes that; a bed mesh does.",
            rms(&shape, touches.len()),
            touches.len()
        )
    })
}
