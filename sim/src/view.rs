//! What a stage of drawing looks from and works with.

use nalgebra::Isometry3;

use crate::camera::{CameraSpec, Intrinsics};
use crate::light::{Gamma, Light};
use crate::mesh::Meshes;

/// Texels along each side of the shadow map, for one colour sample.
const SHADOW_SIZE: usize = 512;

/// A camera with its light at a resolution.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) intrinsics: Intrinsics,
    pub(crate) world_from_camera: Isometry3<f64>,
    pub(crate) light: Light,
    pub(crate) shadow_size: usize,
}

impl View {
    /// The camera with `samples` samples along each side of its pixels.
    pub(crate) fn of(camera: &CameraSpec, samples: u32) -> Self {
        let k = camera.intrinsics();
        let n = f64::from(samples);
        let centre = |c: f64| n * c + 0.5 * (n - 1.0);
        Self {
            width: (camera.width * samples) as usize,
            height: (camera.height * samples) as usize,
            intrinsics: Intrinsics {
                fx: n * k.fx,
                fy: n * k.fy,
                cx: centre(k.cx),
                cy: centre(k.cy),
            },
            world_from_camera: camera.world_from_camera(),
            light: Light::of(&camera.light),
            shadow_size: SHADOW_SIZE * if samples > 1 { 2 } else { 1 },
        }
    }
}

/// What every stage needs.
pub(crate) struct Tools<'a> {
    pub(crate) gamma: &'a Gamma,
    pub(crate) meshes: &'a mut Meshes,
}
