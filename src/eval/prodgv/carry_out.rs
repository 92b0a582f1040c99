//! One (exemplar, test) pair from detections to a plan that is tried on the truth.

use std::collections::{BTreeMap, BTreeSet};

use super::goal;
use super::matching::{Matching, Nameless, match_implied, matched, renamed_atom, renamed_plan};
use super::pair::{PairInput, PairParts, PairResult, solve};
use super::score::score;
use super::stage;
use super::{FittedDomain, Labelled};
use crate::logic::Truth;
use crate::pddl::{Atom, Domain, Name, Problem, SourceText, Step, parse_problem, print_problem};
use crate::perception::GripperContent;
use crate::perception::grounders::{GrounderError, Grounding};
use crate::perception::model::ObjectBox;
use crate::planners::Planner;
use crate::planning::{Outcome, PlanRequest, Validation, validate};

/// Detected names to true ones, implied objects included.
pub(super) fn match_all(fitted: &FittedDomain, boxes: &[ObjectBox], test: &Labelled) -> Matching {
    let mut matching = matched(boxes, &test.boxes);
    let implied = &fitted.folder.perception.implied;
    match_implied(&mut matching, implied, &test.problem.objects, &test.boxes);
    matching
}

/// Carries one pair out.
///
/// # Errors
/// What the grounder says.
pub fn carry_out(
    parts: &PairParts<'_>,
    input: &PairInput<'_>,
) -> Result<PairResult, GrounderError> {
    let PairParts { fitted, grounder, planner, .. } = *parts;
    let PairInput { pair, evaluated, test, observation, .. } = *input;
    let boxes = observation.objects;
    let folder = &fitted.folder;
    let matching = match_all(fitted, boxes, test);
    // In none of the photographs is anything held that the robot itself would know of.
    let state = fitted.pipeline(grounder).state(&observation, &GripperContent::Empty)?;
    let score = score(&state.grounding.judged, &matching, &test.init, &fitted.observed);
    let read = goal::read(input.goal, fitted, (boxes, &state.objects), &matching);
    let (goal, dropped) = match read {
        Ok(goal) if parts.repair_goals => {
            let (goal, dropped) = goal::repair(&goal, fitted);
            (Ok(goal), dropped)
        }
        other => (other, Vec::new()),
    };
    let mut episode = PairResult {
        pair,
        evaluated,
        boxes: boxes.to_vec(),
        object_faults: stage::object_faults(boxes, test, &folder.domain),
        matching,
        differs: input.recorded.map(|recorded| differing(&state.grounding, boxes, test, recorded)),
        state,
        score,
        goal,
        dropped,
        problem: Ok(()),
        outcome: None,
        plan_valid: false,
        success: Err("there is no plan".to_owned()),
        failure: None,
    };
    plan(&mut episode, &folder.domain, planner, test);
    episode.failure = stage::failure(&episode, test, &folder.domain, planner);
    Ok(episode)
}

/// Assembles the problem, plans, and tries the plan on it and on the truth.
fn plan(episode: &mut PairResult, domain: &Domain, planner: &dyn Planner, test: &Labelled) {
    let goal = match &episode.goal {
        Ok(goal) => goal.clone(),
        Err(fault) => {
            episode.problem = Err(fault.why.clone());
            return;
        }
    };
    let problem = Problem {
        name: "seen".into(),
        domain: domain.name.clone(),
        objects: episode.state.objects.clone(),
        init: episode.state.facts.known.clone(),
        costs: BTreeMap::new(),
        goal,
        minimise_cost: false,
    };
    let text = SourceText::new("problem", print_problem(&problem));
    if let Err(error) = parse_problem(&text, domain) {
        episode.problem = Err(goal::one_line(&error.to_string()));
        return;
    }
    let outcome = solve(domain, planner, &problem);
    if let Outcome::Solved(found) = &outcome {
        let own = validate(domain, &PlanRequest::new(&problem), &found.steps);
        episode.plan_valid = own.is_valid();
        episode.success = try_on_truth(domain, &found.steps, &episode.matching, &test.problem);
    }
    episode.outcome = Some(outcome);
}

/// Renames a plan and tries it on the true problem.
fn try_on_truth(
    domain: &Domain,
    steps: &[Step],
    matching: &Matching,
    truth: &Problem,
) -> Result<(), String> {
    let to = |name: &Name| {
        let constant = || domain.constants.iter().find(|c| c.name == *name);
        matching.get(name).cloned().or_else(|| constant().map(|c| c.name.clone()))
    };
    let steps = renamed_plan(steps, &to)
        .map_err(|Nameless(name)| format!("the plan uses {name}, which stands for nothing"))?;
    match validate(domain, &PlanRequest::new(truth), &steps) {
        Validation::Valid { .. } => Ok(()),
        Validation::Invalid { reason, .. } => Err(reason),
    }
}

/// How many facts are predicted or recorded, but not both. Where both speak of the same boxes they
/// are compared as they are, otherwise by the true objects that the boxes are matched with.
fn differing(
    grounding: &Grounding,
    boxes: &[ObjectBox],
    test: &Labelled,
    (recorded, recorded_boxes): (&BTreeSet<Atom>, &[ObjectBox]),
) -> usize {
    let holds = grounding.judged.iter().filter(|judged| judged.truth == Truth::True);
    let predicted: BTreeSet<Atom> = holds.map(|judged| judged.atom.clone()).collect();
    if boxes == recorded_boxes {
        return predicted.symmetric_difference(recorded).count();
    }
    let in_true_names = |atoms: &BTreeSet<Atom>, boxes: &[ObjectBox]| {
        let matching = matched(boxes, &test.boxes);
        let to = |name: &Name| matching.get(name).cloned();
        let named = atoms.iter().filter_map(|atom| renamed_atom(atom, &to).ok());
        let named: BTreeSet<Atom> = named.collect();
        let n_unnamed = atoms.len() - named.len();
        (named, n_unnamed)
    };
    let (ours, n_ours) = in_true_names(&predicted, boxes);
    let (theirs, n_theirs) = in_true_names(recorded, recorded_boxes);
    ours.symmetric_difference(&theirs).count() + n_ours + n_theirs
}
