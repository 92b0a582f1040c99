//! The project's own planner, in process.

use super::{PlanQuery, Planner, PlannerError, PlannerSettings};
use crate::messages::Rung;
use crate::planning::{Answer, Budget, Outcome, Task, plan};

#[derive(Debug)]
struct Embedded {
    budget: Budget,
}

pub(super) fn build(settings: &PlannerSettings<'_>) -> Result<Box<dyn Planner>, PlannerError> {
    settings.no_options()?;
    let config = settings.config;
    let improves = config.rungs.contains(&Rung::Improve);
    let budget = Budget {
        optimal_expansions_max: config.optimal_expansions_max,
        greedy_expansions_max: config.expansions_max,
        improve_expansions_max: if improves { config.improve_expansions_max } else { 0 },
        ..Budget::standard()
    };
    Ok(Box::new(Embedded { budget }))
}

impl Planner for Embedded {
    fn plan(&self, query: &PlanQuery<'_>) -> Answer {
        if let Some(grounded) = query.grounded {
            return self.solve(grounded.task, query);
        }
        plan(query.domain, &query.request(), &self.budget)
    }
}

impl Embedded {
    /// Looks for a cheapest plan until that takes too long, then for any plan.
    fn solve(&self, task: &Task, query: &PlanQuery<'_>) -> Answer {
        let (init, penalties) = (query.init, query.penalties);
        let optimal = Budget { greedy_expansions_max: 0, ..self.budget.clone() };
        let first = task.solve(init, penalties, &optimal, query.hurry);
        let is_open = matches!(first.outcome, Outcome::OutOfBudget { .. });
        if !is_open || self.budget.greedy_expansions_max == 0 {
            return first;
        }
        let greedy = Budget { optimal_expansions_max: 0, ..self.budget.clone() };
        let mut second = task.solve(init, penalties, &greedy, query.interrupt);
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
