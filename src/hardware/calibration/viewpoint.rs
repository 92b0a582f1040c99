//! The options `intrinsics`, `intrinsics_px` and `pose` of cameras.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::{Calibration, Distortion, parse_calibration};
use crate::geometry::{CameraModel, Intrinsics};
use crate::hardware::CameraPort;
use crate::mismatch::listed;
use crate::parts::{PartContext, PartError};

/// How far a lens may move what is in a corner before people are told, pixels.
const DISPLACEMENT_PX_MAX: f64 = 2.0;
/// How far the length of a quaternion may be off 1: it is written with three decimals or more.
const LENGTH_OFF_MAX: f64 = 1e-3;

/// What options say of a camera.
#[derive(Debug, Clone, Copy)]
pub(in crate::hardware) struct Known<'a> {
    /// A calibration file.
    pub(in crate::hardware) intrinsics: Option<&'a str>,
    /// Or fx, fy, cx, cy.
    pub(in crate::hardware) intrinsics_px: Option<[f64; 4]>,
    /// Where it stands: x, y, z, and the quaternion x, y, z, w.
    pub(in crate::hardware) pose: Option<[f64; 7]>,
}

/// Intrinsics and pose, as far as they are known.
#[derive(Debug, Clone)]
pub(in crate::hardware) struct Viewpoint {
    /// With where it was written.
    calibration: Option<(String, Calibration)>,
    world_from_camera: Option<Isometry3<f64>>,
}

impl Viewpoint {
    /// Reads what options say.
    ///
    /// # Errors
    /// [`PartError`] naming file or option.
    pub(in crate::hardware) fn read(
        context: &PartContext<'_, CameraPort>,
        known: Known<'_>,
    ) -> Result<Self, PartError> {
        let calibration = match (known.intrinsics, known.intrinsics_px) {
            (Some(_), Some(numbers)) => {
                let expected = "intrinsics or intrinsics_px, not both";
                return Err(context.bad_option("intrinsics_px", expected, listed(numbers)));
            }
            (Some(path), None) => {
                let file = context.path(path).display().to_string();
                let read = parse_calibration(&context.read(path)?);
                Some((file.clone(), read.map_err(|message| PartError::file(file, message))?))
            }
            (None, Some([fx, fy, cx, cy])) => {
                let matrix = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
                let read = Calibration::of_matrix(None, &matrix, Distortion::NONE);
                let read = read.map_err(|_bad| {
                    let expected = "fx, fy, cx, cy with positive focal lengths";
                    context.bad_option("intrinsics_px", expected, format!("{fx}, {fy}, {cx}, {cy}"))
                });
                Some(("camera.options.intrinsics_px".to_owned(), read?))
            }
            (None, None) => None,
        };
        let pose = known.pose.map(|numbers| {
            isometry(numbers).ok_or_else(|| {
                let expected = "x, y, z in metres and a unit quaternion x, y, z, w";
                context.bad_option("pose", expected, listed(numbers))
            })
        });
        Ok(Self { calibration, world_from_camera: pose.transpose()? })
    }

    /// The same with a calibration that came with the frames, where options say none.
    pub(in crate::hardware) fn or_else(mut self, whence: &str, own: Option<Calibration>) -> Self {
        self.calibration = self.calibration.or_else(|| Some((whence.to_owned(), own?)));
        self
    }

    /// The camera model of frames of `size`, where it is known; warns of what is left out.
    ///
    /// # Errors
    /// [`PartError`]: the calibration is of another ratio of width to height.
    pub(in crate::hardware) fn model(
        &self,
        size: [u32; 2],
    ) -> Result<Option<CameraModel>, PartError> {
        let Some((whence, calibration)) = &self.calibration else {
            if self.world_from_camera.is_some() {
                let reason =
                    "camera.options.pose: expected intrinsics beside it, got none".to_owned();
                return Err(PartError::Inputs { reason });
            }
            return Ok(None);
        };
        let wrong = |message| PartError::file(whence.clone(), message);
        let intrinsics: Intrinsics = calibration.at(size).map_err(wrong)?;
        match calibration.displacement_px(size).map_err(wrong)? {
            Some(px) if px <= DISPLACEMENT_PX_MAX => {}
            Some(px) => tracing::warn!(
                "{whence}: the lens moves what is in a corner by up to {px:.1} pixels, and a pinhole is \
                 assumed: rectify the pictures, or volumes near the edges are off by as much"
            ),
            None => tracing::warn!(
                "{whence}: the kind of lens ({}) is not known here, and a pinhole is assumed",
                calibration.distortion.name()
            ),
        }
        let Some(world_from_camera) = self.world_from_camera else {
            tracing::warn!(
                "{whence}: intrinsics without camera.options.pose place nothing: neither is published"
            );
            return Ok(None);
        };
        Ok(Some(CameraModel { intrinsics, world_from_camera }))
    }
}

fn isometry([x, y, z, i, j, k, w]: [f64; 7]) -> Option<Isometry3<f64>> {
    let quaternion = Quaternion::new(w, i, j, k);
    let is_sound = [x, y, z].iter().all(|v| v.is_finite())
        && (quaternion.norm() - 1.0).abs() <= LENGTH_OFF_MAX;
    is_sound.then(|| {
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    })
}
