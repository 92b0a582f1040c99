//! What can be wrong with files and settings.

use thiserror::Error;

use crate::actors::Fatal;
use crate::files::FileError;
use crate::goals::GoalError;
use crate::mismatch::Mismatch;
use crate::parts::PartError;
use crate::pddl::PddlError;
use crate::perception::detectors::DetectorError;
use crate::perception::grounders::GrounderError;
use crate::perception::model::{ExemplarError, PerceptionError};
use crate::perception::{ImageError, StillError};
use crate::settings::{SettingsProblem, joined};
use crate::skills::SkillMapError;
use crate::transport::TransportError;

/// A file or setting is not usable. Every message names the file, and the line or key.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// A file cannot be read.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: String,
        /// The system's reason.
        reason: String,
    },
    /// A TOML file has bad syntax, an unknown key, or a value of the wrong type.
    #[error("{path}: {message}")]
    Toml {
        /// The file.
        path: String,
        /// The parser's message, with line, column and the line itself.
        message: String,
    },
    /// Settings are not usable: every fault, with its place.
    #[error("{}", joined(.0))]
    Problems(Vec<SettingsProblem>),
    /// A key has a value that cannot be.
    #[error("{key}: expected {expected}, got {got}")]
    Value {
        /// Dotted path of the key, such as `camera.rate_hz`.
        key: String,
        /// What may stand there.
        expected: String,
        /// What does.
        got: String,
    },
    /// The same.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// A PDDL file is not usable.
    #[error(transparent)]
    Pddl(#[from] PddlError),
    /// `perception.toml` is not usable.
    #[error(transparent)]
    Perception(PerceptionError),
    /// A labelled example is not usable.
    #[error(transparent)]
    Exemplar(#[from] ExemplarError),
    /// The goal is not usable.
    #[error(transparent)]
    Goal(GoalError),
    /// A part cannot be made.
    #[error(transparent)]
    Part(PartError),
    /// A detector cannot work on an image.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// A grounder cannot judge.
    #[error(transparent)]
    Grounder(#[from] GrounderError),
    /// An image is not usable.
    #[error("{path}: {source}")]
    Image {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: ImageError,
    },
}

impl ConfigError {
    /// The error as people read it: PDDL and instructions with their words underlined.
    pub fn render(&self) -> String {
        match self {
            Self::Pddl(error) | Self::Exemplar(ExemplarError::State(error)) => error.render(),
            Self::Goal(error) => error.render(),
            Self::Problems(problems) => {
                problems.iter().map(SettingsProblem::render).collect::<Vec<_>>().join("\n")
            }
            Self::File { .. }
            | Self::Toml { .. }
            | Self::Value { .. }
            | Self::Mismatch(_)
            | Self::Perception(_)
            | Self::Exemplar(_)
            | Self::Detector(_)
            | Self::Grounder(_)
            | Self::Part(_)
            | Self::Image { .. } => self.to_string(),
        }
    }
}

impl From<StillError> for ConfigError {
    fn from(error: StillError) -> Self {
        match error {
            StillError::Detector(error) => error.into(),
            StillError::Grounder(error) => error.into(),
        }
    }
}

impl From<Vec<SettingsProblem>> for ConfigError {
    fn from(problems: Vec<SettingsProblem>) -> Self {
        Self::Problems(problems)
    }
}

impl From<PerceptionError> for ConfigError {
    fn from(error: PerceptionError) -> Self {
        match error {
            PerceptionError::File(problems) => Self::Problems(problems),
            other @ (PerceptionError::Colour { .. } | PerceptionError::Value(_)) => {
                Self::Perception(other)
            }
        }
    }
}

impl From<SkillMapError> for ConfigError {
    fn from(error: SkillMapError) -> Self {
        match error {
            SkillMapError::File(problems) => Self::Problems(problems),
            SkillMapError::Part(error) => error.into(),
        }
    }
}

impl From<PartError> for ConfigError {
    fn from(error: PartError) -> Self {
        match error {
            PartError::Problems(problems) => Self::Problems(problems),
            other @ (PartError::Unknown(_)
            | PartError::Missing { .. }
            | PartError::Options { .. }
            | PartError::File { .. }
            | PartError::Inputs { .. }) => Self::Part(other),
        }
    }
}

impl From<FileError> for ConfigError {
    fn from(FileError { file, reason }: FileError) -> Self {
        Self::File { path: file, reason }
    }
}

impl From<GoalError> for ConfigError {
    fn from(error: GoalError) -> Self {
        if let GoalError::Part(error) = error { error.into() } else { Self::Goal(error) }
    }
}

/// Why an episode ended without a verdict.
#[derive(Debug, Error)]
pub enum RunError {
    /// A file or setting is not usable.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The bus does not open.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Something failed that no restart can help.
    #[error(transparent)]
    Fatal(#[from] Fatal),
    /// A picture cannot be written.
    #[error("{path}: {reason}")]
    Snapshot {
        /// The file.
        path: String,
        /// What is wrong, and what to change.
        reason: String,
    },
}

impl RunError {
    /// The process's exit code for it.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Fatal(fatal) => exit_code(fatal),
            Self::Transport(TransportError::Full { .. }) => 5,
            Self::Config(ConfigError::Detector(error)) if error.is_missing() => 5,
            Self::Config(ConfigError::Part(error)) if error.is_missing() => 5,
            Self::Config(ConfigError::Grounder(error)) if error.is_missing() => 5,
            Self::Config(_)
            | Self::Snapshot { .. }
            | Self::Transport(
                TransportError::Taken { .. }
                | TransportError::Name { .. }
                | TransportError::Unsayable(_),
            ) => 2,
            Self::Transport(_) => 1,
        }
    }
}

fn exit_code(fatal: &Fatal) -> u8 {
    match fatal {
        Fatal::Missing { .. } | Fatal::Full { .. } => 5,
        Fatal::BadInput { .. } => 2,
        Fatal::GaveUp { .. } => 4,
        Fatal::Goal { why } => exit_code(why),
        Fatal::Restarts { .. } => 1,
    }
}
