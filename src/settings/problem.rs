//! What is wrong with settings, each fault at its place.

use std::fmt;
use std::ops::Range;

use super::sources::Sources;
use crate::pddl::SourcePosition;

/// One thing that is wrong, or odd, with a setting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SettingsProblem {
    /// The dotted key; empty where a whole file is meant.
    pub key: String,
    /// What is wrong, without key and place.
    pub message: String,
    /// Whether settings can be used all the same.
    pub is_warning: bool,
    at: At,
    /// Where it stands among all texts.
    order: usize,
}

/// Where a problem is.
#[derive(Debug, Clone, PartialEq, Eq)]
enum At {
    /// In a text.
    Place(Box<SourcePosition>),
    /// In a file as a whole.
    File(String),
    /// On the command line; there is no line to point to.
    Set,
    /// In a table that was never a text.
    Nowhere,
}

impl SettingsProblem {
    /// A problem with what stands at a span.
    pub(super) fn at(
        sources: &Sources,
        span: &Range<usize>,
        key: &str,
        message: impl Into<String>,
    ) -> Self {
        let at = match sources.place(span) {
            Some(_) if sources.is_set(span) => At::Set,
            Some(place) => At::Place(Box::new(place)),
            None => At::Nowhere,
        };
        Self {
            key: key.to_owned(),
            message: message.into(),
            is_warning: false,
            at,
            order: span.start,
        }
    }

    /// A problem with a file as a whole.
    pub(crate) fn of_file(file: &str, key: &str, message: impl Into<String>) -> Self {
        let (key, message) = (key.to_owned(), message.into());
        Self { key, message, is_warning: false, at: At::File(file.to_owned()), order: 0 }
    }

    /// A problem with a whole `--set`.
    pub(super) fn of_set(set: &str, message: impl Into<String>) -> Self {
        Self {
            key: set.to_owned(),
            message: message.into(),
            is_warning: false,
            at: At::Set,
            order: 0,
        }
    }

    /// Where it stands among all texts: problems are told in this order.
    pub(super) fn order(&self) -> usize {
        self.order
    }

    /// File, line and column, as far as there are any.
    pub(crate) fn place(&self) -> String {
        match &self.at {
            At::Place(place) => place.to_string(),
            At::File(file) => file.clone(),
            At::Set | At::Nowhere => String::new(),
        }
    }

    /// Key and message, without the place.
    pub(crate) fn keyed(&self) -> String {
        if self.key.is_empty() {
            self.message.clone()
        } else {
            format!("{}: {}", self.key, self.message)
        }
    }

    /// The same as a remark that keeps nobody from going on.
    pub(super) fn warning(self) -> Self {
        Self { is_warning: true, ..self }
    }

    /// The problem with the line that it is in, and carets under the part of it that is meant.
    pub fn render(&self) -> String {
        match &self.at {
            At::Place(place) => format!("{self}\n{}", place.shown().trim_end()),
            At::File(_) | At::Set | At::Nowhere => self.to_string(),
        }
    }
}

/// Problems without the lines that they are in, one below the other.
pub fn joined(problems: &[SettingsProblem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

impl fmt::Display for SettingsProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let level = if self.is_warning { "warning" } else { "error" };
        match &self.at {
            At::Place(place) => write!(f, "{place}: {level}: ")?,
            At::File(file) => write!(f, "{file}: {level}: ")?,
            At::Set => write!(f, "{level}: --set ")?,
            At::Nowhere => write!(f, "{level}: ")?,
        }
        f.write_str(&self.keyed())
    }
}
