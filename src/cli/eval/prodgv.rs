//! `groundloop eval prodg-v`: the paper's evaluation, on any checkout of its data set.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Deserialize;

use super::super::services::ServiceArgs;
use super::super::{Failure, out};
use super::prodgv_tables::{print_details, print_report};
use crate::eval::prodgv::{
    BoxSource, DomainData, EvalError, Evaluation, EvaluationReport, FittedDomain, Goals, Jitter,
    PairResult, Setup, data_set, domain_report, evaluate, picture, published,
};
use crate::files::Folder;
use crate::goals::GOALS;
use crate::http::Answers;
use crate::parts::{PartChoice, PartContext, Registry, Role};
use crate::perception::detectors::DETECTORS;
use crate::perception::grounders::GROUNDERS;
use crate::planners::{PLANNERS, Planner, PlannerInputs};
use crate::planning::Budget;
use crate::run::{ConfigError, DomainFolder, environment, read_text};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The checkout: a folder with `data/` and, where there are any, `results/reported_results/`.
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Which grounder judges the facts: see `groundloop parts grounder`.
    #[arg(long, value_name = "NAME", default_value = "s2s")]
    grounder: String,
    /// Where the boxes come from: `recorded`, `annotated`, or a detector.
    #[arg(long, value_name = "NAME", default_value = "recorded")]
    detections: String,
    /// Where the goals come from: `recorded`, `truth`, or a kind of goal that is given the
    /// instruction (`lexicon` is another word for `instruction`).
    #[arg(long, value_name = "NAME", default_value = "recorded")]
    goals: String,
    /// Which planner plans: see `groundloop parts planner`.
    #[arg(long, value_name = "NAME", default_value = "embedded")]
    planner: String,
    /// A TOML file with the options of the detector, `[perception.options]`, and of the goal
    /// source, `[goal.options]`.
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    #[command(flatten)]
    services: ServiceArgs,
    /// Evaluates this domain only; may be repeated.
    #[arg(long, value_name = "NAME")]
    domain: Vec<String>,
    /// Takes the first N problems only as labelled examples, for data sets of thousands: without it every
    /// ordered pair of problems is an episode.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    exemplars: Option<u32>,
    /// Where the domain folders are, if not in `domains/` of the working directory.
    #[arg(long, value_name = "DIR")]
    domains: Option<PathBuf>,
    /// Whether goal atoms that contradict the rest of their goal are dropped; if not given, for
    /// every grounder but the reference `s2s`.
    #[arg(long, value_name = "true|false")]
    repair_goals: Option<bool>,
    /// Also measures the states with Gaussian noise of this standard deviation, in pixels, on every
    /// coordinate of the test's boxes.
    #[arg(long, value_name = "PX")]
    jitter_px: Option<f64>,
    /// Over how many seeds the noise is averaged.
    #[arg(long, value_name = "N", default_value_t = 3, requires = "jitter_px",
          value_parser = clap::value_parser!(u64).range(1..=SEEDS_MAX))]
    seeds: u64,
    /// Draws each evaluated test into this folder: what was recognised, what is wrong and missing.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Also reports pair by pair: facts, anomalies, goals.
    #[arg(long)]
    details: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Most seeds of one measurement: keeps a mistyped number from running for days.
const SEEDS_MAX: u64 = 10_000;

/// The file of `--options`: a part of a run file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Options {
    #[serde(default)]
    perception: PartOptions,
    #[serde(default)]
    goal: PartOptions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct PartOptions {
    options: Option<toml::Table>,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let jitter = jitter(args)?;
    let options = options(args.options.as_deref())?;
    let planner = planner(&args.planner)?;
    GROUNDERS.find("--grounder", &args.grounder).map_err(ConfigError::from)?;
    let file = args.options.as_deref().unwrap_or(Path::new(""));
    let detections = detections(&args.detections, options.perception.options.as_ref(), file)?;
    let goals = goals(&args.goals, options.goal.options.as_ref(), file)?;
    let (detections, goals) = with_answers(args.services.answers(), detections, goals);
    let repair_goals = args.repair_goals.unwrap_or(args.grounder != REFERENCE);
    let setup = Setup {
        grounder: &PartChoice::new("--grounder", &args.grounder),
        detections: &detections,
        goals: &goals,
        planner: &*planner,
        repair_goals,
        jitter,
        exemplars_max: args.exemplars.map_or(usize::MAX, |n| n as usize),
    };
    let data = data_set::read(&args.data, &args.domain)?;
    let bar = bar(&data, setup.exemplars_max);
    let mut domains = BTreeMap::new();
    for data in &data {
        bar.set_message(data.name.clone());
        let fitted = FittedDomain::new(folder(args, &data.name)?, &data.domain)?;
        let evaluation = evaluate(data, &fitted, &setup, &mut |_| bar.inc(1))?;
        let report = domain_report(&evaluation, &data.left_out, args.details);
        for left_out in &report.left_out {
            bar.suspend(|| out::note(&format!("{}: left out: {left_out}", data.name)));
        }
        if let Some(folder) = &args.pictures {
            draw(folder, data, &fitted, &evaluation)?;
        }
        domains.insert(data.name.clone(), report);
    }
    bar.finish_and_clear();
    let report = EvaluationReport {
        grounder: args.grounder.clone(),
        detections: args.detections.clone(),
        goals: args.goals.clone(),
        planner: args.planner.clone(),
        repair_goals,
        domains,
        jitter,
        published: published(),
    };
    if args.json {
        out::json(&report)?;
    } else {
        print_report(&report);
        print_details(&report);
    }
    Ok(0)
}

