//! `groundloop validate`: is a plan right?

use std::path::PathBuf;

use super::plan::{Task, read_task, source};
use super::reports::{ExplanationReport, ValidationReport};
use super::{Failure, exit, out};
use crate::pddl::{Number, parse_plan};
use crate::planning::{PlanRequest, Validation, explain, validate};

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
    /// Say of a wrong plan which condition fails, which step made it so, and the nearest repair
    #[arg(long)]
    explain: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let Task { domain, problem } = read_task(&args.domain, &args.problem)?;
    let steps = parse_plan(&source(&args.plan)?)?;
    let request = PlanRequest::new(&problem);
    let (cost, wrong) = match validate(&domain, &request, &steps) {
        Validation::Valid { cost } => (Some(cost), None),
        Validation::Invalid { step_idx, reason } => (None, Some((step_idx, reason))),
    };
    let explanation = args.explain.then(|| explain(&domain, &request, &steps)).flatten();
    if args.json {
        let (step_idx, reason) = match &wrong {
            Some((step_idx, reason)) => (*step_idx, Some(reason.clone())),
            None => (None, None),
        };
        let (valid, steps) = (wrong.is_none(), steps.len());
        let cost = cost.map(Number::to_f64);
        let explanation = explanation.as_ref().map(ExplanationReport::new);
        out::json(&ValidationReport { valid, cost, steps, step_idx, reason, explanation })?;
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
        if let Some(explanation) = explanation {
            out::line(&explanation.to_string());
        }
    }
    Ok(if wrong.is_none() { 0 } else { exit::CHECK_FAILED })
}
