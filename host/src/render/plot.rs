//! Figures as SVG: axes with units, and a legend. The output is deterministic.
//!
//! ```
//! use delta_cal_host::render::plot::{Axis, Colour, Figure, Shape};
//! let median = vec![(8.0, 52.0), (20.0, 61.0), (40.0, 68.0), (60.0, 69.0)];
//! let figure = Figure::new(
//!     Axis::linear("poses", 0.0, 64.0),
//!     Axis::linear("gain, %", -50.0, 100.0),
//! )
//! .with("median", Colour::Blue, Shape::Points(median));
//! let svg = figure.to_svg();
//! assert!(svg.contains("gain, %") && svg.ends_with("</svg>\n"));
//! ```

use maud::{Markup, html};

/// The colours of Okabe and Ito, which the colour-blind can distinguish, without the yellow, which is too pale on
/// white; and two neutral colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// #0072B2.
    Blue,
    /// #D55E00.
    Vermilion,
    /// #009E73.
    Green,
    /// #CC79A7.
    Purple,
    /// #E69F00.
    Orange,
    /// Text and axes: black on white; the page inverts it on a dark background.
    Ink,
    /// Background and comparison.
    Grey,
}

impl Colour {
    /// The colour as an SVG attribute.
    const fn hex(self) -> &'static str {
        match self {
            Self::Blue => "#0072B2",
            Self::Vermilion => "#D55E00",
            Self::Green => "#009E73",
            Self::Purple => "#CC79A7",
            Self::Orange => "#E69F00",
            Self::Ink => "#1A1A1A",
            Self::Grey => "#808080",
        }
    }
}

/// Appearance of a series. Coordinates are in axis units; values that are not finite, or not positive on a logarithmic
/// axis, are omitted.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A dashed line between (x, y) and (x, y).
    Dashed([(f64, f64); 2]),
    /// Rectangles given by two corners, all with this opacity, 0 to 1.
    Tiles(Vec<[(f64, f64); 2]>, f64),
    /// Separate lines between (x, y) and (x, y).
    Segments(Vec<[(f64, f64); 2]>),
    /// Discs.
    Points(Vec<(f64, f64)>),
    /// Rings, larger than discs, to highlight points.
    Rings(Vec<(f64, f64)>),
    /// Text to the right of points.
    Labels(Vec<((f64, f64), String)>),
}

/// One entry of the legend and its data.
#[derive(Debug, Clone, PartialEq)]
struct Series {
    name: String,
    colour: Colour,
    shape: Shape,
}

/// Two axes and the series drawn between them, the first at the bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    width: u32,
    height: u32,
    equal_scales: bool,
}

impl Figure {
    /// An empty figure of 720 by 400 pixels.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            x,
            y,
            series: Vec::new(),
            width: 720,
            height: 400,
            equal_scales: false,
        }
    }

    /// Adds a series on top of the others; without a name it is not in the legend.
    pub fn with(mut self, name: impl Into<String>, colour: Colour, shape: Shape) -> Self {
        let name = name.into();
        self.series.push(Series {
            name,
            colour,
            shape,
        });
        self
    }

    /// Sets the size in screen pixels.
    pub fn sized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Uses the same scale on both axes, for spatial data; one range is widened.
    pub fn with_equal_scales(mut self) -> Self {
        self.equal_scales = true;
        self
    }
}

/// Most labels of a logarithmic axis.
const DECADES: usize = 10;

#[derive(Debug, Clone, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
    Named(Vec<String>),
}

