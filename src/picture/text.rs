//! Text: measuring, cutting, wrapping, drawing.

use ab_glyph::{Font as _, FontRef, PxScale, ScaleFont as _, point};

use super::PictureError;
use super::canvas::{Canvas, Point};

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
    mono: FontRef<'static>,
    sans: FontRef<'static>,
}

impl Fonts {
    pub(super) fn load() -> Result<Self, PictureError> {
        let read = |bytes: &'static [u8], font| {
            FontRef::try_from_slice(bytes).map_err(|_broken| PictureError::Font { font })
        };
        Ok(Self {
            mono: read(epaint_default_fonts::HACK_REGULAR, "Hack")?,
            sans: read(epaint_default_fonts::UBUNTU_LIGHT, "Ubuntu Light")?,
        })
    }

    fn face(&self, face: Face) -> &FontRef<'static> {
        match face {
            Face::Mono => &self.mono,
            Face::Sans => &self.sans,
        }
    }

    /// Width of a line of text in pixels.
    pub(super) fn width(&self, text: &str, style: Style) -> f32 {
        let font = self.face(style.face).as_scaled(PxScale::from(style.size));
        text.chars().map(|c| font.h_advance(font.glyph_id(c))).sum()
    }

    /// The text, cut with an ellipsis where it is wider than `width_max`.
    pub(super) fn cut(&self, text: &str, style: Style, width_max: f32) -> String {
        if self.width(text, style) <= width_max {
            return text.to_owned();
        }
        let font = self.face(style.face).as_scaled(PxScale::from(style.size));
        let mut left = width_max - self.width("…", style);
        let mut kept = String::new();
        for c in text.chars() {
            left -= font.h_advance(font.glyph_id(c));
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

    /// Draws a line of text whose box starts at `at` (left, top); returns its width.
    pub(super) fn draw(&self, canvas: &mut Canvas, text: &str, at: Point, style: Style) -> f32 {
        let font = self.face(style.face).as_scaled(PxScale::from(style.size));
        let mut x = at.0;
        for c in text.chars() {
            let id = font.glyph_id(c);
            let baseline = (at.1 + font.ascent()).round();
            let glyph = id.with_scale_and_position(style.size, point(x, baseline));
            x += font.h_advance(id);
            let Some(outlined) = font.outline_glyph(glyph) else { continue };
            let bounds = outlined.px_bounds();
            let (left, top) = (bounds.min.x as i64, bounds.min.y as i64);
            outlined.draw(|column, row, coverage| {
                let (x, y) = (left + i64::from(column), top + i64::from(row));
                canvas.blend(x, y, style.colour, coverage);
            });
        }
        x - at.0
    }
}
