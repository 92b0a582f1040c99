//! Scene files: which bodies there are and how they are arranged at the start.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body_spec::BodySpec;
use crate::material::{MATERIALS, Material};
use crate::scene_error::{BODIES_MAX, SceneError, check_number};

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
    /// Materials of this scene by name, besides those that every scene knows; one of the same name
    /// takes its place.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, Material>,
}

/// How the bodies that can move are placed at the start. Every one of them is placed exactly once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Arrangement {
    /// All bodies in random stacks on slots along x, in one row or several; in a stack of other
    /// bodies than blocks the wider ones are below.
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
    /// Every body at a random free place, on the table or on what is fixed there.
    Scattered {
        /// Where middles of bodies may be: the lowest and the highest x and y of each area. Each body
        /// takes one of them at random.
        areas_m: Vec<[[f64; 2]; 2]>,
        /// Room kept around a body; 30 mm when absent.
        #[serde(default = "clearance_m")]
        clearance_m: f64,
        /// Each body is turned about z by at most this much; 3 degrees when absent.
        #[serde(default = "block_jitter_deg")]
        yaw_jitter_deg: f64,
    },
    /// Explicit stacks on the table and towers on pegs.
    Fixed {
        /// Stacks that stand on the table or on what is fixed there.
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

fn clearance_m() -> f64 {
    0.03
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
            self.material_of(body)?;
        }
        for (name, material) in &self.materials {
            material.check(name)?;
        }
        self.arrangement.check()
    }

    /// What a body is made of; `None` when it does not say.
    ///
    /// # Errors
    /// [`SceneError::UnknownMaterial`].
    pub(crate) fn material_of(&self, body: &BodySpec) -> Result<Option<Material>, SceneError> {
        let Some(wanted) = &body.material else { return Ok(None) };
        let shipped = MATERIALS.iter().find(|(name, _)| name == wanted);
        let found = self.materials.get(wanted).or(shipped.map(|(_, material)| material));
        found.copied().map(Some).ok_or_else(|| {
            let shipped = MATERIALS.iter().map(|(name, _)| *name);
            let own = self.materials.keys().map(String::as_str);
            let known = shipped.chain(own).collect::<Vec<_>>().join(", ");
            SceneError::UnknownMaterial { name: body.name.clone(), known, got: wanted.clone() }
        })
    }

    /// Index of the body called `name`.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
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
            Self::Scattered { areas_m, clearance_m, yaw_jitter_deg } => {
                for [low, high] in areas_m {
                    for value in low.iter().chain(high) {
                        number("areas_m", *value, -1.0, 1.0)?;
                    }
                }
                let is_area = |[low, high]: &[[f64; 2]; 2]| (0..2).all(|k| low[k] <= high[k]);
                if areas_m.is_empty() || !areas_m.iter().all(is_area) {
                    return Err(SceneError::BadArea);
                }
                number("clearance_m", *clearance_m, 0.0, 0.3)?;
                number("yaw_jitter_deg", *yaw_jitter_deg, 0.0, 180.0)
            }
            Self::Fixed { stacks, .. } => stacks.iter().try_for_each(|stack| {
                number("at_m[0]", stack.at_m[0], -1.0, 1.0)?;
                number("at_m[1]", stack.at_m[1], -1.0, 1.0)?;
                number("yaw_deg", stack.yaw_deg, -360.0, 360.0)
            }),
        }
    }
}
