//! Figures as SVG.

use super::{Colour, Figure, Series, Shape};
use maud::html;
use std::fmt::Write;

/// Text size.
const TEXT: f64 = 12.0;
/// Width of a letter relative to the text size, for wide fonts.
const LETTER: f64 = 0.62;
/// Distance between the plot and the figure's edge.
const MARGIN: f64 = 12.0;
/// Minimum distance between labels along each axis.
const BETWEEN_LABELS: (f64, f64) = (70.0, 40.0);
/// Row height of the legend, which is placed above the plot so that it hides nothing.
const ROW: f64 = 20.0;
/// Width of a legend's swatch.
const KEY: f64 = 22.0;
/// Gap between the swatch and its name; twice that between entries.
const GAP: f64 = 8.0;
/// Opacity of regions.
const REGION: f64 = 0.2;
/// Discs are drawn smaller if there are more than this.
const MANY: usize = 250;
/// Line width.
const LINE: f64 = 1.75;
/// Ring radius.
const RING: f64 = 6.0;
/// Colour of grid lines.
const GRID: &str = "#DDDDDD";

type Place = (f64, f64);

impl Figure {
    /// The figure as SVG. Colours are attributes, so that a style sheet can change them for dark pages.
    pub fn to_svg(&self) -> String {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let (x, y) = (self.x.ends(), self.y.ends());
        let y_ticks = self.y.ticks(y, most(height, BETWEEN_LABELS.1));
        let widest = y_ticks.iter().map(|(_, text)| text_width(text));
        let beside = if self.y.label.is_empty() { 14.0 } else { 34.0 };
        let (left, below) = (widest.fold(0.0, f64::max) + beside, 46.0);
        let (entries, above) = self.legend(left, width - MARGIN);
        let top = MARGIN + above;
        let size = (width - left - MARGIN - 8.0, height - top - below);
        let (x, y) = if self.equal_scales {
            equal(x, y, size)
        } else {
            (x, y)
        };
        let frame = Frame {
            figure: self,
            x,
            y,
            left,
            top,
            size,
        };
        let mut svg = Svg(format!(
            "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" font-size=\"{TEXT}\">\n"
        ));
        for (series, place) in entries {
            svg.entry(series, place);
        }
        frame.axes(&mut svg);
        for series in &self.series {
            frame.draw(series, &mut svg);
        }
        svg.0.push_str("</svg>\n");
        svg.0
    }

    /// The position of each named series in the legend, and the legend's height.
    fn legend(&self, left: f64, right: f64) -> (Vec<(&Series, Place)>, f64) {
        let (mut x, mut row) = (left, 0.0);
        let mut entries = Vec::new();
        for series in self.series.iter().filter(|series| !series.name.is_empty()) {
            let width = KEY + GAP + text_width(&series.name);
            if x > left && x + width > right {
                (x, row) = (left, row + 1.0);
            }
            entries.push((series, (x, (row + 0.5) * ROW + 2.0)));
            x += width + 2.0 * GAP;
        }
        let rows = if entries.is_empty() { 0.0 } else { row + 1.0 };
        (entries, rows * ROW)
    }
}

/// The position of the plot in its figure, and the ranges of its axes.
struct Frame<'a> {
    figure: &'a Figure,
    x: (f64, f64),
    y: (f64, f64),
    left: f64,
    top: f64,
    size: (f64, f64),
}

