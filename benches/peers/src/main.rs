//! What a replan costs, beside other planners on the same states: thread-CPU medians as a Markdown
//! table.
//!
//! ```text
//! cargo run --release -- peers.toml [--data DIR] [--fast-downward PYTHON]
//! ```
//!
//! A *replan* is: take in all facts of a new state, and have the whole plan by names. groundloop
//! asks its plan-reuse cascade, with the distance table made beforehand (what that took is a column of its
//! own). ferroplan keeps a grounded `Session`, observes, keeps the rest of its plan where that is
//! still valid and searches within a budget where not. Fast Downward is translated and started
//! anew, as it knows no other way.

mod ferro;
mod own;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use groundloop::planners::PlannerConfig;
use groundloop::pddl::{Domain, Problem, Step};
use groundloop::parts::{PartChoice, PartContext};
use groundloop::planners::{FastDownward, PlannerInputs};
use groundloop::planning::{Budget, NO_PENALTIES, Outcome, PlanRequest, validate};
use groundloop::stress::{Workload, WorkloadGenerator, Instance, StressConfig, View, instances, load_stress};

use self::ferro::Ferro;
use self::own::Own;

/// Processor time that a peer gets for one problem and feed; then the states that are left are not
/// asked for.
const PEER_NS_MAX: u64 = 20_000_000_000;

type Failure = Box<dyn std::error::Error>;

struct Args {
    config: PathBuf,
    data: Option<PathBuf>,
    python: Option<String>,
}

