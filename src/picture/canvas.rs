//! An image that is drawn on. The shapes are tiny-skia's; a shape that it cannot draw, such as one
//! without a finite size, is left out.

use image::RgbImage;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect,
    Stroke, StrokeDash, Transform,
};

use super::area::{Area, Point};
use super::{PictureError, palette};

/// Control points of a quarter circle lie at this share of its radius.
const QUARTER: f32 = 0.552_284_8;

/// Rings that make up a soft edge.
const SHADOW_RINGS: u8 = 6;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) width: f32,
    pub(super) colour: [u8; 3],
    pub(super) alpha: f32,
    /// Lengths of a dash and of the gap after it; `None` for an unbroken line.
    pub(super) dash: Option<[f32; 2]>,
}

impl Line {
    pub(super) fn unbroken(width: f32, colour: [u8; 3], alpha: f32) -> Self {
        Self { width, colour, alpha, dash: None }
    }
}

/// An opaque image that is drawn on.
#[derive(Debug)]
pub(super) struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// # Errors
    /// [`PictureError::Size`] when there is no memory for it, or nothing to draw on.
    pub(super) fn new(width: u32, height: u32, colour: [u8; 3]) -> Result<Self, PictureError> {
        let mut pixmap = Pixmap::new(width, height).ok_or(PictureError::Size { width, height })?;
        let [red, green, blue] = colour;
        pixmap.fill(tiny_skia::Color::from_rgba8(red, green, blue, 255));
        Ok(Self { pixmap })
    }

    pub(super) fn height(&self) -> f32 {
        self.pixmap.height() as f32
    }

    pub(super) fn finish(self) -> RgbImage {
        let (width, pixels) = (self.pixmap.width(), self.pixmap.pixels());
        RgbImage::from_fn(width, self.pixmap.height(), |x, y| {
            let pixel = pixels[(y * width + x) as usize];
            image::Rgb([pixel.red(), pixel.green(), pixel.blue()])
        })
    }

    /// Puts an image onto the canvas; what does not fit is cut.
    pub(super) fn paste(&mut self, image: &RgbImage, left: u32, top: u32) {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        let pixels = self.pixmap.pixels_mut();
        for (x, y, image::Rgb([red, green, blue])) in image.enumerate_pixels() {
            let (x, y) = (left + x, top + y);
            let pixel = PremultipliedColorU8::from_rgba(*red, *green, *blue, 255);
            if let (true, Some(pixel)) = (x < width && y < height, pixel) {
                pixels[(y * width + x) as usize] = pixel;
            }
        }
    }

    /// Fills a path: text, or a shape of this file.
    pub(super) fn fill_path(&mut self, path: Option<Path>, colour: [u8; 3], alpha: f32) {
        let Some(path) = path else { return };
        let (paint, rule) = (paint(colour, alpha), FillRule::Winding);
        self.pixmap.fill_path(&path, &paint, rule, Transform::identity(), None);
    }

    /// A filled rectangle with rounded corners.
    pub(super) fn fill(&mut self, area: &Area, radius: f32, colour: [u8; 3], alpha: f32) {
        self.fill_path(rounded(area, radius), colour, alpha);
    }

    /// A soft shadow below a rectangle.
    pub(super) fn shadow(&mut self, area: &Area, radius: f32, blur: f32, alpha: f32) {
        // Rings on top of each other: their transparencies multiply.
        let each = 1.0 - (1.0 - alpha).powf(1.0 / f32::from(SHADOW_RINGS));
        for ring in 0..SHADOW_RINGS {
            let margin = blur * (f32::from(ring) / f32::from(SHADOW_RINGS) - 0.5);
            self.fill(&area.grown(margin), radius + margin, palette::SHADE, each);
        }
    }

    /// The outline of a rectangle with rounded corners.
    pub(super) fn outline(&mut self, area: &Area, radius: f32, line: &Line) {
        self.stroke_path(rounded(area, radius), line, LineCap::Butt);
    }

    /// A line through the points with round ends.
    pub(super) fn stroke(&mut self, points: &[Point], line: &Line) {
        let [(x, y), rest @ ..] = points else { return };
        let mut path = PathBuilder::new();
        path.move_to(*x, *y);
        for (x, y) in rest {
            path.line_to(*x, *y);
        }
        self.stroke_path(path.finish(), line, LineCap::Round);
    }

    fn stroke_path(&mut self, path: Option<Path>, line: &Line, line_cap: LineCap) {
        let Some(path) = path else { return };
        let dash = line.dash.and_then(|dash| StrokeDash::new(dash.to_vec(), 0.0));
        let line_join = LineJoin::Round;
        let stroke = Stroke { width: line.width, line_cap, line_join, dash, ..Stroke::default() };
        let paint = paint(line.colour, line.alpha);
        self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    /// A filled circle.
    pub(super) fn disc(&mut self, (x, y): Point, radius: f32, colour: [u8; 3], alpha: f32) {
        self.fill_path(PathBuilder::from_circle(x, y, radius), colour, alpha);
    }

    /// A filled triangle with its tip at `tip`, pointing along `direction` (a unit vector).
    pub(super) fn arrow_head(
        &mut self,
        (x, y): Point,
        (dx, dy): Point,
        length: f32,
        colour: [u8; 3],
        alpha: f32,
    ) {
        let (back, half) = ((x - dx * length, y - dy * length), 0.55 * length);
        let mut path = PathBuilder::new();
        path.move_to(x, y);
        path.line_to(back.0 - dy * half, back.1 + dx * half);
        path.line_to(back.0 + dy * half, back.1 - dx * half);
        path.close();
        self.fill_path(path.finish(), colour, alpha);
    }
}

fn paint([red, green, blue]: [u8; 3], alpha: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

/// A rectangle with rounded corners; `None` when it has no inside.
fn rounded(area: &Area, radius: f32) -> Option<Path> {
    let Area { x1, y1, x2, y2 } = *area;
    let rect = Rect::from_ltrb(x1, y1, x2, y2)?;
    let radius = radius.min(area.width() / 2.0).min(area.height() / 2.0);
    if radius <= 0.0 {
        return Some(PathBuilder::from_rect(rect));
    }
    // From the end of a side, over the corner, to the start of the next side.
    let (r, k) = (radius, radius * (1.0 - QUARTER));
    let mut path = PathBuilder::new();
    path.move_to(x1 + r, y1);
    path.line_to(x2 - r, y1);
    path.cubic_to(x2 - k, y1, x2, y1 + k, x2, y1 + r);
    path.line_to(x2, y2 - r);
    path.cubic_to(x2, y2 - k, x2 - k, y2, x2 - r, y2);
    path.line_to(x1 + r, y2);
    path.cubic_to(x1 + k, y2, x1, y2 - k, x1, y2 - r);
    path.line_to(x1, y1 + r);
    path.cubic_to(x1, y1 + k, x1 + k, y1, x1 + r, y1);
    path.close();
    path.finish()
}
