//! One (exemplar, test) pair from detections to a plan that is tried on the truth.

use std::collections::{BTreeMap, BTreeSet};

use super::goal::{self, GoalFault, GoalFrom};
use super::matching::{Matching, match_implied, matched};
use super::recorded::Pair;
use super::rename::{self, Nameless};
use super::score::{Score, score};
use super::stage::{self, Failure};
use super::{Labelled, Vocabulary};
use crate::logic::{Facts, Truth};
use crate::pddl::{
    Atom, Condition, Domain, Name, Problem, SourceText, Step, Typed, parse_problem, print_problem,
};
use crate::perception::grounders::{Grounder, Grounding};
use crate::perception::model::ObjectBox;
use crate::perception::{Grip, complete, facts_of, merged, proprioception};
use crate::planners::{PlanQuery, Planner};
use crate::planning::{Outcome, PlanRequest, Validation, validate};

/// What an episode is carried out with.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a grounder is known by its name only")]
pub struct EpisodeParts<'a> {
    /// How the domain is seen.
    pub vocabulary: &'a Vocabulary,
    /// The grounder, made from the exemplar.
    pub grounder: &'a dyn Grounder,
    /// The planner.
    pub planner: &'a dyn Planner,
    /// Whether goal atoms that contradict the rest of the goal are dropped.
    pub repair_goals: bool,
}

/// What happened to one pair.
#[derive(Debug, Clone)]
pub struct Episode {
    /// Exemplar and test.
    pub pair: Pair,
    /// Whether the pair counts, by the reference's rule.
    pub evaluated: bool,
    /// The detected objects.
    pub boxes: Vec<ObjectBox>,
    /// Which of them are which.
    pub matching: Matching,
    /// What the grounder said.
    pub grounding: Grounding,
    /// The facts against the true ones.
    pub score: Score,
    /// Every fact that was planned from.
    pub facts: Facts,
    /// The goal over the detected objects, repaired.
    pub goal: Result<Condition, GoalFault>,
    /// What was dropped from the goal, and why.
    pub dropped: Vec<String>,
    /// Whether the assembled problem is one of the domain; if not, why.
    pub problem: Result<(), String>,
    /// What the planner answered, where it was asked.
    pub outcome: Option<Outcome>,
    /// Whether the plan is valid on the assembled problem.
    pub plan_valid: bool,
    /// Whether the plan, renamed, is valid on the true problem; if not, why.
    pub success: Result<(), String>,
    /// How many facts differ from the recorded ones, where those are there.
    pub differs: Option<usize>,
    /// What went wrong, where anything did.
    pub failure: Option<Failure>,
}

impl Episode {
    /// The steps of the plan, where there is one.
    pub fn plan(&self) -> Option<&[Step]> {
        if let Some(Outcome::Solved(plan)) = &self.outcome { Some(&plan.steps) } else { None }
    }
}

/// One pair, as it is given.
#[derive(Debug, Clone, Copy)]
pub struct EpisodeInput<'a> {
    /// Exemplar and test.
    pub pair: Pair,
    /// Whether the pair counts.
    pub evaluated: bool,
    /// The test.
    pub test: &'a Labelled,
    /// What was detected in its photograph.
    pub boxes: &'a [ObjectBox],
    /// Where the goal comes from.
    pub goal: GoalFrom<'a>,
    /// The recorded facts with the boxes that they speak of, where they are there.
    pub recorded: Option<(&'a BTreeSet<Atom>, &'a [ObjectBox])>,
}

/// Detected names to true ones, implied objects included.
pub(super) fn match_all(vocabulary: &Vocabulary, boxes: &[ObjectBox], test: &Labelled) -> Matching {
    let mut matching = matched(boxes, &test.boxes);
    let implied = &vocabulary.folder.perception.implied;
    match_implied(&mut matching, implied, &test.problem.objects, &test.boxes);
    matching
}

/// Carries one pair out.
pub fn carry_out(parts: &EpisodeParts<'_>, input: &EpisodeInput<'_>) -> Episode {
    let EpisodeParts { vocabulary, grounder, planner, .. } = *parts;
    let EpisodeInput { pair, evaluated, test, boxes, .. } = *input;
    let folder = &vocabulary.folder;
    let matching = match_all(vocabulary, boxes, test);
    let objects = objects_of(vocabulary, boxes);
    let grounding = grounder.ground(boxes);
    let score = score(&grounding.judged, &matching, &test.init, &vocabulary.observed);
    // In none of the photographs is anything held that the robot itself would know of.
    let own = proprioception(&folder.domain, &folder.perception, &objects, &Grip::Empty);
    let base = merged(facts_of(&grounding.judged), own);
    let facts = complete(&folder.rules, &folder.domain.types, &objects, &base);
    let read = goal::read(input.goal, vocabulary, (boxes, &objects), &matching);
    let (goal, dropped) = match read {
        Ok(goal) if parts.repair_goals => {
            let (goal, dropped) = goal::repair(&goal, vocabulary);
            (Ok(goal), dropped)
        }
        other => (other, Vec::new()),
    };
    let mut episode = Episode {
        pair,
        evaluated,
        boxes: boxes.to_vec(),
        matching,
        differs: input.recorded.map(|recorded| differing(&grounding, boxes, test, recorded)),
        grounding,
        score,
        facts,
        goal,
        dropped,
        problem: Ok(()),
        outcome: None,
        plan_valid: false,
        success: Err("there is no plan".to_owned()),
        failure: None,
    };
    plan(&mut episode, &folder.domain, planner, (&objects, test));
    episode.failure = stage::failure(&episode, test, &folder.domain, planner);
    episode
}

/// The detected objects, then the implied ones.
pub(super) fn objects_of(vocabulary: &Vocabulary, boxes: &[ObjectBox]) -> Vec<Typed> {
    let seen = boxes.iter().map(|b| Typed::new(b.name.clone(), b.type_name.clone()));
    let implied = &vocabulary.folder.perception.implied;
    let implied = implied.iter().map(|i| Typed::new(i.name.clone(), i.type_name.clone()));
    seen.chain(implied).collect()
}

/// Assembles the problem, plans, and tries the plan on it and on the truth.
fn plan(
    episode: &mut Episode,
    domain: &Domain,
    planner: &dyn Planner,
    (objects, test): (&[Typed], &Labelled),
) {
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
        objects: objects.to_vec(),
        init: episode.facts.known.clone(),
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

/// Plans a problem; no step has failed before.
pub(super) fn solve(domain: &Domain, planner: &dyn Planner, problem: &Problem) -> Outcome {
    let objects: Vec<Typed> = problem.objects.iter().chain(&domain.constants).cloned().collect();
    let query = PlanQuery {
        domain,
        objects: &objects,
        init: &problem.init,
        goal: &problem.goal,
        penalties: &BTreeMap::new(),
        grounded: None,
        hurry: &|| false,
        interrupt: &|| false,
    };
    planner.plan(&query).outcome
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
    let steps = rename::plan(steps, &to)
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
        let named = atoms.iter().filter_map(|atom| rename::atom(atom, &to).ok());
        let named: BTreeSet<Atom> = named.collect();
        let n_unnamed = atoms.len() - named.len();
        (named, n_unnamed)
    };
    let (ours, n_ours) = in_true_names(&predicted, boxes);
    let (theirs, n_theirs) = in_true_names(recorded, recorded_boxes);
    ours.symmetric_difference(&theirs).count() + n_ours + n_theirs
}
