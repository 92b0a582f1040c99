//! Scene files: which bodies there are and how they are arranged at the start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::shape::{Colour, Shape};

/// Most bodies one scene may have; image ids and the cost of a step are bounded by it.
pub const BODIES_MAX: usize = 64;

/// A scene: its bodies and their arrangement. Written as TOML.
///
/// The world frame has its origin on the table top in front of the middle of the camera, x to the
/// right as the camera sees it, y away from the camera, z up; all lengths are in metres.
///
/// ```
/// let spec: groundloop_sim::SceneSpec = toml::from_str(r##"
///     [[bodies]]
///     name = "red_block"
///     shape = { kind = "block", size_m = 0.05 }
///     colour = "#cc2828"
///
///     [arrangement]
///     kind = "random_stacks"
///     slots_x_m = [-0.12, 0.0, 0.12]
///     stack_height_max = 3
/// "##).unwrap();
/// spec.check().unwrap();
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Every body. Names are unique.
    pub bodies: Vec<BodySpec>,
    /// Where the bodies that can move are at the start.
    pub arrangement: Arrangement,
}

/// One body of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Unique name, for example `red_block`.
    pub name: String,
    /// Shape and size.
    pub shape: Shape,
    /// Surface colour.
    pub colour: Colour,
    /// Where a peg or a board stands: x and y of its middle. Blocks and disks have none: the
    /// arrangement places them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_m: Option<[f64; 2]>,
}

/// How the bodies that can move are placed at the start. Every one of them is placed exactly once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Arrangement {
    /// All blocks in random stacks on slots along x, in one row or several.
    RandomStacks {
        /// The x of each slot.
        slots_x_m: Vec<f64>,
        /// The y of each row of slots; one row at `y_m` when absent.
        #[serde(default)]
        rows_y_m: Vec<f64>,
        /// The y of every slot of the only row; 0 when absent.
        #[serde(default)]
        y_m: f64,
        /// Each stack is moved along y by at most this much; 0 when absent.
        #[serde(default)]
        y_jitter_m: f64,
        /// Most blocks in one stack.
        stack_height_max: usize,
        /// Each block is moved along x and y by at most this much; 1.5 mm when absent.
        #[serde(default = "block_jitter_m")]
        xy_jitter_m: f64,
        /// Each block is turned about z by at most this much; 3 degrees when absent.
        #[serde(default = "block_jitter_deg")]
        yaw_jitter_deg: f64,
    },
    /// All disks on one peg, the largest at the bottom.
    Tower {
        /// Name of the peg.
        peg: String,
    },
    /// Every disk on a random peg, larger disks below smaller ones.
    RandomTowers {},
    /// Explicit stacks on the table and towers on pegs.
    Fixed {
        /// Stacks that stand on the table or on a board.
        #[serde(default)]
        stacks: Vec<FixedStack>,
        /// Disks on pegs.
        #[serde(default)]
        towers: Vec<FixedTower>,
    },
}

/// A stack of bodies at an explicit place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedStack {
    /// The x and y of the stack's axis.
    pub at_m: [f64; 2],
    /// Turn of every body about z, in degrees; 0 when absent.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Names of the bodies from the bottom up.
    pub bodies: Vec<String>,
}

/// Disks on one peg.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedTower {
    /// Name of the peg.
    pub peg: String,
    /// Names of the disks from the bottom up; any order of sizes.
    pub disks: Vec<String>,
}

fn block_jitter_m() -> f64 {
    0.0015
}

fn block_jitter_deg() -> f64 {
    3.0
}

/// Why a scene cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SceneError {
    /// A number of the scene is out of its range.
    #[error("{field} of {of}: expected {min} to {max}, got {got}")]
    BadNumber {
        /// The body or the arrangement.
        of: String,
        /// The field.
        field: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// What was written.
        got: f64,
    },
    /// Two bodies share a name, or a name is empty.
    #[error("body names must be unique and not empty: \"{name}\"")]
    BadName {
        /// The name.
        name: String,
    },
    /// The number of bodies is out of range.
    #[error("expected 1 to {BODIES_MAX} bodies, got {got}")]
    BodyCount {
        /// How many there are.
        got: usize,
    },
    /// A peg or a board has no place.
    #[error("at_m of {name}: a {kind} needs a place, got none")]
    PlaceMissing {
        /// The body.
        name: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A block or a disk has a place of its own.
    #[error("at_m of {name}: a {kind} is placed by the arrangement, so it must not have at_m")]
    PlaceUnexpected {
        /// The body.
        name: String,
        /// Its kind.
        kind: &'static str,
    },
    /// The arrangement names a body that is not in the scene or is of another kind.
    #[error("{field} of the arrangement: expected the name of a {expected}, got \"{name}\"")]
    UnknownBody {
        /// The field.
        field: &'static str,
        /// The kind that is needed.
        expected: &'static str,
        /// The name as written.
        name: String,
    },
    /// A body that can move is placed never or more than once.
    #[error("{name} is placed {times} times by the arrangement, expected once")]
    NotPlacedOnce {
        /// The body.
        name: String,
        /// How often it is placed.
        times: usize,
    },
    /// The slots cannot hold all blocks.
    #[error("{n_blocks} blocks do not fit on {n_slots} slots with stack_height_max {height_max}")]
    TooFewSlots {
        /// Number of blocks.
        n_blocks: usize,
        /// Number of slots.
        n_slots: usize,
        /// Most blocks in one stack.
        height_max: usize,
    },
    /// A random arrangement of disks needs a peg.
    #[error("random_towers needs at least one peg")]
    NoPeg,
    /// Two bodies would be inside each other at the start.
    #[error("{first} and {second} would overlap by {depth_mm:.1} mm")]
    Overlap {
        /// One body.
        first: String,
        /// The other.
        second: String,
        /// How deep, in millimetres.
        depth_mm: f64,
    },
    /// The scene did not come to rest.
    #[error("{name} still moves after {seconds} simulated seconds")]
    Unsettled {
        /// A body that moves.
        name: String,
        /// How long was waited.
        seconds: f64,
    },
}

