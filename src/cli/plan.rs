//! `groundloop plan`: one plan, from a PDDL problem.

use std::path::{Path, PathBuf};

use super::goal::choice;
use super::reports::{PlanReport, PlanTimes, steps_of};
use super::{Failure, exit, out};
use crate::clock::monotonic_ns;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::{
    Domain, Parsed, Problem, SourcePosition, SourceText, Warning, parse_domain, parse_problem,
};
use crate::planners::{PLANNERS, PlanQuery, Planner, PlannerInputs};
use crate::planning::{Budget, Outcome, Plan, PlanRequest, Proof, Validation, validate};
use crate::run::{ConfigError, environment, given_domain, read_pddl};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain file, a domain folder, or the name of a shipped domain.
    #[arg(long)]
    domain: PathBuf,
    /// A problem file.
    #[arg(long, value_name = "FILE")]
    problem: PathBuf,
    /// Most states that the search for a cheapest plan expands; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = Budget::standard().optimal_expansions_max)]
    optimal_expansions: u64,
    /// Most states that the search for any plan expands; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = Budget::standard().greedy_expansions_max)]
    expansions: u64,
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

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let started_ns = monotonic_ns();
    let Task { domain, problem } = read_task(&args.domain, &args.problem)?;
    let parsed_ns = monotonic_ns();
    let (outcome, expanded) = answer(args, &domain, &PlanRequest::new(&problem))?;
    let planned_ns = monotonic_ns();
    let found = if let Outcome::Solved(found) = &outcome { Some(found) } else { None };
    if let Some(found) = found {
        let checked = validate(&domain, &PlanRequest::new(&problem), &found.steps);
        if let Validation::Invalid { reason, .. } = checked {
            return Err(Failure::internal(format!("the plan that was found is wrong: {reason}")));
        }
    }
    if args.json {
        let scaled = |p: &Plan, cost: u64| p.in_full(cost).to_f64();
        let microseconds = |from: u64, to: u64| (to - from) / 1000;
        out::json(&PlanReport {
            verdict: outcome.word(),
            reason: outcome.reason(),
            cost: found.map(|p| scaled(p, p.cost)),
            optimal: found.map(|p| p.proven_optimal),
            lower_bound: found.map(|p| scaled(p, p.lower_bound)),
            proof: outcome.proof().map(Proof::kind),
            plan: steps_of(&outcome),
            expanded,
            time_us: PlanTimes {
                parse: microseconds(started_ns, parsed_ns),
                plan: microseconds(parsed_ns, planned_ns),
                total: microseconds(started_ns, monotonic_ns()),
            },
        })?;
    } else {
        match found {
            Some(found) => out::line(found.to_string().trim_end()),
            None => out::note(&format!("{outcome}{}", hint(&outcome))),
        }
    }
    Ok(exit::of(&outcome))
}

/// Which flag raises the limit that was met.
fn hint(outcome: &Outcome) -> &'static str {
    let Outcome::OutOfBudget { limit, .. } = outcome else { return "" };
    match *limit {
        "greedy_expansions_max" => " (--expansions N raises this limit)",
        "optimal_expansions_max" => " (--optimal-expansions N raises this limit)",
        _ => "",
    }
}

/// The planner's answer, and how many states it has expanded.
fn answer(
    args: &Args,
    domain: &Domain,
    request: &PlanRequest<'_>,
) -> Result<(Outcome, u64), Failure> {
    let budget = Budget {
        optimal_expansions_max: args.optimal_expansions,
        greedy_expansions_max: args.expansions,
        ..Budget::standard()
    };
    let choice = choice("--planner", &args.planner, args.planner_options.as_deref())?;
    let answer = planner(&choice, &budget)?.plan(&PlanQuery::once(domain, request));
    Ok((answer.outcome, answer.statistics.expanded()))
}

/// Makes the chosen planner.
pub(super) fn planner(choice: &PartChoice, budget: &Budget) -> Result<Box<dyn Planner>, Failure> {
    let context = PartContext { choice, inputs: PlannerInputs { budget }, environment };
    Ok(PLANNERS.build(&context).map_err(ConfigError::from)?)
}
