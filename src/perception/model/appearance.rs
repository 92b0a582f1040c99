//! How objects of a type look: the `[[type]]` tables of `perception.toml`.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{PerceptionError, value, with_hint};
use crate::pddl::Name;

/// One visible type, for the detectors.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TypeSpec {
    /// One of the domain's types; each at most once.
    pub name: Name,
    /// What an open-vocabulary detector is asked for.
    pub prompt: Option<String>,
    /// Colour names that such objects have; keys of `[colours]`.
    #[serde(default)]
    pub colours: Vec<Name>,
    /// The outline that the colour detector looks for; without it, colours do not tell such
    /// objects.
    pub appearance: Option<Appearance>,
    /// How deep an object is, since a camera sees its front only.
    #[serde(default)]
    pub depth: DepthRule,
    /// How detections become named objects.
    pub naming: Naming,
}

/// What the visible part of an object of one type looks like.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Appearance {
    /// The outline.
    pub shape: Shape,
    /// Least and greatest width, as a share of the image height.
    pub width: [f64; 2],
    /// Least and greatest height, as a share of the image height.
    pub height: [f64; 2],
    /// Least and greatest width divided by height.
    pub aspect: [f64; 2],
    /// Least share of the box that the object's own pixels fill.
    pub fill_min: f64,
    /// Specks narrower or lower than this (width, height; shares of the image height) vanish.
    pub open: [f64; 2],
    /// Holes and cracks narrower or lower than this (as above) are closed.
    pub close: [f64; 2],
}

/// An outline in the image.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub enum Shape {
    /// One connected patch.
    Patch {
        /// Cut a patch where its outline has a waist: round objects of one colour that touch.
        split_waists: bool,
    },
    /// One connected patch that is never cut: something wide and flat on which others stand, such as a
    /// tray. Their outlines in it would else be taken for edges between several bodies.
    Plate {},
    /// An upright bar that may stand on a wide base of the same colour. Its pieces above and
    /// below something in front of it count as one.
    Post {
        /// Whatever is at least this wide (share of the image height) is base, not post.
        base_width_min: f64,
    },
}

/// How the hidden depth of an object is guessed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DepthRule {
    /// As deep as it is wide.
    #[default]
    AsWide,
    /// As deep as what is seen of it reaches, from its lower front edge to the upper back one: for flat
    /// things whose top is seen, such as trays.
    AsSeen,
}

/// How detections of one type become named objects.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Naming {
    /// Which of several detections is named first.
    pub order: Order,
    /// A name with `{colour}` (the detector's label) and `{type}` replaced; the second of a name
    /// gets a `2`, and so on.
    pub template: String,
    /// Names given in order when there are exactly as many detections; replaces the template.
    #[serde(default)]
    pub list: Vec<Name>,
}

/// An order over detections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// By the box's centre column.
    LeftToRight,
    /// By width, smallest first.
    NarrowFirst,
    /// By the box's centre row.
    TopToBottom,
}

/// A colour in sRGB, written `"#rrggbb"`.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(try_from = "String", into = "String")]
pub struct Srgb(pub [u8; 3]);

impl TryFrom<String> for Srgb {
    type Error = PerceptionError;

    fn try_from(text: String) -> Result<Self, PerceptionError> {
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6);
        match digits.and_then(|d| u32::from_str_radix(d, 16).ok()) {
            Some(v) => Ok(Self([(v >> 16) as u8, (v >> 8) as u8, v as u8])),
            None => Err(PerceptionError::Colour { text }),
        }
    }
}

impl From<Srgb> for String {
    fn from(colour: Srgb) -> Self {
        colour.to_string()
    }
}

impl fmt::Display for Srgb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.0;
        write!(f, "#{r:02x}{g:02x}{b:02x}")
    }
}

impl TypeSpec {
    /// Checks the type by itself and against the colours that `[colours]` describes.
    pub(super) fn check(&self, shades: &BTreeMap<Name, Vec<Srgb>>) -> Result<(), PerceptionError> {
        for colour in &self.colours {
            if shades.get(colour).is_none_or(Vec::is_empty) {
                let field = format!("type.{}.colours", self.name);
                let known = shades.keys().map(Name::as_str);
                let got = with_hint(colour.as_str(), known);
                return Err(value(field, "colours that [colours] describes", got));
            }
        }
        self.appearance.as_ref().map_or(Ok(()), |appearance| {
            appearance.check(&|key: &str| format!("type.{}.appearance.{key}", self.name))
        })
    }
}

impl Appearance {
    fn check(&self, field: &dyn Fn(&str) -> String) -> Result<(), PerceptionError> {
        for (key, [low, high]) in
            [("width", self.width), ("height", self.height), ("aspect", self.aspect)]
        {
            if !(low >= 0.0 && high.is_finite() && low <= high) {
                let got = format!("[{low}, {high}]");
                return Err(value(field(key), "[least, greatest], not negative", got));
            }
        }
        for (key, [x, y]) in [("open", self.open), ("close", self.close)] {
            if !((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)) {
                return Err(value(field(key), "two shares in 0..=1", format!("[{x}, {y}]")));
            }
        }
        if !(0.0..=1.0).contains(&self.fill_min) {
            return Err(value(field("fill_min"), "a share in 0..=1", self.fill_min));
        }
        match self.shape {
            Shape::Patch { .. } | Shape::Plate {} => Ok(()),
            Shape::Post { base_width_min } if base_width_min > 0.0 && base_width_min <= 1.0 => {
                Ok(())
            }
            Shape::Post { base_width_min } => {
                Err(value(field("shape.base_width_min"), "a share above 0", base_width_min))
            }
        }
    }
}
