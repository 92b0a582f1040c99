//! Planning: from a state and a goal to a plan, or to the reason why there is none.
//!
//! A classical planner. [`Task`] grounds a domain over the present objects (lower → instantiate →
//! ground → prune → pack), a [`Solver`] looks for plans in its packed states, [`validate()`] checks
//! a plan by direct interpretation, without any of that; [`plan()`] does the first two for one
//! question. Everything is counted and nothing is timed: the same input gives the same answer on
//! every machine.

mod budget;
mod outcome;
mod plan;
mod validate;
mod explain;
mod task;
mod mutex;
mod heuristics;
mod search;
mod answer;
mod solver;
mod call;
mod solve;

use std::collections::{BTreeMap, BTreeSet};

pub use answer::Interrupts;
pub use budget::{Budget, GroundingLimits, OptimalHeuristic};
pub use explain::{Explanation, MissingPart, PlanRepair, explain, impossible_parts};
pub use mutex::{MutexGroups, Violation};
pub use outcome::{Outcome, Phase, Proof, Statistics};
pub use plan::Plan;
pub use solver::Solver;
pub use task::{Coverage, Task, TaskError, TaskInput};
pub(crate) use task::{LiteralMask, Operator, StateRegistry, static_predicates};
pub use validate::{Validation, validate};

use crate::pddl::{Atom, Condition, Domain, Number, Problem, Step, Typed};

/// One planning problem over a domain.
#[derive(Debug, Clone, Copy)]
pub struct PlanRequest<'a> {
    /// The objects, with or without the domain's constants.
    pub objects: &'a [Typed],
    /// What holds at first; derived atoms are computed.
    pub init: &'a BTreeSet<Atom>,
    /// What must hold at the end.
    pub goal: &'a Condition,
    /// Values of cost functions.
    pub costs: &'a BTreeMap<Atom, Number>,
    /// Whether to minimise `total-cost`; otherwise the number of steps.
    pub minimise_cost: bool,
    /// Costs added to particular steps, in whole units: what keeps failing is worth a detour.
    pub penalties: &'a BTreeMap<Step, u32>,
}

/// For requests in which every step costs what its action costs.
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
pub struct PlanAnswer {
    /// A plan, or why there is none.
    pub outcome: Outcome,
    /// Sizes and counts of what was searched, and a lower bound.
    pub statistics: Statistics,
}

/// Plans once, from scratch: any plan soon, and a cheapest one where the budget allows.
///
/// The same request gives the same answer, whatever the machine.
pub fn plan(domain: &Domain, request: &PlanRequest<'_>, budget: &Budget) -> PlanAnswer {
    plan_until(domain, request, budget, Interrupts { proof: &|| false, all: &|| false })
}

/// As [`plan`], until it is interrupted: then with the plan that it has.
pub fn plan_until(
    domain: &Domain,
    request: &PlanRequest<'_>,
    budget: &Budget,
    interrupts: Interrupts<'_>,
) -> PlanAnswer {
    let PlanRequest { objects, init, goal, costs, minimise_cost, .. } = *request;
    let input = TaskInput { domain, objects, init, goal, costs, minimise_cost };
    match Task::until(&input, Coverage::Reachable, &budget.grounding, interrupts.all) {
        Ok(task) => Solver::new(task).solve_until(init, request.penalties, budget, interrupts),
        Err(TaskError::Interrupted) => {
            PlanAnswer { outcome: Outcome::Interrupted, statistics: Statistics::default() }
        }
        Err(TaskError::OutOfBudget { limit, value }) => PlanAnswer {
            outcome: Outcome::OutOfBudget { limit, value },
            statistics: Statistics::default(),
        },
        Err(
            error @ (TaskError::UnknownName { .. }
            | TaskError::Cost(_)
            | TaskError::CostRange { .. }
            | TaskError::NotStratified(_)),
        ) => PlanAnswer {
            outcome: Outcome::BadInput { reason: error.to_string() },
            statistics: Statistics::default(),
        },
    }
}

#[cfg(test)]
mod tests;
