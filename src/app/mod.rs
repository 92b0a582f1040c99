//! Wiring: the picture in `lib.rs` as code, top to bottom.

mod episode;
mod wiring;

use std::path::PathBuf;

use thiserror::Error;

use crate::actors::Fatal;
use crate::config::ConfigError;
use crate::transport::TransportError;

pub use episode::{Episode, EpisodeOptions, run_episode};
pub use wiring::Prepared;

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
        /// The reason.
        reason: String,
    },
}

impl RunError {
    /// The process's exit code for it.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Config(ConfigError::Missing { .. }) | Self::Fatal(Fatal::Missing { .. }) => 5,
            Self::Config(ConfigError::Detector(error)) if error.is_missing() => 5,
            Self::Config(_) | Self::Fatal(Fatal::BadInput { .. }) | Self::Snapshot { .. } => 2,
            Self::Fatal(Fatal::GaveUp { .. }) => 4,
            Self::Transport(_) | Self::Fatal(Fatal::Restarts { .. }) => 1,
        }
    }
}

/// A picture of one cycle, asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SnapshotRequest {
    /// The PNG file.
    pub path: PathBuf,
    /// The first cycle that it may show; it shows the first settled one with a plan from there on.
    pub from_cycle: u64,
}
