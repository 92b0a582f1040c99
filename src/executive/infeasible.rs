//! Steps that the robot cannot carry out as things stand: out of reach, no free place.

use super::places::Places;
use super::{Answer, Cycle, Executive};
use crate::pddl::{Name, Step};
use crate::skills::SkillError;

/// A step for which there was no motion.
#[derive(Debug, Clone)]
pub(super) struct Infeasible {
    step: Step,
    /// Where everything stood then, and what was held.
    places: Places,
    held: Option<Name>,
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
        let places = Places::known(cycle.input.scene);
        let held = self.held.as_ref().map(|held| held.object.clone());
        let is_known = self
            .infeasible
            .iter()
            .any(|known| known.step == *step && known.held == held && places.are_as(&known.places));
        if is_known {
            return self.re_observe(cycle, &format!("{step} cannot be carried out: {error}"));
        }
        self.infeasible.retain(|known| known.step != *step);
        self.infeasible.push(Infeasible { step: step.clone(), places, held });
        self.fail(cycle, step, error.to_string());
        self.give_up_or_wait(cycle)
    }
}
