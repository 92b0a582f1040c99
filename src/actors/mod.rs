//! Actors: each receives, makes one pure call, and sends. Supervision is ractor's; data never is.

mod checkpoint;
mod commands;
mod lifecycle;
mod monitor;
mod patience;
mod pause;
mod robot_states;
mod supervisor;
mod system_faults;
mod table_thread;
#[cfg(test)]
mod tests;
pub mod camera;
pub mod scene_parser;
pub mod goal_parser;
pub mod planner;
pub mod skill_executor;
pub mod robot;
pub mod snapshot;

use thiserror::Error;

use crate::goals::GoalError;
use crate::parts::PartError;
use crate::transport::TransportError;
use crate::transport::convert::WireError;

pub use checkpoint::Checkpoint;
pub use commands::CommandLine;
pub use lifecycle::{DataLoop, Serve};
pub use monitor::Monitor;
pub use snapshot::{SnapshotMoment, SnapshotRequest};
pub use supervisor::{ActorSpec, HealthReport, Supervision, SupervisorConfig, supervise};
pub use system_faults::{Handling, SystemFaults};

/// Why an actor's data loop ended.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ActorError {
    /// The bus failed; a restart opens it anew.
    #[error(transparent)]
    Transport(TransportError),
    /// Something could not be written to the bus.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// The loop panicked; a restart goes on from the last checkpoint.
    #[error("panicked: {message}")]
    Panicked {
        /// What it said.
        message: String,
    },
    /// A part failed; a restart tries again.
    #[error("{reason}")]
    Part {
        /// Why.
        reason: String,
    },
    /// No restart can help.
    #[error(transparent)]
    Fatal(#[from] Fatal),
}

/// What ends an episode without a verdict.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Fatal {
    /// A required device or service is missing: exit code 5.
    #[error("{what} is missing: {how}")]
    Missing {
        /// What.
        what: String,
        /// How to get it.
        how: String,
    },
    /// Shared memory is full: exit code 5.
    #[error("{message}")]
    Full {
        /// What has no room, and what to change.
        message: String,
    },
    /// The goal or another input is not usable: exit code 2.
    #[error("{message}")]
    BadInput {
        /// What is wrong with it.
        message: String,
    },
    /// A bound was met before the loop could start: exit code 4.
    #[error("{message}")]
    GaveUp {
        /// Which bound, and what it came to.
        message: String,
    },
    /// The goal cannot be read, or what reads it is not there or gives up: the exit code is that of `why`.
    #[error("{why}")]
    Goal {
        /// Why.
        why: Box<Self>,
    },
    /// An actor failed more often than `supervisor.restarts_max`: exit code 1.
    #[error("{actor} failed {failures} times (supervisor.restarts_max): {reason}")]
    Restarts {
        /// The actor.
        actor: &'static str,
        /// How often it failed.
        failures: u32,
        /// The last failure.
        reason: String,
    },
}

impl Fatal {
    /// The supervisor has ended, and nobody has stopped it.
    pub fn gone() -> Self {
        let reason = "it has stopped by itself".to_owned();
        Self::Restarts { actor: "supervisor", failures: 1, reason }
    }
}

impl From<TransportError> for ActorError {
    fn from(error: TransportError) -> Self {
        if let TransportError::Full { .. } = error {
            // Started again, the actor would find as little.
            return Fatal::Full { message: error.to_string() }.into();
        }
        Self::Transport(error)
    }
}

impl From<GoalError> for Fatal {
    fn from(error: GoalError) -> Self {
        match error {
            GoalError::Part(PartError::Missing { what, how }) => Self::Missing { what, how },
            GoalError::GaveUp { .. } => Self::GaveUp { message: error.render() },
            GoalError::Part(_)
            | GoalError::Language { .. }
            | GoalError::Logical { .. }
            | GoalError::Instruction { .. }
            | GoalError::Key { .. }
            | GoalError::Image { .. }
            | GoalError::NotYet { .. } => Self::BadInput { message: error.render() },
        }
    }
}
