//! What `--json` writes: one struct for each verb, described by the JSON Schemas in `docs/schemas/`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::doctor::DoctorFinding;
use crate::domain_check::DomainFinding;
use crate::messages::{TaskState, Verdict};
use crate::metrics::EpisodeReport;
use crate::parts::PartOption;
use crate::pddl::{Atom, Step};
use crate::perception::self_check::FindingKind;
use crate::planning::{Explanation, Outcome, Proof};

/// Output of `groundloop run --json`: one episode, or all of them with `--episodes`.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(title = "groundloop run --json")]
pub(super) enum RunReport<'a> {
    /// One episode.
    One(&'a EpisodeReport),
    /// Several episodes.
    Several {
        /// In the order of their seeds.
        episodes: &'a [EpisodeReport],
        /// Episodes that ended without a verdict; left out when there are none.
        #[serde(skip_serializing_if = "<[_]>::is_empty")]
        errors: &'a [EpisodeError],
    },
}

/// An episode that ended without a verdict.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct EpisodeError {
    /// Its seed.
    pub(super) seed: u64,
    /// Why.
    pub(super) reason: String,
}

/// Output of `groundloop plan --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop plan --json")]
pub(super) struct PlanReport {
    /// How the call ended.
    #[schemars(extend("enum" = Outcome::WORDS))]
    pub(super) verdict: &'static str,
    /// Why there is no plan, in words: the proof, the limit with its value, the feature that is not
    /// supported, or what does not fit. `null` with a plan.
    pub(super) reason: Option<String>,
    /// Cost of the plan: the sum of the action costs if the problem has a metric, else its length.
    pub(super) cost: Option<f64>,
    /// Whether the plan is proven to be cheapest.
    pub(super) optimal: Option<bool>,
    /// No plan is cheaper than this; 0 if nothing is known.
    pub(super) lower_bound: Option<f64>,
    /// What is known of cheaper plans, and what ended the search for one; `null` where the plan is
    /// proven to be cheapest, and where there is none.
    pub(super) unproven: Option<String>,
    /// Kind of the proof that there is no plan.
    #[schemars(extend("enum" = with_null(&Proof::KINDS)))]
    pub(super) proof: Option<&'static str>,
    /// The steps in order, each as `(action object …)`.
    pub(super) plan: Option<Vec<String>>,
    /// States that all searches have expanded.
    pub(super) expanded: u64,
    /// Wall-clock times in microseconds.
    pub(super) time_us: PlanTimes,
}

/// Wall-clock times in microseconds.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct PlanTimes {
    /// Reading and checking domain and problem.
    pub(super) parse: u64,
    /// Grounding and search.
    pub(super) plan: u64,
    /// Both, and the validation of the plan.
    pub(super) total: u64,
}

/// Output of `groundloop validate --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop validate --json")]
pub(super) struct ValidationReport {
    /// Whether every step is applicable and the goal holds at the end.
    pub(super) valid: bool,
    /// Cost of a valid plan: the sum of the action costs if the problem has a metric, else its
    /// length.
    pub(super) cost: Option<f64>,
    /// How many steps the plan has.
    pub(super) steps: usize,
    /// Index of the first step that is not applicable, from 0; `null` if all are, and the goal does
    /// not hold at the end.
    pub(super) step_idx: Option<usize>,
    /// Why the plan is not valid.
    pub(super) reason: Option<String>,
    /// More about a plan that is not valid, with `--explain`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) explanation: Option<ExplanationReport>,
}

/// More about a plan that is not valid.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct ExplanationReport {
    /// What had to hold, as PDDL; `null` where the step is none of the domain's.
    pub(super) needed: Option<String>,
    /// The parts of it that do not hold.
    pub(super) missing: Vec<MissingReport>,
    /// What to change, in words; `null` where nothing was found.
    pub(super) repair: Option<String>,
    /// The plan with that change.
    pub(super) repaired: Option<Vec<String>>,
}

/// A part of a condition that does not hold.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct MissingReport {
    /// As PDDL.
    pub(super) part: String,
    /// Index of the last step that changed its atom, from 0; `null` where none did.
    pub(super) changed_by: Option<usize>,
}

impl ExplanationReport {
    /// As text.
    pub(super) fn new(explanation: &Explanation) -> Self {
        let Explanation { needed, missing, repair, .. } = explanation;
        let texts = |steps: &[Step]| steps.iter().map(ToString::to_string).collect();
        let missing = missing.iter().map(|missing| MissingReport {
            part: missing.part.to_string(),
            changed_by: missing.changed_by.as_ref().map(|(idx, _)| *idx),
        });
        Self {
            needed: needed.as_ref().map(ToString::to_string),
            missing: missing.collect(),
            repair: repair.as_ref().map(|repair| repair.text.clone()),
            repaired: repair.as_ref().map(|repair| texts(&repair.steps)),
        }
    }
}

/// A thing outside of where objects stand.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct OutsideThing {
    /// What the detector calls it: a colour, or a class text.
    pub(super) label: String,
    /// The type whose objects it looks like.
    #[serde(rename = "type")]
    pub(super) type_name: String,
    /// Left, upper, right and lower edge in pixels.
    #[serde(rename = "box")]
    pub(super) pixel_box: [f64; 4],
    /// Why it is no object.
    pub(super) reason: String,
}

