//! What a part is made from.

use std::fmt::Display;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::{PartError, Role, read_file};
use crate::http::Answers;
use crate::mismatch::Mismatch;
use crate::settings::read_options;

/// A part that somebody has chosen: its name, its options, and where both were written.
#[derive(Debug, Clone, PartialEq)]
pub struct PartChoice {
    /// What named it: the key of a run file, or a flag.
    pub key: String,
    /// The part's name.
    pub name: String,
    /// Its own options.
    pub options: toml::Table,
    /// The file that the options stand in, for messages; empty when they come from no file.
    pub file: String,
    /// What relative paths in the options start from.
    pub folder: PathBuf,
    /// The recorded answers of services, for parts that ask one.
    pub answers: Option<Answers>,
}

impl PartChoice {
    /// A part without options.
    pub fn new(key: &str, name: &str) -> Self {
        Self {
            key: key.to_owned(),
            name: name.to_owned(),
            options: toml::Table::new(),
            file: String::new(),
            folder: PathBuf::new(),
            answers: None,
        }
    }

    /// The same part with recorded answers of services.
    pub fn with_answers(self, answers: Option<Answers>) -> Self {
        Self { answers, ..self }
    }

    /// The same part with options from a file; relative paths start from its folder.
    pub fn with_options(self, options: Option<&toml::Table>, file: impl Into<PathBuf>) -> Self {
        let file = file.into();
        Self {
            options: options.cloned().unwrap_or_default(),
            folder: file.parent().map(PathBuf::from).unwrap_or_default(),
            file: file.display().to_string(),
            ..self
        }
    }
}

/// What a part is made from.
pub struct PartContext<'a, T: Role + ?Sized> {
    /// Which part, with its options.
    pub choice: &'a PartChoice,
    /// What every part of the role is made from.
    pub inputs: T::Inputs<'a>,
    /// Looks up environment variables: keys of services come from there only.
    pub environment: fn(&str) -> Option<String>,
}

impl<T: Role + ?Sized> std::fmt::Debug for PartContext<'_, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PartContext").field("choice", self.choice).finish_non_exhaustive()
    }
}

impl<T: Role + ?Sized> PartContext<'_, T> {
    /// The options as the part declares them, over its defaults.
    ///
    /// # Errors
    /// [`PartError::Options`] naming every key that is wrong.
    pub fn options<O: DeserializeOwned + JsonSchema>(&self) -> Result<O, PartError> {
        let PartChoice { name, options, file, .. } = self.choice;
        read_options(T::OPTIONS, name, options)
            .map_err(|message| PartError::Options { file: file.clone(), message })
    }

    /// An option has a value that cannot be.
    pub fn bad_option(&self, option: &str, expected: impl Display, got: impl Display) -> PartError {
        let key = format!("{}.{option}", T::OPTIONS);
        let message = Mismatch::new(key, expected, got).to_string();
        PartError::Options { file: self.choice.file.clone(), message }
    }

    /// A path of the options: relative ones start from the folder of the file that they stand in.
    pub fn path(&self, path: &str) -> PathBuf {
        self.choice.folder.join(path)
    }

    /// A text file that an option names.
    ///
    /// # Errors
    /// [`PartError::File`] when it cannot be read.
    pub fn read(&self, path: &str) -> Result<String, PartError> {
        read_file(&self.path(path))
    }
}