/// An axis: label with unit, range and scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    scale: Scale,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            label: label.into(),
            low,
            high,
            scale: Scale::Linear,
        }
    }

    /// A logarithmic axis between two powers of ten.
    pub fn logarithmic(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            scale: Scale::Logarithmic,
            ..Self::linear(label, low, high)
        }
    }

    /// A linear axis with names at 0, 1, 2…, the first at the far end.
    pub fn named(label: impl Into<String>, names: Vec<String>) -> Self {
        let count = names.len() as f64;
        Self {
            scale: Scale::Named(names),
            ..Self::linear(label, count - 0.5, -0.5)
        }
    }

    /// Position of a value on the axis before scaling; `None` if it cannot be drawn.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Logarithmic => value.log10(),
            Scale::Linear | Scale::Named(_) => value,
        };
        place.is_finite().then_some(place)
    }

    /// The positions of both ends; 0 and 1 if the range is not finite, empty, or logarithmic and not positive.
    fn ends(&self) -> (f64, f64) {
        match (self.place(self.low), self.place(self.high)) {
            (Some(low), Some(high)) if (high - low).abs() > 0.0 => (low, high),
            _ => (0.0, 1.0),
        }
    }

    /// Positions and texts of the labels between two positions; on a linear axis at most about `most`.
    fn ticks(&self, (low, high): (f64, f64), most: f64) -> Vec<(f64, String)> {
        match &self.scale {
            Scale::Named(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear => steps(low.min(high), low.max(high), most),
            Scale::Logarithmic => decades(low, high),
        }
    }
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn steps(low: f64, high: f64, most: f64) -> Vec<(f64, String)> {
    let least = (high - low) / most;
    let power = 10f64.powf(least.log10().floor());
    let factors = [1.0, 2.0, 5.0].into_iter();
    let step = factors
        .map(|factor| factor * power)
        .find(|step| *step >= least)
        .unwrap_or(10.0 * power);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 308
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step).ceil();
    let places = (0..=100).map(|index| (first + f64::from(index)) * step + 0.0);
    places
        .take_while(|place| *place <= high)
        .map(|place| (place, format!("{place:.decimals$}").replace('-', "−")))
        .collect()
}

/// Powers of ten: 0.01, 1000, or 1e-7 if shorter.
fn decades(low: f64, high: f64) -> Vec<(f64, String)> {
    #[allow(clippy::cast_possible_truncation)] // exponents of f64
    let all = low.round() as i32..=high.round() as i32;
    let every = (all.clone().count() / DECADES).max(1);
    let text = |decade: i32| match decade {
        -4..=5 => 10f64.powi(decade).to_string(),
        _ => format!("1e{decade}").replace('-', "−"),
    };
    all.step_by(every)
        .map(|decade| (f64::from(decade), text(decade)))
        .collect()
}

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
        let svg = html! {
            svg width=(width) height=(height) viewBox={ "0 0 " (width) " " (height) }
                xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size=(TEXT) {
                @for (series, place) in entries { (series.entry(place)) }
                (frame.axes())
                @for series in &self.series { (frame.draw(series)) }
            }
        };
        svg.into_string() + "\n"
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

    /// The same within the axes.
    fn within(&self, point: &Place) -> Option<Place> {
        // Half the resolution of the output, 0.01 pixels.
        let inside =
            |at: f64, from: f64, size: f64| at >= from - 0.005 && at <= from + size + 0.005;
        self.at(point).filter(|(x, y)| {
            inside(*x, self.left, self.size.0) && inside(*y, self.top, self.size.1)
        })
    }

    fn axes(&self) -> Markup {
        let Self {
            figure,
            left,
            top,
            size: (width, height),
            ..
        } = *self;
        let (right, bottom) = (left + width, top + height);
        let ticks = |axis: &Axis, ends, length, each| axis.ticks(ends, most(length, each));
        let across = ticks(&figure.x, self.x, width, BETWEEN_LABELS.0);
        let down = ticks(&figure.y, self.y, height, BETWEEN_LABELS.1);
        let across = across.iter().map(|(at, text)| (self.across(*at), text));
        let down = down.iter().map(|(at, text)| (self.down(*at), text));
        let line = |points: &[Place], colour| line(points, colour, 1.0, None);
        let (ink, middle) = (Colour::Ink.hex(), (left + width / 2.0, top + height / 2.0));
        html! {
            @for (x, label) in across {
                (line(&[(x, top), (x, bottom)], GRID))
                (line(&[(x, bottom), (x, bottom + 4.0)], ink))
                (text((x, bottom + 13.0), "middle", Colour::Ink, label))
            }
            @for (y, label) in down {
                (line(&[(left, y), (right, y)], GRID))
                (line(&[(left - 4.0, y), (left, y)], ink))
                (text((left - 7.0, y), "end", Colour::Ink, label))
            }
            (line(&[(left, top), (left, bottom), (right, bottom)], ink))
            (text((middle.0, bottom + 34.0), "middle", Colour::Ink, &figure.x.label))
            // Rotated about its middle to read upwards.
            g transform={ "rotate(-90 12 " (middle.1) ")" } {
                (text((12.0, middle.1), "middle", Colour::Ink, &figure.y.label))
            }
        }
    }

    fn draw(&self, series: &Series) -> Markup {
        html! {
            @match &series.shape {
                Shape::Dashed(ends) => (series.line(&self.all(ends))),
                Shape::Segments(segments) => {
                    @for segment in segments { (series.line(&self.all(segment))) }
                }
                Shape::Tiles(tiles, opacity) => {
                    @for &[(x1, y1), (x2, y2)] in tiles {
                        (series.area(&self.all(&[(x1, y1), (x2, y1), (x2, y2), (x1, y2)]), *opacity))
                    }
                }
                Shape::Points(points) | Shape::Rings(points) => {
                    @for at in points.iter().filter_map(|point| self.within(point)) {
                        (series.mark(at))
                    }
                }
                Shape::Labels(labels) => {
                    @for (at, label) in labels {
                        @if let Some((x, y)) = self.within(at) {
                            (text((x + 9.0, y), "start", series.colour, label))
                        }
                    }
                }
            }
        }
    }
}

