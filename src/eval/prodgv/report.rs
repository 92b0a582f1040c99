//! What came out, as figures: the JSON of `groundloop eval prodg-v --json`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::evaluate::Evaluation;
use super::jitter::Jitter;
use super::pair::Failure;
use super::published::Published;
use super::score::FactCounts;

/// Output of `groundloop eval prodg-v --json`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EvaluationReport {
    /// Name of the grounder.
    pub grounder: String,
    /// Value of `--detections`: where the boxes came from.
    pub detections: String,
    /// Value of `--goals`: where the goals came from.
    pub goals: String,
    /// Name of the planner.
    pub planner: String,
    /// Whether goal atoms that contradict the rest of their goal were dropped.
    pub repair_goals: bool,
    /// What was measured, by domain.
    pub domains: BTreeMap<String, DomainReport>,
    /// The noise that `jitter` of each domain was measured with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<Jitter>,
    /// Figures quoted from the paper; none of them is measured here.
    pub published: Vec<Published>,
}

/// A part and a whole.
pub type Ratio = [usize; 2];

/// What was measured in one domain.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DomainReport {
    /// Always `measured`.
    pub source: &'static str,
    /// Evaluated pairs.
    pub pairs: usize,
    /// True positives: predicted facts that hold.
    pub tp: usize,
    /// False positives: predicted facts that do not hold.
    pub fp: usize,
    /// False negatives: labelled facts that are not predicted; one that is labelled twice counts twice.
    #[serde(rename = "fn")]
    pub fn_: usize,
    /// Precision, `tp / (tp + fp)`; `null` when nothing is predicted.
    pub precision: Option<f64>,
    /// Recall, `tp / (tp + fn)`; `null` when there is nothing to predict.
    pub recall: Option<f64>,
    /// F1, the harmonic mean of precision and recall.
    pub f1: Option<f64>,
    /// Pairs whose state is exactly right by the reference's metric: no wrong and no missing fact.
    pub exact_states: usize,
    /// Pairs whose state is strictly right: also every detection is one object of its type, none is
    /// missed or invented, and no fact is unknown.
    pub strict_states: usize,
    /// Facts that are judged unknown; they are not predicted.
    pub unknown: usize,
    /// Predicted facts that a constraint of the domain decided.
    pub inferred: usize,
    /// Anomalies: observations that no consistent state explains.
    pub anomalies: usize,
    /// Goals that lost an atom which contradicted the rest.
    pub goals_repaired: usize,
    /// Generated problems that parse against the domain, over all ordered pairs.
    pub problem_valid: Ratio,
    /// Plans that are valid on their own problem, over the evaluated pairs.
    pub plan_valid_pairs: Ratio,
    /// Plans that are valid on their own problem, over all ordered pairs.
    pub plan_valid_all: Ratio,
    /// Plans that are valid on the true problem, over the evaluated pairs.
    pub success: Ratio,
    /// Facts that differ from the recorded ones, over all ordered pairs; `null` without any.
    pub differs_from_recorded: Option<usize>,
    /// Evaluated pairs whose plan fails or whose state is not exactly right.
    pub failures: Vec<Failure>,
    /// Problems and pairs that cannot be evaluated, and what is missing.
    pub left_out: Vec<String>,
    /// Means over the seeds, with noise on the boxes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<JitterReport>,
    /// Pair by pair, on request.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub details: Vec<PairReport>,
}

/// Means over the seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct JitterReport {
    /// Mean of the precisions.
    pub precision: Option<f64>,
    /// Mean of the recalls.
    pub recall: Option<f64>,
    /// Mean of the harmonic means.
    pub f1: Option<f64>,
    /// Mean number of states that are exactly right.
    pub exact_states: f64,
    /// Mean number of unknown facts.
    pub unknown: f64,
}

/// What was measured of one pair.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[expect(clippy::struct_excessive_bools, reason = "a row of a report: each is a figure of its own")]
pub struct PairReport {
    /// Number of the problem that is the exemplar.
    pub exemplar: u32,
    /// Number of the problem that is read.
    pub test: u32,
    /// Whether the pair counts.
    pub evaluated: bool,
    /// True positives: predicted facts that hold.
    pub tp: usize,
    /// False positives: predicted facts that do not hold.
    pub fp: usize,
    /// False negatives: labelled facts that are not predicted.
    #[serde(rename = "fn")]
    pub fn_: usize,
    /// Facts that are judged unknown.
    pub unknown: usize,
    /// Facts that a constraint of the domain decided.
    pub inferred: usize,
    /// Facts that differ from the recorded ones; `null` without any.
    pub differs_from_recorded: Option<usize>,
    /// Wrong facts, with the names of the detections.
    pub wrong: Vec<String>,
    /// Missing facts, with the true names.
    pub missing: Vec<String>,
    /// Objects that are missed, invented or of another type, in words.
    pub object_faults: Vec<String>,
    /// Whether the state is strictly right: facts and objects.
    pub strictly_right: bool,
    /// Anomalies: observations that no consistent state explains.
    pub anomalies: Vec<String>,
    /// The goal over the detections, or why there is none.
    pub goal: String,
    /// What was dropped from the goal.
    pub dropped: Vec<String>,
    /// Length of the plan, where there is one.
    pub plan_steps: Option<usize>,
    /// Whether the plan is valid on its own problem.
    pub plan_valid: bool,
    /// Whether the plan is valid on the true problem.
    pub success: bool,
}

