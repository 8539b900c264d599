//! Figures made to be read: axes with units, a legend, quantile bands, reference points, log axes.
//!
//! A [`Figure`] says what is to be seen; [`Figure::to_svg`] and [`Figure::to_png`] draw it. The
//! same figure gives the same bytes.
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
mod colour;
mod draw;
mod legend;
mod png;
mod style;

pub use axis::Axis;
pub use colour::{Colour, STEPS};
use std::error::Error;
use std::fmt;

/// A figure that could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlotError {
    /// An axis is not finite or empty, or is logarithmic and not positive.
    Range(String),
    /// The figure is too small for its labels.
    Size,
    /// What the drawing library says.
    Drawing(String),
    /// What the PNG encoder says.
    Png(String),
}

impl fmt::Display for PlotError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range(axis) => write!(formatter, "the axis \"{axis}\" has no usable range"),
            Self::Size => formatter.write_str("the figure is too small for its labels"),
            Self::Drawing(cause) => write!(formatter, "the figure cannot be drawn: {cause}"),
            Self::Png(cause) => write!(formatter, "the figure cannot be made a PNG: {cause}"),
        }
    }
}

impl Error for PlotError {}

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
