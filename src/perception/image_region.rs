//! The part of a camera's image in which objects can be.

use thiserror::Error;

use crate::geometry::PixelBox;

/// A rectangle, in shares of an image's width and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageRegion {
    x: [f64; 2],
    y: [f64; 2],
}

/// Four numbers that are no region of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("[x1, y1, x2, y2], shares of width and height from 0 to 1 with x1 < x2 and y1 < y2")]
pub struct NoImageRegion;

impl ImageRegion {
    /// The region between left, upper, right and lower edge.
    ///
    /// # Errors
    /// [`NoImageRegion`], which says what they must be.
    pub fn new([x1, y1, x2, y2]: [f64; 4]) -> Result<Self, NoImageRegion> {
        let is_side = |from: f64, to: f64| 0.0 <= from && from < to && to <= 1.0;
        let region = Self { x: [x1, x2], y: [y1, y2] };
        (is_side(x1, x2) && is_side(y1, y2)).then_some(region).ok_or(NoImageRegion)
    }

    /// The region in an image of this width and height, in pixels.
    pub fn pixels(&self, width: usize, height: usize) -> PixelBox {
        let [x1, x2] = self.x.map(|share| share * width as f64);
        let [y1, y2] = self.y.map(|share| share * height as f64);
        PixelBox { x1, y1, x2, y2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_lies_inside_the_image_and_has_an_area() {
        let region = ImageRegion::new([0.25, 0.0, 1.0, 0.5]).unwrap();
        assert_eq!(<[f64; 4]>::from(region.pixels(640, 480)), [160.0, 0.0, 640.0, 240.0]);
        for edges in [
            [0.5, 0.0, 0.5, 1.0],
            [0.0, 0.7, 1.0, 0.6],
            [-0.1, 0.0, 1.0, 1.0],
            [0.0, 0.0, 1.0, 1.01],
            [0.0, f64::NAN, 1.0, 1.0],
            [10.0, 10.0, 300.0, 200.0],
        ] {
            assert_eq!(ImageRegion::new(edges), Err(NoImageRegion), "{edges:?}");
        }
    }
}
