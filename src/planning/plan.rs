//! Plans.

use std::fmt;

use crate::pddl::Step;

/// A sequence of steps that reaches the goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// First to last; empty when the goal holds at once.
    pub steps: Vec<Step>,
    /// Sum of the actions' costs, in units of `1 / cost_scale`; the number of steps when the
    /// problem does not ask for cheap plans.
    pub cost: u64,
    /// How many units of `cost` make 1; above 1 only when actions have fractional costs.
    pub cost_scale: u64,
    /// Sum of the penalties of the steps, in the same units. Search minimises `cost + penalty`.
    pub penalty: u64,
    /// No plan has a smaller `cost + penalty` than this; 0 when nothing better is known.
    pub lower_bound: u64,
    /// Whether no plan has a smaller `cost + penalty`.
    pub proven_optimal: bool,
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            writeln!(f, "{step}")?;
        }
        writeln!(f, "; cost = {}", self.cost as f64 / self.cost_scale as f64)
    }
}
