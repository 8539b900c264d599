//! Figures as PNG, from their SVG: of that the shapes, attributes and units that the drawing library
//! writes, so that no renderer of all of SVG is built with this program. The font is built in, so that
//! the result is the same on a machine without any.

use super::{Figure, PlotError};
use roxmltree::{Document, Node};
use std::fmt::Display;
use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// DejaVu Sans: Latin, Greek and the signs of mathematics.
static FONT: &[u8] = include_bytes!("../../../assets/DejaVuSans-subset.ttf");

fn failed(cause: impl Display) -> PlotError {
    PlotError::Png(cause.to_string())
}

impl Figure {
    /// As PNG on white, with `scale` dots a pixel of the screen: 1, or 2 to 4 for print.
    ///
    /// # Errors
    /// As [`to_svg`](Self::to_svg), or a scale that is not above 0 or far too large.
    pub fn to_png(&self, scale: f32) -> Result<Vec<u8>, PlotError> {
        draw(&self.to_svg()?, scale)?.encode_png().map_err(failed)
    }
}

fn draw(svg: &str, scale: f32) -> Result<Pixmap, PlotError> {
    let document = Document::parse(svg).map_err(failed)?;
    let root = document.root_element();
    let dots = |name| {
        let dots = (number(root, name)? * scale).round();
        // Beyond this no picture can be held in memory.
        let fits = dots >= 1.0 && dots <= f32::from(u16::MAX);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within u16
        fits.then_some(dots as u32)
            .ok_or_else(|| failed("a scale must be above 0 and not far too large"))
    };
    let mut pixels =
        Pixmap::new(dots("width")?, dots("height")?).ok_or_else(|| failed("it is too large"))?;
    pixels.fill(Color::WHITE);
    let frame = numbers(attribute(root, "viewBox")?)?;
    let [0.0, 0.0, width, _] = frame[..] else {
        return Err(failed("its frame does not begin at 0"));
    };
    let by = number(root, "width")? * scale / width;
    let face = Face::parse(FONT, 0).map_err(failed)?;
    for node in root.children().filter(Node::is_element) {
        shape(node, &face, Transform::from_scale(by, by), &mut pixels)?;
    }
    Ok(pixels)
}

fn shape(
    node: Node<'_, '_>,
    face: &Face<'_>,
    scale: Transform,
    pixels: &mut Pixmap,
) -> Result<(), PlotError> {
    let mut place = scale;
    let at = |name| number(node, name);
    let path = match node.tag_name().name() {
        "circle" => PathBuilder::from_circle(at("cx")?, at("cy")?, at("r")?),
        "rect" => Rect::from_xywh(at("x")?, at("y")?, at("width")?, at("height")?)
            .map(PathBuilder::from_rect),
        "line" => polygon(&[at("x1")?, at("y1")?, at("x2")?, at("y2")?], false),
        "polyline" => polygon(&numbers(attribute(node, "points")?)?, false),
        "polygon" => polygon(&numbers(attribute(node, "points")?)?, true),
        "text" => {
            if let Some(turn) = node.attribute("transform") {
                place = scale.pre_concat(rotation(turn)?);
            }
            text(node, face)?
        }
        other => return Err(failed(format_args!("<{other}> is not known"))),
    };
    // Nothing of any size is no shape.
    let Some(path) = path else { return Ok(()) };
    let opacity = at("opacity")?;
    if let Some(paint) = paint(node.attribute("fill").unwrap_or("#000000"), opacity)? {
        pixels.fill_path(&path, &paint, FillRule::Winding, place, None);
    }
    if let Some(paint) = paint(node.attribute("stroke").unwrap_or("none"), opacity)? {
        let stroke = Stroke {
            width: at("stroke-width")?,
            ..Stroke::default()
        };
        pixels.stroke_path(&path, &paint, &stroke, place, None);
    }
    Ok(())
}

