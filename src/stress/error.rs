//! Why a stress test cannot be carried out.

use thiserror::Error;

use crate::actors::Fatal;
use crate::pddl::PddlError;
use crate::run::ConfigError;
use crate::transport::TransportError;
use crate::transport::convert::WireError;

/// A stress test cannot be carried out.
#[derive(Debug, Error)]
pub enum StressError {
    /// A file or setting is not usable.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The bus fails.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// A scene cannot be sent.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// The planner fails for good.
    #[error(transparent)]
    Fatal(#[from] Fatal),
    /// A plot cannot be drawn.
    #[error("the plot cannot be drawn: {reason}")]
    Plot {
        /// What the drawing library says.
        reason: String,
    },
    /// The planner does not answer.
    #[error("{case}: no plan came within answer_s_max = {seconds} s")]
    Silent {
        /// Case and size.
        case: String,
        /// How long was waited.
        seconds: f64,
    },
}

impl From<PddlError> for StressError {
    fn from(error: PddlError) -> Self {
        Self::Config(error.into())
    }
}
