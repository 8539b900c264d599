//! A line and the band about it.

use crate::render::plot::{Colour, Figure, Shape};

pub(super) type Points = Vec<(f64, f64)>;
pub(super) type Band = Vec<(f64, f64, f64)>;

pub(super) fn with_band(
    figure: Figure,
    name: &str,
    colour: Colour,
    (line, band): (Points, Band),
) -> Figure {
    figure
        .with("", colour, Shape::Band(band))
        .with("", colour, Shape::Points(line.clone()))
        .with(name, colour, Shape::Line(line))
}
