//! `groundloop ground`: one image to objects, facts, goal and plan, without a loop.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{Failure, exit, out};
use crate::config::{ConfigError, DomainFolder, exemplar_from_files, read_image, read_text};
use crate::detectors::{
    GroundedImage, ImageView, Pipeline, ground_image, label_of, phrase_of_name,
};
use crate::goals::{self, GoalObject, GoalSettings, ParsedGoal};
use crate::grounding::Grip;
use crate::pddl::Atom;
use crate::planning::{Budget, NO_PENALTIES, Outcome, PlanRequest, plan};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain folder.
    #[arg(long)]
    domain: PathBuf,
    /// The image (PNG or JPEG).
    #[arg(long)]
    image: PathBuf,
    /// The labelled example's image.
    #[arg(long)]
    exemplar_image: PathBuf,
    /// The labelled example's boxes: JSON `{"name": [x1, y1, x2, y2]}`.
    #[arg(long)]
    exemplar_boxes: PathBuf,
    /// The labelled example's state: a PDDL problem.
    #[arg(long)]
    exemplar_state: PathBuf,
    /// The goal in words.
    #[arg(long, conflicts_with = "goal")]
    instruction: Option<String>,
    /// The goal in PDDL.
    #[arg(long)]
    goal: Option<String>,
    /// Which detector finds the objects.
    #[arg(long, default_value = "colour")]
    detector: String,
    /// The detector's own options: a TOML file with what `[perception.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    detector_options: Option<PathBuf>,
    /// Which grounder judges the facts.
    #[arg(long, default_value = "s2s")]
    grounder: String,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let folder = DomainFolder::read(&args.domain)?;
    let example = exemplar_from_files(
        &args.exemplar_image,
        &args.exemplar_boxes,
        &args.exemplar_state,
        &folder,
    )?;
    let picture = read_image(&args.image)?;
    let [width, height] = example.1.image_size;
    if [picture.width(), picture.height()] != [width, height] {
        return Err(Failure::bad_input(format!(
            "{}: expected {width}x{height} pixels like the labelled example, got {}x{}",
            args.image.display(),
            picture.width(),
            picture.height(),
        )));
    }
    let examples = [example];
    let options = args.detector_options.as_deref().map(read_options).transpose()?;
    let base = args.detector_options.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let mut detector = folder.detector(&args.detector, (options.as_ref(), base), &examples)?;
    let grounder = folder.grounder(&args.grounder, &examples)?;
    let pipeline = Pipeline {
        domain: &folder.domain,
        perception: &folder.perception,
        rules: &folder.rules,
        grounder: &*grounder,
    };
    let view = ImageView::new(width as usize, height as usize, picture.as_raw())
        .map_err(Failure::bad_input)?;
    let grounded = ground_image(&pipeline, &mut *detector, &view, &[], &Grip::Empty)
        .map_err(ConfigError::from)?;
    let mut goal = read_goal(args, &folder, &grounded)?;
    let mut grounded = grounded;
    if let Some(goal) = goal.as_mut().filter(|goal| !goal.expected.is_empty()) {
        let phrases: Vec<String> = goal.expected.iter().map(|e| phrase_of_name(&e.name)).collect();
        grounded = ground_image(&pipeline, &mut *detector, &view, &phrases, &Grip::Empty)
            .map_err(ConfigError::from)?;
        goal.expected.retain(|e| grounded.objects.iter().all(|seen| seen.name != e.name));
        grounded.unplaced.iter().for_each(|reason| out::note(&format!("phrase {reason}")));
    }
    let outcome = goal.as_ref().map(|goal| solve(&folder, &grounded, goal)).transpose()?;
    report(args, &grounded, goal.as_ref(), outcome.as_ref())?;
    Ok(match &outcome {
        None | Some(Outcome::Solved(_)) => 0,
        Some(Outcome::Unsolvable { .. }) => exit::UNSOLVABLE,
        Some(Outcome::OutOfBudget { .. }) => exit::GAVE_UP,
        Some(Outcome::Unsupported { .. } | Outcome::BadInput { .. }) => exit::BAD_INPUT,
    })
}

/// The options of a detector, from a file of their own.
fn read_options(path: &Path) -> Result<toml::Table, ConfigError> {
    read_text(path)?.parse().map_err(|e: toml::de::Error| ConfigError::Toml {
        path: path.display().to_string(),
        message: e.to_string(),
    })
}

