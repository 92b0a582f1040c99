//! Why a plan is wrong, and the fewest changes that would make it right.

use std::fmt;

use super::validate::{all_objects, execute, validate};
use super::{Budget, Outcome, PlanRequest, plan};
use crate::logic::{Bindings, Changes, Demand, Facts, Universe, bind, failing, substitute};
use crate::pddl::{Atom, Condition, Domain, Step, Term};

/// Most steps of a plan of which every one is tried at every earlier place.
const MOVED_STEPS_MAX: usize = 200;
/// Most parts of a goal that are looked at, each of which is grounded for.
const PARTS_MAX: usize = 20;
/// Most states that are expanded for one repair, for a shortest one and for any.
const EXPANSIONS_MAX: (u64, u64) = (20_000, 50_000);

/// Why a plan is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Explanation {
    /// The step that cannot be taken, from 0; none when the goal is not reached.
    pub step_idx: Option<usize>,
    /// What had to hold, with objects in place of variables; none when the step is no step of the
    /// domain at all.
    pub needed: Option<Condition>,
    /// The parts of it that do not hold, each with what has become of its atom.
    pub missing: Vec<MissingPart>,
    /// The fewest changes that were found to make the plan right.
    pub repair: Option<PlanRepair>,
}

/// A part of a condition that does not hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingPart {
    /// What does not hold.
    pub part: Condition,
    /// The last step that changed its atom, from 0.
    pub changed_by: Option<(usize, Step)>,
}

/// Changes that make a plan right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanRepair {
    /// What to do, in words.
    pub text: String,
    /// How many steps are left out, put in or moved.
    pub n_edits: usize,
    /// The plan then.
    pub steps: Vec<Step>,
}

/// Says why a plan is wrong; `None` when it is right.
pub fn explain(domain: &Domain, request: &PlanRequest<'_>, steps: &[Step]) -> Option<Explanation> {
    let objects = all_objects(domain, request.objects);
    let universe = Universe { types: &domain.types, objects: &objects };
    let mut states = vec![Facts::new(request.init.clone())];
    let mut done: Vec<Changes> = Vec::new();
    for step in steps {
        let before = &states[states.len() - 1];
        let Ok(changes) = execute(domain, &universe, before, step) else { break };
        let after = changes.apply(before);
        states.push(after);
        done.push(changes);
    }
    let at = done.len();
    let state = &states[at];
    let derived = Demand::new(&domain.axioms, universe, state);
    let truth = |atom: &Atom| derived.truth(atom);
    let step = steps.get(at);
    let (needed, bindings) = match step {
        None => (Some(request.goal.clone()), Bindings::new()),
        Some(step) => {
            let action = domain.action(step.action.as_str());
            let bound = action.and_then(|action| Some((action, bind(action, &step.args)?)));
            match bound {
                Some((action, bindings)) => (Some(action.precondition.clone()), bindings),
                None => (None, Bindings::new()),
            }
        }
    };
    let parts = needed.as_ref().map(|c| failing(c, &bindings, &universe, &truth));
    let missing: Vec<MissingPart> = parts
        .unwrap_or_default()
        .into_iter()
        .map(|part| MissingPart { changed_by: changed_by(&part, &done, steps), part })
        .collect();
    if step.is_none() && missing.is_empty() {
        return None;
    }
    let needed = needed.map(|condition| substitute(&condition, &bindings));
    let wrong = Wrong { domain, request, steps, at, state, needed: needed.as_ref() };
    let repair = wrong.repair();
    Some(Explanation { step_idx: step.map(|_| at), needed, missing, repair })
}

/// The parts of the goal that cannot hold in any state, at most `n_max` of them. They are looked for in
/// the delete relaxation, so there may be others.
pub fn impossible_parts(
    domain: &Domain,
    request: &PlanRequest<'_>,
    n_max: usize,
) -> Vec<Condition> {
    let objects = all_objects(domain, request.objects);
    let universe = Universe { types: &domain.types, objects: &objects };
    let state = Facts::new(request.init.clone());
    let derived = Demand::new(&domain.axioms, universe, &state);
    let truth = |atom: &Atom| derived.truth(atom);
    let parts = failing(request.goal, &Bindings::new(), &universe, &truth);
    let budget =
        Budget { optimal_expansions_max: 1, greedy_expansions_max: 0, ..Budget::standard() };
    let is_impossible = |part: &Condition| {
        let request = PlanRequest { goal: part, ..*request };
        matches!(plan(domain, &request, &budget).outcome, Outcome::Unsolvable { .. })
    };
    parts.into_iter().take(PARTS_MAX).filter(is_impossible).take(n_max).collect()
}

