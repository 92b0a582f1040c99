//! The project's own planner, in process.

use super::{Deadlines, Grounded, PlanQuery, Planner};
use crate::parts::{Part, no_options};
use crate::planning::{Budget, Interrupts, PlanAnswer, plan_until};

#[derive(Debug)]
struct Embedded {
    budget: Budget,
}

/// The entry of the table of planners.
pub(super) const PART: Part<dyn Planner> = Part {
    name: "embedded",
    help: "the project's own, in this process: any plan soon, a cheapest one where the budget allows",
    options: no_options,
    build: |context| Ok(Box::new(Embedded { budget: context.inputs.budget.clone() })),
};

impl Planner for Embedded {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        let Deadlines { soft, hard } = query.deadlines;
        let interrupts = Interrupts { proof: soft, all: hard };
        match query.grounded {
            Some(Grounded { solver, .. }) => {
                solver.solve_until(query.init, query.penalties, &self.budget, interrupts)
            }
            None => plan_until(query.domain, &query.request(), &self.budget, interrupts),
        }
    }
}
