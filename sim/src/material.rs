//! What bodies are made of: friction, density and gloss by name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene_error::{SceneError, check_number};

/// What a body is made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Coulomb friction; two surfaces in contact use the mean of theirs.
    pub friction: f64,
    /// Density, in kilograms per cubic metre.
    pub density_kg_m3: f64,
    /// Brightness of the reflection of the key light, as a share of the light: 0 is dull.
    #[serde(default = "usual_gloss")]
    pub gloss: f64,
    /// How small that reflection is: the exponent of Blinn's model; 10 is rough, 100 polished.
    #[serde(default = "usual_polish")]
    pub polish: u8,
}

/// Gloss and polish of what says nothing of a material.
pub(crate) const USUAL_GLOSS: f64 = 0.16;
pub(crate) const USUAL_POLISH: u8 = 36;

fn usual_gloss() -> f64 {
    USUAL_GLOSS
}

fn usual_polish() -> u8 {
    USUAL_POLISH
}

/// The materials that every scene knows, by name, in alphabetical order. Rounded values of common
/// tables; `docs/scenes.md` lists them.
pub const MATERIALS: &[(&str, Material)] = &[
    ("cardboard", of(0.5, 250.0, 0.04, 12)),
    ("ceramic", of(0.45, 2300.0, 0.34, 80)),
    ("foam", of(0.7, 60.0, 0.03, 10)),
    ("metal", of(0.35, 2700.0, 0.42, 60)),
    ("plastic", of(0.4, 1050.0, 0.28, 50)),
    ("rubber", of(0.9, 1200.0, 0.06, 14)),
    ("wood", of(0.6, 600.0, USUAL_GLOSS, USUAL_POLISH)),
];

const fn of(friction: f64, density_kg_m3: f64, gloss: f64, polish: u8) -> Material {
    Material { friction, density_kg_m3, gloss, polish }
}

impl Material {
    /// Checks its numbers; `name` is for the message.
    pub(crate) fn check(&self, name: &str) -> Result<(), SceneError> {
        let of = format!("material {name}");
        check_number(&of, "friction", self.friction, 0.0, 2.0)?;
        check_number(&of, "density_kg_m3", self.density_kg_m3, 10.0, 20_000.0)?;
        check_number(&of, "gloss", self.gloss, 0.0, 1.0)?;
        check_number(&of, "polish", f64::from(self.polish), 1.0, 255.0)
    }
}
