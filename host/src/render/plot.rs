//! Figures made to be read: axes with units, a legend, quantile bands, reference points, log axes.
//!
//! A [`Figure`] says what is to be seen; [`Figure::to_svg`] draws it. The same figure gives the same
//! bytes.
//!
//! ```
//! use delta_cal_host::render::plot::{Axis, Colour, Figure, Shape};
//! let median = vec![(8.0, 52.0), (20.0, 61.0), (40.0, 68.0), (60.0, 69.0)];
//! let band = median.iter().map(|&(x, y)| (x, y - 9.0, y + 6.0)).collect();
//! let figure = Figure::new(
//!     Axis::linear("poses", 0.0, 64.0),
//!     Axis::linear("gain, %", -50.0, 100.0),
//! )
//! .with("5 % to 95 %", Colour::Blue, Shape::Band(band))
//! .with("median", Colour::Blue, Shape::Line(median));
//! let svg = figure.to_svg()?;
//! assert!(svg.contains("gain, %") && svg.ends_with("</svg>\n"));
//! # Ok::<(), delta_cal_host::render::plot::PlotError>(())
//! ```

mod axis;
mod svg;

pub use axis::Axis;
use std::error::Error;
use std::fmt;

/// A figure that could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlotError {
    /// An axis is not finite or empty, or is logarithmic and not positive.
    Range(String),
    /// The figure is too small for its labels.
    Size,
}

impl fmt::Display for PlotError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range(axis) => write!(formatter, "the axis \"{axis}\" has no usable range"),
            Self::Size => formatter.write_str("the figure is too small for its labels"),
        }
    }
}

impl Error for PlotError {}

/// The colours of Okabe and Ito that differ for the colour-blind and stand out from white and from
/// black (their yellow does not), and two that are part of no comparison.
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
    /// #56B4E9.
    SkyBlue,
    /// Text and axes: black on white, and what the page makes of it on black.
    Ink,
    /// What is there for comparison only.
    Grey,
}

impl Colour {
    /// Red, green and blue.
    pub const fn channels(self) -> [u8; 3] {
        match self {
            Self::Blue => [0x00, 0x72, 0xb2],
            Self::Vermilion => [0xd5, 0x5e, 0x00],
            Self::Green => [0x00, 0x9e, 0x73],
            Self::Purple => [0xcc, 0x79, 0xa7],
            Self::Orange => [0xe6, 0x9f, 0x00],
            Self::SkyBlue => [0x56, 0xb4, 0xe9],
            Self::Ink => [0x1a, 0x1a, 0x1a],
            Self::Grey => [0x80, 0x80, 0x80],
        }
    }

    fn hex(self) -> String {
        svg::hex(self.channels())
    }
}

/// Six steps from dark to light of the map viridis, whose steps differ for the colour-blind: for
/// what is graded.
pub const STEPS: [[u8; 3]; 6] = [
    [0x44, 0x01, 0x54],
    [0x41, 0x44, 0x87],
    [0x2a, 0x78, 0x8e],
    [0x22, 0xa8, 0x84],
    [0x7a, 0xd1, 0x51],
    [0xfd, 0xe7, 0x25],
];

/// What a series looks like. Values are those of the axes; what is not finite, or not positive on a
/// logarithmic axis, is left out.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Points (x, y) joined.
    Line(Vec<(f64, f64)>),
    /// The same, dashed.
    Dashed(Vec<(f64, f64)>),
    /// (x, lower, upper): a quantile band.
    Band(Vec<(f64, f64, f64)>),
    /// The inside of a polygon.
    Region(Vec<(f64, f64)>),
    /// Rectangles between two corners, all of this opacity, 0 to 1: one shade of a map.
    Tiles(Vec<[(f64, f64); 2]>, f64),
    /// Lines between (x, y) and (x, y), each by itself.
    Segments(Vec<[(f64, f64); 2]>),
    /// The same, thin and pale: what leads the eye.
    Hairlines(Vec<[(f64, f64); 2]>),
    /// Discs.
    Points(Vec<(f64, f64)>),
    /// Rings, larger than discs: what stands out.
    Rings(Vec<(f64, f64)>),
    /// Diamonds: what others published.
    Diamonds(Vec<(f64, f64)>),
    /// Polygons, each filled with a colour of its own (red, green, blue), the first undermost.
    Patches(Vec<Patch>),
    /// Text to the right of points.
    Labels(Vec<((f64, f64), String)>),
}

/// The corners of a polygon, and its colour: red, green, blue.
pub type Patch = (Vec<(f64, f64)>, [u8; 3]);

/// One entry of the legend and what it stands for.
#[derive(Debug, Clone, PartialEq)]
struct Series {
    name: String,
    colour: Colour,
    shape: Shape,
}

/// Two axes and what is drawn between them, the first series undermost.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    width: u32,
    height: u32,
    equal_scales: bool,
    axes_shown: bool,
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
            axes_shown: true,
        }
    }

    /// With one more series, on top of the others; one without a name is not in the legend.
    pub fn with(mut self, name: impl Into<String>, colour: Colour, shape: Shape) -> Self {
        let name = name.into();
        self.series.push(Series {
            name,
            colour,
            shape,
        });
        self
    }

    /// In this size, pixels at the resolution of a screen.
    pub fn sized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// With as many pixels a unit on both axes: for what is seen in space. One range grows.
    pub fn with_equal_scales(mut self) -> Self {
        self.equal_scales = true;
        self
    }

    /// Without axes and their labels.
    pub fn without_axes(mut self) -> Self {
        self.axes_shown = false;
        self
    }
}
