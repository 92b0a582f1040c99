//! The pinhole camera: where it is, what it sees, its noise and the light.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A pinhole camera without distortion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// Angle of view from the top to the bottom edge of the image, in degrees.
    pub fov_y_deg: f64,
    /// Position of the camera: metres, world frame.
    #[schemars(with = "[f64; 3]")]
    pub position_m: Point3<f64>,
    /// The point in the middle of the image: metres, world frame.
    #[schemars(with = "[f64; 3]")]
    pub look_at_m: Point3<f64>,
    /// What the camera stands on.
    pub mount: Mount,
    /// Colour samples along each side of a pixel: 1 for speed, 2 or 3 for smooth edges. Depth and
    /// ids are sampled at the pixel's centre in any case.
    pub samples: u32,
    /// Noise of the sensor.
    pub noise: NoiseSpec,
    /// The key light.
    pub light: LightSpec,
}

/// What a camera stands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// A fixed stand.
    Stand,
    /// The carriage that takes the gripper along x and y: the camera goes with it, but not up and down
    /// with the gripper. Its position is the one at x = 0, y = 0.
    Carriage,
}

/// Noise of the sensor, normally distributed and independent from pixel to pixel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSpec {
    /// Standard deviation of each colour channel, in steps of 1/255; 0 for none, 20 at most.
    pub rgb_sigma: f64,
    /// Standard deviation of depth, in metres; 0 for none, 0.05 at most.
    pub depth_sigma_m: f64,
}

/// The key light; its values are drawn from these ranges with `seed` and do not flicker.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightSpec {
    /// Seed of the draw.
    pub seed: u64,
    /// Lowest and highest intensity; 1 is usual, 0.2 to 3 is allowed.
    pub intensity: [f64; 2],
    /// Lowest and highest direction the light comes from, in degrees from x towards y: -90 is from
    /// the camera's side, -180 from the left.
    pub azimuth_deg: [f64; 2],
    /// Lowest and highest height of the light above the table, in degrees, 20 to 90.
    pub elevation_deg: [f64; 2],
}

/// The camera's matrix K in pixels: `u = fx x / z + cx`, `v = fy y / z + cy` for a point in the
/// camera frame (x right, y down, z forward); pixel (0, 0) is the centre of the top left pixel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Focal length along columns.
    pub fx: f64,
    /// Focal length along rows.
    pub fy: f64,
    /// Column of the optical axis.
    pub cx: f64,
    /// Row of the optical axis.
    pub cy: f64,
}

/// Why a camera cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("camera: expected {field} from {min} to {max}, got {got}")]
pub struct CameraError {
    /// The field.
    pub field: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// The value as given.
    pub got: f64,
}

