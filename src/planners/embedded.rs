//! The project's own planner, in process.

use std::collections::BTreeMap;

use super::{PlanQuery, Planner, PlannerError, PlannerSettings};
use crate::planning::{Answer, Budget, PlanRequest, plan};

#[derive(Debug)]
struct Embedded {
    budget: Budget,
}

pub(super) fn build(settings: &PlannerSettings<'_>) -> Result<Box<dyn Planner>, PlannerError> {
    settings.no_options()?;
    let budget = Budget {
        optimal_expansions_max: settings.config.optimal_expansions_max,
        greedy_expansions_max: settings.config.expansions_max,
        ..Budget::standard()
    };
    Ok(Box::new(Embedded { budget }))
}

impl Planner for Embedded {
    fn plan(&self, query: &PlanQuery<'_>) -> Answer {
        if let Some(grounded) = query.grounded {
            return grounded.task.solve(query.init, query.penalties, &self.budget, query.interrupt);
        }
        let request = PlanRequest {
            objects: query.objects,
            init: query.init,
            goal: query.goal,
            costs: &BTreeMap::new(),
            minimise_cost: false,
            penalties: query.penalties,
        };
        plan(query.domain, &request, &self.budget)
    }
}
