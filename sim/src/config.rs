//! Physical properties of the table top and everything on it.

use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Steps of the physics in one simulated second.
pub const STEPS_PER_SECOND: u64 = 240;

/// What holds an object between the closed fingers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grasp {
    /// The object is joined to the gripper, and the fingers meet nothing.
    Weld,
    /// Friction alone: the fingers collide with what they meet and press with some ten newtons.
    Friction,
}

/// Properties of a world that are not part of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// What holds an object between the closed fingers: `weld` joins it to the gripper, `friction`
    /// leaves it to the pads of fingers that collide.
    pub grasp: Grasp,
    /// Where the tool centre point is at the start: metres, world frame.
    #[schemars(with = "[f64; 3]")]
    pub gripper_home: Point3<f64>,
    /// Where faults may set objects down: lowest and highest x and y of an object's centre, in
    /// metres. It must lie in the camera's view and in the gripper's workspace.
    pub free_area_m: [[f64; 2]; 2],
}
