//! What the planner itself costs: cold starts, the competition corpus, large block worlds.
//!
//! `cargo bench --bench planning [-- cold|satisficing|optimal|blocks]` prints Markdown tables of
//! thread-CPU time. Reads `prodgv/` and `ipc/` in the folder that `GROUNDLOOP_DATA` names, in
//! place. With `GROUNDLOOP_FAST_DOWNWARD` (a Python that has the wheel) Fast Downward is asked the
//! same in the same run.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the benchmark")]
#![expect(clippy::print_stdout, reason = "tables are what it is for")]

mod blocks;
mod cold;
mod corpus;

use std::path::{Path, PathBuf};
use std::{env, fs};

use groundloop::clock::thread_cpu_ns;
use groundloop::pddl::{Domain, Problem, SourceText, parse_domain, parse_problem};
use groundloop::planning::{Outcome, PlanRequest, Validation, validate};

/// Milliseconds of this thread's processor time.
fn cpu_ms<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let started_ns = thread_cpu_ns();
    let value = work();
    (value, (thread_cpu_ns() - started_ns) as f64 / 1e6)
}

/// The value below which a share of the values lies.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

fn data(folder: &str) -> Option<PathBuf> {
    let root = env::var_os("GROUNDLOOP_DATA").map_or_else(|| "../shared".into(), PathBuf::from);
    let path = root.join(folder);
    if !path.is_dir() {
        println!("skipped: {folder} is not there (set GROUNDLOOP_DATA)");
        return None;
    }
    Some(path)
}

fn source(path: &Path) -> SourceText {
    SourceText::new(path.display().to_string(), fs::read_to_string(path).unwrap())
}

fn read(domain: &SourceText, problem: &SourceText) -> (Domain, Problem) {
    let domain = parse_domain(domain).unwrap_or_else(|e| panic!("{}", e.render())).value;
    let problem = parse_problem(problem, &domain).unwrap_or_else(|e| panic!("{}", e.render()));
    (domain, problem.value)
}

/// The cost of a plan, checked.
fn cost(domain: &Domain, request: &PlanRequest<'_>, outcome: &Outcome) -> Option<f64> {
    let Outcome::Solved(plan) = outcome else { return None };
    match validate(domain, request, &plan.steps) {
        Validation::Valid { cost } => Some(cost.to_f64()),
        Validation::Invalid { reason, .. } => panic!("{reason}"),
    }
}

fn main() {
    let parts: Vec<String> = env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let wanted = |part: &str| parts.is_empty() || parts.iter().any(|p| p == part);
    if wanted("cold") {
        cold::measure();
    }
    if wanted("satisficing") {
        corpus::measure(false);
    }
    if wanted("optimal") {
        corpus::measure(true);
    }
    if wanted("blocks") {
        blocks::measure();
    }
}
