//! Figures: axes with units, a legend, logarithmic axes.
//!
//! A [`Figure`] describes the content; [`Figure::to_svg`] draws it. The output is deterministic.
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

mod svg;

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
    /// Points (x, y) connected by a dashed line.
    Dashed(Vec<(f64, f64)>),
    /// A filled polygon.
    Region(Vec<(f64, f64)>),
    /// Rectangles given by two corners, all with this opacity, 0 to 1: one shade of a map.
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

/// Most decades of a logarithmic axis with lines in between.
const DIVIDED_DECADES: f64 = 9.0;
/// Most decades of a logarithmic axis with a label each.
const LABELLED_DECADES: usize = 10;

/// Position and text of a label.
pub(super) type Tick = (f64, String);

#[derive(Debug, Clone, PartialEq)]
enum Scale {
    Linear,
    Logarithmic,
    Named(Vec<String>),
}

/// An axis: label with unit, range and scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(super) label: String,
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

    /// A logarithmic axis; both ends must be positive.
    pub fn logarithmic(label: impl Into<String>, low: f64, high: f64) -> Self {
        Self {
            scale: Scale::Logarithmic,
            ..Self::linear(label, low, high)
        }
    }

    /// A linear axis with names at 0, 1, 2…, the first at the far end.
    pub fn named(label: impl Into<String>, names: Vec<String>) -> Self {
        let count = u32::try_from(names.len()).map_or(f64::INFINITY, f64::from);
        Self {
            scale: Scale::Named(names),
            ..Self::linear(label, count - 0.5, -0.5)
        }
    }

    /// Position of a value on the axis before scaling; `None` if it cannot be drawn.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Logarithmic => value.log10(),
            Scale::Linear | Scale::Named(_) => value,
        };
        place.is_finite().then_some(place)
    }

    /// The positions of both ends; 0 and 1 if the range is not finite, empty, or logarithmic and not positive.
    pub(super) fn ends(&self) -> (f64, f64) {
        match (self.place(self.low), self.place(self.high)) {
            (Some(low), Some(high)) if (high - low).abs() > 0.0 => (low, high),
            _ => (0.0, 1.0),
        }
    }

    /// Labels between two positions; on a linear axis at most about `most`.
    pub(super) fn ticks(&self, (low, high): (f64, f64), most: f64) -> Vec<Tick> {
        match &self.scale {
            Scale::Named(names) => (0..).map(f64::from).zip(names.iter().cloned()).collect(),
            Scale::Linear => steps(low.min(high), low.max(high), most),
            Scale::Logarithmic => decades(low, high),
        }
    }

    /// Positions between the labels of a logarithmic axis: 2, 3… 9 times a power of ten.
    pub(super) fn minor(&self, (low, high): (f64, f64)) -> Vec<f64> {
        if self.scale != Scale::Logarithmic || high - low > DIVIDED_DECADES {
            return Vec::new();
        }
        let multiples = (2..10).map(f64::from).map(f64::log10);
        whole(low - 1.0, high)
            .flat_map(|decade| multiples.clone().map(move |part| f64::from(decade) + part))
            .filter(|place| (low..=high).contains(place))
            .collect()
    }
}

/// The integers between two positions.
#[allow(clippy::cast_possible_truncation)] // exponents of f64, or some dozens of steps
fn whole(low: f64, high: f64) -> std::ops::RangeInclusive<i32> {
    low.ceil() as i32..=high.floor() as i32
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn steps(low: f64, high: f64, most: f64) -> Vec<Tick> {
    let least = (high - low) / most;
    let mut exponent = least.log10().floor();
    let factors = [1.0, 2.0, 5.0];
    let factor = factors
        .into_iter()
        .find(|factor| factor * 10f64.powf(exponent) >= least);
    let factor = factor.unwrap_or_else(|| {
        exponent += 1.0;
        1.0
    });
    let step = factor * 10f64.powf(exponent);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 308
    let decimals = (-exponent).max(0.0) as usize;
    let first = (low / step).ceil();
    let places = (0..=100).map(|index| (first + f64::from(index)) * step);
    places
        .take_while(|place| *place <= high)
        .map(|place| (place, number(place, decimals)))
        .collect()
}

fn decades(low: f64, high: f64) -> Vec<Tick> {
    let every = (whole(low, high).count() / LABELLED_DECADES).max(1);
    let decades: Vec<_> = whole(low, high)
        .step_by(every)
        .map(|decade| (f64::from(decade), power_of_ten(decade)))
        .collect();
    if decades.len() > 1 {
        return decades;
    }
    // Less than two decades: 1, 2 and 5.
    let parts = |decade: i32| [1.0, 2.0, 5.0].map(|part: f64| (decade, part));
    whole(low - 1.0, high)
        .flat_map(parts)
        .map(|(decade, part)| {
            let decimals = usize::try_from(-decade).unwrap_or(0);
            let text = number(part * 10f64.powi(decade), decimals);
            (f64::from(decade) + part.log10(), text)
        })
        .filter(|(place, _)| (low..=high).contains(place))
        .collect()
}

/// 0.01, 1000, or 1e-7 if shorter.
fn power_of_ten(decade: i32) -> String {
    match decade {
        -4..=5 => number(10f64.powi(decade), usize::try_from(-decade).unwrap_or(0)),
        _ => format!("1e{decade}").replace('-', "\u{2212}"),
    }
}

fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // −0 keeps its sign, as does a value rounded to it.
    let zero = text.parse::<f64>().is_ok_and(|value| value.abs() <= 0.0);
    let text = if zero {
        text.trim_start_matches('-')
    } else {
        &text
    };
    text.replace('-', "\u{2212}")
}