fn main() -> ExitCode {
    match args().and_then(|args| run(&args)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn args() -> Result<Args, Failure> {
    let mut given = std::env::args().skip(1);
    let mut args = Args { config: PathBuf::from("peers.toml"), data: None, python: None };
    while let Some(word) = given.next() {
        let mut value = || given.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--data" => args.data = Some(value()?.into()),
            "--fast-downward" => args.python = Some(value()?),
            _ => args.config = word.into(),
        }
    }
    Ok(args)
}

fn run(args: &Args) -> Result<(), Failure> {
    let config = load_stress(&args.config)?;
    let instances = instances(&config, args.data.as_deref())?;
    let other = args.python.as_deref().map(fast_downward).transpose()?;
    println!(
        "| problem | states | groundloop | ferroplan | ratio | Fast Downward | ratio | \
         steps: groundloop | ferroplan | Fast Downward | table |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for instance in &instances {
        for &feed in &config.case[instance.case_idx].feeds {
            let row = row(&config, instance, feed, other.as_ref())?;
            println!("{row}");
        }
    }
    Ok(())
}

fn fast_downward(python: &str) -> Result<FastDownward, Failure> {
    let options: toml::Table = format!("python = {python:?}\ntimeout_s = 60").parse()?;
    let choice = PartChoice::new("--fast-downward", "fast-downward");
    let choice = choice.with_options(Some(&options), "--fast-downward");
    let inputs = PlannerInputs { budget: &Budget::standard() };
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    Ok(FastDownward::new(&context)?)
}

/// What one planner has done with the states.
#[derive(Default)]
struct Tally {
    cpu_ns: Vec<u64>,
    /// Plan length for each state, where there is a plan.
    lengths: Vec<Option<usize>>,
}

impl Tally {
    fn add(&mut self, cpu_ns: u64, length: Option<usize>) {
        self.cpu_ns.push(cpu_ns);
        self.lengths.push(length);
    }

    fn median_ns(&self) -> Option<u64> {
        let mut sorted = self.cpu_ns.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}

fn row(
    config: &StressConfig,
    instance: &Instance,
    feed: Workload,
    other: Option<&FastDownward>,
) -> Result<String, Failure> {
    let case = &config.case[instance.case_idx];
    let (domain, problem) = (&instance.folder.domain, &instance.problem);
    let mut own = Own::new(instance, &case.planner, &args_folder(config))?;
    let mut feeder = WorkloadGenerator::new(feed, (domain, problem), case.walk_steps, config.seed);
    let first = own.ask(&feeder.now()).1;
    own.make_table();
    let (mut views, mut mine) = (Vec::new(), Tally::default());
    let mut step = first.and_then(|plan| plan.first().cloned());
    for _ in 0..case.samples {
        let view = feeder.next(step.as_ref());
        let (cpu_ns, plan) = own.ask(&view);
        if let Some(plan) = &plan {
            right("groundloop", domain, problem, &view, plan)?;
        }
        step = plan.as_ref().and_then(|plan| plan.first().cloned());
        mine.add(cpu_ns, plan.map(|plan| plan.len()));
        views.push(view);
    }
    let ferro = ferro_tally(domain, problem, &views)?;
    let mut down = Tally::default();
    if let Some(other) = other {
        let apart = views.len() / (case.compare_samples as usize).max(1);
        for view in views.iter().step_by(apart.max(1)).take(case.compare_samples as usize) {
            let answer = other.solve(domain, &request(problem, view), &|| false);
            let length = match answer.outcome {
                Outcome::Solved(plan) => Some(plan.steps.len()),
                _ => None,
            };
            down.add(answer.cpu_ns, length);
        }
    }
    Ok(format(instance, feed, &mine, &ferro, &down, own.table_ns))
}

fn args_folder(config: &StressConfig) -> PathBuf {
    config.origin.folder.base().to_owned()
}

fn ferro_tally(domain: &Domain, problem: &Problem, views: &[View]) -> Result<Tally, Failure> {
    let mut tally = Tally::default();
    let Ok(mut ferro) = Ferro::new(domain, problem) else { return Ok(tally) };
    let mut spent_ns = 0;
    for view in views {
        let (cpu_ns, plan) = ferro.ask(view);
        if let Some(plan) = &plan {
            right("ferroplan", domain, problem, view, plan)?;
        }
        tally.add(cpu_ns, plan.map(|plan| plan.len()));
        spent_ns += cpu_ns;
        if spent_ns > PEER_NS_MAX {
            break;
        }
    }
    Ok(tally)
}

fn request<'a>(problem: &'a Problem, view: &'a View) -> PlanRequest<'a> {
    PlanRequest {
        objects: &view.objects,
        init: &view.facts.known,
        minimise_cost: false,
        penalties: &NO_PENALTIES,
        ..PlanRequest::new(problem)
    }
}

/// Every plan of everybody is checked by the independent validator.
fn right(
    who: &str,
    domain: &Domain,
    problem: &Problem,
    view: &View,
    plan: &[Step],
) -> Result<(), Failure> {
    let checked = validate(domain, &request(problem, view), plan);
    if checked.is_valid() { Ok(()) } else { Err(format!("{who}: {checked:?}").into()) }
}

fn format(
    instance: &Instance,
    feed: Workload,
    own: &Tally,
    ferro: &Tally,
    down: &Tally,
    table_ns: u64,
) -> String {
    let us = |ns: u64| match ns {
        0..10_000 => format!("{:.2} µs", ns as f64 / 1e3),
        10_000..1_000_000 => format!("{:.0} µs", ns as f64 / 1e3),
        _ => format!("{:.1} ms", ns as f64 / 1e6),
    };
    let own_ns = own.median_ns().unwrap_or(0);
    let peer = |tally: &Tally| match tally.median_ns() {
        Some(ns) => (us(ns), format!("{:.0}", ns as f64 / own_ns.max(1) as f64)),
        None => ("–".to_owned(), "–".to_owned()),
    };
    let ((ferro_us, ferro_ratio), (down_us, down_ratio)) = (peer(ferro), peer(down));
    // Means over each planner's own states; how many of them it solved is said where it is not all.
    let steps = |tally: &Tally| {
        let lengths: Vec<usize> = tally.lengths.iter().flatten().copied().collect();
        let all = tally.lengths.len();
        let mean = lengths.iter().sum::<usize>() as f64 / lengths.len().max(1) as f64;
        match lengths.len() {
            0 => "–".to_owned(),
            n if n < all => format!("{mean:.1} ({n}/{all})"),
            _ => format!("{mean:.1}"),
        }
    };
    let cells = [
        format!("{}, {}", instance.name(), feed.name()),
        own.cpu_ns.len().to_string(),
        us(own_ns),
        ferro_us,
        ferro_ratio,
        down_us,
        down_ratio,
        steps(own),
        steps(ferro),
        steps(down),
        us(table_ns),
    ];
    format!("| {} |", cells.join(" | "))
}

/// Processor time of the calling thread so far.
fn cpu_ns() -> u64 {
    groundloop::clock::thread_cpu_ns()
}
