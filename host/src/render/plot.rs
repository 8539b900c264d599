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

/// An axis: label with unit, range and scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    scale: Scale,
}

#[derive(Debug, Clone, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
    Named(Vec<String>),
}

impl Axis {
    fn new(label: impl Into<String>, low: f64, high: f64, scale: Scale) -> Self {
        Self {
            label: label.into(),
            low,
            high,
            scale,
        }
    }

    /// A linear axis.
    pub fn linear(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self::new(label, low, high, Scale::Linear)
    }

    /// A logarithmic axis between two powers of ten.
    pub fn logarithmic(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self::new(label, low, high, Scale::Logarithmic)
    }

    /// A linear axis with names at 0, 1, 2…, the first at the far end.
    pub fn named(label: impl Into<String>, names: Vec<String>) -> Self {
        let count = names.len() as f64;
        Self::new(label, count - 0.5, -0.5, Scale::Named(names))
    }

    /// Position of a value on the axis before scaling; `None` if it cannot be drawn.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Logarithmic => value.log10(),
            Scale::Linear | Scale::Named(_) => value,
        };
        place.is_finite().then_some(place)
    }

    /// The axis in a figure, from a pixel so many to the right or, if negative, upwards. It ends at 0 and 1 if the range is
    /// not finite, empty, or logarithmic and not positive.
    fn drawn(&self, start: f64, length: f64) -> Drawn<'_> {
        let (low, high) = match (self.place(self.low), self.place(self.high)) {
            (Some(low), Some(high)) if (high - low).abs() > 0.0 => (low, high),
            _ => (0.0, 1.0),
        };
        Drawn {
            axis: self,
            low,
            high,
            start,
            length,
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

/// Most labels of a logarithmic axis.
const DECADES: usize = 10;

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

/// An axis at its place in a figure.
struct Drawn<'a> {
    axis: &'a Axis,
    low: f64,
    high: f64,
    start: f64,
    length: f64,
}

impl Drawn<'_> {
    fn pixel(&self, place: f64) -> f64 {
        self.start + self.length * (place - self.low) / (self.high - self.low)
    }

    /// The pixel of a value; `None` if it cannot be drawn.
    fn at(&self, value: f64) -> Option<f64> {
        Some(self.pixel(self.axis.place(value)?))
    }

    fn end(&self) -> f64 {
        self.start + self.length
    }

    fn middle(&self) -> f64 {
        self.start + self.length / 2.0
    }

    /// Whether a pixel is between the ends.
    fn contains(&self, pixel: f64) -> bool {
        let out = (pixel - self.middle()).abs() - self.length.abs() / 2.0;
        // Half the resolution of the output, 0.01 pixels.
        out <= 0.005
    }

    /// Pixels and texts of the labels, so far apart.
    fn ticks(&self, apart: f64) -> Vec<(f64, String)> {
        let (low, high) = (self.low.min(self.high), self.low.max(self.high));
        let ticks = match &self.axis.scale {
            Scale::Named(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear => steps(low, high, (self.length.abs() / apart).floor().max(2.0)),
            Scale::Logarithmic => decades(low, high),
        };
        let ticks = ticks.into_iter();
        ticks.map(|(at, text)| (self.pixel(at), text)).collect()
    }

    /// Of a pixel.
    fn scale(&self) -> f64 {
        ((self.high - self.low) / self.length).abs()
    }

    /// Widens the range symmetrically.
    fn widen(&mut self, scale: f64) {
        let middle = f64::midpoint(self.low, self.high);
        let half = 0.5 * scale * self.length.abs() * (self.high - self.low).signum();
        (self.low, self.high) = (middle - half, middle + half);
    }
}

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
const LINE: f64 = 1.75;
const RING: f64 = 6.0;
/// Colour of grid lines.
const GRID: &str = "#DDDDDD";

