//! `[[fault]]` of a run file.

use serde::Deserialize;

/// `[[fault]]`: one disturbance of the simulated world.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultConfig {
    /// When: at this simulated time, seconds.
    pub at_s: Option<f64>,
    /// When: while this action (`stack`) or step (`(stack a b arm)`) is carried out.
    pub during: Option<String>,
    /// Which of its executions, counted from 1; without it, the first.
    pub nth: Option<u32>,
    /// How long after its start, seconds of simulated time; without it, at once.
    pub after_s: Option<f64>,
    /// What happens; read by the simulator.
    pub action: toml::Table,
}
