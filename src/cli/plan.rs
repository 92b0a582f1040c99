//! `groundloop plan`: one plan, from a PDDL problem.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{Failure, exit, out};
use crate::config::read_text;
use crate::pddl::{Domain, Parsed, Problem, SourceText, parse_domain, parse_problem};
use crate::planning::{Budget, Outcome, PlanRequest, Validation, plan, validate};
use crate::telemetry::monotonic_ns;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain file, or a domain folder.
    #[arg(long)]
    domain: PathBuf,
    /// A problem file.
    #[arg(long)]
    problem: PathBuf,
    /// Most states that the search for a cheapest plan expands; 0 leaves it out.
    #[arg(long, default_value_t = Budget::standard().optimal_expansions_max)]
    optimal_expansions: u64,
    /// Most states that the search for any plan expands; 0 leaves it out.
    #[arg(long, default_value_t = Budget::standard().greedy_expansions_max)]
    expansions: u64,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// A domain with one of its problems.
pub(super) struct Task {
    pub(super) domain: Domain,
    pub(super) problem: Problem,
}

/// Reads and checks a domain (file or folder) and a problem.
pub(super) fn read_task(domain: &Path, problem: &Path) -> Result<Task, Failure> {
    let file = if domain.is_dir() { domain.join("domain.pddl") } else { domain.to_owned() };
    let domain = warned(parse_domain(&source(&file)?)?);
    let problem = warned(parse_problem(&source(problem)?, &domain)?);
    Ok(Task { domain, problem })
}

/// Reads a PDDL file.
pub(super) fn source(path: &Path) -> Result<SourceText, Failure> {
    Ok(SourceText { name: path.display().to_string(), text: read_text(path)? })
}

/// Tells the parser's warnings.
fn warned<T>(parsed: Parsed<T>) -> T {
    for warning in &parsed.warnings {
        tracing::info!("{}", warning.message);
    }
    parsed.value
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let started_ns = monotonic_ns();
    let Task { domain, problem } = read_task(&args.domain, &args.problem)?;
    let parsed_ns = monotonic_ns();
    let budget = Budget {
        optimal_expansions_max: args.optimal_expansions,
        greedy_expansions_max: args.expansions,
        ..Budget::standard()
    };
    let answer = plan(&domain, &PlanRequest::new(&problem), &budget);
    let planned_ns = monotonic_ns();
    let (verdict, code, reason) = match &answer.outcome {
        Outcome::Solved(_) => ("solved", 0, String::new()),
        Outcome::Unsolvable { proof } => ("unsolvable", exit::UNSOLVABLE, proof.to_string()),
        Outcome::OutOfBudget { limit, value } => {
            ("out-of-budget", exit::GAVE_UP, format!("{limit} = {value}"))
        }
        Outcome::Unsupported { feature } => {
            ("unsupported", exit::BAD_INPUT, format!("unsupported: {feature}"))
        }
        Outcome::BadInput { reason } => ("bad-input", exit::BAD_INPUT, reason.clone()),
    };
    let found = if let Outcome::Solved(found) = &answer.outcome { Some(found) } else { None };
    if let Some(found) = found {
        let checked = validate(&domain, &PlanRequest::new(&problem), &found.steps);
        if let Validation::Invalid { reason, .. } = checked {
            return Err(Failure::internal(format!("the plan that was found is wrong: {reason}")));
        }
    }
    let proof =
        if let Outcome::Unsolvable { proof } = &answer.outcome { Some(proof.kind()) } else { None };
    if args.json {
        let steps: Vec<String> =
            found.iter().flat_map(|p| &p.steps).map(ToString::to_string).collect();
        let microseconds = |from: u64, to: u64| (to - from) / 1000;
        out::json(&json!({
            "verdict": verdict,
            "reason": reason,
            "cost": found.map(|p| p.cost as f64 / p.cost_scale as f64),
            "optimal": found.map(|p| p.proven_optimal),
            "lower_bound": found.map(|p| p.lower_bound as f64 / p.cost_scale as f64),
            "proof": proof,
            "plan": steps,
            "expanded": answer.statistics.expanded(),
            "time_us": {
                "parse": microseconds(started_ns, parsed_ns),
                "plan": microseconds(parsed_ns, planned_ns),
                "total": microseconds(started_ns, monotonic_ns()),
            },
        }))?;
    } else {
        match found {
            Some(found) => out::line(found.to_string().trim_end()),
            None => out::note(&format!("{verdict}: {reason}")),
        }
    }
    Ok(code)
}
