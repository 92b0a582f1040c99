//! `groundloop plan`: one plan, from a PDDL problem.

use std::path::{Path, PathBuf};

use super::goal::choice;
use super::reports::{PlanReport, PlanTimes, steps_of};
use super::stop::StopConditions;
use super::{Failure, exit, out};
use crate::clock::monotonic_ns;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::{
    Domain, Parsed, Problem, SourcePosition, SourceText, Warning, parse_domain, parse_problem,
};
use crate::planners::{Deadlines, PLANNERS, PlanQuery, Planner, PlannerInputs};
use crate::planning::{
    Budget, GroundingLimits, Outcome, Plan, PlanAnswer, PlanRequest, Proof, Validation,
    impossible_parts, validate,
};

/// Most parts of a goal that are shown when they cannot be reached.
const IMPOSSIBLE_SHOWN_MAX: usize = 3;
use crate::run::{ConfigError, environment, given_domain, read_pddl};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain file, a domain folder, or the name of a shipped domain.
    #[arg(long)]
    domain: PathBuf,
    /// A problem file.
    #[arg(long, value_name = "FILE")]
    problem: PathBuf,
    /// Longest time, in seconds; what is left of it after a first plan goes into making it cheaper and
    /// proving it cheapest
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_limit: Option<f64>,
    /// Most memory, in megabytes; how long is searched is then up to the time limit, or to Ctrl-C
    #[arg(long, value_name = "MB")]
    memory_limit: Option<u64>,
    /// Most states that the search for a cheapest plan expands; 0 leaves it out [default: 100000, or
    /// any number with a limit of time or memory]
    #[arg(long, value_name = "N")]
    optimal_expansions: Option<u64>,
    /// Most states that the search for any plan expands; 0 leaves it out [default: 1000000, or any
    /// number with a limit of time or memory]
    #[arg(long, value_name = "N")]
    expansions: Option<u64>,
    /// Most states that are expanded to make a plan cheaper; 0 leaves it as it was found [default: 0,
    /// or any number with a limit of time or memory]
    #[arg(long, value_name = "N")]
    improve_expansions: Option<u64>,
    /// Most ground actions
    #[arg(long, value_name = "N", default_value_t = GroundingLimits::standard().actions_max)]
    grounding_actions: usize,
    /// Most ground atoms
    #[arg(long, value_name = "N", default_value_t = GroundingLimits::standard().atoms_max)]
    grounding_atoms: usize,
    /// Most elementary steps of grounding
    #[arg(long, value_name = "N", default_value_t = GroundingLimits::standard().steps_max)]
    grounding_steps: u64,
    /// Which planner plans: see `groundloop parts planner`.
    #[arg(long, default_value = "embedded", value_name = "NAME")]
    planner: String,
    /// The planner's own options: a TOML file with what `[planner.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    planner_options: Option<PathBuf>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// A domain with one of its problems.
pub(super) struct Task {
    pub(super) domain: Domain,
    pub(super) problem: Problem,
}

/// Reads and checks a domain (file, folder or name) and a problem.
pub(super) fn read_task(domain: &Path, problem: &Path) -> Result<Task, Failure> {
    let text = domain_source(domain)?;
    let domain = warned(&text, parse_domain(&text)?);
    let text = source(problem)?;
    let problem = warned(&text, parse_problem(&text, &domain)?);
    Ok(Task { domain, problem })
}

/// Reads a domain file: itself, in a folder, or in a shipped domain.
fn domain_source(domain: &Path) -> Result<SourceText, Failure> {
    if domain.is_file() || domain.extension().is_some_and(|ending| ending == "pddl") {
        return source(domain);
    }
    let file = given_domain(domain)?.file("domain.pddl");
    Ok(SourceText::decode(file.to_string(), file.bytes().map_err(ConfigError::from)?)?)
}

/// Reads a PDDL file.
pub(super) fn source(path: &Path) -> Result<SourceText, Failure> {
    Ok(read_pddl(path)?)
}

/// Says what is odd about a text.
fn warned<T>(source: &SourceText, parsed: Parsed<T>) -> T {
    for Warning { span, message } in &parsed.warnings {
        out::note(&format!("{}: warning: {message}", SourcePosition::new(source, *span)));
    }
    parsed.value
}

