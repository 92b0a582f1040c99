//! One thing that a domain folder lacks.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use crate::files::FileRef;
use crate::settings::SettingsProblem;

/// One thing that a domain folder lacks, or that contradicts another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DomainFinding {
    /// What kind of thing.
    pub kind: DomainFindingKind,
    /// The file to change, with line and column where there is one.
    pub file: String,
    /// The field in it.
    pub field: String,
    /// What is wrong, and what to change.
    pub message: String,
}

/// What kind of thing a domain folder lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DomainFindingKind {
    /// A file is missing, or not of its form, or names what is not in the domain.
    Unreadable,
    /// A type of which nothing says how it looks.
    TypeWithoutLook,
    /// A type that no simulated scene has a body of.
    TypeWithoutBody,
    /// A predicate that is neither observed, proprioceptive nor completed.
    PredicateWithoutSource,
    /// A completed predicate without a rule.
    CompletedWithoutRule,
    /// An action without skills.
    ActionWithoutSkill,
    /// Words of `language.toml` that mean nothing.
    WordWithoutMeaning,
    /// A phrase of `language.toml` that is in two lists.
    OverlappingWords,
    /// An observed predicate that `scenes/labels.toml` does not label.
    PredicateWithoutLabel,
    /// No labelled example shows a predicate to hold, or none not to hold.
    PredicateUntaught,
    /// There are no labelled examples.
    NoExample,
}

impl DomainFinding {
    /// A file that cannot be used.
    pub(super) fn unreadable(file: impl Into<String>, field: &str, message: &str) -> Self {
        // One finding, one line.
        let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        let (kind, file) = (DomainFindingKind::Unreadable, file.into());
        Self { kind, file, field: field.to_owned(), message }
    }

    /// A problem with a TOML file, at its line where it has one.
    pub(super) fn of_problem(problem: &SettingsProblem, file: &FileRef) -> Self {
        let place = Some(problem.place()).filter(|place| !place.is_empty());
        let place = place.unwrap_or_else(|| file.to_string());
        Self::unreadable(place, &problem.key, &problem.message)
    }
}

impl fmt::Display for DomainFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, field, message, .. } = self;
        if field.is_empty() {
            return write!(f, "{file}: {message}");
        }
        write!(f, "{file}: {field}: {message}")
    }
}
