//! Plans that come too late: the planner met a budget, or its deadline, before it had an answer.

use super::{Answer, Cycle, Executive, Phase};
use crate::messages::{CommandKind, Event, Limit, PlanVerdict, Verdict};

/// How long there has been no plan in time.
#[derive(Debug, Clone, Default)]
pub(super) struct PlannerTimeouts {
    /// Late plans in a row.
    n_plans: u32,
    /// The cycle of the newest of them.
    cycle: Option<u64>,
}

impl Executive {
    /// Counts plans in a row that came too late; any other answer ends the row.
    pub(super) fn count_planner_timeouts(&mut self, cycle: &Cycle<'_>) {
        let plan = cycle.input.plan;
        if !matches!(plan.verdict, PlanVerdict::OutOfBudget { .. }) {
            self.planner_timeouts = PlannerTimeouts::default();
        } else if self.planner_timeouts.cycle != Some(plan.cause.cycle) {
            self.planner_timeouts.cycle = Some(plan.cause.cycle);
            self.planner_timeouts.n_plans += 1;
        }
    }

    /// Without a plan in time the running step goes on, unless its target has moved: it was right
    /// when it was started. When none runs, the robot holds. After `limits.planner_timeouts_max` such plans in a row the loop gives
    /// up.
    pub(super) fn do_without_plan(&mut self, cycle: &mut Cycle<'_>, limit: &str) -> Answer {
        let planner_timeouts_max = cycle.config.limits.planner_timeouts_max;
        if self.planner_timeouts.n_plans > planner_timeouts_max {
            let detail = format!("no plan within {limit}, {planner_timeouts_max} times in a row");
            return Answer::End(Verdict::GaveUp { limit: Limit::PlannerTimeouts, detail });
        }
        if self.planner_timeouts.n_plans == 1 && cycle.frame_ns > 0 {
            cycle.event(Event::Look { reason: format!("no plan in time ({limit})") });
        }
        match self.phase {
            Phase::Running(_) => match self.moved(cycle).filter(|_| cycle.is_settled()) {
                Some(reason) => self.preempt(cycle, reason),
                None => Answer::Command(CommandKind::Continue),
            },
            Phase::Idle | Phase::VerifyingEffects(_) | Phase::ReObserving(_) => {
                Answer::Command(CommandKind::Hold)
            }
        }
    }
}