impl SceneSpec {
    /// Checks everything that can be checked without placing the bodies.
    ///
    /// # Errors
    /// The first [`SceneError`] met, naming the body or the field.
    pub fn check(&self) -> Result<(), SceneError> {
        if self.bodies.is_empty() || self.bodies.len() > BODIES_MAX {
            return Err(SceneError::BodyCount { got: self.bodies.len() });
        }
        for (idx, body) in self.bodies.iter().enumerate() {
            if body.name.is_empty() || self.bodies[..idx].iter().any(|b| b.name == body.name) {
                return Err(SceneError::BadName { name: body.name.clone() });
            }
            body.check()?;
        }
        self.arrangement.check()
    }

    /// Index of the body called `name`.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }
}

impl BodySpec {
    fn check(&self) -> Result<(), SceneError> {
        let length = |field: &'static str, value: f64, min: f64, max: f64| {
            check_number(&self.name, field, value, min, max)
        };
        match self.shape {
            Shape::Block { size_m } => length("size_m", size_m, 0.01, 0.12)?,
            Shape::Disk { outer_radius_m, hole_radius_m, thickness_m } => {
                length("outer_radius_m", outer_radius_m, 0.015, 0.06)?;
                length("hole_radius_m", hole_radius_m, 0.004, outer_radius_m - 0.005)?;
                length("thickness_m", thickness_m, 0.008, 0.06)?;
            }
            Shape::Peg { radius_m, height_m } => {
                length("radius_m", radius_m, 0.003, 0.05)?;
                length("height_m", height_m, 2.0 * radius_m, 0.3)?;
            }
            Shape::Board { size_m } => {
                length("size_m[0]", size_m[0], 0.01, 2.0)?;
                length("size_m[1]", size_m[1], 0.01, 2.0)?;
                length("size_m[2]", size_m[2], 0.002, 0.1)?;
            }
        }
        let kind = self.shape.kind();
        match (self.at_m, self.shape.is_fixed()) {
            (None, true) => Err(SceneError::PlaceMissing { name: self.name.clone(), kind }),
            (Some(_), false) => Err(SceneError::PlaceUnexpected { name: self.name.clone(), kind }),
            (None, false) => Ok(()),
            (Some([x, y]), true) => {
                length("at_m[0]", x, -1.0, 1.0)?;
                length("at_m[1]", y, -1.0, 1.0)
            }
        }
    }
}

impl Arrangement {
    fn check(&self) -> Result<(), SceneError> {
        let number = |field: &'static str, value: f64, min: f64, max: f64| {
            check_number("the arrangement", field, value, min, max)
        };
        match self {
            Self::RandomStacks {
                slots_x_m,
                rows_y_m,
                y_m,
                y_jitter_m,
                xy_jitter_m,
                yaw_jitter_deg,
                ..
            } => {
                slots_x_m.iter().try_for_each(|&x| number("slots_x_m", x, -1.0, 1.0))?;
                rows_y_m.iter().try_for_each(|&y| number("rows_y_m", y, -1.0, 1.0))?;
                number("y_m", *y_m, -1.0, 1.0)?;
                number("y_jitter_m", *y_jitter_m, 0.0, 0.5)?;
                number("xy_jitter_m", *xy_jitter_m, 0.0, 0.005)?;
                number("yaw_jitter_deg", *yaw_jitter_deg, 0.0, 45.0)
            }
            Self::Tower { .. } | Self::RandomTowers {} => Ok(()),
            Self::Fixed { stacks, .. } => stacks.iter().try_for_each(|stack| {
                number("at_m[0]", stack.at_m[0], -1.0, 1.0)?;
                number("at_m[1]", stack.at_m[1], -1.0, 1.0)?;
                number("yaw_deg", stack.yaw_deg, -360.0, 360.0)
            }),
        }
    }
}

/// Checks that `value` is a number from `min` to `max`.
fn check_number(
    of: &str,
    field: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), SceneError> {
    if value >= min && value <= max {
        return Ok(());
    }
    Err(SceneError::BadNumber { of: of.to_owned(), field, min, max, got: value })
}
