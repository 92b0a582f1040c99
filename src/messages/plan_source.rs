//! Who a plan comes from, and when an old plan may be kept.

use std::fmt;

use schemars::JsonSchema;
use serde::Deserialize;

/// Which source of the plan-reuse cascade gave an answer, from the cheapest to the dearest. Its names
/// are the values of `planner.rungs`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PlanSource {
    /// The observed facts exclude each other: there is nothing to plan from. Always switched on.
    #[serde(skip_deserializing)]
    Mutex,
    /// The goal holds. Always switched on.
    #[serde(skip_deserializing)]
    Goal,
    /// Nothing has changed since the last answer. Always switched on.
    #[serde(skip_deserializing)]
    Unchanged,
    /// The state lies on the trajectory of the current plan.
    Trajectory,
    /// A suffix of the current plan leads from the state to the goal.
    Suffix,
    /// The goal-rooted distance table knows the state.
    Table,
    /// A search from the state.
    Search,
    /// A search, and after it the attempt to make its plan cheaper.
    Improve,
}

impl PlanSource {
    /// Every source, in the order in which they are asked.
    pub const ALL: [Self; 8] = [
        Self::Mutex,
        Self::Goal,
        Self::Unchanged,
        Self::Trajectory,
        Self::Suffix,
        Self::Table,
        Self::Search,
        Self::Improve,
    ];

    /// Its name in run files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mutex => "mutex",
            Self::Goal => "goal",
            Self::Unchanged => "unchanged",
            Self::Trajectory => "trajectory",
            Self::Suffix => "suffix",
            Self::Table => "table",
            Self::Search => "search",
            Self::Improve => "improve",
        }
    }
}

impl fmt::Display for PlanSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// When the current plan, or a suffix of it, is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Reuse {
    /// As long as it leads to the goal.
    Valid,
    /// As long as it is also proven to be as cheap as any plan.
    Optimal,
}