/// The last step that changed the atom of a literal.
fn changed_by(part: &Condition, done: &[Changes], steps: &[Step]) -> Option<(usize, Step)> {
    let literal = if let Condition::Not(inner) = part { inner } else { part };
    let Condition::Atom(literal) = literal else { return None };
    let args = literal.args.iter().map(|term| match term {
        Term::Object(name) | Term::Var(name) => name.clone(),
    });
    let atom = Atom { predicate: literal.predicate.clone(), args: args.collect() };
    let idx = done.iter().rposition(|c| c.add.contains(&atom) || c.delete.contains(&atom))?;
    Some((idx, steps[idx].clone()))
}

/// A plan that is right up to some step.
struct Wrong<'a> {
    domain: &'a Domain,
    request: &'a PlanRequest<'a>,
    steps: &'a [Step],
    /// The step that cannot be taken, or the number of steps.
    at: usize,
    /// Before that step.
    state: &'a Facts,
    needed: Option<&'a Condition>,
}

impl Wrong<'_> {
    /// The right plan with the fewest edits, of those that are tried; the first of several.
    fn repair(&self) -> Option<PlanRepair> {
        let (at, steps) = (self.at, self.steps);
        let mut repairs = Vec::new();
        if at < steps.len() {
            repairs.extend(self.edited(at + 1, &[], format!("leave out step {}", at + 1)));
            let last = steps.len().min(at + MOVED_STEPS_MAX);
            let earlier = (at.saturating_sub(MOVED_STEPS_MAX)..at).rev().map(|to| (at, to));
            let mut moves = earlier.chain((at + 1..last).map(|from| (from, at)));
            repairs.extend(moves.find_map(|(from, to)| self.moved(from, to)));
            if let Some(found) = self.needed.and_then(|needed| self.way_to(needed)) {
                let text = format!("insert {} before step {}", shown(&found), at + 1);
                repairs.extend(self.edited(at, &found, text));
            }
        }
        if let Some(found) = self.way_to(self.request.goal) {
            let text = match (at == steps.len(), found.is_empty()) {
                (true, _) => format!("append {}", shown(&found)),
                (false, true) => format!("leave out step {} and all after it", at + 1),
                (false, false) => {
                    format!("replace step {} and all after it by {}", at + 1, shown(&found))
                }
            };
            repairs.extend(self.edited(steps.len(), &found, text));
        }
        repairs.into_iter().min_by_key(|repair| repair.n_edits)
    }

    /// The plan with new steps in place of those from the wrong one up to `rest`, if it is right.
    fn edited(&self, rest: usize, new: &[Step], text: String) -> Option<PlanRepair> {
        let steps = [&self.steps[..self.at], new, &self.steps[rest..]].concat();
        let n_edits = rest - self.at + new.len();
        self.right(steps, n_edits, text)
    }

    /// The plan with a step moved before an earlier one, if it is right.
    fn moved(&self, from: usize, to: usize) -> Option<PlanRepair> {
        let mut steps = self.steps.to_vec();
        let step = steps.remove(from);
        let text = format!("move step {} {step} before step {}", from + 1, to + 1);
        steps.insert(to, step);
        self.right(steps, 1, text)
    }

    fn right(&self, steps: Vec<Step>, n_edits: usize, text: String) -> Option<PlanRepair> {
        let is_right = validate(self.domain, self.request, &steps).is_valid();
        is_right.then_some(PlanRepair { text, n_edits, steps })
    }

    /// Steps from the state before the wrong one to a condition.
    fn way_to(&self, goal: &Condition) -> Option<Vec<Step>> {
        let init = &self.state.known;
        let minimise_cost = false;
        let request = PlanRequest { init, goal, minimise_cost, ..*self.request };
        let (optimal_expansions_max, greedy_expansions_max) = EXPANSIONS_MAX;
        let budget = Budget { optimal_expansions_max, greedy_expansions_max, ..Budget::standard() };
        match plan(self.domain, &request, &budget).outcome {
            Outcome::Solved(plan) => Some(plan.steps),
            Outcome::Unsolvable { .. }
            | Outcome::OutOfBudget { .. }
            | Outcome::Interrupted
            | Outcome::Unsupported { .. }
            | Outcome::BadInput { .. } => None,
        }
    }
}

fn shown(steps: &[Step]) -> String {
    steps.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

impl fmt::Display for MissingPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.changed_by, &self.part) {
            (Some((idx, step)), part) => {
                write!(f, "{part}: not since step {} {step}", idx + 1)
            }
            (None, Condition::Not(atom)) => write!(f, "(not {atom}): {atom} holds from the start"),
            (None, part) => write!(f, "{part}: never up to there"),
        }
    }
}

/// One line for each thing that is known.
impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(needed) = &self.needed {
            let who =
                self.step_idx.map_or("the goal".to_owned(), |idx| format!("step {}", idx + 1));
            writeln!(f, "{who} needs {needed}")?;
        }
        for part in &self.missing {
            writeln!(f, "{part}")?;
        }
        match &self.repair {
            Some(repair) => write!(f, "nearest repair: {}", repair.text),
            None => write!(f, "nearest repair: none was found"),
        }
    }
}
