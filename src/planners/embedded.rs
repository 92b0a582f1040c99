//! The project's own planner, in process.

use super::{PlanQuery, Planner};
use crate::parts::{Part, no_options};
use crate::planning::{Budget, Outcome, PlanAnswer, Solver, plan};

#[derive(Debug)]
struct Embedded {
    budget: Budget,
}

/// The entry of the table of planners.
pub(super) const PART: Part<dyn Planner> = Part {
    name: "embedded",
    help: "the project's own, in this process: a cheapest plan first, then any",
    options: no_options,
    build: |context| Ok(Box::new(Embedded { budget: context.inputs.budget.clone() })),
};

impl Planner for Embedded {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        if let Some(grounded) = query.grounded {
            return self.solve(grounded.solver, query);
        }
        plan(query.domain, &query.request(), &self.budget)
    }
}

impl Embedded {
    /// Looks for a cheapest plan until that takes too long, then for any plan.
    fn solve(&self, solver: &Solver, query: &PlanQuery<'_>) -> PlanAnswer {
        let (init, penalties) = (query.init, query.penalties);
        let optimal = Budget { greedy_expansions_max: 0, ..self.budget.clone() };
        let first = solver.solve(init, penalties, &optimal, query.deadlines.soft);
        let is_open = matches!(first.outcome, Outcome::OutOfBudget { .. } | Outcome::Interrupted);
        if !is_open || self.budget.greedy_expansions_max == 0 {
            return first;
        }
        let greedy = Budget { optimal_expansions_max: 0, ..self.budget.clone() };
        let mut second = solver.solve(init, penalties, &greedy, query.deadlines.hard);
        let lower_bound = first.statistics.lower_bound.max(second.statistics.lower_bound);
        if let Outcome::Solved(plan) = &mut second.outcome {
            plan.lower_bound = lower_bound;
            plan.proven_optimal |= plan.cost.saturating_add(plan.penalty) == lower_bound;
        }
        second.statistics.lower_bound = lower_bound;
        second.statistics.phases.splice(0..0, first.statistics.phases);
        second
    }
}
