//! From the pixels of a detection and a depth image to a volume in the world.

use nalgebra::{Point2, Point3};
use thiserror::Error;

use super::image::check_sides;
use super::{Detection, ImageError, RowRun};
use crate::geometry::CameraModel;
use crate::grounding::DepthRule;
use crate::scene::Volume;

/// A depth image: metres along the optical axis, row by row from the top; 0 where unknown.
#[derive(Debug, Clone, Copy)]
pub struct DepthView<'a> {
    width: usize,
    depth_m: &'a [f32],
}

/// A depth image is not what it says it is.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DepthError {
    /// Its sides are not an image's.
    #[error(transparent)]
    Side(#[from] ImageError),
    /// The buffer does not have one value for each pixel.
    #[error("depth_m: expected {expected} values, got {got}")]
    Length {
        /// Width times height.
        expected: usize,
        /// The buffer's length.
        got: usize,
    },
}

/// A volume rests on at least this many pixels with depth.
const PIXELS_MIN: usize = 12;

impl<'a> DepthView<'a> {
    /// Looks at a buffer as a depth image.
    ///
    /// # Errors
    /// [`DepthError`] naming the field when a side is zero or absurd, or the buffer's length is
    /// not width times height.
    pub fn new(width: usize, height: usize, depth_m: &'a [f32]) -> Result<Self, DepthError> {
        check_sides(width, height)?;
        let expected = width * height;
        if depth_m.len() != expected {
            return Err(DepthError::Length { expected, got: depth_m.len() });
        }
        Ok(Self { width, depth_m })
    }

    /// The depth of one pixel in metres, `None` where it is unknown or outside the image.
    fn at(&self, x: u32, y: u32) -> Option<f64> {
        let index = (x as usize) < self.width;
        let depth = index.then(|| self.depth_m.get(y as usize * self.width + x as usize));
        depth.flatten().map(|d| f64::from(*d)).filter(|d| d.is_finite() && *d > 0.0)
    }
}

/// The world volume of a detected object; `None` with too few depth pixels.
///
/// The camera looks along world y (x to the right, z up), level or from above. What it sees of an
/// object is its front and top: left and right are taken from the ends of the mask's rows, bottom
/// and top from the ends of its columns, the front from the nearest pixels; how deep the object is
/// follows from `rule`. Quantiles stand in for extremes, against noise and stray pixels.
pub fn volume_of(
    detection: &Detection,
    depth: &DepthView<'_>,
    camera: &CameraModel,
    rule: DepthRule,
) -> Option<Volume> {
    let lift = |column: f64, row: f64, depth_m: f64| -> Option<Point3<f64>> {
        camera.lift(Point2::new(column, row), depth_m).ok()
    };
    let pixel = |x: u32, y: u32, dx: f64, dy: f64| {
        lift(f64::from(x) + dx, f64::from(y) + dy, depth.at(x, y)?)
    };
    let points: Vec<Point3<f64>> = detection
        .mask
        .iter()
        .flat_map(|run| (run.x_start..run.x_end).filter_map(|x| pixel(x, run.y, 0.0, 0.0)))
        .collect();
    if points.len() < PIXELS_MIN {
        return None;
    }
    // Half a pixel outwards: to the edge of the last pixel, not to its middle.
    let rows = row_ends(&detection.mask);
    let left = rows.iter().filter_map(|r| pixel(r.x_start, r.y, -0.5, 0.0)).map(|p| p.x);
    let right = rows.iter().filter_map(|r| pixel(r.x_end - 1, r.y, 0.5, 0.0)).map(|p| p.x);
    let (left, right) = (quantile(left, 0.1)?, quantile(right, 0.9)?);
    let columns = column_ends(&detection.mask);
    let top = columns.iter().filter_map(|c| pixel(c.x, c.y_first, 0.0, 0.0)).map(|p| p.z);
    let bottom = columns.iter().filter_map(|c| pixel(c.x, c.y_last, 0.0, 0.5)).map(|p| p.z);
    let (bottom, top) = (quantile(bottom, 0.5)?, quantile(top, 0.75)?);
    let front = quantile(points.iter().map(|p| p.y), 0.15)?;
    let extent_y = match rule {
        DepthRule::AsWide => right - left,
    };
    let centre =
        Point3::new(f64::midpoint(left, right), front + extent_y / 2.0, f64::midpoint(bottom, top));
    Some(Volume { centre, extent: [right - left, extent_y, top - bottom] })
}

/// First and last column of each row.
fn row_ends(mask: &[RowRun]) -> Vec<RowRun> {
    let mut rows: Vec<RowRun> = Vec::new();
    for run in mask.iter().filter(|r| r.x_start < r.x_end) {
        match rows.last_mut() {
            Some(last) if last.y == run.y => {
                last.x_start = last.x_start.min(run.x_start);
                last.x_end = last.x_end.max(run.x_end);
            }
            _ => rows.push(*run),
        }
    }
    rows
}

struct ColumnEnds {
    x: u32,
    y_first: u32,
    y_last: u32,
}

/// First and last row of each column.
fn column_ends(mask: &[RowRun]) -> Vec<ColumnEnds> {
    let first = mask.iter().map(|r| r.x_start).min().unwrap_or(0);
    let end = mask.iter().map(|r| r.x_end).max().unwrap_or(0);
    let mut columns: Vec<Option<ColumnEnds>> = (first..end).map(|_| None).collect();
    for run in mask {
        for x in run.x_start..run.x_end {
            let column = &mut columns[(x - first) as usize];
            let y_first = column.as_ref().map_or(run.y, |c| c.y_first.min(run.y));
            *column = Some(ColumnEnds { x, y_first, y_last: run.y });
        }
    }
    columns.into_iter().flatten().collect()
}

/// The value below which a share of the values lies; `None` without values.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let index = ((values.len().checked_sub(1)?) as f64 * share).round() as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    Some(*value)
}
