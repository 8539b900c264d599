//! A line and the band about it.

use crate::render::plot::{Colour, Figure, Series, Shape};

pub(super) type Points = Vec<(f64, f64)>;
pub(super) type Band = Vec<(f64, f64, f64)>;

pub(super) fn with_band(
    figure: Figure,
    name: &str,
    colour: Colour,
    (line, band): (Points, Band),
) -> Figure {
    figure
        .with(Series::new("", colour, Shape::Band(band)))
        .with(Series::new("", colour, Shape::Points(line.clone())))
        .with(Series::new(name, colour, Shape::Line(line)))
}
