//! What can be wrong with `perception.toml`.

use std::fmt::Display;

use thiserror::Error;

use crate::mismatch::Mismatch;
use crate::pddl::{Domain, Name};

/// A perception file is not usable.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PerceptionError {
    /// Not TOML, or not of the documented form.
    #[error("{file}: {message}")]
    Form {
        /// The path as it was given.
        file: String,
        /// What the parser says, with line and column.
        message: String,
    },
    /// A colour is not written as it should be.
    #[error("expected a colour such as \"#e50000\", got {text:?}")]
    Colour {
        /// What stands there.
        text: String,
    },
    /// A value contradicts the domain or another value.
    #[error(transparent)]
    Value(#[from] Mismatch),
}

/// A key, such as `type.block.width`, whose value contradicts the domain or another value.
pub(super) fn value(
    field: impl Display,
    expected: impl Display,
    got: impl Display,
) -> PerceptionError {
    PerceptionError::Value(Mismatch::new(field, expected, got))
}

/// How many objects a predicate takes.
pub(super) fn arity(
    domain: &Domain,
    field: &str,
    predicate: &Name,
) -> Result<usize, PerceptionError> {
    let found = domain.predicate(predicate.as_str()).map(|p| p.params.len());
    found.ok_or_else(|| value(field, "a predicate of the domain", predicate))
}