impl Series {
    fn line(&self, points: &[Place]) -> Markup {
        let dashes = matches!(self.shape, Shape::Dashed(_)).then_some("8 6");
        line(points, self.colour.hex(), LINE, dashes)
    }

    fn area(&self, corners: &[Place], opacity: f64) -> Markup {
        let (points, opacity) = (points(corners), rounded(opacity));
        html! { polygon points=(points) fill=(self.colour.hex()) opacity=(opacity) {} }
    }

    /// A disc or a ring.
    fn mark(&self, (x, y): Place) -> Markup {
        let (x, y, hex) = (rounded(x), rounded(y), self.colour.hex());
        match &self.shape {
            Shape::Points(points) => {
                let radius = if points.len() > MANY { 1.75 } else { 2.75 };
                html! { circle cx=(x) cy=(y) r=(radius) fill=(hex) {} }
            }
            _ => {
                html! { circle cx=(x) cy=(y) r=(RING) fill="none" stroke=(hex) stroke-width=(LINE) {} }
            }
        }
    }

    /// A legend entry: swatch and name, from this position to the right.
    fn entry(&self, (x, y): Place) -> Markup {
        let (low, high, right) = (y - 6.0, y + 6.0, x + KEY);
        let corners = [(x, low), (right, low), (right, high), (x, high)];
        html! {
            @match &self.shape {
                Shape::Segments(_) | Shape::Dashed(_) => (self.line(&[(x, y), (right, y)])),
                Shape::Points(_) | Shape::Rings(_) => (self.mark((x + KEY / 2.0, y))),
                Shape::Labels(_) => {},
                Shape::Tiles(_, opacity) => (self.area(&corners, *opacity)),
            }
            (text((right + GAP, y), "start", Colour::Ink, &self.name))
        }
    }
}

fn line(places: &[Place], colour: &str, width: f64, dashes: Option<&str>) -> Markup {
    html! {
        @if !places.is_empty() {
            polyline points=(points(places)) fill="none" stroke=(colour) stroke-width=(width)
                stroke-dasharray=[dashes] {}
        }
    }
}

/// Text, centred vertically.
fn text((x, y): Place, anchor: &str, colour: Colour, text: &str) -> Markup {
    html! {
        text x=(rounded(x)) y=(rounded(y)) dy="0.35em" text-anchor=(anchor) fill=(colour.hex()) { (text) }
    }
}

fn points(places: &[Place]) -> String {
    let places = places.iter();
    let places = places.map(|(x, y)| format!("{},{}", rounded(*x), rounded(*y)));
    places.collect::<Vec<_>>().join(" ")
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
