//! What can be wrong with `perception.toml`.

use std::fmt::Display;

use thiserror::Error;

use crate::mismatch::Mismatch;
use crate::pddl::{Domain, Name};
use crate::settings::{SettingsProblem, TomlFile, joined, near_hint};

/// A perception file is not usable.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PerceptionError {
    /// Not TOML, not of the documented form, or at odds with the domain: every fault at its place.
    #[error("{}", joined(.0))]
    File(Vec<SettingsProblem>),
    /// A colour is not written as it should be.
    #[error("expected a colour such as \"#e50000\", got \"{text}\"")]
    Colour {
        /// What stands there.
        text: String,
    },
    /// A value contradicts the domain or another value.
    #[error(transparent)]
    Value(#[from] Mismatch),
}

impl PerceptionError {
    /// The error with the place of its key in a perception file.
    pub fn in_file(self, file: &str, text: &str) -> Self {
        match (self, TomlFile::parse(file, text)) {
            (Self::Value(mismatch), Ok(toml)) => Self::File(vec![toml.located(mismatch)]),
            (other, _) => other,
        }
    }
}

/// A key, such as `type.block.width`, whose value contradicts the domain or another value.
pub(super) fn value(
    field: impl Display,
    expected: impl Display,
    got: impl Display,
) -> PerceptionError {
    PerceptionError::Value(Mismatch::new(field, expected, got))
}

/// A word with the known one that is near it, if there is one.
pub(super) fn with_hint<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    format!("{word}{}", near_hint(word, known))
}

/// How many objects a predicate takes.
pub(super) fn arity(
    domain: &Domain,
    field: &str,
    predicate: &Name,
) -> Result<usize, PerceptionError> {
    let found = domain.predicate(predicate.as_str()).map(|p| p.params.len());
    let known = || domain.predicates.iter().map(|p| p.name.as_str());
    found.ok_or_else(|| {
        value(field, "a predicate of the domain", with_hint(predicate.as_str(), known()))
    })
}
