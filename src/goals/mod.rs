//! Where the goal of an episode comes from: a trait, a table, one file per kind.
//!
//! The goal is read once and stays constant; only what the camera shows changes.

pub mod error;
pub mod fixed;
pub mod image;
pub mod language;
pub mod language_model;
pub mod lexicon;
pub mod repair;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

pub use error::{GoalError, Misunderstood, Reason};
pub use language::Language;
pub use repair::{Conflict, Repaired, repaired};

use crate::geometry::PixelBox;
use crate::pddl::{Condition, Domain, Name, Typed};
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{GroundedImage, label_of};
use crate::scene::{Scene, SceneObject};

/// One object that a goal may speak of.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalObject {
    /// Its identity.
    pub name: Name,
    /// Its PDDL type.
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
}

/// A source of goals.
pub trait GoalSource: std::fmt::Debug + Send + Sync {
    /// Reads the goal against a domain and the objects seen so far.
    ///
    /// # Errors
    /// The goal is malformed, contradicts itself or cannot be resolved over these objects;
    /// [`GoalError::may_resolve_later`] tells whether another look could help.
    fn read(&self, domain: &Domain, objects: &[GoalObject]) -> Result<ParsedGoal, GoalError>;

    /// Whether [`read`](Self::read) may be called for every scene. One that takes long is called away
    /// from the loop, once the scene has settled.
    fn is_quick(&self) -> bool {
        true
    }
}

/// Reads the state off an image file, as the camera's frames are read; the error names the file.
pub type Look = Arc<dyn Fn(&Path) -> Result<GroundedImage, String> + Send + Sync>;

/// What a goal source is made from.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct GoalSettings<'a> {
    /// Where the text comes from, for messages ("run.toml: goal").
    pub origin: String,
    /// The goal as the user wrote it.
    pub text: String,
    /// The domain's `language.toml`, where there is one.
    pub language: Option<Language>,
    /// The domain's `perception.toml`, where it is known.
    pub perception: Option<&'a Perception>,
    /// The source's own options, `[goal.options]` of the run file.
    pub options: Option<&'a toml::Table>,
    /// What relative paths in text and options start from.
    pub folder: &'a Path,
    /// Looks up environment variables: keys of services come from there only.
    pub environment: fn(&str) -> Option<String>,
    /// Reads images, where there is a detector with labelled examples.
    pub look: Option<Look>,
}

impl GoalSettings<'_> {
    /// Settings of a goal that needs nothing but words.
    pub fn new(origin: &str, text: &str, language: Option<Language>) -> Self {
        Self {
            origin: origin.to_owned(),
            text: text.to_owned(),
            language,
            perception: None,
            options: None,
            folder: Path::new(""),
            environment: |_| None,
            look: None,
        }
    }

    fn bad_options(&self, message: String) -> GoalError {
        GoalError::Options { origin: self.origin.clone(), message }
    }

    /// Refuses options of a kind that has none.
    fn no_options(&self, kind: &str) -> Result<(), GoalError> {
        match self.options.and_then(|options| options.keys().next()) {
            None => Ok(()),
            Some(key) => Err(self.bad_options(format!(
                "goal.options.{key}: a goal of kind \"{kind}\" has no options"
            ))),
        }
    }
}

/// Makes a goal source.
pub type Build = fn(&GoalSettings<'_>) -> Result<Box<dyn GoalSource>, GoalError>;

/// Every goal source by the `kind` a run file gives, in alphabetical order.
pub const GOALS: &[(&str, Build)] = &[
    ("image", image::build),
    ("instruction", lexicon::build),
    ("language_model", language_model::build),
    ("logical", fixed::build),
];

/// Makes the goal source of that kind.
///
/// # Errors
/// [`GoalError::UnknownKind`] when no source has that name, or what the source itself reports.
pub fn build(kind: &str, settings: &GoalSettings<'_>) -> Result<Box<dyn GoalSource>, GoalError> {
    match GOALS.iter().find(|(name, _)| *name == kind) {
        Some((_, build)) => build(settings),
        None => Err(GoalError::UnknownKind {
            kind: kind.to_owned(),
            known: GOALS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain};

    #[test]
    fn the_table_is_alphabetical_and_every_source_refuses_nonsense() {
        assert!(GOALS.is_sorted_by_key(|(name, _)| *name));
        let domain = SourceText::new("d", "(define (domain d) (:predicates (p ?x)))");
        let domain = parse_domain(&domain).unwrap().value;
        for (name, _) in GOALS {
            let language = Language::from_toml("language.toml", "examples = []").unwrap();
            let settings = GoalSettings::new("run.toml", "(((", Some(language));
            let read = build(name, &settings).and_then(|source| source.read(&domain, &[]));
            assert!(!read.unwrap_err().render().is_empty(), "{name}");
        }
    }

    #[test]
    fn kinds_without_options_refuse_them() {
        let options = "speed = 1".parse().unwrap();
        let settings =
            GoalSettings { options: Some(&options), ..GoalSettings::new("run.toml", "(p)", None) };
        let error = build("logical", &settings).unwrap_err();
        let wanted = "run.toml: goal.options.speed: a goal of kind \"logical\" has no options";
        assert_eq!(error.to_string(), wanted);
    }

    #[test]
    fn an_unknown_kind_lists_the_known_ones() {
        let error = build("wish", &GoalSettings::new("run.toml", "", None)).unwrap_err();
        let wanted = "unknown goal kind \"wish\": expected one of image, instruction, \
                      language_model, logical";
        assert_eq!(error.to_string(), wanted);
    }
}
