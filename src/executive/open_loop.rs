//! The open loop, for comparison: one plan from the first confirmed scene, carried out blindly.
//!
//! The setting of the paper: skills are the same as in the closed loop and see where their objects are, but
//! nothing is checked, explained or planned again.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Answer, Cycle, Executive, Phase};
use crate::messages::{CommandKind, Event, PlanVerdict, Verdict};

/// Whether the loop is closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExecutiveMode {
    /// Every frame is looked at: the plan goes on, or another one is found.
    ClosedLoop,
    /// The plan from the first confirmed scene is carried out blindly.
    OpenLoop,
}

impl Executive {
    /// One cycle of the open loop, once there is a plan; `None` before.
    ///
    /// What bounds it are `limits.cycles_max`, `seconds_max` and `skill_timeout_s`.
    pub(super) fn carry_on_blindly(&mut self, cycle: &mut Cycle<'_>) -> Option<Answer> {
        let go_on = Answer::Command(CommandKind::Continue);
        if self.blind_plan.is_none() {
            let PlanVerdict::Plan { steps, cost } = &cycle.input.plan.verdict else { return None };
            if !cycle.is_settled() {
                return None;
            }
            self.blind_plan = Some(steps.iter().cloned().collect());
            cycle.event(Event::Plan { steps: steps.clone(), cost: *cost });
        }
        if let Some(verdict) = self.out_of_time(cycle) {
            return Some(Answer::End(verdict));
        }
        if !matches!(self.phase, Phase::Idle) {
            return Some(match self.overdue(cycle) {
                Some(reason) => self.cancel(cycle, reason),
                None => go_on,
            });
        }
        if cycle.input.hold.is_some() {
            return Some(go_on);
        }
        let rest = self.blind_plan.as_mut()?;
        let step = rest.pop_front();
        self.remaining = Some(step.iter().chain(rest.iter()).cloned().collect());
        let Some(step) = step else { return Some(Answer::End(Verdict::Executed)) };
        Some(match self.start(cycle, &step) {
            Ok(answer) => answer,
            Err(error) => {
                self.fail(cycle, &step, error.to_string());
                go_on
            }
        })
    }
}
