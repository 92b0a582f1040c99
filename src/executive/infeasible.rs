//! Steps that cannot be carried out as things stand: out of reach, no free place, or refused by the
//! robot ("unreachable", "collision", "no grasp").

use super::places::Places;
use super::{Answer, Cycle, Executive};
use crate::pddl::{Name, Step};
use crate::skills::SkillError;

/// A step for which there was no motion, or that the robot has refused.
#[derive(Debug, Clone)]
pub(super) struct Infeasible {
    step: Step,
    /// Where everything stood then, and what was held.
    places: Places,
    held: Option<Name>,
    /// Why.
    reason: String,
}

impl Executive {
    /// There is no motion for a step. The first time that counts as a failure, so that the planner looks for
    /// another way; where there is none, nothing is tried twice on the same evidence: the loop
    /// waits, and looks from other views, until things stand otherwise or `limits.observing_s_max` is used up.
    pub(super) fn cannot_carry_out(
        &mut self,
        cycle: &mut Cycle<'_>,
        step: &Step,
        error: &SkillError,
    ) -> Answer {
        self.not_again(cycle, step, error.to_string());
        self.fail(cycle, step, error.to_string());
        self.give_up_or_wait(cycle)
    }

    /// Remembers that a step cannot be carried out as things stand.
    pub(super) fn not_again(&mut self, cycle: &Cycle<'_>, step: &Step, reason: String) {
        let places = Places::known(cycle.input.scene);
        let held = self.in_gripper(cycle).cloned();
        self.infeasible.retain(|known| known.step != *step);
        self.infeasible.push(Infeasible { step: step.clone(), places, held, reason });
    }

    /// Why a step cannot be carried out, when things stand as they did when that was found.
    pub(super) fn known_infeasible(&self, cycle: &Cycle<'_>, step: &Step) -> Option<String> {
        let known = self.infeasible.iter().find(|known| known.step == *step)?;
        let is_as_then = known.held.as_ref() == self.in_gripper(cycle)
            && Places::known(cycle.input.scene).are_as(&known.places);
        is_as_then.then(|| known.reason.clone())
    }

    /// What is held now: of a step that was refused nothing has been taken.
    fn in_gripper(&self, cycle: &Cycle<'_>) -> Option<&Name> {
        let is_holding = cycle.input.robot.is_some_and(|robot| robot.holding);
        self.held.as_ref().filter(|_| is_holding).map(|held| &held.object)
    }
}
