//! Figures as SVG.

use super::axis::{Coordinate, Tick};
use super::colour::GRID;
use super::legend::{self, text_width};
use super::style::{self, INK, UNIT, failed};
use super::{Axis, Figure, PlotError, Series, Shape};
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Circle, EmptyElement, IntoDrawingArea, PathElement,
    Polygon, Rectangle, SVGBackend, Text, TextStyle,
};
use plotters::series::DashedLineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBColor};

/// Between the plot and the figure's edge, pixels.
const MARGIN: i32 = 12;
/// Between the label of the y axis and the figure's edge, pixels.
const EDGE: i32 = 4;
/// Pixels between the labels of an axis, at least.
const BETWEEN_LABELS: (i32, i32) = (70, 40);

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;
type Range = (f64, f64);

/// Pixels around the plot.
struct Margins {
    left: i32,
    right: i32,
    top: i32,
    bottom: i32,
}

impl Figure {
    /// As SVG. Colours are attributes, so that a style sheet can change them for a dark page.
    ///
    /// # Errors
    /// An axis without a usable range, or a figure too small for its labels.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let (width, height) = (pixels(self.width)?, pixels(self.height)?);
        let (x, y) = (self.x.ends()?, self.y.ends()?);
        let y_ticks = self.y.ticks(y, parts(height, BETWEEN_LABELS.1));
        let widest = y_ticks.iter().map(|(_, text)| text_width(text)).max();
        let (left, bottom) = if self.axes_shown {
            (
                widest.unwrap_or(0) + if self.y.label().is_empty() { 14 } else { 34 },
                46,
            )
        } else {
            (MARGIN, MARGIN)
        };
        let (entries, legend) = legend::layout(&self.series, left, width - MARGIN);
        let margins = Margins {
            left,
            right: MARGIN + 8,
            top: MARGIN + legend,
            bottom,
        };
        let inner = (
            width - margins.left - margins.right,
            height - margins.top - margins.bottom,
        );
        if inner.0 < BETWEEN_LABELS.0 || inner.1 < BETWEEN_LABELS.1 {
            return Err(PlotError::Size);
        }
        let (x, y) = if self.equal_scales {
            equal(x, y, inner)
        } else {
            (x, y)
        };

        let mut svg = String::new();
        {
            let size = (
                self.width * UNIT.unsigned_abs(),
                self.height * UNIT.unsigned_abs(),
            );
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            legend::draw(&area, &entries)?;
            let x_ticks = self.x.ticks(x, parts(inner.0, BETWEEN_LABELS.0));
            let y_ticks = self.y.ticks(y, parts(inner.1, BETWEEN_LABELS.1));
            let labels = i32::from(self.axes_shown);
            let beside = margins.left - EDGE;
            let mut chart = ChartBuilder::on(&area)
                .margin_top(margins.top * UNIT)
                .margin_right(margins.right * UNIT)
                .margin_left((margins.left - labels * beside) * UNIT)
                .margin_bottom((1 - labels) * margins.bottom * UNIT)
                .x_label_area_size(labels * margins.bottom * UNIT)
                .y_label_area_size(labels * beside * UNIT)
                .build_cartesian_2d(
                    Coordinate::new(&self.x, x, &x_ticks),
                    Coordinate::new(&self.y, y, &y_ticks),
                )
                .map_err(failed)?;
            if self.axes_shown {
                mesh(&mut chart, &self.x, &self.y, (&x_ticks, &y_ticks))?;
            }
            for series in &self.series {
                self.draw(&mut chart, series, (x, y))?;
            }
            area.present().map_err(failed)?;
        }
        // The library states its own units as pixels.
        let stated = format!(
            "width=\"{}\" height=\"{}\"",
            self.width * UNIT.unsigned_abs(),
            self.height * UNIT.unsigned_abs()
        );
        let wanted = format!("width=\"{}\" height=\"{}\"", self.width, self.height);
        Ok(svg.replacen(&stated, &wanted, 1))
    }

    fn draw(
        &self,
        chart: &mut Chart<'_, '_>,
        series: &Series,
        ranges: (Range, Range),
    ) -> Result<(), PlotError> {
        let colour = series.colour.rgb();
        let place = |&(x, y): &(f64, f64)| Some((self.x.place(x)?, self.y.place(y)?));
        let inside = |(x, y): &(f64, f64)| within(*x, ranges.0) && within(*y, ranges.1);
        let placed = |points: &[(f64, f64)]| points.iter().filter_map(place).collect::<Vec<_>>();
        let seen = |points: &[(f64, f64)]| {
            let places = points.iter().filter_map(place);
            places.filter(inside).collect::<Vec<_>>()
        };
        let line = style::line(series.colour);
        let lines = |segments: &[[(f64, f64); 2]], style| {
            let ends = segments
                .iter()
                .filter_map(|[from, to]| Some([place(from)?, place(to)?]));
            let lines = ends.map(|ends| PathElement::new(ends, style));
            lines.collect::<Vec<_>>()
        };
        let drawn = match &series.shape {
            Shape::Line(points) => chart.draw_series([PathElement::new(placed(points), line)]),
            Shape::Dashed(points) => {
                let (dash, gap) = (8 * UNIT, 6 * UNIT);
                chart.draw_series(DashedLineSeries::new(placed(points), dash, gap, line))
            }
            Shape::Region(outline) => {
                let fill = colour.mix(style::BAND).filled();
                chart.draw_series([Polygon::new(placed(outline), fill)])
            }
            Shape::Band(band) => {
                let upper = band.iter().filter_map(|&(x, _, upper)| place(&(x, upper)));
                let lower = band
                    .iter()
                    .rev()
                    .filter_map(|&(x, low, _)| place(&(x, low)));
                let outline: Vec<_> = upper.chain(lower).collect();
                let fill = colour.mix(style::BAND).filled();
                chart.draw_series([Polygon::new(outline, fill)])
            }
            Shape::Tiles(tiles, opacity) => {
                let fill = colour.mix(*opacity).filled();
                let corners = tiles
                    .iter()
                    .filter_map(|[from, to]| Some([place(from)?, place(to)?]));
                chart.draw_series(corners.map(|corners| Rectangle::new(corners, fill)))
            }
            Shape::Patches(patches) => chart.draw_series(patches.iter().map(|(outline, fill)| {
                let [red, green, blue] = *fill;
                Polygon::new(placed(outline), RGBColor(red, green, blue).filled())
            })),
            Shape::Segments(segments) => chart.draw_series(lines(segments, line)),
            Shape::Hairlines(segments) => {
                chart.draw_series(lines(segments, style::hairline(series.colour)))
            }
            Shape::Points(points) => chart.draw_series(
                seen(points)
                    .into_iter()
                    .map(|at| Circle::new(at, style::point(points.len()), colour.filled())),
            ),
            Shape::Rings(points) => chart.draw_series(
                seen(points)
                    .into_iter()
                    .map(|at| Circle::new(at, style::RING, line)),
            ),
            Shape::Diamonds(points) => chart.draw_series(seen(points).into_iter().map(|at| {
                EmptyElement::at(at) + Polygon::new(style::diamond((0, 0)), colour.filled())
            })),
            Shape::Labels(labels) => {
                let text = TextStyle::from(("sans-serif", style::text_size()).into_font())
                    .color(&colour)
                    .pos(Pos::new(HPos::Left, VPos::Center));
                let labels = labels
                    .iter()
                    .filter_map(|(at, label)| Some((place(at).filter(inside)?, label)));
                chart.draw_series(labels.map(|(at, label)| {
                    let place = (9 * UNIT, 0);
                    EmptyElement::at(at) + Text::new(label.clone(), place, text.clone())
                }))
            }
        };
        drawn.map(|_| ()).map_err(failed)
    }
}