/// The figures of one domain; `details` asks for those of each pair too.
pub fn domain_report(evaluation: &Evaluation, left_out: &[String], details: bool) -> DomainReport {
    let episodes = &evaluation.episodes;
    let mut counts = FactCounts::default();
    let evaluated = || episodes.iter().filter(|episode| episode.evaluated);
    evaluated().for_each(|episode| counts.add(&episode.score));
    let n_pairs = counts.pairs;
    let valid = evaluated().filter(|e| e.plan_valid).count();
    let all = |n: usize| [n, episodes.len()];
    let pairs = evaluation.left_out.iter();
    let pairs = pairs.map(|((e, t), why)| format!("exemplar {e}, test {t}: {why}"));
    let differs: Vec<usize> = episodes.iter().filter_map(|e| e.differs).collect();
    DomainReport {
        source: "measured",
        pairs: n_pairs,
        tp: counts.tp,
        fp: counts.fp,
        fn_: counts.fn_,
        precision: counts.precision(),
        recall: counts.recall(),
        f1: counts.f1(),
        exact_states: counts.exact,
        strict_states: evaluated().filter(|e| e.is_strictly_right()).count(),
        unknown: counts.unknown,
        inferred: counts.inferred,
        anomalies: evaluated().map(|e| e.state.grounding.anomalies.len()).sum(),
        goals_repaired: evaluated().filter(|e| !e.dropped.is_empty()).count(),
        problem_valid: all(episodes.iter().filter(|e| e.problem.is_ok()).count()),
        plan_valid_pairs: [valid, n_pairs],
        plan_valid_all: all(episodes.iter().filter(|e| e.plan_valid).count()),
        success: [evaluated().filter(|e| e.success.is_ok()).count(), n_pairs],
        differs_from_recorded: (!differs.is_empty()).then(|| differs.iter().sum()),
        failures: evaluated().filter_map(|e| e.failure.clone()).collect(),
        left_out: left_out.iter().cloned().chain(pairs).collect(),
        jitter: jitter_report(&evaluation.jittered),
        details: if details { episodes.iter().map(pair_report).collect() } else { Vec::new() },
    }
}

fn jitter_report(seeds: &[FactCounts]) -> Option<JitterReport> {
    let mean = |value: &dyn Fn(&FactCounts) -> Option<f64>| {
        let values: Option<Vec<f64>> = seeds.iter().map(value).collect();
        values.map(|values| values.iter().sum::<f64>() / seeds.len() as f64)
    };
    let whole = |value: fn(&FactCounts) -> usize| mean(&|counts| Some(value(counts) as f64));
    (!seeds.is_empty()).then(|| JitterReport {
        precision: mean(&FactCounts::precision),
        recall: mean(&FactCounts::recall),
        f1: mean(&FactCounts::f1),
        exact_states: whole(|counts| counts.exact).unwrap_or_default(),
        unknown: whole(|counts| counts.unknown).unwrap_or_default(),
    })
}

fn pair_report(episode: &super::PairResult) -> PairReport {
    fn texts<T: ToString>(list: &[T]) -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    }
    let score = &episode.score;
    let anomalies = episode.state.grounding.anomalies.iter().map(ToString::to_string);
    let goal = match &episode.goal {
        Ok(goal) => goal.to_string(),
        Err(fault) => fault.why.clone(),
    };
    PairReport {
        exemplar: episode.pair.0,
        test: episode.pair.1,
        evaluated: episode.evaluated,
        tp: score.tp,
        fp: score.wrong.len(),
        fn_: score.missing.len(),
        unknown: score.unknown,
        inferred: score.inferred,
        differs_from_recorded: episode.differs,
        wrong: texts(&score.wrong),
        missing: texts(&score.missing),
        object_faults: episode.object_faults.clone(),
        strictly_right: episode.is_strictly_right(),
        anomalies: anomalies.collect(),
        goal,
        dropped: episode.dropped.clone(),
        plan_steps: episode.plan().map(<[_]>::len),
        plan_valid: episode.plan_valid,
        success: episode.success.is_ok(),
    }
}
