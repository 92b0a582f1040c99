//! Antialiased shapes on an image: each is a signed distance, covered by half a pixel of ramp.

use image::{Rgb, RgbImage, imageops};

/// A point of the picture in pixels.
pub(super) type Point = (f32, f32);

/// An axis-aligned rectangle of the picture in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) x1: f32,
    pub(super) y1: f32,
    pub(super) x2: f32,
    pub(super) y2: f32,
}

impl Area {
    pub(super) fn new(x: f32, y: f32, width: f32, height: f32) -> Self {
        Self { x1: x, y1: y, x2: x + width, y2: y + height }
    }

    pub(super) fn width(&self) -> f32 {
        self.x2 - self.x1
    }

    pub(super) fn height(&self) -> f32 {
        self.y2 - self.y1
    }

    pub(super) fn centre(&self) -> Point {
        (f32::midpoint(self.x1, self.x2), f32::midpoint(self.y1, self.y2))
    }

    /// The area with `margin` more on each side.
    pub(super) fn grown(&self, margin: f32) -> Self {
        Self {
            x1: self.x1 - margin,
            y1: self.y1 - margin,
            x2: self.x2 + margin,
            y2: self.y2 + margin,
        }
    }

    /// The area grown until it holds the point.
    fn with(&self, (x, y): Point) -> Self {
        Self { x1: self.x1.min(x), y1: self.y1.min(y), x2: self.x2.max(x), y2: self.y2.max(y) }
    }

    pub(super) fn contains(&self, (x, y): Point) -> bool {
        (self.x1..=self.x2).contains(&x) && (self.y1..=self.y2).contains(&y)
    }

    /// Area of the common part.
    pub(super) fn overlap(&self, other: &Self) -> f32 {
        let width = self.x2.min(other.x2) - self.x1.max(other.x1);
        let height = self.y2.min(other.y2) - self.y1.max(other.y1);
        width.max(0.0) * height.max(0.0)
    }

    /// The nearest point of the area.
    pub(super) fn nearest(&self, (x, y): Point) -> Point {
        (x.clamp(self.x1, self.x2), y.clamp(self.y1, self.y2))
    }

    /// Distance from its edge with rounded corners, negative inside.
    fn distance(&self, (x, y): Point, radius: f32) -> f32 {
        let (cx, cy) = self.centre();
        let radius = radius.min(self.width() / 2.0).min(self.height() / 2.0).max(0.0);
        let dx = (x - cx).abs() - self.width() / 2.0 + radius;
        let dy = (y - cy).abs() - self.height() / 2.0 + radius;
        dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0) - radius
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) width: f32,
    pub(super) colour: [u8; 3],
    pub(super) alpha: f32,
    /// Length of a dash; `None` for an unbroken line.
    pub(super) dash: Option<f32>,
}

/// How much of each pixel several shapes cover together, so that they are blended once.
#[derive(Debug)]
struct Coverage {
    left: i64,
    top: i64,
    width: i64,
    height: i64,
    values: Vec<f32>,
}

impl Coverage {
    /// Nothing covered yet, within the bounds and the image.
    fn new(bounds: &Area, image: &RgbImage) -> Self {
        let (left, top) = (bounds.x1.max(0.0).floor() as i64, bounds.y1.max(0.0).floor() as i64);
        let right = (bounds.x2.ceil() as i64).min(i64::from(image.width()));
        let bottom = (bounds.y2.ceil() as i64).min(i64::from(image.height()));
        let (width, height) = ((right - left).max(0), (bottom - top).max(0));
        Self { left, top, width, height, values: vec![0.0; (width * height) as usize] }
    }

    /// Covers what `distance` (in pixels, negative inside) says, looking at `near` only.
    fn add(&mut self, near: &Area, distance: impl Fn(Point) -> f32) {
        let columns = (near.x1.floor() as i64 - self.left).clamp(0, self.width)
            ..(near.x2.ceil() as i64 - self.left).clamp(0, self.width);
        let rows = (near.y1.floor() as i64 - self.top).clamp(0, self.height)
            ..(near.y2.ceil() as i64 - self.top).clamp(0, self.height);
        for row in rows {
            for column in columns.clone() {
                let point = ((self.left + column) as f32 + 0.5, (self.top + row) as f32 + 0.5);
                let covered = (0.5 - distance(point)).clamp(0.0, 1.0);
                let idx = (row * self.width + column) as usize;
                if let Some(value) = self.values.get_mut(idx) {
                    *value = value.max(covered);
                }
            }
        }
    }
}

