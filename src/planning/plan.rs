//! Plans.

use std::fmt;

use crate::pddl::{Number, Step};

/// A sequence of steps that reaches the goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plan {
    /// First to last; empty when the goal holds at once.
    pub steps: Vec<Step>,
    /// Sum of the actions' costs, in units of `cost_unit`; the number of steps when the
    /// problem does not ask for cheap plans.
    pub cost: u64,
    /// What a `cost` of 1 stands for; 1, unless actions have fractional or huge costs.
    pub cost_unit: Number,
    /// Sum of the penalties of the steps, in the same units. Search minimises `cost + penalty`.
    pub penalty: u64,
    /// No plan has a smaller `cost + penalty` than this; 0 when nothing better is known.
    pub lower_bound: u64,
    /// Whether no plan has a smaller `cost + penalty`.
    pub proven_optimal: bool,
}

impl Plan {
    /// A number of units as the cost that it stands for, exactly.
    pub fn in_full(&self, units: u64) -> Number {
        // A plan costs less than 2^64 units, each of which has at most 19 digits more than 1.
        self.cost_unit.times(units).unwrap_or_default()
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            writeln!(f, "{step}")?;
        }
        writeln!(f, "; cost = {}", self.in_full(self.cost))
    }
}
