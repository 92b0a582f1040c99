//! Checks plans by direct interpretation of the domain, independently of the planner.

use super::PlanRequest;
use crate::logic::{
    Bindings, Changes, CostError, Demand, Facts, Universe, bind, effects, unsatisfied,
};
use crate::pddl::{Atom, Domain, Number, Step, Typed};

/// Whether a plan does what it should.
#[derive(Debug, Clone, PartialEq)]
pub enum Validation {
    /// Every step is applicable and the goal holds at the end.
    Valid {
        /// Sum of the actions' costs; the number of steps when the problem does not ask for cheap
        /// plans.
        cost: Number,
    },
    /// Something is wrong.
    Invalid {
        /// The step that is wrong, from 0; none when the goal is not reached.
        step_idx: Option<usize>,
        /// What is wrong: "(stack a b): (clear b) does not hold", "goal not reached: …".
        reason: String,
    },
}

impl Validation {
    /// Whether the plan is valid.
    pub fn is_valid(&self) -> bool {
        matches!(self, Self::Valid { .. })
    }
}

/// Executes `steps` from the request's initial facts and checks every precondition and the goal.
/// Penalties are not looked at.
pub fn validate(domain: &Domain, request: &PlanRequest<'_>, steps: &[Step]) -> Validation {
    let objects = all_objects(domain, request.objects);
    let universe = Universe { types: &domain.types, objects: &objects };
    let mut state = Facts::new(request.init.clone());
    let mut cost = Number::default();
    for (idx, step) in steps.iter().enumerate() {
        match execute(domain, &universe, &state, step) {
            Ok(changes) => {
                let sum = step_cost(&changes, request)
                    .and_then(|more| cost.checked_add(more).ok_or(CostError::TooLarge));
                match sum {
                    Ok(sum) => cost = sum,
                    Err(error) => return invalid(idx, step, &error.to_string()),
                }
                state = changes.apply(&state);
            }
            Err(reason) => return invalid(idx, step, &reason),
        }
    }
    let derived = Demand::new(&domain.axioms, universe, &state);
    let truth = |atom: &Atom| derived.truth(atom);
    let reasons = unsatisfied(request.goal, &Bindings::new(), &universe, &truth);
    if reasons.is_empty() {
        return Validation::Valid { cost };
    }
    let reason = format!("goal not reached: {}", reasons.join(", "));
    Validation::Invalid { step_idx: None, reason }
}

fn invalid(idx: usize, step: &Step, reason: &str) -> Validation {
    Validation::Invalid { step_idx: Some(idx), reason: format!("{step}: {reason}") }
}

/// Constants and objects, each once.
pub(super) fn all_objects(domain: &Domain, objects: &[Typed]) -> Vec<Typed> {
    let mut all = domain.constants.clone();
    let is_constant = |o: &&Typed| domain.constants.iter().any(|c| c.name == o.name);
    all.extend(objects.iter().filter(|o| !is_constant(o)).cloned());
    all
}

/// What a step changes, or why it cannot be taken.
pub(super) fn execute(
    domain: &Domain,
    universe: &Universe<'_>,
    state: &Facts,
    step: &Step,
) -> Result<Changes, String> {
    let Some(action) = domain.action(step.action.as_str()) else {
        return Err(format!("the domain has no action `{}`", step.action));
    };
    let Some(bindings) = bind(action, &step.args) else {
        let (expected, got) = (action.params.len(), step.args.len());
        return Err(format!("expected {expected} argument(s), got {got}"));
    };
    for (param, arg) in action.params.iter().zip(&step.args) {
        if !universe.has(arg, &param.types) {
            return Err(format!("`{arg}` is no object that may stand for `?{}`", param.name));
        }
    }
    let derived = Demand::new(&domain.axioms, *universe, state);
    let truth = |atom: &Atom| derived.truth(atom);
    let reasons = unsatisfied(&action.precondition, &bindings, universe, &truth);
    if reasons.is_empty() {
        Ok(effects(action, &bindings, universe, &truth))
    } else {
        Err(reasons.join(", "))
    }
}

fn step_cost(changes: &Changes, request: &PlanRequest<'_>) -> Result<Number, CostError> {
    if request.minimise_cost { changes.cost(request.costs) } else { Ok(Number::ONE) }
}
