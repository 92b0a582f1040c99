//! Physical properties of the table top and everything on it.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// Steps of the physics in one simulated second.
pub const STEPS_PER_SECOND: u64 = 240;

/// Properties of a world that are not part of a scene. [`WorldConfig::tabletop`] is recommended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldConfig {
    /// Density of blocks and disks, in kilograms per cubic metre.
    pub density_kg_m3: f64,
    /// Coulomb friction of blocks; two surfaces in contact use the mean of theirs.
    pub block_friction: f64,
    /// Coulomb friction of disks.
    pub disk_friction: f64,
    /// Coulomb friction of pegs.
    pub peg_friction: f64,
    /// Coulomb friction of the table and of boards.
    pub table_friction: f64,
    /// Where the tool centre point is at the start: metres, world frame.
    pub gripper_home: Point3<f64>,
    /// Where faults may set objects down: lowest and highest x and y of an object's centre, in
    /// metres. It must lie in the camera's view and in the gripper's workspace.
    pub free_area_m: [[f64; 2]; 2],
}

impl WorldConfig {
    /// A table top with light wooden objects, made for [`crate::CameraSpec::frontal`].
    pub fn tabletop() -> Self {
        Self {
            density_kg_m3: 600.0,
            block_friction: 0.6,
            disk_friction: 0.4,
            peg_friction: 0.3,
            table_friction: 0.6,
            gripper_home: Point3::new(0.0, 0.0, 0.55),
            free_area_m: [[-0.34, -0.2], [0.34, 0.16]],
        }
    }
}
