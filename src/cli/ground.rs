//! `groundloop ground`: one image to objects, facts, goal and plan, without a loop.

use std::path::PathBuf;
use std::sync::Arc;

use super::goal::choice;
use super::plan::planner;
use super::reports::{GroundReport, GroundedObject, OutsideThing, lists, steps_of};
use super::services::ServiceArgs;
use super::{Failure, exit, out};
use crate::goals::{GOALS, GoalInputs, GoalObject, GoalView, ParsedGoal};
use crate::mismatch::{Mismatch, listed};
use crate::parts::PartContext;
use crate::perception::{GroundedImage, ImageRegion, NoImageRegion, Outside, phrase_of_name};
use crate::planners::{NO_COSTS, PlanQuery};
use crate::planning::{Budget, NO_PENALTIES, Outcome, PlanRequest};
use crate::run::{
    ConfigError, DomainFolder, ExemplarFiles, StillImageParts, environment, region_at,
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain folder, or the name of a shipped domain.
    #[arg(long)]
    domain: PathBuf,
    /// The image (PNG or JPEG).
    #[arg(long, value_name = "FILE")]
    image: PathBuf,
    /// The labelled example's image.
    #[arg(long, value_name = "FILE")]
    exemplar_image: PathBuf,
    /// The labelled example's boxes: JSON `{"name": [x1, y1, x2, y2]}`.
    #[arg(long, value_name = "FILE")]
    exemplar_boxes: PathBuf,
    /// The labelled example's state: a PDDL problem.
    #[arg(long, value_name = "FILE")]
    exemplar_state: PathBuf,
    /// The part of the image in which objects can be, in shares of width and height from 0 to 1.
    #[arg(long, value_name = "X1,Y1,X2,Y2", value_delimiter = ',', allow_hyphen_values = true)]
    region: Vec<f64>,
    /// The goal in words.
    #[arg(long, value_name = "TEXT", conflicts_with_all = ["goal", "goal_image"])]
    instruction: Option<String>,
    /// The goal in PDDL.
    #[arg(long, value_name = "PDDL", conflicts_with = "goal_image")]
    goal: Option<String>,
    /// The goal as an image of the same camera.
    #[arg(long, value_name = "FILE")]
    goal_image: Option<PathBuf>,
    /// What reads the instruction, if not "instruction": see `groundloop parts goal`.
    #[arg(long, value_name = "KIND", requires = "instruction")]
    goal_kind: Option<String>,
    /// The options of what reads the goal: a TOML file with what `[goal.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    goal_options: Option<PathBuf>,
    /// Which detector finds the objects: see `groundloop parts detector`.
    #[arg(long, value_name = "NAME", default_value = "colour")]
    detector: String,
    /// The detector's own options: a TOML file with what `[perception.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    detector_options: Option<PathBuf>,
    /// Which grounder judges the facts: see `groundloop parts grounder`.
    #[arg(long, value_name = "NAME", default_value = "s2s-joint")]
    grounder: String,
    /// Which planner plans: see `groundloop parts planner`.
    #[arg(long, default_value = "embedded", value_name = "NAME")]
    planner: String,
    /// The planner's own options: a TOML file with what `[planner.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    planner_options: Option<PathBuf>,
    #[command(flatten)]
    services: ServiceArgs,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let folder = Arc::new(DomainFolder::given(&args.domain)?);
    let (image, boxes, state) = (&args.exemplar_image, &args.exemplar_boxes, &args.exemplar_state);
    let example = ExemplarFiles::on_disk(image, boxes, state).read(&folder)?;
    let options = args.detector_options.as_deref();
    let parts = StillImageParts {
        folder: Arc::clone(&folder),
        examples: Arc::new(vec![example]),
        detector: choice("--detector", &args.detector, options)?
            .with_answers(args.services.answers()),
        grounder: choice("--grounder", &args.grounder, None)?,
        region: region(&args.region)?,
    };
    let mut reader = parts.reader()?;
    reader.warn_of_examples();
    let mut grounded = reader.read(&args.image, &[])?;
    let mut goal = read_goal(args, &folder, parts, &grounded)?;
    if let Some(goal) = goal.as_mut().filter(|goal| !goal.expected.is_empty()) {
        let phrases: Vec<String> = goal.expected.iter().map(|e| phrase_of_name(&e.name)).collect();
        grounded = reader.read(&args.image, &phrases)?;
        goal.expected.retain(|e| grounded.state.objects.iter().all(|seen| seen.name != e.name));
        grounded.named.unplaced.iter().for_each(|reason| out::note(&format!("phrase {reason}")));
    }
    let outcome = goal.as_ref().map(|goal| solve(args, &folder, &grounded, goal)).transpose()?;
    report(args, &grounded, goal.as_ref(), outcome.as_ref())?;
    Ok(outcome.as_ref().map_or(0, exit::of))
}

/// The region of the flag, if it is given.
fn region(edges: &[f64]) -> Result<Option<ImageRegion>, Failure> {
    let flag = "--region";
    match *edges {
        [] => Ok(None),
        [x1, y1, x2, y2] => Ok(Some(region_at(flag, [x1, y1, x2, y2]).map_err(ConfigError::from)?)),
        _ => Err(ConfigError::from(Mismatch::new(flag, NoImageRegion, listed(edges))).into()),
    }
}