fn mesh(
    chart: &mut Chart<'_, '_>,
    x: &Axis,
    y: &Axis,
    (x_ticks, y_ticks): (&[Tick], &[Tick]),
) -> Result<(), PlotError> {
    let text = || TextStyle::from(("sans-serif", style::text_size()).into_font()).color(&INK);
    let x_text = |place: &f64| label_at(x_ticks, *place);
    let y_text = |place: &f64| label_at(y_ticks, *place);
    chart
        .configure_mesh()
        .bold_line_style(GRID.stroke_width(UNIT.unsigned_abs()))
        .light_line_style(GRID.stroke_width(UNIT.unsigned_abs() / 2))
        .axis_style(INK.stroke_width(UNIT.unsigned_abs()))
        .set_all_tick_mark_size(4 * UNIT)
        .label_style(text())
        .axis_desc_style(text())
        .x_desc(x.label())
        .y_desc(y.label())
        .x_label_formatter(&x_text)
        .y_label_formatter(&y_text)
        .draw()
        .map_err(failed)
}

fn label_at(ticks: &[Tick], place: f64) -> String {
    ticks
        .iter()
        .find(|tick| tick.0.total_cmp(&place).is_eq())
        .map(|tick| tick.1.clone())
        .unwrap_or_default()
}

fn within(place: f64, (from, to): Range) -> bool {
    (from.min(to)..=from.max(to)).contains(&place)
}

fn pixels(size: u32) -> Result<i32, PlotError> {
    i32::try_from(size)
        .ok()
        .filter(|size| *size < i32::MAX / UNIT)
        .ok_or(PlotError::Size)
}

fn parts(length: i32, each: i32) -> usize {
    usize::try_from(length / each).unwrap_or(0).max(2)
}

/// The same number of units a pixel on both axes: the one that has room grows on both sides.
fn equal(x: Range, y: Range, (width, height): (i32, i32)) -> (Range, Range) {
    let (width, height) = (f64::from(width), f64::from(height));
    let scale = ((x.1 - x.0).abs() / width).max((y.1 - y.0).abs() / height);
    let grown = |(from, to): Range, length: f64| {
        let middle = f64::midpoint(from, to);
        let half = 0.5 * scale * length * (to - from).signum();
        (middle - half, middle + half)
    };
    (grown(x, width), grown(y, height))
}
