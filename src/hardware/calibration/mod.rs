//! What is known of a camera: intrinsics from a calibration, and where it stands.

mod distortion;
mod file;
mod viewpoint;
#[cfg(test)]
mod tests;

use nalgebra::Point2;

use crate::geometry::Intrinsics;
use crate::perception::model::RATIO_OFF_MAX;

pub use distortion::Distortion;
pub use file::parse_calibration;
pub(super) use viewpoint::{Known, Viewpoint};

/// The intrinsics of a camera at one size, and how its lens bends what it sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Columns and rows of the pictures that it was made from; without, those of the frames.
    pub image_size: Option<[u32; 2]>,
    /// Focal lengths and principal point at that size.
    pub intrinsics: Intrinsics,
    /// What the pinhole leaves out.
    pub distortion: Distortion,
}

impl Calibration {
    /// Of a camera matrix, row by row.
    ///
    /// # Errors
    /// What is expected of it.
    pub fn of_matrix(
        image_size: Option<[u32; 2]>,
        matrix: &[f64],
        distortion: Distortion,
    ) -> Result<Self, String> {
        let &[fx, skew, cx, zero, fy, cy, 0.0, 0.0, 1.0] = matrix else {
            return Err("expected 9 numbers, row by row, the last row 0, 0, 1".to_owned());
        };
        if matrix.iter().any(|value| !value.is_finite()) || fx <= 0.0 || fy <= 0.0 {
            return Err(format!("expected positive focal lengths, got {fx} and {fy}"));
        }
        if skew != 0.0 || zero != 0.0 {
            return Err(format!("expected a pinhole without skew, got {skew} and {zero}"));
        }
        Ok(Self { image_size, intrinsics: Intrinsics { fx, fy, cx, cy }, distortion })
    }

    /// The intrinsics of frames of another size of the same ratio of width to height.
    ///
    /// # Errors
    /// What sizes there are, where the ratio is another one.
    pub fn at(&self, size: [u32; 2]) -> Result<Intrinsics, String> {
        let own = self.image_size.unwrap_or(size).map(f64::from);
        let [across, down] = [0, 1].map(|axis| f64::from(size[axis]) / own[axis]);
        if !(across.is_finite() && down.is_finite() && (across / down - 1.0).abs() <= RATIO_OFF_MAX)
        {
            let [width, height] = size;
            return Err(format!(
                "it is of {}x{} pixels, the frames are {width}x{height}: calibrate at their ratio of width \
                 to height",
                own[0], own[1]
            ));
        }
        Ok(self.intrinsics.scaled([across, down]))
    }

    /// How far the lens moves what a pinhole would show in a corner of frames of `size`, pixels: the most of
    /// the four. `None` where the kind of lens is not known.
    ///
    /// # Errors
    /// As for [`Calibration::at`].
    pub fn displacement_px(&self, size: [u32; 2]) -> Result<Option<f64>, String> {
        let Intrinsics { fx, fy, cx, cy } = self.at(size)?;
        let [right, low] = size.map(|side| f64::from(side) - 1.0);
        let corners = [[0.0, 0.0], [right, 0.0], [0.0, low], [right, low]];
        let moved = corners.map(|[x, y]| {
            let at = Point2::new((x - cx) / fx, (y - cy) / fy);
            let moved = self.distortion.bend(at)? - at;
            Some((moved.x * fx).hypot(moved.y * fy))
        });
        Ok(moved.into_iter().try_fold(0.0, |most: f64, px| Some(most.max(px?))))
    }
}
