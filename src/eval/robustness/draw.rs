//! Drawing on disturbed pictures.

use image::{Rgb, RgbImage};

use crate::geometry::PixelBox;
use crate::perception::model::ObjectBox;

/// A pixel outside all boxes of which no channel differs by more than this from the ground's is
/// ground.
const GROUND_DIFFERENCE_MAX: u8 = 60;

/// What is drawn into a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Rectangle,
    Ellipse,
}

/// Fills a shape; what lies outside the picture is left out.
pub(super) fn fill(image: &mut RgbImage, within: PixelBox, rgb: [u8; 3], shape: Shape) {
    let (width, height) = image.dimensions();
    let span = |low: f64, high: f64, side: u32| {
        let at = |v: f64| v.round().clamp(0.0, f64::from(side)) as u32;
        at(low)..at(high)
    };
    let (cx, cy) = within.centre();
    for y in span(within.y1, within.y2, height) {
        for x in span(within.x1, within.x2, width) {
            let dx = 2.0 * (f64::from(x) + 0.5 - cx) / within.width();
            let dy = 2.0 * (f64::from(y) + 0.5 - cy) / within.height();
            if shape == Shape::Rectangle || dx * dx + dy * dy <= 1.0 {
                image.put_pixel(x, y, Rgb(rgb));
            }
        }
    }
}

/// The colour between pixels (bilinear); outside the picture that of its edge.
pub(super) fn halves(image: &RgbImage, [x, y]: [f64; 2]) -> Rgb<u8> {
    let (width, height) = image.dimensions();
    let inside = |v: f64, side: u32| v.clamp(0.0, f64::from(side.saturating_sub(1)));
    let (x, y) = (inside(x, width) as f32, inside(y, height) as f32);
    let blend = image::imageops::interpolate_bilinear(image, x, y);
    blend.unwrap_or_else(|| *image.get_pixel(x as u32, y as u32))
}

/// Gives the ground another colour, and keeps its folds, shadows and grain as they are. The ground's
/// colour is the median of the picture's rim; what lies in a box stays as it is.
pub(super) fn recolour_ground(image: &mut RgbImage, objects: &[ObjectBox], target: [u8; 3]) {
    let (width, height) = image.dimensions();
    let is_rim = |x: u32, y: u32| x == 0 || y == 0 || x + 1 == width || y + 1 == height;
    let rim: Vec<[u8; 3]> =
        image.enumerate_pixels().filter(|(x, y, _)| is_rim(*x, *y)).map(|(.., p)| p.0).collect();
    let ground = [0, 1, 2].map(|channel| {
        let mut values: Vec<u8> = rim.iter().map(|p| p[channel]).collect();
        values.sort_unstable();
        values.get(values.len() / 2).copied().unwrap_or_default()
    });
    for (x, y, pixel) in image.enumerate_pixels_mut() {
        let (px, py) = (f64::from(x), f64::from(y));
        let is_inside = objects.iter().any(|object| {
            let b = object.pixel_box;
            b.x1 <= px && px < b.x2 && b.y1 <= py && py < b.y2
        });
        let is_like = |(v, g): (&u8, u8)| v.abs_diff(g) <= GROUND_DIFFERENCE_MAX;
        if !is_inside && pixel.0.iter().zip(ground).all(is_like) {
            for ((v, g), t) in pixel.0.iter_mut().zip(ground).zip(target) {
                *v = (i16::from(*v) - i16::from(g) + i16::from(t)).clamp(0, 255) as u8;
            }
        }
    }
}
