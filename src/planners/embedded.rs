//! The project's own planner, in process.

use super::{PlanQuery, Planner};
use crate::config::PlannerConfig;
use crate::planning::{Budget, Outcome, PlanRequest, plan};

#[derive(Debug)]
struct Embedded {
    budget: Budget,
}

pub(super) fn build(config: &PlannerConfig) -> Box<dyn Planner> {
    let budget = Budget {
        optimal_expansions_max: config.optimal_expansions_max,
        greedy_expansions_max: config.expansions_max,
        ..Budget::standard()
    };
    Box::new(Embedded { budget })
}

impl Planner for Embedded {
    fn plan(&self, query: &PlanQuery<'_>) -> Outcome {
        let costs = std::collections::BTreeMap::new();
        let request = PlanRequest {
            objects: query.objects,
            init: query.init,
            goal: query.goal,
            costs: &costs,
            minimise_cost: false,
            penalties: query.penalties,
        };
        plan(query.domain, &request, &self.budget).outcome
    }
}
