//! The one way to say that a value is not what may stand there.

use std::fmt::Display;

use thiserror::Error;

/// A value that is not what may stand there.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{at}: expected {expected}, got {got}")]
pub struct Mismatch {
    /// Where: a key, a field, or a file and what is in it.
    pub at: String,
    /// What may stand there.
    pub expected: String,
    /// What does.
    pub got: String,
}

impl Mismatch {
    /// A mismatch from anything that can be written.
    pub fn new(at: impl Display, expected: impl Display, got: impl Display) -> Self {
        Self { at: at.to_string(), expected: expected.to_string(), got: got.to_string() }
    }
}