type Place = (f64, f64);

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

    /// The figure as SVG. Colours are attributes, so that a style sheet can change them for dark pages.
    pub fn to_svg(&self) -> String {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let labels = self.y.drawn(0.0, height).ticks(BETWEEN_LABELS.1);
        let widest = labels.iter().map(|(_, text)| text_width(text));
        let beside = if self.y.label.is_empty() { 14.0 } else { 34.0 };
        let left = widest.fold(0.0, f64::max) + beside;
        let (legend, above) = self.legend(left, width - MARGIN);
        let (top, bottom) = (MARGIN + above, height - 46.0);
        let mut x = self.x.drawn(left, width - left - MARGIN - 8.0);
        let mut y = self.y.drawn(bottom, top - bottom);
        if self.equal_scales {
            let scale = x.scale().max(y.scale());
            x.widen(scale);
            y.widen(scale);
        }
        let svg = html! {
            svg width=(width) height=(height) viewBox={ "0 0 " (width) " " (height) }
                xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size=(TEXT) {
                (legend)
                (axes(&x, &y))
                @for series in &self.series { (series.draw(&x, &y)) }
            }
        };
        svg.into_string() + "\n"
    }

    /// Swatches and names of the named series from left to right, in rows, and the height of these.
    fn legend(&self, left: f64, right: f64) -> (Markup, f64) {
        let (mut x, mut y) = (left, 2.0 + ROW / 2.0);
        let mut rows = 0.0;
        let mut entries = Vec::new();
        for series in self.series.iter().filter(|series| !series.name.is_empty()) {
            let width = KEY + GAP + text_width(&series.name);
            if x > left && x + width > right {
                (x, y) = (left, y + ROW);
            }
            entries.push(series.entry((x, y)));
            rows = y + ROW / 2.0 - 2.0;
            x += width + 2.0 * GAP;
        }
        (html! { @for entry in entries { (entry) } }, rows)
    }
}

fn axes(x: &Drawn<'_>, y: &Drawn<'_>) -> Markup {
    let line = |points: &[Place], colour| line(points, colour, 1.0, None);
    let (ink, bottom) = (Colour::Ink.hex(), y.start);
    html! {
        @for (at, label) in x.ticks(BETWEEN_LABELS.0) {
            (line(&[(at, y.end()), (at, bottom)], GRID))
            (line(&[(at, bottom), (at, bottom + 4.0)], ink))
            (text((at, bottom + 13.0), "middle", Colour::Ink, &label))
        }
        @for (at, label) in y.ticks(BETWEEN_LABELS.1) {
            (line(&[(x.start, at), (x.end(), at)], GRID))
            (line(&[(x.start - 4.0, at), (x.start, at)], ink))
            (text((x.start - 7.0, at), "end", Colour::Ink, &label))
        }
        (line(&[(x.start, y.end()), (x.start, bottom), (x.end(), bottom)], ink))
        (text((x.middle(), bottom + 34.0), "middle", Colour::Ink, &x.axis.label))
        // Rotated about its middle to read upwards.
        g transform={ "rotate(-90 12 " (y.middle()) ")" } {
            (text((12.0, y.middle()), "middle", Colour::Ink, &y.axis.label))
        }
    }
}

impl Series {
    fn draw(&self, x: &Drawn<'_>, y: &Drawn<'_>) -> Markup {
        let at = |point: &Place| Some((x.at(point.0)?, y.at(point.1)?));
        let all = |points: &[Place]| points.iter().filter_map(at).collect::<Vec<_>>();
        let within = |point: &Place| {
            at(point).filter(|(right, down)| x.contains(*right) && y.contains(*down))
        };
        html! {
            @match &self.shape {
                Shape::Dashed(ends) => (self.line(&all(ends))),
                Shape::Segments(segments) => {
                    @for segment in segments { (self.line(&all(segment))) }
                }
                Shape::Tiles(tiles, opacity) => {
                    @for [one, other] in tiles { (self.area(&all(&corners(*one, *other)), *opacity)) }
                }
                Shape::Points(points) | Shape::Rings(points) => {
                    @for place in points.iter().filter_map(within) { (self.mark(place)) }
                }
                Shape::Labels(labels) => {
                    @for (point, label) in labels {
                        @if let Some((right, down)) = within(point) {
                            (text((right + 9.0, down), "start", self.colour, label))
                        }
                    }
                }
            }
        }
    }

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
        let right = x + KEY;
        html! {
            @match &self.shape {
                Shape::Segments(_) | Shape::Dashed(_) => (self.line(&[(x, y), (right, y)])),
                Shape::Points(_) | Shape::Rings(_) => (self.mark((x + KEY / 2.0, y))),
                Shape::Labels(_) => {},
                Shape::Tiles(_, opacity) => {
                    (self.area(&corners((x, y - 6.0), (right, y + 6.0)), *opacity))
                }
            }
            (text((right + GAP, y), "start", Colour::Ink, &self.name))
        }
    }
}

/// Of the rectangle between two of them.
const fn corners((x1, y1): Place, (x2, y2): Place) -> [Place; 4] {
    [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]
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
