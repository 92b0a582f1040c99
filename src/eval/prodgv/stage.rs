//! Which stage a failure is due to.
//!
//! The first of these that applies:
//!
//! 1. *goal*, where the plan fails: the goal cannot be read, cannot be reached from the true state,
//!    or a plan that reaches it from the true state leaves the true goal open;
//! 2. *detection*: an object is missed, invented, or of another type;
//! 3. *grounding*: a fact is wrong, missing or unknown although every object is right, or the plan
//!    works from the facts that were read and fails from the true ones;
//! 4. *planning*: facts and goal are right, and there is no plan or not a valid one.

use super::Labelled;
use super::matching::{nearest, renamed_condition};
use super::pair::{Failure, PairResult, Stage, solve};
use crate::pddl::{Domain, Name, Problem};
use crate::perception::model::ObjectBox;
use crate::planners::Planner;
use crate::planning::{Outcome, PlanRequest, Validation, validate};

/// A detection that overlaps its true box by less stands for something else. Below the usual 0.5:
/// people and detectors draw different boxes around things with arms and handles.
const IOU_FOUND_MIN: f64 = 0.3;

/// Most facts or objects that are named in a reason.
const NAMED_MAX: usize = 4;

/// What went wrong with a pair, if anything.
pub(super) fn failure(
    episode: &PairResult,
    test: &Labelled,
    domain: &Domain,
    planner: &dyn Planner,
) -> Option<Failure> {
    if episode.success.is_ok() && episode.score.is_exact() {
        return None;
    }
    let (stage, why) = cause(episode, test, domain, planner);
    let (exemplar, test) = episode.pair;
    Some(Failure { exemplar, test, stage, why })
}

fn cause(
    episode: &PairResult,
    test: &Labelled,
    domain: &Domain,
    planner: &dyn Planner,
) -> (Stage, String) {
    let unseen = (!episode.object_faults.is_empty()).then(|| listed(&episode.object_faults));
    if episode.success.is_err()
        && let Some(why) = goal_fault(episode, test, domain, planner, unseen.is_some())
    {
        return (Stage::Goal, why);
    }
    if let Some(why) = unseen {
        return (Stage::Detection, why);
    }
    if !episode.score.is_exact() {
        return (Stage::Grounding, fact_fault(episode));
    }
    if let Err(why) = &episode.problem {
        return (Stage::Grounding, format!("the problem is not one of the domain: {why}"));
    }
    match (&episode.outcome, &episode.success) {
        (Some(Outcome::Solved(_)), _) if !episode.plan_valid => {
            (Stage::Planning, "the plan does not reach the goal from the facts".to_owned())
        }
        (Some(Outcome::Solved(_)), Err(why)) => {
            (Stage::Grounding, format!("the plan fails from the true state: {why}"))
        }
        (Some(outcome), _) => (Stage::Planning, outcome.to_string()),
        (None, _) => (Stage::Planning, "nothing was planned".to_owned()),
    }
}

/// Why the goal is at fault, if it is.
fn goal_fault(
    episode: &PairResult,
    test: &Labelled,
    domain: &Domain,
    planner: &dyn Planner,
    objects_are_wrong: bool,
) -> Option<String> {
    let goal = match &episode.goal {
        Ok(goal) => goal,
        Err(fault) if fault.not_seen && objects_are_wrong => return None,
        Err(fault) => return Some(fault.why.clone()),
    };
    let to = |name: &Name| {
        let constant = || domain.constants.iter().find(|c| c.name == *name);
        episode.matching.get(name).cloned().or_else(|| constant().map(|c| c.name.clone()))
    };
    // A goal about an invented object is the detector's fault.
    let goal = renamed_condition(goal, &to).ok()?;
    if goal == test.problem.goal {
        return None;
    }
    let meant = Problem { goal, ..test.problem.clone() };
    match solve(domain, planner, &meant) {
        Outcome::Solved(plan) => {
            match validate(domain, &PlanRequest::new(&test.problem), &plan.steps) {
                Validation::Valid { .. } => None,
                Validation::Invalid { reason, .. } => {
                    Some(format!("what is asked for is not what is meant: {reason}"))
                }
            }
        }
        // Too hard to tell.
        Outcome::OutOfBudget { .. } | Outcome::Interrupted => None,
        outcome @ (Outcome::Unsolvable { .. }
        | Outcome::Unsupported { .. }
        | Outcome::BadInput { .. }) => {
            Some(format!("cannot be reached from the true state: {outcome}"))
        }
    }
}

/// Objects that are missed, invented or of another type, each in words.
pub(super) fn object_faults(boxes: &[ObjectBox], test: &Labelled, domain: &Domain) -> Vec<String> {
    let matching = super::matching::matched(boxes, &test.boxes);
    let mut faults = Vec::new();
    let mut found: Vec<&Name> = Vec::new();
    for detection in boxes {
        let place = nearest(detection, &test.boxes);
        let place = place.filter(|(iou, object)| {
            *iou >= IOU_FOUND_MIN && matching.get(&detection.name) == Some(&object.name)
        });
        let Some((_, object)) = place else {
            faults.push(format!("{} is not there", detection.name));
            continue;
        };
        found.push(&object.name);
        let (is, should) = (&detection.type_name, &object.type_name);
        if !domain.types.is_a(is, should) && !domain.types.is_a(should, is) {
            faults.push(format!("{} is taken for a {is}, not a {should}", object.name));
        }
    }
    let missed = test.boxes.iter().filter(|object| !found.contains(&&object.name));
    faults.extend(missed.map(|object| format!("{} is not detected", object.name)));
    faults
}

fn fact_fault(episode: &PairResult) -> String {
    let score = &episode.score;
    let mut parts = Vec::new();
    for (what, atoms) in [("wrong", &score.wrong), ("missing", &score.missing)] {
        if !atoms.is_empty() {
            let atoms: Vec<String> = atoms.iter().map(ToString::to_string).collect();
            parts.push(format!("{what}: {}", listed(&atoms)));
        }
    }
    if score.unknown > 0 {
        parts.push(format!("{} unknown", score.unknown));
    }
    parts.join("; ")
}

/// The first few, and how many more.
fn listed(names: &[String]) -> String {
    let shown = names.iter().take(NAMED_MAX).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(NAMED_MAX) {
        0 => shown,
        n_more => format!("{shown} and {n_more} more"),
    }
}
