//! Planners: state and goal to plan. Each is one file with one line in [`PLANNERS`].

mod embedded;
mod replanner;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use crate::config::PlannerConfig;
use crate::pddl::{Atom, Condition, Domain, Step, Typed};
use crate::planning::Outcome;

pub use replanner::Replanner;

/// What a planner is asked.
#[derive(Debug, Clone, Copy)]
pub struct PlanQuery<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// All objects, the domain's constants included.
    pub objects: &'a [Typed],
    /// What holds; everything else does not.
    pub init: &'a BTreeSet<Atom>,
    /// What must hold.
    pub goal: &'a Condition,
    /// Extra cost of single steps: those that have failed before.
    pub penalties: &'a BTreeMap<Step, u32>,
}

/// A planner. Deterministic: the same query gets the same answer.
pub trait Planner: std::fmt::Debug + Send + Sync {
    /// Plans once, within its configured limits.
    fn plan(&self, query: &PlanQuery<'_>) -> Outcome;
}

/// Makes a planner.
pub type Build = fn(&PlannerConfig) -> Box<dyn Planner>;

/// Every planner by its name in configuration files, in alphabetical order.
pub const PLANNERS: &[(&str, Build)] = &[("embedded", embedded::build)];
