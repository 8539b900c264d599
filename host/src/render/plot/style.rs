//! Sizes and strokes, in units of the drawing library.

use super::{Colour, PlotError};
use plotters::style::{Color, RGBColor, ShapeStyle};
use std::fmt::Display;

/// The drawing library knows whole units only; so many make a pixel.
pub(super) const UNIT: i32 = 4;
/// Size of the text, pixels.
pub(super) const TEXT: f64 = 12.0;
pub(super) const INK: RGBColor = Colour::Ink.rgb();

pub(super) const BAND: f64 = 0.2;
/// More discs than this are drawn smaller.
const MANY: usize = 250;
pub(super) const RING: i32 = 6 * UNIT;

/// Radius of one of so many discs.
pub(super) fn point(count: usize) -> i32 {
    if count > MANY {
        2 * UNIT - 1
    } else {
        3 * UNIT - 1
    }
}

/// The library takes the size of a line of text, and not of its letters.
pub(super) fn text_size() -> f64 {
    1.24 * TEXT * f64::from(UNIT)
}

pub(super) fn line(colour: Colour) -> ShapeStyle {
    colour.rgb().stroke_width(2 * UNIT.unsigned_abs() - 1)
}

pub(super) fn hairline(colour: Colour) -> ShapeStyle {
    colour
        .rgb()
        .mix(2.0 * BAND)
        .stroke_width(UNIT.unsigned_abs())
}

pub(super) fn diamond((x, y): (i32, i32)) -> Vec<(i32, i32)> {
    let half = 5 * UNIT;
    vec![(x - half, y), (x, y - half), (x + half, y), (x, y + half)]
}

pub(super) fn failed(cause: impl Display) -> PlotError {
    PlotError::Drawing(cause.to_string())
}
