//! Why a part cannot be made.

use std::path::Path;

use thiserror::Error;

use crate::files::FileError;
use crate::mismatch::Mismatch;
use crate::settings::{SettingsProblem, joined};

/// A part cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PartError {
    /// No part of its role has this name.
    #[error("{0}")]
    Unknown(Mismatch),
    /// Something outside that it needs is not there: exit code 5.
    #[error("{what} is missing: {how}")]
    Missing {
        /// What: a program, a service, a feature of this build.
        what: String,
        /// How to get it.
        how: String,
    },
    /// Its options are not of the documented form.
    #[error("{}{message}", in_file(file))]
    Options {
        /// The file that they stand in; empty when they come from no file.
        file: String,
        /// Each wrong option by its key, with what may stand there and what does.
        message: String,
    },
    /// A file that it reads is not usable.
    #[error("{file}: {message}")]
    File {
        /// Path of the file that a part cannot be made from.
        file: String,
        /// What is wrong with it: the field, what was expected and what stands there.
        message: String,
    },
    /// A TOML file that it reads is not usable: every fault at its place.
    #[error("{}", joined(.0))]
    Problems(Vec<SettingsProblem>),
    /// What it is made from does not do.
    #[error("{reason}")]
    Inputs {
        /// Why, naming the file or key.
        reason: String,
    },
}

impl From<FileError> for PartError {
    fn from(FileError { file, reason }: FileError) -> Self {
        Self::File { file, message: reason }
    }
}

impl From<Vec<SettingsProblem>> for PartError {
    fn from(problems: Vec<SettingsProblem>) -> Self {
        Self::Problems(problems)
    }
}

impl PartError {
    /// Something outside is missing, and this is how to get it.
    pub fn missing(what: impl Into<String>, how: impl Into<String>) -> Self {
        Self::Missing { what: what.into(), how: how.into() }
    }

    /// A file is not usable.
    pub fn file(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self::File { file: file.into(), message: message.into() }
    }

    /// Whether something outside is missing that may be there another time: exit code 5.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }
}

/// Reads a text file.
///
/// # Errors
/// [`PartError::File`] naming the file.
pub fn read_file(path: &Path) -> Result<String, PartError> {
    std::fs::read_to_string(path)
        .map_err(|e| PartError::file(path.display().to_string(), e.to_string()))
}

fn in_file(file: &str) -> String {
    if file.is_empty() { String::new() } else { format!("{file}: ") }
}