impl Frame<'_> {
    fn across(&self, place: f64) -> f64 {
        self.left + self.size.0 * (place - self.x.0) / (self.x.1 - self.x.0)
    }

    fn down(&self, place: f64) -> f64 {
        self.top + self.size.1 * (self.y.1 - place) / (self.y.1 - self.y.0)
    }

    /// Position of a point; `None` if it cannot be drawn.
    fn at(&self, &(x, y): &Place) -> Option<Place> {
        let (x, y) = (self.figure.x.place(x)?, self.figure.y.place(y)?);
        Some((self.across(x), self.down(y)))
    }

    fn all(&self, points: &[Place]) -> Vec<Place> {
        points.iter().filter_map(|point| self.at(point)).collect()
    }

    /// Positions of the points within the axes.
    fn within<'a>(&self, points: impl IntoIterator<Item = &'a Place>) -> Vec<Place> {
        let places = points.into_iter().filter_map(|point| self.at(point));
        places.filter(|at| self.holds(*at)).collect()
    }

    fn holds(&self, (x, y): Place) -> bool {
        // Half the resolution of the output, 0.01 pixels.
        let inside =
            |at: f64, from: f64, size: f64| at >= from - 0.005 && at <= from + size + 0.005;
        inside(x, self.left, self.size.0) && inside(y, self.top, self.size.1)
    }

    fn axes(&self, svg: &mut Svg) {
        let Self {
            figure,
            left,
            top,
            size: (width, height),
            ..
        } = *self;
        let (right, bottom) = (left + width, top + height);
        let (x_label, y_label) = (&figure.x.label, &figure.y.label);
        let x_ticks = figure.x.ticks(self.x, most(width, BETWEEN_LABELS.0));
        let y_ticks = figure.y.ticks(self.y, most(height, BETWEEN_LABELS.1));
        let light = format!("fill=\"none\" stroke=\"{GRID}\" stroke-width=\"0.5\"");
        let bold = format!("fill=\"none\" stroke=\"{GRID}\" stroke-width=\"1\"");
        let ink = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"1\"",
            Colour::Ink.hex()
        );
        let upright = |at: f64| [(at, top), (at, bottom)];
        let level = |at: f64| [(left, at), (right, at)];
        for at in figure.x.minor(self.x) {
            svg.line(&upright(self.across(at)), &light);
        }
        for at in figure.y.minor(self.y) {
            svg.line(&level(self.down(at)), &light);
        }
        for (at, text) in &x_ticks {
            let x = self.across(*at);
            svg.line(&upright(x), &bold);
            svg.line(&[(x, bottom), (x, bottom + 4.0)], &ink);
            svg.text((x, bottom + 13.0), "middle", Colour::Ink, text);
        }
        for (at, text) in &y_ticks {
            let y = self.down(*at);
            svg.line(&level(y), &bold);
            svg.line(&[(left - 4.0, y), (left, y)], &ink);
            svg.text((left - 7.0, y), "end", Colour::Ink, text);
        }
        svg.line(&[(left, top), (left, bottom), (right, bottom)], &ink);
        let middle = (left + width / 2.0, top + height / 2.0);
        svg.text((middle.0, bottom + 34.0), "middle", Colour::Ink, x_label);
        // Rotated about its middle to read upwards.
        let _ = writeln!(svg.0, "<g transform=\"rotate(-90 12 {})\">", middle.1);
        svg.text((12.0, middle.1), "middle", Colour::Ink, y_label);
        svg.0.push_str("</g>\n");
    }

    fn draw(&self, series: &Series, svg: &mut Svg) {
        let style = series.style();
        match &series.shape {
            Shape::Dashed(points) => svg.line(&self.all(points), &style),
            Shape::Segments(segments) => {
                for segment in segments {
                    svg.line(&self.all(segment), &style);
                }
            }
            Shape::Region(outline) => svg.area(&self.all(outline), &style),
            Shape::Tiles(tiles, _) => {
                for &[(x1, y1), (x2, y2)] in tiles {
                    let corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2)];
                    svg.area(&self.all(&corners), &style);
                }
            }
            Shape::Points(points) | Shape::Rings(points) => {
                for at in self.within(points) {
                    svg.mark(series, at);
                }
            }
            Shape::Labels(labels) => {
                for (at, text) in labels {
                    for (x, y) in self.within([at]) {
                        svg.text((x + 9.0, y), "start", series.colour, text);
                    }
                }
            }
        }
    }
}

