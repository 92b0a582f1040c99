//! What cheapest plans cost, off the clock.

use std::collections::BTreeMap;

use crate::logic::Facts;
use crate::pddl::{Domain, Problem};
use crate::planning::{
    Budget, Coverage, GroundingLimits, NO_PENALTIES, Outcome, PlanRequest, Solver, Task, TaskInput,
    plan,
};

/// Most states that one search for a cheapest plan may expand.
const EXPANSIONS_MAX: u64 = 1_000_000;

/// Finds the cheapest cost of single states of one problem.
#[derive(Debug)]
pub(super) struct Reference<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    /// Grounded once, where that is possible.
    solver: Option<Solver>,
    budget: Budget,
}

impl<'a> Reference<'a> {
    pub(super) fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let costs = BTreeMap::new();
        let Problem { objects, init, goal, .. } = problem;
        let input = TaskInput { domain, objects, init, goal, costs: &costs, minimise_cost: false };
        let task = Task::new(&input, Coverage::AllStates, &GroundingLimits::standard());
        let budget = Budget {
            optimal_expansions_max: EXPANSIONS_MAX,
            greedy_expansions_max: 0,
            ..Budget::standard()
        };
        Self { domain, problem, solver: task.ok().map(Solver::new), budget }
    }

    /// The number of steps of a shortest plan, where one is found and proven.
    pub(super) fn cheapest(&self, facts: &Facts) -> Option<u64> {
        let answer = if let Some(solver) = &self.solver {
            solver.solve(&facts.known, &NO_PENALTIES, &self.budget, &|| false)
        } else {
            let costs = BTreeMap::new();
            let request = PlanRequest {
                init: &facts.known,
                costs: &costs,
                minimise_cost: false,
                ..PlanRequest::new(self.problem)
            };
            plan(self.domain, &request, &self.budget)
        };
        match answer.outcome {
            Outcome::Solved(plan) if plan.proven_optimal => Some(plan.cost),
            Outcome::Solved(_)
            | Outcome::Unsolvable { .. }
            | Outcome::OutOfBudget { .. }
            | Outcome::Interrupted
            | Outcome::Unsupported { .. }
            | Outcome::BadInput { .. } => None,
        }
    }
}
