//! `[sim]` of a run file: the scene, its cameras, what the world is made of.

use std::collections::BTreeMap;

use groundloop_sim::{CameraSpec, Mount, WorldConfig};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::files::FileRef;
use crate::messages::MAIN_CAMERA;
use crate::parts::PartError;

/// `[sim]` of a run file.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimConfig {
    /// Scene file, below the domain's folder.
    pub scene: String,
    /// The simulated camera.
    pub camera: CameraSpec,
    /// Where the simulated cameras of `[cameras.NAME]` are, by their names.
    #[serde(default)]
    pub cameras: BTreeMap<String, OtherCameraSpec>,
    /// What the world is made of.
    pub world: WorldConfig,
}

/// `[sim.cameras.NAME]`: another simulated camera. What it does not say is as in `[sim.camera]`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherCameraSpec {
    /// Columns of the image.
    pub width: Option<u32>,
    /// Rows of the image.
    pub height: Option<u32>,
    /// Angle of view from the top to the bottom edge of the image, in degrees.
    pub fov_y_deg: Option<f64>,
    /// Position of the camera: metres, world frame.
    #[schemars(with = "[f64; 3]")]
    pub position_m: Point3<f64>,
    /// The point in the middle of the image: metres, world frame.
    #[schemars(with = "[f64; 3]")]
    pub look_at_m: Point3<f64>,
    /// What the camera stands on.
    pub mount: Option<Mount>,
}

impl SimConfig {
    /// Reads `[sim]`; `file` is where it stands.
    ///
    /// # Errors
    /// [`PartError::Options`] naming the key.
    pub fn read(table: Option<&toml::Table>, file: &FileRef) -> Result<Self, PartError> {
        let table = table.cloned().unwrap_or_default();
        table.try_into().map_err(|e: toml::de::Error| PartError::Options {
            file: file.to_string(),
            message: format!("[sim]: {e}"),
        })
    }

    /// Every camera with its name, that of `[sim.camera]` as `main`.
    pub fn every_camera(&self) -> impl Iterator<Item = (String, CameraSpec)> {
        let others = self.cameras.iter().map(|(name, other)| {
            let main = &self.camera;
            let camera = CameraSpec {
                width: other.width.unwrap_or(main.width),
                height: other.height.unwrap_or(main.height),
                fov_y_deg: other.fov_y_deg.unwrap_or(main.fov_y_deg),
                position_m: other.position_m,
                look_at_m: other.look_at_m,
                mount: other.mount.unwrap_or(main.mount),
                ..main.clone()
            };
            (name.clone(), camera)
        });
        std::iter::once((MAIN_CAMERA.to_owned(), self.camera.clone())).chain(others)
    }

    /// The same with another camera in the place of `[sim.camera]`; `None` where there is none of that
    /// name.
    pub fn seen_by(self, name: &str) -> Option<Self> {
        let (_, camera) = self.every_camera().find(|(camera, _)| camera == name)?;
        Some(Self { camera, ..self })
    }

    /// Where a camera stands in a run file.
    pub fn key_of(camera: &str) -> String {
        if camera == MAIN_CAMERA {
            return "sim.camera".to_owned();
        }
        format!("sim.cameras.{camera}")
    }
}
