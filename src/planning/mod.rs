//! Planning: from a state and a goal to a plan, or to the reason why there is none.
//!
//! A pipeline: [`Task`] grounds a domain over the present objects (schema → instantiate → ground →
//! prune → pack), a search looks for a plan in packed states, [`validate()`] checks the plan by
//! direct interpretation, without any of that. Everything is counted and nothing is timed: the
//! same input gives the same answer on every machine.

mod budget;
mod outcome;
mod plan;
mod validate;
pub(crate) mod task;
pub(crate) mod mutex;
pub(crate) mod heuristics;
pub(crate) mod search;
pub(crate) mod solve;

use std::collections::{BTreeMap, BTreeSet};

pub use budget::{Budget, GroundingLimits, OptimalHeuristic};
pub use mutex::{MutexGroups, Violation};
pub use outcome::{Outcome, Phase, Proof, Statistics};
pub use plan::Plan;
pub use task::{Coverage, Task, TaskError, TaskInput};
pub use validate::{Validation, validate};

use crate::pddl::{Atom, Condition, Domain, Problem, Step, Typed};

/// One planning problem over a domain.
#[derive(Debug, Clone, Copy)]
pub struct PlanRequest<'a> {
    /// The objects, with or without the domain's constants.
    pub objects: &'a [Typed],
    /// What holds at first; derived atoms are computed.
    pub init: &'a BTreeSet<Atom>,
    /// The goal.
    pub goal: &'a Condition,
    /// Values of cost functions.
    pub costs: &'a BTreeMap<Atom, f64>,
    /// Whether to minimise `total-cost`; otherwise the number of steps.
    pub minimise_cost: bool,
    /// Costs added to particular steps, in whole units: what keeps failing is worth a detour.
    pub penalties: &'a BTreeMap<Step, u32>,
}

/// No step is penalised.
pub static NO_PENALTIES: BTreeMap<Step, u32> = BTreeMap::new();

impl<'a> PlanRequest<'a> {
    /// The problem as it was read, without penalties.
    pub fn new(problem: &'a Problem) -> Self {
        let Problem { objects, init, goal, costs, minimise_cost, .. } = problem;
        let minimise_cost = *minimise_cost;
        Self { objects, init, goal, costs, minimise_cost, penalties: &NO_PENALTIES }
    }
}

/// What a planning call answers and what it did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// The answer.
    pub outcome: Outcome,
    /// Counts.
    pub statistics: Statistics,
}

/// Plans once, from scratch: an optimal search within its limit, then a greedy one.
///
/// The same request gives the same answer, whatever the machine.
pub fn plan(domain: &Domain, request: &PlanRequest<'_>, budget: &Budget) -> Answer {
    let PlanRequest { objects, init, goal, costs, minimise_cost, .. } = *request;
    let input = TaskInput { domain, objects, init, goal, costs, minimise_cost };
    match Task::new(&input, Coverage::Reachable, &budget.grounding) {
        Ok(task) => task.solve(init, request.penalties, budget, &|| false),
        Err(TaskError::OutOfBudget { limit, value }) => Answer {
            outcome: Outcome::OutOfBudget { limit, value },
            statistics: Statistics::default(),
        },
        Err(
            error @ (TaskError::UnknownName { .. }
            | TaskError::NoCost { .. }
            | TaskError::NotStratified(_)),
        ) => Answer {
            outcome: Outcome::BadInput { reason: error.to_string() },
            statistics: Statistics::default(),
        },
    }
}

#[cfg(test)]
mod tests;