/// The grounder that is compared with the recorded facts; it takes goals as they are.
const REFERENCE: &str = "s2s";

fn jitter(args: &Args) -> Result<Option<Jitter>, Failure> {
    let Some(px) = args.jitter_px else { return Ok(None) };
    if px.is_finite() && px >= 0.0 {
        return Ok(Some(Jitter { px, seeds: args.seeds }));
    }
    Err(Failure::bad_input(format!("--jitter-px: expected a number from 0 upwards, got {px}")))
}

fn options(path: Option<&Path>) -> Result<Options, Failure> {
    let Some(path) = path else { return Ok(Options::default()) };
    let text = read_text(path)?;
    toml::from_str(&text).map_err(|e| {
        ConfigError::Toml { path: path.display().to_string(), message: e.to_string() }.into()
    })
}

fn planner(name: &str) -> Result<Box<dyn Planner>, Failure> {
    let choice = PartChoice::new("--planner", name);
    let inputs = PlannerInputs { budget: &Budget::standard() };
    let context = PartContext { choice: &choice, inputs, environment };
    Ok(PLANNERS.build(&context).map_err(ConfigError::from)?)
}

fn detections(
    name: &str,
    options: Option<&toml::Table>,
    file: &Path,
) -> Result<BoxSource, Failure> {
    match name {
        "recorded" => Ok(BoxSource::Recorded),
        "annotated" => Ok(BoxSource::Annotated),
        detector if DETECTORS.get(detector).is_some() => {
            let choice = PartChoice::new("--detections", detector).with_options(options, file);
            Ok(BoxSource::Detector(choice))
        }
        other => Err(unknown("--detections", &["recorded", "annotated"], &DETECTORS, other)),
    }
}

fn goals(name: &str, options: Option<&toml::Table>, file: &Path) -> Result<Goals, Failure> {
    let source =
        |kind| Ok(Goals::Source(PartChoice::new("--goals", kind).with_options(options, file)));
    match name {
        "recorded" => Ok(Goals::Recorded),
        "truth" => Ok(Goals::Truth),
        "lexicon" => source("instruction"),
        kind if GOALS.get(kind).is_some() => source(kind),
        other => Err(unknown("--goals", &["recorded", "truth", "lexicon"], &GOALS, other)),
    }
}

/// The same parts with the recorded answers of services.
fn with_answers(answers: Option<Answers>, boxes: BoxSource, goals: Goals) -> (BoxSource, Goals) {
    let boxes = match boxes {
        BoxSource::Detector(choice) => BoxSource::Detector(choice.with_answers(answers.clone())),
        BoxSource::Recorded | BoxSource::Annotated => boxes,
    };
    let goals = match goals {
        Goals::Source(choice) => Goals::Source(choice.with_answers(answers)),
        Goals::Recorded | Goals::Truth => goals,
    };
    (boxes, goals)
}

fn unknown<T: Role + ?Sized>(key: &str, own: &[&str], table: &Registry<T>, got: &str) -> Failure {
    let table: Vec<&str> = table.names().collect();
    let table = table.into_iter().filter(|name| !own.contains(name));
    let known = own.iter().copied().chain(table);
    let expected = known.collect::<Vec<_>>().join(" or ");
    ConfigError::Value { key: key.to_owned(), expected, got: got.to_owned() }.into()
}

/// The shipped folder of a domain of the data set: the one of the same name.
fn folder(args: &Args, name: &str) -> Result<DomainFolder, Failure> {
    let folder = match &args.domains {
        Some(domains) => DomainFolder::read(&domains.join(name)),
        None => DomainFolder::find(name, &Folder::default()),
    };
    Ok(folder?)
}

fn bar(data: &[DomainData], exemplars_max: usize) -> ProgressBar {
    let n_problems = data.iter().map(|data| data.problems.len());
    let n_pairs: usize = n_problems.map(|n| n.min(exemplars_max) * n.saturating_sub(1)).sum();
    let bar = ProgressBar::new(n_pairs as u64);
    match ProgressStyle::with_template("{bar:40} {pos}/{len} pairs, {eta} left, {msg}") {
        Ok(style) => bar.with_style(style),
        Err(error) => {
            tracing::debug!(%error, "progress is shown plainly");
            bar
        }
    }
}

/// Draws every evaluated pair of a domain into the folder.
fn draw(
    folder: &Path,
    data: &DomainData,
    fitted: &FittedDomain,
    evaluation: &Evaluation,
) -> Result<(), Failure> {
    let fault = |path: &Path, reason: String| {
        Failure::from(ConfigError::File { path: path.display().to_string(), reason })
    };
    std::fs::create_dir_all(folder).map_err(|e| fault(folder, e.to_string()))?;
    for test in &data.problems {
        let Some(photograph) = test.picture()? else {
            out::note(&format!("{}: problem {} has no photograph", data.name, test.number));
            continue;
        };
        let of_test = |episode: &&PairResult| episode.evaluated && episode.pair.1 == test.number;
        for episode in evaluation.episodes.iter().filter(of_test) {
            let (e, t) = episode.pair;
            let path = folder.join(format!("{}_ex{e}_test{t}.png", data.name));
            let drawn = picture(episode, &photograph, test, fitted)?;
            drawn.save(&path).map_err(|e| fault(&path, e.to_string()))?;
        }
    }
    Ok(())
}

impl From<EvalError> for Failure {
    fn from(error: EvalError) -> Self {
        match error {
            EvalError::Config(error) => error.into(),
            EvalError::File { .. }
            | EvalError::Field(_)
            | EvalError::Pddl(_)
            | EvalError::Picture(_) => Self::bad_input(error.render()),
        }
    }
}
