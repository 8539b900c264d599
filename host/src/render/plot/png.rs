//! Figures as PNG, from their SVG. The font is built in, so that the result is the same on a machine
//! without any.

use super::{Figure, PlotError};
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use std::fmt::Display;

/// DejaVu Sans: Latin, Greek and the signs of mathematics.
static FONT: &[u8] = include_bytes!("../../../assets/DejaVuSans-subset.ttf");
const FAMILY: &str = "DejaVu Sans";

fn failed(cause: impl Display) -> PlotError {
    PlotError::Png(cause.to_string())
}

impl Figure {
    /// As PNG on white, with `scale` dots a pixel of the screen: 1, or 2 to 4 for print.
    ///
    /// # Errors
    /// As [`to_svg`](Self::to_svg), or a scale that is not above 0 or far too large.
    pub fn to_png(&self, scale: f32) -> Result<Vec<u8>, PlotError> {
        let mut options = Options {
            font_family: FAMILY.to_owned(),
            ..Options::default()
        };
        let fonts = options.fontdb_mut();
        fonts.load_font_data(FONT.to_vec());
        fonts.set_sans_serif_family(FAMILY);
        let tree = Tree::from_str(&self.to_svg()?, &options).map_err(failed)?;
        let size = tree
            .size()
            .to_int_size()
            .scale_by(scale)
            .ok_or_else(|| failed("a scale must be above 0"))?;
        let mut pixels =
            Pixmap::new(size.width(), size.height()).ok_or_else(|| failed("it is too large"))?;
        pixels.fill(Color::WHITE);
        resvg::render(
            &tree,
            Transform::from_scale(scale, scale),
            &mut pixels.as_mut(),
        );
        pixels.encode_png().map_err(failed)
    }
}