/// A number of seconds above 0.
fn seconds(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|s| s.is_finite() && *s > 0.0);
    value.ok_or_else(|| format!("expected a number of seconds above 0, got {text}"))
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let stop = StopConditions::start(args.time_limit, args.memory_limit)?;
    let started_ns = monotonic_ns();
    let Task { domain, problem } = read_task(&args.domain, &args.problem)?;
    let parsed_ns = monotonic_ns();
    let request = PlanRequest::new(&problem);
    let PlanAnswer { outcome, statistics } = answer(args, &domain, &request, &stop)?;
    let planned_ns = monotonic_ns();
    let found = outcome.plan();
    if let Some(found) = found {
        let checked = validate(&domain, &request, &found.steps);
        if let Validation::Invalid { reason, .. } = checked {
            return Err(Failure::internal(format!("the plan that was found is wrong: {reason}")));
        }
    }
    let unproven = found.filter(|plan| !plan.proven_optimal).map(|plan| {
        let bound = plan.in_full(plan.lower_bound);
        let why = stop.met().map(str::to_owned).or_else(|| statistics.unproven.map(limit_met));
        let why = why.unwrap_or_else(|| "it was not asked for".to_owned());
        format!("no plan costs less than {bound}; {why}")
    });
    if args.json {
        let scaled = |p: &Plan, cost: u64| p.in_full(cost).to_f64();
        let microseconds = |from: u64, to: u64| (to - from) / 1000;
        out::json(&PlanReport {
            verdict: outcome.word(),
            reason: outcome.reason(),
            cost: found.map(|p| scaled(p, p.cost)),
            optimal: found.map(|p| p.proven_optimal),
            lower_bound: found.map(|p| scaled(p, p.lower_bound)),
            unproven,
            proof: outcome.proof().map(Proof::kind),
            plan: steps_of(&outcome),
            expanded: statistics.expanded(),
            time_us: PlanTimes {
                parse: microseconds(started_ns, parsed_ns),
                plan: microseconds(parsed_ns, planned_ns),
                total: microseconds(started_ns, monotonic_ns()),
            },
        })?;
    } else {
        match (found, &outcome, stop.met()) {
            (Some(found), ..) => out::line(found.to_string().trim_end()),
            (None, Outcome::Interrupted, Some(why)) => out::note(&format!("interrupted: {why}")),
            (None, Outcome::OutOfBudget { limit, .. }, _) => {
                out::note(&format!("{outcome}{}", hint(limit)));
            }
            (None, Outcome::Unsolvable { .. }, _) => {
                let parts = impossible_parts(&domain, &request, IMPOSSIBLE_SHOWN_MAX);
                let parts = parts.iter().map(|part| format!("\n  {part} cannot be reached"));
                out::note(&format!("{outcome}{}", parts.collect::<String>()));
            }
            (None, ..) => out::note(&outcome.to_string()),
        }
        // Who does not ask for a proof knows that there is none.
        let is_asked_for = args.optimal_expansions != Some(0)
            && (stop.met().is_some() || statistics.unproven.is_some());
        if let Some(unproven) = unproven.filter(|_| is_asked_for) {
            out::note(&format!("not proven cheapest: {unproven}"));
        }
    }
    Ok(exit::of(&outcome))
}

/// A limit that ended the search for a cheapest plan.
fn limit_met((limit, value): (&'static str, u64)) -> String {
    format!("{limit} = {value} was met{}", hint(limit))
}

/// Which flag raises a limit.
fn hint(limit: &str) -> String {
    let flag = match limit {
        "greedy_expansions_max" => "--expansions N",
        "optimal_expansions_max" => "--optimal-expansions N",
        "bytes_max" => "--memory-limit MB",
        "grounding.actions_max" => "--grounding-actions N",
        "grounding.atoms_max" => "--grounding-atoms N",
        "grounding.steps_max" => "--grounding-steps N",
        _ => return String::new(),
    };
    format!(" ({flag} raises this limit)")
}

/// The planner's answer.
fn answer(
    args: &Args,
    domain: &Domain,
    request: &PlanRequest<'_>,
    stop: &StopConditions,
) -> Result<PlanAnswer, Failure> {
    let choice = choice("--planner", &args.planner, args.planner_options.as_deref())?;
    let planner = planner(&choice, &budget(args))?;
    let is_met = || stop.is_met();
    let deadlines = Deadlines { soft: &is_met, hard: &is_met };
    Ok(planner.plan(&PlanQuery { deadlines, ..PlanQuery::once(domain, request) }))
}

/// What the flags allow. With a limit of time or memory, counts limit nothing by themselves.
fn budget(args: &Args) -> Budget {
    let standard = Budget::standard();
    let is_limited = args.time_limit.is_some() || args.memory_limit.is_some();
    let or = |given: Option<u64>, standard: u64| {
        given.unwrap_or(if is_limited { u64::MAX } else { standard })
    };
    let bytes = args.memory_limit.map(|mb| usize::try_from(mb << 20).unwrap_or(usize::MAX));
    Budget {
        optimal_expansions_max: or(args.optimal_expansions, standard.optimal_expansions_max),
        greedy_expansions_max: or(args.expansions, standard.greedy_expansions_max),
        improve_expansions_max: or(args.improve_expansions, standard.improve_expansions_max),
        bytes_max: bytes.unwrap_or(standard.bytes_max),
        grounding: GroundingLimits {
            actions_max: args.grounding_actions,
            atoms_max: args.grounding_atoms,
            steps_max: args.grounding_steps,
        },
        ..standard
    }
}

/// Makes the chosen planner.
pub(super) fn planner(choice: &PartChoice, budget: &Budget) -> Result<Box<dyn Planner>, Failure> {
    let context = PartContext { choice, inputs: PlannerInputs { budget }, environment };
    Ok(PLANNERS.build(&context).map_err(ConfigError::from)?)
}
