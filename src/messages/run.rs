//! What a process must know of a run to take part in it.

use serde::{Deserialize, Serialize};

/// A run's description of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunDescriptor {
    /// Identity that every message about the task carries.
    pub run_id: u64,
    /// The run's name on the bus.
    pub run: String,
    /// The domain's name.
    pub domain: String,
    /// `domain.pddl`.
    pub domain_text: String,
    /// Of all files of the domain folder; every message about the task carries it.
    pub domain_hash: u64,
    /// The run file as it was resolved, as TOML.
    pub config: String,
    /// Seed of everything random.
    pub seed: u64,
    /// As `groundloop --version` says it.
    pub program_version: String,
    /// Version of the layouts in shared memory.
    pub wire_schema: u32,
    /// Whether the run waits for goals on the topic `task`. It describes itself anew for each of them, with a
    /// `run_id` that no other has.
    pub takes_tasks: bool,
}