impl Series {
    /// The SVG attributes of the series.
    fn style(&self) -> String {
        let hex = self.colour.hex();
        let line = |width: f64| format!("fill=\"none\" stroke=\"{hex}\" stroke-width=\"{width}\"");
        let filled = |opacity: f64| format!("fill=\"{hex}\" opacity=\"{}\"", rounded(opacity));
        match &self.shape {
            Shape::Segments(_) | Shape::Rings(_) => line(LINE),
            Shape::Dashed(_) => line(LINE) + " stroke-dasharray=\"8 6\"",
            Shape::Region(_) => filled(REGION),
            Shape::Tiles(_, opacity) => filled(*opacity),
            Shape::Points(_) | Shape::Labels(_) => format!("fill=\"{hex}\""),
        }
    }
}

/// The elements of a drawing.
struct Svg(String);

impl Svg {
    fn line(&mut self, points: &[Place], style: &str) {
        self.through("polyline", points, style);
    }

    fn area(&mut self, corners: &[Place], style: &str) {
        self.through("polygon", corners, style);
    }

    fn through(&mut self, element: &str, points: &[Place], style: &str) {
        let point = |(x, y): &Place| format!("{},{}", rounded(*x), rounded(*y));
        let points: Vec<_> = points.iter().map(point).collect();
        if !points.is_empty() {
            let points = points.join(" ");
            let _ = writeln!(self.0, "<{element} points=\"{points}\" {style}/>");
        }
    }

    /// A disc or a ring.
    fn mark(&mut self, series: &Series, (x, y): Place) {
        let radius = match &series.shape {
            Shape::Points(points) if points.len() > MANY => 1.75,
            Shape::Points(_) => 2.75,
            _ => RING,
        };
        let (x, y, style) = (rounded(x), rounded(y), series.style());
        let _ = writeln!(
            self.0,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" {style}/>"
        );
    }

    /// Text, centred vertically.
    fn text(&mut self, (x, y): Place, anchor: &str, colour: Colour, text: &str) {
        let (x, y, fill) = (rounded(x), rounded(y), colour.hex());
        let text = html! { (text) }.into_string();
        let _ = writeln!(
            self.0,
            "<text x=\"{x}\" y=\"{y}\" dy=\"0.35em\" text-anchor=\"{anchor}\" fill=\"{fill}\">{text}</text>"
        );
    }

    /// A legend entry: swatch and name, from this position to the right.
    fn entry(&mut self, series: &Series, (x, y): Place) {
        let (low, high, right, style) = (y - 6.0, y + 6.0, x + KEY, series.style());
        match &series.shape {
            Shape::Segments(_) | Shape::Dashed(_) => {
                self.line(&[(x, y), (right, y)], &style);
            }
            Shape::Points(_) | Shape::Rings(_) => {
                self.mark(series, (x + KEY / 2.0, y));
            }
            Shape::Labels(_) => {}
            Shape::Region(_) | Shape::Tiles(..) => {
                self.area(&[(x, low), (right, low), (right, high), (x, high)], &style);
            }
        }
        self.text((right + GAP, y), "start", Colour::Ink, &series.name);
    }
}

/// Rounded to hundredths.
fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

/// Upper bound of a text's width.
fn text_width(text: &str) -> f64 {
    text.chars().map(|_| LETTER * TEXT).sum::<f64>().ceil()
}

/// Most labels on an axis of this length.
fn most(length: f64, each: f64) -> f64 {
    (length / each).floor().max(2.0)
}

/// Widens one range symmetrically so that both axes have the same scale.
fn equal(x: Place, y: Place, (width, height): (f64, f64)) -> (Place, Place) {
    let scale = ((x.1 - x.0).abs() / width).max((y.1 - y.0).abs() / height);
    let grown = |(from, to): Place, length: f64| {
        let middle = f64::midpoint(from, to);
        let half = 0.5 * scale * length * (to - from).signum();
        (middle - half, middle + half)
    };
    (grown(x, width), grown(y, height))
}
