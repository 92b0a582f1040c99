//! `groundloop goal`: shows what a goal is read as, over objects that are listed or come from a
//! problem.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::reports::{ExpectedObject, GoalPhrase, GoalReport};
use super::services::ServiceArgs;
use super::{Failure, out};
use crate::geometry::PixelBox;
use crate::goals::{GOALS, GoalInputs, GoalObject, GoalView, ParsedGoal, Phrase, Referent};
use crate::logic::Facts;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::{Atom, Name, SourceText, Typed, parse_facts, parse_problem};
use crate::run::{ConfigError, DomainFolder, environment, read_pddl, read_text};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain folder, or the name of a shipped domain.
    #[arg(long)]
    domain: PathBuf,
    /// The goal: a sentence, or PDDL for the kind "logical".
    #[arg(long, value_name = "TEXT")]
    instruction: String,
    /// Objects that are seen, separated by blanks: `name:type`, or `name:type@x1,y1,x2,y2` with a box
    /// in pixels; may be repeated.
    #[arg(long, value_name = "OBJECTS")]
    objects: Vec<String>,
    /// A PDDL problem, whose objects are seen too.
    #[arg(long, value_name = "FILE")]
    problem: Option<PathBuf>,
    /// Facts that are seen, as PDDL (`(on a b) (clear a)`); all others are taken to be false. Without
    /// them and a problem, nobody knows what holds.
    #[arg(long, value_name = "FACTS")]
    facts: Option<String>,
    /// What reads the goal: see `groundloop parts goal`.
    #[arg(long, value_name = "KIND", default_value = "instruction")]
    kind: String,
    /// The options of what reads the goal: a TOML file with what `[goal.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    /// Tells the reading back in the domain's words, too, clause by clause.
    #[arg(long)]
    explain: bool,
    #[command(flatten)]
    services: ServiceArgs,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let folder = DomainFolder::given(&args.domain)?;
    let mut objects = Vec::new();
    for text in args.objects.iter().flat_map(|list| list.split_whitespace()) {
        let (name, type_name, pixel_box) = object(text).ok_or_else(|| {
            let forms = "name:type or name:type@x1,y1,x2,y2";
            Failure::bad_input(format!("--objects: expected {forms}, got {text}"))
        })?;
        objects.push(GoalObject::new(&folder.perception, name, type_name, pixel_box));
    }
    let mut known: Option<BTreeSet<Atom>> = None;
    if let Some(path) = &args.problem {
        let source = read_pddl(path)?;
        let problem = parse_problem(&source, &folder.domain)?.value;
        known = Some(problem.init.into_iter().collect());
        let typed = problem.objects.into_iter().filter_map(|typed| {
            let type_name = typed.types.first()?.clone();
            Some(GoalObject::new(&folder.perception, typed.name, type_name, None))
        });
        objects.extend(typed);
    }
    if let Some(text) = &args.facts {
        let typed: Vec<Typed> =
            objects.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect();
        let source = SourceText::new("--facts", text.clone());
        known.get_or_insert_default().extend(parse_facts(&source, &folder.domain, &typed)?.value);
    }
    let facts = known.map(Facts::new);
    let choice = choice("--kind", &args.kind, args.options.as_deref())?;
    let choice = choice.with_answers(args.services.answers());
    let inputs = GoalInputs {
        perception: Some(&folder.perception),
        ..GoalInputs::words("--instruction", &args.instruction, folder.language.as_ref())
    };
    let context = PartContext { choice: &choice, inputs, environment };
    let source = GOALS.build(&context).map_err(ConfigError::from)?;
    let goal =
        source.read_in(&folder.domain, GoalView { objects: &objects, facts: facts.as_ref() })?;
    report(args, &goal)?;
    Ok(0)
}

/// A part that a flag names, with the options of a file of their own where there is one.
pub(super) fn choice(key: &str, name: &str, options: Option<&Path>) -> Result<PartChoice, Failure> {
    let choice = PartChoice::new(key, name);
    let Some(path) = options else { return Ok(choice) };
    let table: toml::Table = read_text(path)?.parse().map_err(|e: toml::de::Error| {
        ConfigError::Toml { path: path.display().to_string(), message: e.to_string() }
    })?;
    Ok(choice.with_options(Some(&table), path))
}

/// `name:type` or `name:type@x1,y1,x2,y2`.
fn object(text: &str) -> Option<(Name, Name, Option<PixelBox>)> {
    let (text, edges) = match text.split_once('@') {
        Some((text, edges)) => (text, Some(edges)),
        None => (text, None),
    };
    let (name, type_name) = text.split_once(':')?;
    let is_name = |text: &str| !text.is_empty() && !text.contains(['(', ')', ';', '?']);
    let pixel_box = match edges {
        None => None,
        Some(edges) => {
            let numbers: Option<Vec<f64>> = edges
                .split(',')
                .map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite()))
                .collect();
            Some(PixelBox::from(<[f64; 4]>::try_from(numbers?).ok()?))
        }
    };
    (is_name(name) && is_name(type_name)).then(|| (name.into(), type_name.into(), pixel_box))
}

fn report(args: &Args, parsed: &ParsedGoal) -> Result<(), Failure> {
    let ParsedGoal { goal, phrases, expected, notes, said } = parsed;
    if args.json {
        let phrase = |p: &Phrase| GoalPhrase { text: p.text.clone(), means: means(&p.means) };
        let object = |typed: &Typed| ExpectedObject {
            name: typed.name.to_string(),
            type_name: typed.types.first().map(ToString::to_string),
        };
        return out::json(&GoalReport {
            goal: goal.to_string(),
            phrases: phrases.iter().map(phrase).collect(),
            expected: expected.iter().map(object).collect(),
            notes: notes.clone(),
            said: said.clone(),
        });
    }
    out::line(&format!("goal     {goal}"));
    for clause in said.iter().filter(|_| args.explain) {
        out::line(&format!("said     {clause}"));
    }
    for phrase in phrases {
        out::line(&format!("phrase   \"{}\": {}", phrase.text, means(&phrase.means)));
    }
    for typed in expected {
        let types: Vec<&str> = typed.types.iter().map(Name::as_str).collect();
        out::line(&format!("expected {} - {}", typed.name, types.join("/")));
    }
    for note in notes {
        out::line(&format!("note     {note}"));
    }
    Ok(())
}

fn means(referent: &Referent) -> String {
    match referent {
        Referent::Object(name) => name.to_string(),
        Referent::Several(names) => {
            names.iter().map(Name::as_str).collect::<Vec<_>>().join(" and ")
        }
        Referent::Every(type_name) => format!("every {type_name}"),
    }
}