fn polygon(coordinates: &[f32], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (index, [x, y]) in coordinates.as_chunks().0.iter().enumerate() {
        if index == 0 {
            path.move_to(*x, *y);
        } else {
            path.line_to(*x, *y);
        }
    }
    if closed {
        path.close();
    }
    path.finish()
}

/// The outlines of a line of text.
fn text(node: Node<'_, '_>, face: &Face<'_>) -> Result<Option<Path>, PlotError> {
    let size = number(node, "font-size")?;
    let scale = size / f32::from(face.units_per_em());
    let glyphs: Vec<_> = node
        .text()
        .unwrap_or_default()
        .trim()
        .chars()
        .map(|letter| face.glyph_index(letter).unwrap_or_default())
        .collect();
    let advance = |glyph| scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or_default());
    let width: f32 = glyphs.iter().copied().map(advance).sum();
    let before = match attribute(node, "text-anchor")? {
        "start" => 0.0,
        "middle" => width / 2.0,
        "end" => width,
        other => return Err(failed(format_args!("text-anchor {other} is not known"))),
    };
    let mut outlines = Outlines {
        path: PathBuilder::new(),
        scale,
        x: number(node, "x")? - before,
        y: number(node, "y")? + length(attribute(node, "dy")?, size)?,
    };
    for glyph in glyphs {
        // A space has no outline.
        let _ = face.outline_glyph(glyph, &mut outlines);
        outlines.x += advance(glyph);
    }
    Ok(outlines.path.finish())
}

/// Takes the outlines of letters, whose y points up.
struct Outlines {
    path: PathBuilder,
    scale: f32,
    x: f32,
    y: f32,
}

impl Outlines {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlineBuilder for Outlines {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

/// `#0072B2`; `None` of `none`.
fn paint(colour: &str, opacity: f32) -> Result<Option<Paint<'static>>, PlotError> {
    if colour == "none" {
        return Ok(None);
    }
    let bits = colour.strip_prefix('#').filter(|digits| digits.len() == 6);
    let bits = bits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let [_, red, green, blue] = bits
        .ok_or_else(|| failed(format_args!("the colour {colour} is not known")))?
        .to_be_bytes();
    let mut colour = Color::from_rgba8(red, green, blue, u8::MAX);
    colour.apply_opacity(opacity);
    let mut paint = Paint::default();
    paint.set_color(colour);
    Ok(Some(paint))
}

/// `rotate(270, 16, 572)`: degrees about a point.
fn rotation(text: &str) -> Result<Transform, PlotError> {
    let inner = text
        .strip_prefix("rotate(")
        .and_then(|rest| rest.strip_suffix(')'));
    let inner = inner.map(numbers).transpose()?;
    let Some([angle, x, y]) = inner.as_deref() else {
        return Err(failed(format_args!("{text} is not known")));
    };
    Ok(Transform::from_rotate_at(*angle, *x, *y))
}

/// `0.76em`, `0.5ex`: sizes of the text, and halves of it.
fn length(text: &str, size: f32) -> Result<f32, PlotError> {
    let (number, unit) = if let Some(number) = text.strip_suffix("em") {
        (number, size)
    } else if let Some(number) = text.strip_suffix("ex") {
        (number, size / 2.0)
    } else {
        (text, 1.0)
    };
    Ok(parsed(number)? * unit)
}

fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, PlotError> {
    let tag = node.tag_name().name();
    node.attribute(name)
        .ok_or_else(|| failed(format_args!("<{tag}> has no {name}")))
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f32, PlotError> {
    parsed(attribute(node, name)?)
}

/// Separated by commas, spaces or both.
fn numbers(text: &str) -> Result<Vec<f32>, PlotError> {
    text.split([',', ' '])
        .filter(|number| !number.is_empty())
        .map(parsed)
        .collect()
}

fn parsed(number: &str) -> Result<f32, PlotError> {
    number
        .parse()
        .map_err(|_| failed(format_args!("{number} is no number")))
}
