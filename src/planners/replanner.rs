//! Replanning every cycle: the old plan where it still works, a new one where it does not.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{PlanQuery, Planner};
use crate::messages::{GoalMessage, PlanVerdict, Scene};
use crate::pddl::{Atom, Bindings, Domain, Name, Step, Typed, Universe, bind, effects, evaluate};
use crate::planning::Outcome;
use crate::scene::{Facts, Truth};

/// Remembers the last plan. A clone is a checkpoint.
#[derive(Debug, Clone)]
pub struct Replanner {
    domain: Arc<Domain>,
    planner: Arc<dyn Planner>,
    failure_penalty: u32,
    last: Option<Answer>,
    /// The plan that is followed, as it was made.
    plan: Vec<Step>,
}

/// The last question with its answer: most frames change nothing.
#[derive(Debug, Clone)]
struct Answer {
    facts: Facts,
    objects: Vec<Typed>,
    failures: BTreeMap<Step, u32>,
    verdict: PlanVerdict,
}

impl Replanner {
    /// A replanner without a plan. Every failure adds `failure_penalty` to a step's cost.
    pub fn new(domain: Arc<Domain>, planner: Arc<dyn Planner>, failure_penalty: u32) -> Self {
        Self { domain, planner, failure_penalty, last: None, plan: Vec::new() }
    }

    /// The plan from what is believed to the goal.
    ///
    /// The plan that is followed is kept as long as a rest of it leads to the goal and its next
    /// step has not failed more often than when it was chosen.
    pub fn replan(
        &mut self,
        scene: &Scene,
        goal: &GoalMessage,
        failures: &BTreeMap<Step, u32>,
    ) -> PlanVerdict {
        let facts = scene.confirmed();
        let objects = scene.typed_objects();
        if let Some(last) = &self.last
            && last.facts == facts
            && last.objects == objects
            && last.failures == *failures
        {
            return last.verdict.clone();
        }
        let same_failures = self.last.as_ref().is_none_or(|last| last.failures == *failures);
        let verdict = self.answer(&facts, &objects, goal, (failures, same_failures));
        self.last =
            Some(Answer { facts, objects, failures: failures.clone(), verdict: verdict.clone() });
        verdict
    }

    fn answer(
        &mut self,
        facts: &Facts,
        objects: &[Typed],
        goal: &GoalMessage,
        (failures, same_failures): (&BTreeMap<Step, u32>, bool),
    ) -> PlanVerdict {
        let missing: Vec<Name> = goal
            .named
            .iter()
            .filter(|named| objects.iter().all(|object| object.name != named.name))
            .map(|named| named.name.clone())
            .collect();
        if !missing.is_empty() {
            return PlanVerdict::Missing { objects: missing };
        }
        let universe = Universe { types: &self.domain.types, objects };
        let truth = |atom: &Atom| facts.truth(atom);
        if evaluate(&goal.goal, &Bindings::new(), &universe, &truth) == Truth::True {
            self.plan.clear();
            return PlanVerdict::Plan { steps: Vec::new(), cost: 0 };
        }
        if same_failures && let Some(rest) = self.valid_rest(facts, &universe, goal) {
            let cost = rest.len() as u64;
            return PlanVerdict::Plan { steps: rest, cost };
        }
        let penalties = failures.iter().filter(|(_, n)| **n > 0);
        let penalties =
            penalties.map(|(step, n)| (step.clone(), n.saturating_mul(self.failure_penalty)));
        let penalties: BTreeMap<Step, u32> = penalties.collect();
        let query = PlanQuery {
            domain: &self.domain,
            objects,
            init: &facts.known,
            goal: &goal.goal,
            penalties: &penalties,
            grounded: None,
            interrupt: &|| false,
        };
        self.verdict(self.planner.plan(&query).outcome, !facts.unknown.is_empty())
    }

    fn verdict(&mut self, outcome: Outcome, unknowns: bool) -> PlanVerdict {
        match outcome {
            Outcome::Solved(plan) => {
                self.plan.clone_from(&plan.steps);
                PlanVerdict::Plan { steps: plan.steps, cost: plan.cost }
            }
            Outcome::Unsolvable { proof } => {
                PlanVerdict::Unsolvable { proof: proof.to_string(), unknowns }
            }
            Outcome::OutOfBudget { limit, value } => {
                PlanVerdict::OutOfBudget { limit: format!("{limit} = {value}") }
            }
            Outcome::Unsupported { feature } => PlanVerdict::Unsupported { feature },
            Outcome::BadInput { reason } => PlanVerdict::Unsupported { feature: reason },
        }
    }

    /// The shortest rest of the followed plan that leads from `facts` to the goal.
    fn valid_rest(
        &self,
        facts: &Facts,
        universe: &Universe<'_>,
        goal: &GoalMessage,
    ) -> Option<Vec<Step>> {
        let rests = (0..self.plan.len()).rev().map(|start| &self.plan[start..]);
        let mut valid = rests.filter(|rest| self.leads_to_goal(rest, facts, universe, goal));
        valid.next().map(<[Step]>::to_vec)
    }

    fn leads_to_goal(
        &self,
        steps: &[Step],
        facts: &Facts,
        universe: &Universe<'_>,
        goal: &GoalMessage,
    ) -> bool {
        let mut state: BTreeSet<Atom> = facts.known.clone();
        for step in steps {
            let Some(action) = self.domain.action(step.action.as_str()) else { return false };
            let Some(bindings) = bind(action, &step.args) else { return false };
            let truth = |atom: &Atom| Truth::from(state.contains(atom));
            if !evaluate(&action.precondition, &bindings, universe, &truth).is_true() {
                return false;
            }
            let changes = effects(action, &bindings, universe, &truth);
            state.retain(|atom| !changes.delete.contains(atom));
            state.extend(changes.add);
        }
        let truth = |atom: &Atom| Truth::from(state.contains(atom));
        evaluate(&goal.goal, &Bindings::new(), universe, &truth).is_true()
    }
}
