//! What can be wrong with a checkout of the data set, or with the parts that are to be measured.

use thiserror::Error;

use crate::mismatch::Mismatch;
use crate::pddl::PddlError;
use crate::run::ConfigError;

/// The evaluation cannot be carried out. Every message names the file or the setting.
#[derive(Debug, Error)]
pub enum EvalError {
    /// A file or folder cannot be read.
    #[error("{path}: {reason}")]
    File {
        /// The file or folder.
        path: String,
        /// Why not, and what is expected there.
        reason: String,
    },
    /// A file says something that cannot be.
    #[error(transparent)]
    Field(#[from] Mismatch),
    /// A PDDL file is not usable.
    #[error(transparent)]
    Pddl(#[from] PddlError),
    /// A part, an option or a shipped domain folder is not usable.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] crate::picture::PictureError),
}

impl EvalError {
    /// The error as people read it: PDDL with its words underlined.
    pub fn render(&self) -> String {
        match self {
            Self::Pddl(error) => error.render(),
            Self::Config(error) => error.render(),
            Self::File { .. } | Self::Field(_) | Self::Picture(_) => self.to_string(),
        }
    }
}
