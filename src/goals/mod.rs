//! Where the goal of an episode comes from: a trait, a table, one file per kind.
//!
//! The goal is read once and stays constant; only what the camera shows changes.

pub mod error;
pub mod logical;
pub mod image;
pub mod language;
pub mod language_model;
pub mod instruction;
pub mod repair;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

pub use error::{GoalError, Misunderstood, Reason, Unsupported};
pub use language::{Language, english};
pub use repair::{Conflict, Repaired, repaired};

use crate::geometry::PixelBox;
use crate::logic::Facts;
use crate::parts::{Registry, Role};
use crate::pddl::{Condition, Domain, Name, Typed};
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{GroundedImage, label_of};
use crate::scene::{Scene, SceneObject};

/// One object that a goal may speak of.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalObject {
    /// Its identity.
    pub name: Name,
    /// One of the domain's types.
    pub type_name: Name,
    /// Its colour name, where the detector gives one.
    pub colour: Option<Name>,
    /// Where it is in the image; words such as "rightmost" are resolved over these boxes.
    pub pixel_box: Option<PixelBox>,
}

impl GoalObject {
    /// An object whose name may tell its colour, by the rules of its type.
    pub fn new(
        perception: &Perception,
        name: Name,
        type_name: Name,
        pixel_box: Option<PixelBox>,
    ) -> Self {
        let spec = perception.type_spec(&type_name);
        let colour = spec.and_then(|spec| label_of(spec, &name).cloned());
        Self { name, type_name, colour, pixel_box }
    }

    /// What an image shows, and what is there without being seen.
    pub fn of_image(perception: &Perception, seen: &[ObjectBox]) -> Vec<Self> {
        let seen = seen.iter().map(|o| (&o.name, &o.type_name, Some(o.pixel_box)));
        let implied = perception.implied.iter().map(|o| (&o.name, &o.type_name, None));
        let new = |(name, type_name, pixel_box): (&Name, &Name, _)| {
            Self::new(perception, name.clone(), type_name.clone(), pixel_box)
        };
        seen.chain(implied).map(new).collect()
    }

    /// What a scene knows.
    pub fn of_scene(perception: &Perception, scene: &Scene) -> Vec<Self> {
        let new = |o: &SceneObject| {
            Self::new(perception, o.name.clone(), o.type_name.clone(), o.pixel_box)
        };
        scene.objects.iter().map(new).collect()
    }
}

/// What a phrase of the goal stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Referent {
    /// One object, seen or expected.
    Object(Name),
    /// Several objects that the words single out ("the red disks").
    Several(Vec<Name>),
    /// Every object of a type, also those that have not been seen.
    Every(Name),
}

/// One phrase of the goal that names an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Phrase {
    /// The words as they were written.
    pub text: String,
    /// Their place in the goal's text, in bytes.
    pub span: Range<usize>,
    /// What they stand for.
    pub means: Referent,
}

/// A goal, understood.
#[derive(Debug, Clone, PartialEq)]
pub struct ParsedGoal {
    /// The goal condition; its objects are seen ones or listed in `expected`.
    pub goal: Condition,
    /// The phrases that name objects, in the order of the text; none for a logical goal.
    pub phrases: Vec<Phrase>,
    /// Objects that the goal names and nothing has shown yet, in order of mention.
    pub expected: Vec<Typed>,
    /// Remarks for people: what was assumed or ignored.
    pub notes: Vec<String>,
    /// The goal told back in the domain's words, one clause each; none where the source has no words.
    pub said: Vec<String>,
}

/// What a goal is read against: descriptions such as "the block on the red one" are looked up here.
#[derive(Debug, Clone, Copy)]
pub struct GoalView<'a> {
    /// The objects seen so far.
    pub objects: &'a [GoalObject],
    /// What holds between them; `None` where nobody knows.
    pub facts: Option<&'a Facts>,
}

impl<'a> From<&'a [GoalObject]> for GoalView<'a> {
    fn from(objects: &'a [GoalObject]) -> Self {
        Self { objects, facts: None }
    }
}

/// Reads what a user wrote, or a picture, as a goal condition over the objects that are seen.
pub trait GoalSource: std::fmt::Debug + Send + Sync {
    /// Reads the goal against a domain and what is seen so far.
    ///
    /// # Errors
    /// The goal is malformed, contradicts itself or cannot be resolved over these objects;
    /// [`GoalError::may_resolve_later`] tells whether another look could help.
    fn read_in(&self, domain: &Domain, view: GoalView<'_>) -> Result<ParsedGoal, GoalError>;

    /// The same where objects are all that is known.
    ///
    /// # Errors
    /// See [`read_in`](Self::read_in).
    fn read(&self, domain: &Domain, objects: &[GoalObject]) -> Result<ParsedGoal, GoalError> {
        self.read_in(domain, objects.into())
    }

    /// Whether [`read_in`](Self::read_in) may be called for every scene. One that takes long is called away
    /// from the loop, once the scene has settled.
    fn is_quick(&self) -> bool {
        true
    }
}

/// Reads the state off an image file, as the camera's frames are read; the error names the file.
pub type ReadImage = Arc<dyn Fn(&Path) -> Result<GroundedImage, String> + Send + Sync>;

/// What goal sources are made from.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct GoalInputs<'a> {
    /// Where the text comes from, for messages ("run.toml: goal").
    pub origin: &'a str,
    /// The goal as the user wrote it.
    pub text: &'a str,
    /// The domain's `language.toml`, where there is one.
    pub language: Option<&'a Language>,
    /// The domain's `perception.toml`, where it is known.
    pub perception: Option<&'a Perception>,
    /// Reads images, where there is a detector with labelled examples.
    pub read_image: Option<ReadImage>,
}

impl<'a> GoalInputs<'a> {
    /// For a goal that needs nothing but words.
    pub fn words(origin: &'a str, text: &'a str, language: Option<&'a Language>) -> Self {
        Self { origin, text, language, perception: None, read_image: None }
    }
}

impl Role for dyn GoalSource {
    type Inputs<'a> = GoalInputs<'a>;
    const NAME: &'static str = "goal";
    const KEY: &'static str = "goal.kind";
    const OPTIONS: &'static str = "goal.options";
}

/// Every goal source by the `kind` a run file gives, in alphabetical order.
pub static GOALS: Registry<dyn GoalSource> =
    Registry(&[image::PART, instruction::PART, language_model::PART, logical::PART]);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::{PartChoice, PartContext};
    use crate::pddl::{SourceText, parse_domain};

    #[test]
    fn every_source_refuses_nonsense() {
        let domain = SourceText::new("d", "(define (domain d) (:predicates (p ?x)))");
        let domain = parse_domain(&domain).unwrap().value;
        let language = Language::from_toml("language.toml", "examples = []").unwrap();
        for name in GOALS.names() {
            let choice = PartChoice::new("goal.kind", name);
            let inputs = GoalInputs::words("run.toml", "(((", Some(&language));
            let context = PartContext { choice: &choice, inputs, environment: |_| None };
            let read = GOALS.build(&context).map_err(GoalError::from);
            let read = read.and_then(|source| source.read(&domain, &[]));
            assert!(!read.unwrap_err().render().is_empty(), "{name}");
        }
    }
}