fn read_goal(
    args: &Args,
    folder: &DomainFolder,
    grounded: &GroundedImage,
) -> Result<Option<ParsedGoal>, Failure> {
    let (kind, text) = match (&args.instruction, &args.goal) {
        (Some(text), _) => ("instruction", text),
        (None, Some(text)) => ("logical", text),
        (None, None) => return Ok(None),
    };
    let settings = GoalSettings {
        origin: format!("--{}", if kind == "logical" { "goal" } else { kind }),
        text: text.clone(),
        language: folder.language.clone(),
    };
    let seen = grounded.boxes.iter().map(|b| GoalObject {
        name: b.name.clone(),
        type_name: b.type_name.clone(),
        colour: folder
            .perception
            .type_spec(&b.type_name)
            .and_then(|spec| label_of(spec, &b.name).cloned()),
        pixel_box: Some(b.pixel_box),
    });
    let implied = folder.perception.implied.iter().map(|i| GoalObject {
        name: i.name.clone(),
        type_name: i.type_name.clone(),
        colour: None,
        pixel_box: None,
    });
    let objects: Vec<GoalObject> = seen.chain(implied).collect();
    let source = goals::build(kind, &settings).map_err(|e| Failure::bad_input(e.render()))?;
    let goal = source.read(&folder.domain, &objects);
    goal.map(Some).map_err(|e| Failure::bad_input(e.render()))
}

fn solve(
    folder: &DomainFolder,
    grounded: &GroundedImage,
    goal: &ParsedGoal,
) -> Result<Outcome, Failure> {
    if let Some(missing) = goal.expected.first() {
        let message = format!("the goal names {}, which is not in the image", missing.name);
        return Err(Failure { message, code: exit::GAVE_UP });
    }
    let costs = std::collections::BTreeMap::new();
    let request = PlanRequest {
        objects: &grounded.objects,
        init: &grounded.facts.known,
        goal: &goal.goal,
        costs: &costs,
        minimise_cost: false,
        penalties: &NO_PENALTIES,
    };
    Ok(plan(&folder.domain, &request, &Budget::standard()).outcome)
}

fn report(
    args: &Args,
    grounded: &GroundedImage,
    goal: Option<&ParsedGoal>,
    outcome: Option<&Outcome>,
) -> Result<(), Failure> {
    let goal_text = goal.map(|goal| goal.goal.to_string());
    let steps: Option<Vec<String>> = if let Some(Outcome::Solved(found)) = outcome {
        Some(found.steps.iter().map(ToString::to_string).collect())
    } else {
        None
    };
    if args.json {
        let objects: Vec<Value> = grounded
            .boxes
            .iter()
            .zip(&grounded.detections)
            .map(|(object, detection)| {
                json!({
                    "name": object.name,
                    "type": object.type_name,
                    "box": object.pixel_box,
                    "score": detection.score,
                })
            })
            .collect();
        return out::json(&json!({
            "objects": objects,
            "facts": lists(&grounded.facts.known),
            "unknown": lists(&grounded.facts.unknown),
            "goal": goal_text,
            "plan": steps,
        }));
    }
    for object in &grounded.boxes {
        let [x1, y1, x2, y2]: [f64; 4] = object.pixel_box.into();
        let place = format!("{x1:.0} {y1:.0} {x2:.0} {y2:.0}");
        out::line(&format!("object  {:20} {:8} {place}", object.name, object.type_name));
    }
    grounded.facts.known.iter().for_each(|atom| out::line(&format!("fact    {atom}")));
    grounded.facts.unknown.iter().for_each(|atom| out::line(&format!("unknown {atom}")));
    if let Some(goal) = goal_text {
        out::line(&format!("goal    {goal}"));
    }
    match (steps, outcome) {
        (Some(steps), _) => steps.iter().for_each(|step| out::line(&format!("plan    {step}"))),
        (None, Some(outcome)) => out::note(&format!("no plan: {outcome:?}")),
        (None, None) => {}
    }
    Ok(())
}

/// Facts as `["predicate", "object", …]`.
fn lists(atoms: &BTreeSet<Atom>) -> Vec<Vec<String>> {
    let list = |atom: &Atom| {
        let names = std::iter::once(&atom.predicate).chain(&atom.args);
        names.map(ToString::to_string).collect()
    };
    atoms.iter().map(list).collect()
}
