//! The legend: rows above the plot, so that it never hides what it explains.

use super::style::{self, INK, TEXT, UNIT, failed};
use super::{PlotError, Series, Shape};
use plotters::coord::Shift;
use plotters::prelude::{
    Circle, DrawingArea, PathElement, Polygon, Rectangle, SVGBackend, Text, TextStyle,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBColor};

/// Height of a row, pixels.
const ROW: i32 = 20;
/// Width of a sample of the series.
const KEY: i32 = 22;
/// Between the sample and its name, and twice that between two entries.
const GAP: i32 = 8;
/// Width of a letter in parts of the text's size: what wide fonts need.
const LETTER: f64 = 0.62;

/// Width of a text, pixels, at most.
#[allow(clippy::cast_possible_truncation)] // a few hundred
pub(super) fn text_width(text: &str) -> i32 {
    let letters = text.chars().fold(0.0, |count, _| count + 1.0);
    (letters * LETTER * TEXT).ceil() as i32
}

/// A series' place: x and row.
type Entry<'a> = (&'a Series, i32, i32);

/// Where each named series goes, and the height of all rows.
pub(super) fn layout(series: &[Series], left: i32, right: i32) -> (Vec<Entry<'_>>, i32) {
    let (mut x, mut row) = (left, 0);
    let mut entries = Vec::new();
    for series in series.iter().filter(|series| !series.name.is_empty()) {
        let width = KEY + GAP + text_width(&series.name);
        if x > left && x + width > right {
            (x, row) = (left, row + 1);
        }
        entries.push((series, x, row));
        x += width + 2 * GAP;
    }
    let rows = if entries.is_empty() { 0 } else { row + 1 };
    (entries, rows * ROW)
}

pub(super) fn draw(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    entries: &[Entry<'_>],
) -> Result<(), PlotError> {
    for &(series, x, row) in entries {
        let y = row * ROW + ROW / 2 + 2;
        key(area, series, x, y)?;
        let text = TextStyle::from(("sans-serif", style::text_size()).into_font())
            .color(&INK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        let place = ((x + KEY + GAP) * UNIT, y * UNIT);
        area.draw(&Text::new(series.name.clone(), place, text))
            .map_err(failed)?;
    }
    Ok(())
}

fn key(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    series: &Series,
    x: i32,
    y: i32,
) -> Result<(), PlotError> {
    let colour = series.colour.rgb();
    let at = |dx: i32, dy: i32| ((x + dx) * UNIT, (y + dy) * UNIT);
    let middle = at(KEY / 2, 0);
    match &series.shape {
        Shape::Line(_) | Shape::Segments(_) => {
            let line = vec![at(0, 0), at(KEY, 0)];
            area.draw(&PathElement::new(line, style::line(series.colour)))
        }
        Shape::Hairlines(_) => {
            let line = vec![at(0, 0), at(KEY, 0)];
            area.draw(&PathElement::new(line, style::hairline(series.colour)))
        }
        Shape::Dashed(_) => {
            for (from, to) in [(0, 8), (14, 22)] {
                let line = vec![at(from, 0), at(to, 0)];
                area.draw(&PathElement::new(line, style::line(series.colour)))
                    .map_err(failed)?;
            }
            Ok(())
        }
        Shape::Band(_) | Shape::Region(_) => area.draw(&Rectangle::new(
            [at(0, -6), at(KEY, 6)],
            colour.mix(style::BAND).filled(),
        )),
        Shape::Tiles(_, opacity) => area.draw(&Rectangle::new(
            [at(0, -6), at(KEY, 6)],
            colour.mix(*opacity).filled(),
        )),
        Shape::Patches(patches) => {
            let [red, green, blue] = patches.first().map_or([0; 3], |(_, fill)| *fill);
            let ends = [at(0, -6), at(KEY, 6)];
            area.draw(&Rectangle::new(ends, RGBColor(red, green, blue).filled()))
        }
        Shape::Points(points) => area.draw(&Circle::new(
            middle,
            style::point(points.len()),
            colour.filled(),
        )),
        Shape::Rings(_) => area.draw(&Circle::new(
            middle,
            style::RING,
            style::line(series.colour),
        )),
        Shape::Diamonds(_) => area.draw(&Polygon::new(style::diamond(middle), colour.filled())),
        Shape::Labels(_) => Ok(()),
    }
    .map_err(failed)
}
