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
mod formula;
mod schema;
mod ground;
mod seeds;
mod instantiate;
mod prune;
mod axioms;
mod state;
mod successors;
mod task;
mod mutex;
mod pack;
mod heuristics;
mod search;
mod ladder;

use std::collections::{BTreeMap, BTreeSet};

pub use budget::{Budget, GroundingLimits, OptimalHeuristic};
pub use ladder::{Reuse, Rung};
pub use outcome::{Outcome, Phase, Statistics};
pub use mutex::{MutexGroups, Violation};
pub use plan::Plan;
pub use task::{Coverage, Task, TaskError, TaskInput};
pub use validate::{Validation, validate};

use crate::pddl::{Atom, Condition, Domain, Problem, Step, Typed};
use formula::Formula;
use heuristics::{Blind, FastForward, Heuristic, Max};
use search::{End, Limits};

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
        Ok(task) => task.solve(init, request.penalties, budget),
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

impl Task {
    /// Plans from `init` within the task; see [`plan()`].
    pub fn solve(
        &self,
        init: &BTreeSet<Atom>,
        penalties: &BTreeMap<Step, u32>,
        budget: &Budget,
    ) -> Answer {
        let phases = Vec::new();
        let (n_atoms, n_actions) = (self.n_atoms(), self.n_actions());
        let mut statistics = Statistics { n_atoms, n_actions, phases };
        let outcome = self.search(&self.state(init), penalties, budget, &mut statistics);
        Answer { outcome, statistics }
    }

    fn search(
        &self,
        initial: &[u64],
        penalties: &BTreeMap<Step, u32>,
        budget: &Budget,
        statistics: &mut Statistics,
    ) -> Outcome {
        if self.goal == Formula::False {
            let proof = "the goal cannot hold even if nothing ever stopped being possible";
            return Outcome::Unsolvable { proof: proof.to_owned() };
        }
        let penalty = |step: &Step| {
            u64::from(penalties.get(step).copied().unwrap_or(0)).saturating_mul(self.cost_scale)
        };
        let penalties: Vec<u64> = self.operators.iter().map(|o| penalty(&o.step)).collect();
        let costs: Vec<u64> =
            self.operators.iter().zip(&penalties).map(|(o, p)| o.cost.saturating_add(*p)).collect();
        let mut outcome = Outcome::OutOfBudget { limit: "optimal_expansions_max", value: 0 };
        if budget.optimal_expansions_max > 0 {
            let limits = limits("optimal_expansions_max", budget.optimal_expansions_max, budget);
            let mut heuristic: Box<dyn Heuristic> = match budget.optimal_heuristic {
                OptimalHeuristic::Blind => Box::new(Blind::new(self, &costs)),
                OptimalHeuristic::Max => Box::new(Max::new(self, &costs)),
            };
            let (end, phase) = search::astar(self, initial, &costs, &mut *heuristic, limits);
            statistics.phases.push(phase);
            outcome = self.outcome(end, &penalties, true);
        }
        if budget.greedy_expansions_max > 0 && matches!(outcome, Outcome::OutOfBudget { .. }) {
            let limits = limits("greedy_expansions_max", budget.greedy_expansions_max, budget);
            // One more for each step, so that free actions are not free to pile up.
            let costs = costs.iter().map(|c| c.saturating_add(1)).collect();
            let mut heuristic = FastForward::new(self, costs);
            let (end, phase) = search::greedy(self, initial, &mut heuristic, limits);
            statistics.phases.push(phase);
            let end = match end {
                End::Found(plan) => End::Found(search::shorten(self, initial, plan)),
                other @ (End::Exhausted(_) | End::Limit(..)) => other,
            };
            outcome = self.outcome(end, &penalties, false);
        }
        outcome
    }

    fn outcome(&self, end: End, penalties: &[u64], proven_optimal: bool) -> Outcome {
        match end {
            End::Exhausted(n_states) => {
                let proof = format!("all {n_states} states that can matter were looked at");
                Outcome::Unsolvable { proof }
            }
            End::Limit(limit, value) => Outcome::OutOfBudget { limit, value },
            End::Found(actions) => {
                let sum = |value: &dyn Fn(u32) -> u64| {
                    actions.iter().fold(0, |sum: u64, &a| sum.saturating_add(value(a)))
                };
                Outcome::Solved(Plan {
                    steps: actions
                        .iter()
                        .map(|&a| self.operators[a as usize].step.clone())
                        .collect(),
                    cost: sum(&|a| self.operators[a as usize].cost),
                    cost_scale: self.cost_scale,
                    penalty: sum(&|a| penalties[a as usize]),
                    proven_optimal,
                })
            }
        }
    }
}

fn limits(expansions_name: &'static str, expansions_max: u64, budget: &Budget) -> Limits {
    let Budget { states_max, bytes_max, .. } = *budget;
    Limits { expansions_name, expansions_max, states_max, bytes_max }
}

#[cfg(test)]
mod tests;
