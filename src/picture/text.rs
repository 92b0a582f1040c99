//! Text: measuring, cutting, wrapping, drawing.

use tiny_skia::PathBuilder;
use ttf_parser::{Face as Font, GlyphId, OutlineBuilder};

use super::PictureError;
use super::area::Point;
use super::canvas::Canvas;

/// Which of the two faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Face {
    /// For names, atoms and steps.
    Mono,
    /// For everything else.
    Sans,
}

/// Face, size in pixels and colour of a piece of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Style {
    pub(super) face: Face,
    pub(super) size: f32,
    pub(super) colour: [u8; 3],
}

/// The built-in fonts.
#[derive(Debug)]
pub(super) struct Fonts {
    mono: Font<'static>,
    sans: Font<'static>,
}

/// A font at a size: what its units are in pixels.
struct Scaled<'f> {
    font: &'f Font<'static>,
    scale: f32,
}

impl Scaled<'_> {
    fn glyph(&self, c: char) -> GlyphId {
        self.font.glyph_index(c).unwrap_or_default()
    }

    fn advance(&self, glyph: GlyphId) -> f32 {
        f32::from(self.font.glyph_hor_advance(glyph).unwrap_or(0)) * self.scale
    }
}

/// Writes a glyph's outline, in font units with y up, to a path in pixels with y down.
struct OutlinePen<'p> {
    path: &'p mut PathBuilder,
    origin: Point,
    scale: f32,
}

impl OutlinePen<'_> {
    fn at(&self, x: f32, y: f32) -> Point {
        (self.origin.0 + x * self.scale, self.origin.1 - y * self.scale)
    }
}

impl OutlineBuilder for OutlinePen<'_> {
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

impl Fonts {
    pub(super) fn load() -> Result<Self, PictureError> {
        let read = |bytes: &'static [u8], font| {
            Font::parse(bytes, 0).map_err(|_broken| PictureError::Font { font })
        };
        Ok(Self {
            mono: read(epaint_default_fonts::HACK_REGULAR, "Hack")?,
            sans: read(epaint_default_fonts::UBUNTU_LIGHT, "Ubuntu Light")?,
        })
    }

    fn scaled(&self, style: Style) -> Scaled<'_> {
        let font = match style.face {
            Face::Mono => &self.mono,
            Face::Sans => &self.sans,
        };
        let height = f32::from(font.ascender()) - f32::from(font.descender());
        Scaled { font, scale: style.size / height }
    }

    /// Width of a line of text in pixels.
    pub(super) fn width(&self, text: &str, style: Style) -> f32 {
        let font = self.scaled(style);
        text.chars().map(|c| font.advance(font.glyph(c))).sum()
    }

    /// The text, cut with an ellipsis where it is wider than `width_max`.
    pub(super) fn cut(&self, text: &str, style: Style, width_max: f32) -> String {
        if self.width(text, style) <= width_max {
            return text.to_owned();
        }
        let font = self.scaled(style);
        let mut left = width_max - self.width("…", style);
        let mut kept = String::new();
        for c in text.chars() {
            left -= font.advance(font.glyph(c));
            if left < 0.0 {
                break;
            }
            kept.push(c);
        }
        kept.push('…');
        kept
    }

    /// The text in lines no wider than `width_max`; at most `lines_max`, the last one cut.
    pub(super) fn wrap(
        &self,
        text: &str,
        style: Style,
        width_max: f32,
        lines_max: usize,
    ) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        let mut line = String::new();
        for word in text.split_whitespace() {
            let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
            let is_last = lines.len() + 1 >= lines_max;
            if is_last || line.is_empty() || self.width(&longer, style) <= width_max {
                line = longer;
            } else {
                lines.push(std::mem::replace(&mut line, word.to_owned()));
            }
        }
        if !line.is_empty() {
            lines.push(line);
        }
        lines.iter().map(|line| self.cut(line, style, width_max)).collect()
    }

    /// Draws a line of text whose box starts at `at` (left, top).
    pub(super) fn draw(&self, canvas: &mut Canvas, text: &str, at: Point, style: Style) {
        let scaled = self.scaled(style);
        let Scaled { font, scale } = scaled;
        let baseline = (at.1 + f32::from(font.ascender()) * scale).round();
        let mut path = PathBuilder::new();
        let mut x = at.0;
        for c in text.chars() {
            let glyph = scaled.glyph(c);
            let mut pen = OutlinePen { path: &mut path, origin: (x, baseline), scale };
            font.outline_glyph(glyph, &mut pen);
            x += scaled.advance(glyph);
        }
        canvas.fill_path(path.finish(), style.colour, 1.0);
    }
}
