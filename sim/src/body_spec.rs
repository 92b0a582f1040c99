//! One body of a scene: shape, colour, type, material, and whether it is fixed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene_error::{SceneError, check_number};
use crate::shape::{Colour, Shape};
use crate::solid::ShapePart;

/// Most parts of a compound: each costs when something touches it.
const PARTS_MAX: usize = 32;

/// The type of a body that is no object of the task.
pub const SCENERY: &str = "scenery";

/// One body of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Unique name, for example `red_block`.
    pub name: String,
    /// Its type in the domain, or `scenery` for what is no object of the task. Without the key the
    /// shape's kind; a board whose kind the domain does not know is scenery.
    #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
    pub type_name: Option<String>,
    /// Shape and size.
    pub shape: Shape,
    /// Surface colour.
    pub colour: Colour,
    /// What it is made of: a name of `[materials]`, or one that every scene knows. Without the key
    /// what `[sim.world]` of the run file says for its shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Whether it never moves. Without the key pegs and boards do not, and all others can.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed: Option<bool>,
    /// Where a body that is fixed stands: x and y of its middle. What can move has none: the
    /// arrangement places it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_m: Option<[f64; 2]>,
}

impl BodySpec {
    /// A body that says nothing but what it must.
    pub fn new(name: impl Into<String>, shape: Shape, colour: Colour) -> Self {
        let (type_name, material, fixed, at_m) = (None, None, None, None);
        Self { name: name.into(), type_name, shape, colour, material, fixed, at_m }
    }

    /// Whether it never moves.
    pub fn is_fixed(&self) -> bool {
        self.fixed.unwrap_or_else(|| self.shape.is_usually_fixed())
    }

    /// Its type in the domain: what it says, or the shape's kind.
    pub fn type_name(&self) -> &str {
        self.type_name.as_deref().unwrap_or_else(|| self.shape.kind())
    }

    /// Whether it is no object of the task: it says so, or is a board that says nothing where
    /// `is_type` knows no boards.
    pub fn is_scenery(&self, is_type: impl Fn(&str) -> bool) -> bool {
        match &self.type_name {
            Some(type_name) => type_name == SCENERY,
            None => matches!(self.shape, Shape::Board { .. }) && !is_type(self.shape.kind()),
        }
    }

    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let name = || self.name.clone();
        let kind = self.shape.kind();
        if self.type_name.as_ref().is_some_and(String::is_empty) {
            return Err(SceneError::BadType { name: name() });
        }
        self.check_shape()?;
        match (self.at_m, self.is_fixed()) {
            (_, false) if matches!(self.shape, Shape::Peg { .. }) => {
                Err(SceneError::CannotMove { name: name(), kind })
            }
            (None, true) => Err(SceneError::PlaceMissing { name: name(), kind }),
            (Some(_), false) => Err(SceneError::PlaceUnexpected { name: name(), kind }),
            (None, false) => Ok(()),
            (Some([x, y]), true) => {
                self.number("at_m[0]", x, -1.0, 1.0)?;
                self.number("at_m[1]", y, -1.0, 1.0)
            }
        }
    }

    fn number(
        &self,
        field: &'static str,
        value: f64,
        min: f64,
        max: f64,
    ) -> Result<(), SceneError> {
        check_number(&self.name, field, value, min, max)
    }

    fn check_shape(&self) -> Result<(), SceneError> {
        match &self.shape {
            Shape::Block { size_m } => self.number("size_m", *size_m, 0.01, 0.12),
            Shape::Disk { outer_radius_m, hole_radius_m, thickness_m } => {
                self.number("outer_radius_m", *outer_radius_m, 0.015, 0.06)?;
                self.number("hole_radius_m", *hole_radius_m, 0.004, outer_radius_m - 0.005)?;
                self.number("thickness_m", *thickness_m, 0.008, 0.06)
            }
            Shape::Peg { radius_m, height_m } => {
                self.number("radius_m", *radius_m, 0.003, 0.05)?;
                self.number("height_m", *height_m, 2.0 * radius_m, 0.3)
            }
            Shape::Board { size_m } => {
                self.number("size_m[0]", size_m[0], 0.01, 2.0)?;
                self.number("size_m[1]", size_m[1], 0.01, 2.0)?;
                self.number("size_m[2]", size_m[2], 0.002, 0.1)
            }
            Shape::Box { size_m } => {
                self.number("size_m[0]", size_m[0], 0.01, 0.6)?;
                self.number("size_m[1]", size_m[1], 0.01, 0.6)?;
                self.number("size_m[2]", size_m[2], 0.01, 0.3)
            }
            Shape::Cylinder { radius_m, height_m } => {
                self.number("radius_m", *radius_m, 0.005, 0.3)?;
                self.number("height_m", *height_m, 0.01, 0.3)
            }
            Shape::Tube { outer_radius_m, inner_radius_m, height_m } => {
                self.number("outer_radius_m", *outer_radius_m, 0.01, 0.3)?;
                self.number("inner_radius_m", *inner_radius_m, 0.004, outer_radius_m - 0.003)?;
                self.number("height_m", *height_m, 0.008, 0.3)
            }
            Shape::Compound { parts } => self.check_parts(parts),
        }
    }

    fn check_parts(&self, parts: &[ShapePart]) -> Result<(), SceneError> {
        if parts.is_empty() || parts.len() > PARTS_MAX {
            let (name, max, got) = (self.name.clone(), PARTS_MAX, parts.len());
            return Err(SceneError::PartCount { name, max, got });
        }
        for part in parts {
            let at_m = match part {
                ShapePart::Box { size_m, at_m } => {
                    size_m.iter().try_for_each(|&v| self.number("parts.size_m", v, 0.002, 0.6))?;
                    at_m
                }
                ShapePart::Cylinder { radius_m, height_m, at_m } => {
                    self.number("parts.radius_m", *radius_m, 0.001, 0.3)?;
                    self.number("parts.height_m", *height_m, 0.002, 0.3)?;
                    at_m
                }
            };
            at_m.iter().try_for_each(|&v| self.number("parts.at_m", v, -0.5, 0.5))?;
        }
        let size = self.shape.size_m();
        self.number("extent of parts along x", size.x, 0.01, 0.6)?;
        self.number("extent of parts along y", size.y, 0.01, 0.6)?;
        self.number("height of parts", size.z, 0.008, 0.3)
    }
}
