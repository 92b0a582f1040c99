//! `groundloop validate`: is a plan right?

use std::path::PathBuf;

use super::plan::{Task, read_task, source};
use super::reports::ValidationReport;
use super::{Failure, exit, out};
use crate::pddl::{Number, parse_plan};
use crate::planning::{PlanRequest, Validation, validate};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain file, a domain folder, or the name of a shipped domain.
    #[arg(long)]
    domain: PathBuf,
    /// A problem file.
    #[arg(long, value_name = "FILE")]
    problem: PathBuf,
    /// A plan: one `(action object …)` per line, `;` starts a comment.
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let Task { domain, problem } = read_task(&args.domain, &args.problem)?;
    let steps = parse_plan(&source(&args.plan)?)?;
    let (cost, wrong) = match validate(&domain, &PlanRequest::new(&problem), &steps) {
        Validation::Valid { cost } => (Some(cost), None),
        Validation::Invalid { step_idx, reason } => (None, Some((step_idx, reason))),
    };
    if args.json {
        let (step_idx, reason) = match &wrong {
            Some((step_idx, reason)) => (*step_idx, Some(reason.clone())),
            None => (None, None),
        };
        let (valid, steps) = (wrong.is_none(), steps.len());
        let cost = cost.map(Number::to_f64);
        out::json(&ValidationReport { valid, cost, steps, step_idx, reason })?;
    } else {
        match (&wrong, cost) {
            (Some((Some(idx), reason)), _) => {
                out::line(&format!("plan invalid: step {}: {reason}", idx + 1));
            }
            (Some((None, reason)), _) => out::line(&format!("plan invalid: {reason}")),
            (None, cost) => {
                let (n, cost) = (steps.len(), cost.unwrap_or_default());
                out::line(&format!("plan valid: {n} steps, cost {cost}"));
            }
        }
    }
    Ok(if wrong.is_none() { 0 } else { exit::CHECK_FAILED })
}