/// An image that is drawn on.
#[derive(Debug)]
pub(super) struct Canvas {
    image: RgbImage,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32, colour: [u8; 3]) -> Self {
        Self { image: RgbImage::from_pixel(width, height, Rgb(colour)) }
    }

    pub(super) fn height(&self) -> f32 {
        self.image.height() as f32
    }

    pub(super) fn finish(self) -> RgbImage {
        self.image
    }

    pub(super) fn paste(&mut self, image: &RgbImage, left: u32, top: u32) {
        imageops::replace(&mut self.image, image, i64::from(left), i64::from(top));
    }

    /// Mixes a colour into one pixel; outside the image nothing happens.
    pub(super) fn blend(&mut self, x: i64, y: i64, colour: [u8; 3], alpha: f32) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        let Some(pixel) = self.image.get_pixel_mut_checked(x, y) else { return };
        let alpha = alpha.clamp(0.0, 1.0);
        for (old, new) in pixel.0.iter_mut().zip(colour) {
            *old = (f32::from(new) * alpha + f32::from(*old) * (1.0 - alpha)).round() as u8;
        }
    }

    /// Fills where `distance` (in pixels, negative inside) says, within `bounds`.
    fn shape(
        &mut self,
        bounds: &Area,
        colour: [u8; 3],
        alpha: f32,
        distance: impl Fn(Point) -> f32,
    ) {
        let (width, height) = (self.image.width() as f32, self.image.height() as f32);
        let columns = bounds.x1.max(0.0).floor() as i64..bounds.x2.min(width).ceil() as i64;
        for y in bounds.y1.max(0.0).floor() as i64..bounds.y2.min(height).ceil() as i64 {
            for x in columns.clone() {
                let coverage = 0.5 - distance((x as f32 + 0.5, y as f32 + 0.5));
                if coverage > 0.0 {
                    self.blend(x, y, colour, coverage.min(1.0) * alpha);
                }
            }
        }
    }

    /// A filled rectangle with rounded corners.
    pub(super) fn fill(&mut self, area: &Area, radius: f32, colour: [u8; 3], alpha: f32) {
        self.shape(&area.grown(1.0), colour, alpha, |point| area.distance(point, radius));
    }

    /// A soft shadow below a rectangle.
    pub(super) fn shadow(&mut self, area: &Area, radius: f32, blur: f32, alpha: f32) {
        let soft = |point| area.distance(point, radius) / blur;
        self.shape(&area.grown(blur), super::palette::SHADE, alpha, soft);
    }

    /// The outline of a rectangle.
    pub(super) fn outline(&mut self, area: &Area, radius: f32, line: &Line) {
        let sides = [
            Area { x2: area.x1 + radius, ..*area },
            Area { x1: area.x2 - radius, ..*area },
            Area { x1: area.x1 + radius, x2: area.x2 - radius, y2: area.y1 + radius, ..*area },
            Area { x1: area.x1 + radius, x2: area.x2 - radius, y1: area.y2 - radius, ..*area },
        ];
        let distance = |point: Point| match line.dash {
            // Along each straight side the sum of the coordinates grows with the length.
            Some(dash) if ((point.0 + point.1) / dash).rem_euclid(2.0) > 1.1 => 1.0,
            _ => area.distance(point, radius).abs() - line.width / 2.0,
        };
        let mut coverage = Coverage::new(&area.grown(line.width + 1.0), &self.image);
        for side in sides {
            coverage.add(&side.grown(line.width + 1.0), distance);
        }
        self.blend_all(&coverage, line.colour, line.alpha);
    }

    /// A line through the points with round ends.
    pub(super) fn stroke(&mut self, points: &[Point], width: f32, colour: [u8; 3], alpha: f32) {
        let Some(first) = points.first() else { return };
        let start = Area::new(first.0, first.1, 0.0, 0.0);
        let bounds = points.iter().fold(start, |area, &point| area.with(point));
        let mut coverage = Coverage::new(&bounds.grown(width), &self.image);
        for pair in points.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let near = Area::new(from.0, from.1, 0.0, 0.0).with(to).grown(width);
            coverage.add(&near, |point| to_segment(point, from, to) - width / 2.0);
        }
        self.blend_all(&coverage, colour, alpha);
    }

    fn blend_all(&mut self, coverage: &Coverage, colour: [u8; 3], alpha: f32) {
        let places = (0_i64..).zip(&coverage.values);
        for (idx, value) in places.filter(|(_, value)| **value > 0.0) {
            let (x, y) =
                (coverage.left + idx % coverage.width, coverage.top + idx / coverage.width);
            self.blend(x, y, colour, value * alpha);
        }
    }

    /// A filled circle.
    pub(super) fn disc(&mut self, centre: Point, radius: f32, colour: [u8; 3], alpha: f32) {
        let bounds = Area::new(centre.0, centre.1, 0.0, 0.0).grown(radius + 1.0);
        self.shape(&bounds, colour, alpha, |(x, y)| (x - centre.0).hypot(y - centre.1) - radius);
    }

    /// A filled triangle with its tip at `tip`, pointing along `direction` (a unit vector).
    pub(super) fn arrow_head(
        &mut self,
        tip: Point,
        direction: Point,
        length: f32,
        colour: [u8; 3],
        alpha: f32,
    ) {
        let bounds = Area::new(tip.0, tip.1, 0.0, 0.0).grown(length + 2.0);
        let slope = 0.55_f32;
        let norm = slope.hypot(1.0);
        self.shape(&bounds, colour, alpha, |(x, y)| {
            let along = (x - tip.0) * direction.0 + (y - tip.1) * direction.1;
            let across = ((x - tip.0) * direction.1 - (y - tip.1) * direction.0).abs();
            ((across + along * slope) / norm).max(-along - length)
        });
    }
}

/// Distance of a point from a line segment.
fn to_segment(point: Point, start: Point, end: Point) -> f32 {
    let (dx, dy) = (end.0 - start.0, end.1 - start.1);
    let length_squared = dx * dx + dy * dy;
    let part = if length_squared > 0.0 {
        (((point.0 - start.0) * dx + (point.1 - start.1) * dy) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point.0 - start.0 - part * dx).hypot(point.1 - start.1 - part * dy)
}
