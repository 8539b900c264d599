//! The map of the positions' uncertainty.

use crate::accuracy::uncertainty_map::{Plane, Slice, UncertaintyMap};
use crate::geometry::range::range;
use crate::render::plot::{Axis, Colour, Figure, Shape};
use crate::text::numbers::{significant, small};

/// Shades of a map.
const SHADES: u32 = 5;
/// Opacity of the lightest and of the darkest.
const OPACITY: (f64, f64) = (0.12, 0.95);

/// Each slice with its caption, all in the same shades.
pub(super) fn slices(map: &UncertaintyMap) -> Vec<(Figure, String)> {
    let cells = map.slices.iter().flat_map(|slice| &slice.cells);
    let (least, most) = range(cells.map(|(_, sigma)| *sigma));
    // Equal steps of the logarithm: near the edges the uncertainty is many times that inside.
    let levels: Vec<_> = (1..=SHADES)
        .map(|shade| least * (most / least).powf(f64::from(shade) / f64::from(SHADES)))
        .collect();
    map.slices
        .iter()
        .map(|slice| (figure(slice, &levels), caption(slice)))
        .collect()
}

fn caption(slice: &Slice) -> String {
    let place = match slice.plane {
        Plane::Horizontal(z) => format!("From above, at z = {z:.0} mm"),
        Plane::Vertical => "From the side, at y = 0".to_owned(),
    };
    slice.rms_and_max().map_or_else(
        || place.clone(),
        |(rms, max)| {
            format!(
                "{place}: {} mm rms, {} mm at worst.",
                small(rms),
                small(max)
            )
        },
    )
}

fn figure(slice: &Slice, levels: &[f64]) -> Figure {
    let vertical = slice.plane == Plane::Vertical;
    let placed: Vec<_> = slice
        .cells
        .iter()
        .map(|(x, sigma)| ((x.x, if vertical { x.z } else { x.y }), *sigma))
        .collect();
    let half = 0.5 * slice.step;
    let extent = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = range(placed.iter().map(|(at, _)| of(at)));
        (low - slice.step, high + slice.step)
    };
    let (x, y) = (extent(|at| at.0), extent(|at| at.1));
    let mut figure = Figure::new(
        Axis::linear("x, mm", x.0, x.1),
        Axis::linear(if vertical { "z, mm" } else { "y, mm" }, y.0, y.1),
    )
    .sized(420, 400)
    .with_equal_scales();
    let mut below = f64::NEG_INFINITY;
    for ((level, shade), last) in levels.iter().zip(0..).zip((0..levels.len()).rev()) {
        let top = if last == 0 { f64::INFINITY } else { *level };
        let cells = placed
            .iter()
            .filter(|(_, sigma)| *sigma > below && *sigma <= top);
        let tiles = cells.map(|((x, y), _)| [(x - half, y - half), (x + half, y + half)]);
        let part = f64::from(shade) / f64::from(SHADES - 1);
        let opacity = OPACITY.0 + (OPACITY.1 - OPACITY.0) * part;
        figure = figure.with(
            format!("to {} mm", significant(*level, 2)),
            Colour::Blue,
            Shape::Tiles(tiles.collect(), opacity),
        );
        below = top;
    }
    figure
}
