//! What a stress test reports, and a baseline for a later one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measure::{Cell, TimingQuantiles};

/// A stress test's report. Thread-CPU figures of two reports compare after division by their
/// calibrations; wall figures compare only on a machine that does nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StressReport {
    /// Version of this file's form; another one is not compared.
    pub format: u32,
    /// Path of the stress file, as given.
    pub config: String,
    /// Value of `planner.name`.
    pub planner: String,
    /// Seed of the workload generator.
    pub seed: u64,
    /// How often every cell was measured.
    pub repeats: u32,
    /// Where it was measured.
    pub machine: Machine,
    /// What was measured, in order.
    pub cells: Vec<Cell>,
    /// The same states through another planner, where that was asked for.
    pub comparisons: Vec<Comparison>,
}

/// The only form of reports so far.
pub(super) const FORMAT: u32 = 1;

/// Where and under what load a report was made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// How many processors there are.
    pub processors: usize,
    /// Load averages (1, 5, 15 minutes) before the first repeat and after each one.
    pub load: Vec<[f64; 3]>,
    /// Thread-CPU time of a fixed piece of work, timed between all parts: the least of the repeats'
    /// medians.
    pub calibration_ns: u64,
}

/// The same states through another planner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Comparison {
    /// Name of the other planner.
    pub planner: String,
    /// The case's name.
    pub case: String,
    /// The problem's size.
    pub size: u32,
    /// The problem file's name; nothing for a sweep.
    pub problem: Option<String>,
    /// How many states both planners were given.
    pub states: u64,
    /// States of which the other planner found a plan.
    pub solved: u64,
    /// Thread-CPU time of the planner actor for these states.
    pub cpu_ns: TimingQuantiles,
    /// CPU time of the other planner for them.
    pub other_cpu_ns: TimingQuantiles,
    /// Wall time of the other planner.
    pub other_wall_ns: TimingQuantiles,
    /// Median CPU time of the other planner over that of the actor.
    pub ratio: f64,
    /// Sum of the plans' costs, over the states that both have solved.
    pub cost: u64,
    /// Sum of the other planner's costs over the same states.
    pub other_cost: u64,
}