fn read_goal(
    args: &Args,
    folder: &DomainFolder,
    parts: StillImageParts,
    grounded: &GroundedImage,
) -> Result<Option<ParsedGoal>, Failure> {
    let (origin, kind, text) = match (&args.instruction, &args.goal, &args.goal_image) {
        (Some(text), _, _) => ("--instruction", "instruction", text.clone()),
        (None, Some(text), _) => ("--goal", "logical", text.clone()),
        (None, None, Some(path)) => {
            // Relative to where the program was called, not to the options' folder.
            let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
            ("--goal-image", "image", path.display().to_string())
        }
        (None, None, None) => return Ok(None),
    };
    let kind = args.goal_kind.as_deref().unwrap_or(kind);
    let choice = choice("--goal-kind", kind, args.goal_options.as_deref())?;
    let choice = choice.with_answers(args.services.answers());
    let inputs = GoalInputs {
        perception: Some(&folder.perception),
        read_image: Some(parts.into_read_image()),
        ..GoalInputs::words(origin, &text, folder.language.as_ref())
    };
    let context = PartContext { choice: &choice, inputs, environment };
    let source = GOALS.build(&context).map_err(ConfigError::from)?;
    let objects = GoalObject::of_image(&folder.perception, &grounded.named.boxes);
    let view = GoalView { objects: &objects, facts: Some(&grounded.state.facts) };
    Ok(Some(source.read_in(&folder.domain, view)?))
}

fn solve(
    args: &Args,
    folder: &DomainFolder,
    grounded: &GroundedImage,
    goal: &ParsedGoal,
) -> Result<Outcome, Failure> {
    if let Some(missing) = goal.expected.first() {
        let message = format!("the goal names {}, which is not in the image", missing.name);
        return Err(Failure { message, code: exit::GAVE_UP });
    }
    let request = PlanRequest {
        objects: &grounded.state.objects,
        init: &grounded.state.facts.known,
        goal: &goal.goal,
        costs: &NO_COSTS,
        minimise_cost: false,
        penalties: &NO_PENALTIES,
    };
    let choice = choice("--planner", &args.planner, args.planner_options.as_deref())?;
    let planner = planner(&choice, &Budget::standard())?;
    Ok(planner.plan(&PlanQuery::once(&folder.domain, &request)).outcome)
}

fn report(
    args: &Args,
    grounded: &GroundedImage,
    goal: Option<&ParsedGoal>,
    outcome: Option<&Outcome>,
) -> Result<(), Failure> {
    let goal_text = goal.map(|goal| goal.goal.to_string());
    let steps = outcome.and_then(steps_of);
    let anomalies: Vec<String> =
        grounded.state.grounding.anomalies.iter().map(ToString::to_string).collect();
    if args.json {
        let objects = grounded.named.boxes.iter().zip(&grounded.named.detections.objects);
        let objects = objects.map(|(object, detection)| GroundedObject {
            name: object.name.to_string(),
            type_name: object.type_name.to_string(),
            pixel_box: object.pixel_box.into(),
            score: detection.score,
        });
        let outside = grounded.named.detections.outside.iter().map(|thing| OutsideThing {
            label: thing.detection.label.to_string(),
            type_name: thing.detection.type_name.to_string(),
            pixel_box: thing.detection.pixel_box.into(),
            reason: thing.reason.to_string(),
        });
        return out::json(&GroundReport {
            objects: objects.collect(),
            outside: outside.collect(),
            facts: lists(&grounded.state.facts.known),
            unknown: lists(&grounded.state.facts.unknown),
            anomalies,
            goal: goal_text,
            verdict: outcome.map(Outcome::word),
            reason: outcome.and_then(Outcome::reason),
            plan: steps,
        });
    }
    for object in &grounded.named.boxes {
        let [x1, y1, x2, y2]: [f64; 4] = object.pixel_box.into();
        let place = format!("{x1:.0} {y1:.0} {x2:.0} {y2:.0}");
        out::line(&format!("object  {:20} {:8} {place}", object.name, object.type_name));
    }
    for Outside { detection: thing, reason, .. } in &grounded.named.detections.outside {
        let [x1, y1, x2, y2]: [f64; 4] = thing.pixel_box.into();
        let place = format!("{x1:.0} {y1:.0} {x2:.0} {y2:.0}");
        out::line(&format!("outside {:20} {:8} {place}: {reason}", thing.label, thing.type_name));
    }
    grounded.state.facts.known.iter().for_each(|atom| out::line(&format!("fact    {atom}")));
    grounded.state.facts.unknown.iter().for_each(|atom| out::line(&format!("unknown {atom}")));
    for anomaly in &anomalies {
        out::line(&format!("anomaly {anomaly}"));
    }
    if let Some(goal) = goal_text {
        out::line(&format!("goal    {goal}"));
    }
    match (steps, outcome) {
        (Some(steps), _) => steps.iter().for_each(|step| out::line(&format!("plan    {step}"))),
        (None, Some(outcome)) => out::note(&format!("no plan: {outcome}")),
        (None, None) => {}
    }
    Ok(())
}
