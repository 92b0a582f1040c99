//! One (exemplar, test) pair: what it is given and what came of it.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::goal::{GoalFault, GoalFrom};
use super::matching::Matching;
use super::recorded::Pair;
use super::score::Score;
use super::{FittedDomain, Labelled};
use crate::pddl::{Atom, Condition, Domain, Problem, Step, Typed};
use crate::perception::grounders::Grounder;
use crate::perception::model::ObjectBox;
use crate::perception::{Observation, State};
use crate::planners::{NO_COSTS, PlanQuery, Planner};
use crate::planning::{NO_PENALTIES, Outcome, PlanRequest};

/// What an episode is carried out with.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a grounder is known by its name only")]
pub struct PairParts<'a> {
    /// How the domain is seen.
    pub fitted: &'a FittedDomain,
    /// The grounder, made from the exemplar.
    pub grounder: &'a dyn Grounder,
    /// Plans from the facts that were read.
    pub planner: &'a dyn Planner,
    /// Whether goal atoms that contradict the rest of the goal are dropped.
    pub repair_goals: bool,
}

/// What happened to one pair.
#[derive(Debug, Clone)]
pub struct PairResult {
    /// Exemplar and test.
    pub pair: Pair,
    /// Whether the pair counts, by the reference's rule.
    pub evaluated: bool,
    /// The detected objects.
    pub boxes: Vec<ObjectBox>,
    /// Objects that are missed, invented or of another type, each in words.
    pub object_faults: Vec<String>,
    /// Which of them are which.
    pub matching: Matching,
    /// The state that they are read to be in: what was planned from.
    pub state: State,
    /// The facts against the true ones.
    pub score: Score,
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

impl PairResult {
    /// Whether the state is right without an exception: its objects too, and nothing unknown.
    ///
    /// The reference counts wrong and missing facts only. A state in which an object is missed of
    /// which no fact is listed, or one is invented of which none is predicted, is exact by its metric.
    pub fn is_strictly_right(&self) -> bool {
        self.object_faults.is_empty() && self.score.is_exact() && self.score.unknown == 0
    }

    /// The steps of the plan, where there is one.
    pub fn plan(&self) -> Option<&[Step]> {
        if let Some(Outcome::Solved(plan)) = &self.outcome { Some(&plan.steps) } else { None }
    }
}

/// One pair, as it is given.
#[derive(Debug, Clone, Copy)]
pub struct PairInput<'a> {
    /// Exemplar and test.
    pub pair: Pair,
    /// Whether the pair counts.
    pub evaluated: bool,
    /// The test.
    pub test: &'a Labelled,
    /// What was detected in its photograph, which is there where somebody looks at it.
    pub observation: Observation<'a>,
    /// Where the goal comes from.
    pub goal: GoalFrom<'a>,
    /// The recorded facts with the boxes that they speak of, where they are there.
    pub recorded: Option<(&'a BTreeSet<Atom>, &'a [ObjectBox])>,
}

/// Where a failure comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Pixels to objects.
    Detection,
    /// Objects to facts.
    Grounding,
    /// Words to goal.
    Goal,
    /// Facts and goal to plan.
    Planning,
}

impl Stage {
    /// Its name in reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Detection => "detection",
            Self::Grounding => "grounding",
            Self::Goal => "goal",
            Self::Planning => "planning",
        }
    }
}

/// A pair whose plan fails or whose state is not exactly right.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Failure {
    /// Number of the exemplar.
    pub exemplar: u32,
    /// Number of the test.
    pub test: u32,
    /// The first stage that is wrong.
    pub stage: Stage,
    /// What is wrong, in words.
    pub why: String,
}

/// Plans a problem; no step has failed before.
pub(super) fn solve(domain: &Domain, planner: &dyn Planner, problem: &Problem) -> Outcome {
    let objects: Vec<Typed> = problem.objects.iter().chain(&domain.constants).cloned().collect();
    let request = PlanRequest {
        objects: &objects,
        init: &problem.init,
        goal: &problem.goal,
        costs: &NO_COSTS,
        minimise_cost: false,
        penalties: &NO_PENALTIES,
    };
    let query = PlanQuery::once(domain, &request);
    planner.plan(&query).outcome
}