impl CameraSpec {
    /// Checks every number.
    ///
    /// # Errors
    /// [`CameraError`] with the first field that is out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        let within = |field, got: f64, min: f64, max: f64| {
            if got >= min && got <= max {
                Ok(())
            } else {
                Err(CameraError { field, min, max, got })
            }
        };
        within("width", f64::from(self.width), 8.0, 4096.0)?;
        within("height", f64::from(self.height), 8.0, 4096.0)?;
        within("samples", f64::from(self.samples), 1.0, 4.0)?;
        within("fov_y_deg", self.fov_y_deg, 5.0, 120.0)?;
        for coordinate in self.position_m.iter().chain(self.look_at_m.iter()) {
            within("position_m and look_at_m", *coordinate, -10.0, 10.0)?;
        }
        let distance = (self.look_at_m - self.position_m).norm();
        within("distance from position_m to look_at_m", distance, 0.01, 40.0)?;
        within("noise.rgb_sigma", self.noise.rgb_sigma, 0.0, 20.0)?;
        within("noise.depth_sigma_m", self.noise.depth_sigma_m, 0.0, 0.05)?;
        let light = &self.light;
        for k in 0..2 {
            within("light.intensity", light.intensity[k], 0.2, 3.0)?;
            within("light.azimuth_deg", light.azimuth_deg[k], -360.0, 360.0)?;
            within("light.elevation_deg", light.elevation_deg[k], 20.0, 90.0)?;
        }
        Ok(())
    }

    /// The camera as it stands while the gripper is at a place: metres, world frame.
    #[must_use]
    pub fn with_gripper_at(&self, gripper: Point3<f64>) -> Self {
        let shift = match self.mount {
            Mount::Stand => Vector3::zeros(),
            Mount::Carriage => Vector3::new(gripper.x, gripper.y, 0.0),
        };
        let (position_m, look_at_m) = (self.position_m + shift, self.look_at_m + shift);
        Self { position_m, look_at_m, ..self.clone() }
    }

    /// The camera's matrix.
    pub fn intrinsics(&self) -> Intrinsics {
        let f = 0.5 * f64::from(self.height) / (0.5 * self.fov_y_deg.to_radians()).tan();
        let centre = |n: u32| 0.5 * (f64::from(n) - 1.0);
        Intrinsics { fx: f, fy: f, cx: centre(self.width), cy: centre(self.height) }
    }

    /// Pose of the camera frame (x right, y down, z forward along the optical axis) in the world.
    pub fn world_from_camera(&self) -> Isometry3<f64> {
        let forward = (self.look_at_m - self.position_m).normalize();
        let sideways = forward.cross(&Vector3::z());
        // Looking straight down, the world's y points up in the image.
        let right = sideways.try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let down = forward.cross(&right);
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]));
        Isometry3::from_parts(
            Translation3::from(self.position_m.coords),
            UnitQuaternion::from_rotation_matrix(&axes),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Low and frontal, so that the fronts and tops of blocks are visible.
    fn frontal(width: u32, height: u32) -> CameraSpec {
        let file: toml::Table = include_str!("../tests/data/tabletop.toml").parse().unwrap();
        CameraSpec { width, height, ..file["camera"].clone().try_into().unwrap() }
    }

    #[test]
    fn the_middle_of_the_image_is_the_point_looked_at() {
        let spec = frontal(640, 480);
        let seen = spec.world_from_camera().inverse() * spec.look_at_m;
        assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && seen.z > 0.0);
        let right = spec.world_from_camera() * Vector3::x();
        assert!((right - Vector3::x()).norm() < 1e-12, "x is to the right: {right}");
        let down = spec.world_from_camera() * Vector3::y();
        assert!(down.z < -0.9, "{down}");
    }

    #[test]
    fn a_camera_that_looks_straight_down_has_a_frame() {
        let mut spec = frontal(64, 48);
        spec.position_m = Point3::new(0.0, 0.0, 1.0);
        spec.look_at_m = Point3::origin();
        let frame = spec.world_from_camera();
        assert!((frame * Vector3::z() + Vector3::z()).norm() < 1e-9);
        assert!((frame * Vector3::y() + Vector3::y()).norm() < 1e-9);
    }

    #[test]
    fn a_camera_on_the_carriage_goes_along_and_not_down() {
        let stand = frontal(64, 48);
        let gripper = Point3::new(0.2, -0.1, 0.03);
        assert_eq!(stand.with_gripper_at(gripper), stand);
        let carried = CameraSpec { mount: Mount::Carriage, ..stand.clone() };
        let moved = carried.with_gripper_at(gripper);
        let shift = Vector3::new(0.2, -0.1, 0.0);
        assert!((moved.position_m - stand.position_m - shift).norm() < 1e-12, "{moved:?}");
        assert!((moved.look_at_m - stand.look_at_m - shift).norm() < 1e-12, "{moved:?}");
        assert_eq!(carried.with_gripper_at(Point3::new(0.0, 0.0, 0.5)), carried);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        let mut spec = frontal(640, 480);
        spec.fov_y_deg = f64::NAN;
        assert_eq!(spec.check().unwrap_err().field, "fov_y_deg");
        spec = frontal(640, 5);
        assert_eq!(spec.check().unwrap_err().field, "height");
    }
}