/// Output of `groundloop ground --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop ground --json")]
pub(super) struct GroundReport {
    /// The objects that were detected.
    pub(super) objects: Vec<GroundedObject>,
    /// What looks like an object and stands elsewhere than the labelled ones: not an object.
    pub(super) outside: Vec<OutsideThing>,
    /// The facts that hold, derived ones included, each as `["predicate", "object", …]`.
    pub(super) facts: Vec<Vec<String>>,
    /// The facts that may hold or not, in the same form; all others do not hold.
    pub(super) unknown: Vec<Vec<String>>,
    /// Observations that no consistent state explains, in words.
    pub(super) anomalies: Vec<String>,
    /// The goal as a PDDL condition; `null` if none was given.
    pub(super) goal: Option<String>,
    /// How planning ended; `null` without a goal.
    #[schemars(extend("enum" = with_null(&Outcome::WORDS)))]
    pub(super) verdict: Option<&'static str>,
    /// Why there is no plan, in words; `null` with a plan, or without a goal.
    pub(super) reason: Option<String>,
    /// The steps in order, each as `(action object …)`.
    pub(super) plan: Option<Vec<String>>,
}

/// An object in the image.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct GroundedObject {
    /// Its name, as facts and goal use it.
    pub(super) name: String,
    /// Its PDDL type.
    #[serde(rename = "type")]
    pub(super) type_name: String,
    /// Its box in pixels: left, top, right, bottom.
    #[serde(rename = "box")]
    pub(super) pixel_box: [f64; 4],
    /// The detector's confidence, from 0 to 1.
    pub(super) score: f32,
}

/// Output of `groundloop exemplar check --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop exemplar check --json")]
pub(super) struct ExemplarCheckReport {
    /// Whether nothing was found.
    pub(super) right: bool,
    /// What was found, by camera.
    pub(super) cameras: Vec<CheckedCamera>,
}

/// The labelled examples of one camera.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct CheckedCamera {
    /// The camera of the run file; `main` for loose files.
    pub(super) camera: String,
    /// How many examples it has.
    pub(super) examples: usize,
    /// How many objects are labelled in them.
    pub(super) objects: usize,
    /// What is not as labelled.
    pub(super) findings: Vec<ExemplarFindingReport>,
}

/// One thing that is not as labelled.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct ExemplarFindingReport {
    /// The file of the example's boxes; `null` for what is about all examples.
    pub(super) example: Option<String>,
    /// What kind of thing.
    #[schemars(extend("enum" = FindingKind::WORDS))]
    pub(super) kind: &'static str,
    /// The labelled object; `null` where there is none.
    pub(super) object: Option<String>,
    /// The fact that is read otherwise, as `(predicate object …)`.
    pub(super) fact: Option<String>,
    /// The predicate that is not taught.
    pub(super) predicate: Option<String>,
    /// The labelled box in pixels: left, top, right, bottom.
    pub(super) labelled_box: Option<[f64; 4]>,
    /// The detected box in pixels: left, top, right, bottom.
    pub(super) found_box: Option<[f64; 4]>,
    /// What is wrong, why, and what to do, in words.
    pub(super) message: String,
}

/// Output of `groundloop domain check --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop domain check --json")]
pub(super) struct DomainCheckReport {
    /// The folder.
    pub(super) folder: String,
    /// Whether nothing was found.
    pub(super) right: bool,
    /// What is missing in it, or at odds with another of its files.
    pub(super) findings: Vec<DomainFinding>,
}

/// Output of `groundloop goal --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop goal --json")]
pub(super) struct GoalReport {
    /// The goal as a PDDL condition.
    pub(super) goal: String,
    /// What each phrase of the instruction refers to.
    pub(super) phrases: Vec<GoalPhrase>,
    /// Objects that the goal names and that are not in the scene.
    pub(super) expected: Vec<ExpectedObject>,
    /// What the goal source has to say about its answer.
    pub(super) notes: Vec<String>,
    /// The goal told back in the domain's words, one clause each; empty where its source has no words.
    pub(super) said: Vec<String>,
}

/// A phrase of an instruction.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct GoalPhrase {
    /// As it stands in the instruction.
    pub(super) text: String,
    /// The objects it refers to, in words: `a`, `a and b`, or `every type`.
    pub(super) means: String,
}

/// An object that a goal names.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct ExpectedObject {
    /// Its name.
    pub(super) name: String,
    /// Its PDDL type.
    #[serde(rename = "type")]
    pub(super) type_name: Option<String>,
}

/// Output of `groundloop eval sim-grounding --json`.
#[cfg(feature = "sim")]
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop eval sim-grounding --json")]
pub(super) struct SimGroundingReport {
    /// First and last seed of the scenes.
    pub(super) seeds: [u64; 2],
    /// What was measured, by domain, camera, source of the objects, and features; none with `--over`.
    pub(super) rows: Vec<SimGroundingRow>,
    /// What was measured with `--over`, by domain, factor, level, source of the objects, and features.
    pub(super) factors: Vec<crate::eval::grounding_factors::FactorRow>,
}

/// One combination, with the shares that follow from its counts.
#[cfg(feature = "sim")]
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SimGroundingRow {
    #[serde(flatten)]
    pub(super) row: crate::eval::sim_grounding::Row,
    /// The share of the predicted facts that hold; 1 if none is predicted.
    pub(super) precision: f64,
    /// The share of the facts that hold that are predicted; 1 if none holds.
    pub(super) recall: f64,
}

/// Facts as `["predicate", "object", …]`.
pub(super) fn lists<'a>(atoms: impl IntoIterator<Item = &'a Atom>) -> Vec<Vec<String>> {
    let list = |atom: &Atom| {
        let names = std::iter::once(&atom.predicate).chain(&atom.args);
        names.map(ToString::to_string).collect()
    };
    atoms.into_iter().map(list).collect()
}

/// The steps of a plan, where there is one.
pub(super) fn steps_of(outcome: &Outcome) -> Option<Vec<String>> {
    let Outcome::Solved(plan) = outcome else { return None };
    Some(plan.steps.iter().map(ToString::to_string).collect())
}

/// The values of a field that may be `null`.
fn with_null(words: &[&'static str]) -> Vec<Option<&'static str>> {
    words.iter().copied().map(Some).chain([None]).collect()
}

/// Output of `groundloop parts --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop parts --json")]
pub(super) struct PartsReport {
    /// The kinds of parts.
    pub(super) kinds: Vec<PartKind>,
}

/// The parts of one kind.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct PartKind {
    /// The kind, such as "detector".
    pub(super) kind: &'static str,
    /// The key that names a part of this kind.
    pub(super) key: &'static str,
    /// The table with its options.
    pub(super) options: &'static str,
    /// Its parts, by their names in alphabetical order.
    pub(super) parts: Vec<ListedPart>,
}

/// One part.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct ListedPart {
    /// What names it.
    pub(super) name: &'static str,
    /// What it is.
    pub(super) help: &'static str,
    /// What can be said of it.
    pub(super) options: Vec<PartOption>,
}

/// Output of `groundloop config show --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop config show --json")]
pub(super) struct ConfigReport {
    /// The file.
    pub(super) file: String,
    /// Its settings with all that they are laid over: what `groundloop config schema` describes, or
    /// with `--stress` for the file of a stress test.
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub(super) values: toml::Table,
    /// Where each value was written, by its dotted key.
    pub(super) origins: BTreeMap<String, KeyOrigin>,
}

/// Where a value was written.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct KeyOrigin {
    /// In the defaults, in a file, or in a `--set`.
    #[schemars(extend("enum" = ["default", "file", "set"]))]
    pub(super) kind: &'static str,
    /// The file; `null` if it is in none.
    pub(super) file: Option<String>,
    /// The line in that file, from 1.
    pub(super) line: Option<usize>,
}

/// A line of the output of `groundloop serve --json`: one goal that nothing more comes of.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop serve --json")]
pub(super) struct ServeReport<'a> {
    /// The identity that whoever submitted the goal gave it.
    pub(super) id: &'a str,
    /// The goal as it was submitted.
    pub(super) text: &'a str,
    /// What has become of it.
    #[schemars(extend("enum" = TaskState::WORDS))]
    pub(super) state: &'static str,
    /// Why.
    pub(super) reason: String,
    /// Its episode; `null` where that has not come to a verdict.
    pub(super) episode: Option<&'a EpisodeReport>,
}

/// Output of `groundloop task submit --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop task submit --json")]
pub(super) struct TaskReport<'a> {
    /// The goal's identity.
    pub(super) id: &'a str,
    /// The goal as it was submitted.
    pub(super) text: &'a str,
    /// What has become of it.
    #[schemars(extend("enum" = TaskState::WORDS))]
    pub(super) state: &'static str,
    /// How its episode ended; `null` without one.
    #[schemars(extend("enum" = with_null(&Verdict::WORDS)))]
    pub(super) verdict: Option<&'static str>,
    /// Why.
    pub(super) reason: String,
    /// What was read out of the text, as PDDL; `null` without an episode.
    pub(super) goal: Option<&'a str>,
    /// How long its episode took in run time, seconds; `null` without one.
    pub(super) run_s: Option<f64>,
    /// Whether the goal really holds, where the world is simulated.
    pub(super) goal_in_simulator: Option<bool>,
}

/// Output of `groundloop doctor --json`.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(title = "groundloop doctor --json")]
pub(super) struct DoctorReport {
    /// The run file whose needs were checked; `null` without one, or with one that cannot be used.
    pub(super) run_file: Option<String>,
    /// How many findings are faults: with one the exit code is 6.
    pub(super) n_faults: usize,
    /// How many findings are warnings.
    pub(super) n_warnings: usize,
    /// With `--clean` how many files were removed, and their bytes.
    pub(super) cleaned: Option<[u64; 2]>,
    /// All findings, in the order of the checks.
    pub(super) findings: Vec<DoctorFinding>,
}
