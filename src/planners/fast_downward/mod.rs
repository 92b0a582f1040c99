//! Fast Downward as a program beside this one: an installed `fast-downward.py`, or the parts of the
//! Python wheel `up-fast-downward`.
//!
//! It is a second opinion and a yardstick, not a part of a quick loop: a call costs a process or
//! two. Its licence (GPL) asks for exactly this distance: nothing of it is linked or shipped.

mod call;
mod encode;
mod plain;
mod process;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use schemars::JsonSchema;
use serde::Deserialize;

use self::call::Call;
use self::encode::encode;
use self::process::{End, Limits};
use super::{PlanQuery, Planner};
use crate::clock::monotonic_ns;
use crate::parts::{Part, PartContext, PartError, options_of};
use crate::pddl::{Domain, Number, Step};
use crate::planning::{
    Outcome, Phase, Plan, PlanAnswer, PlanRequest, Statistics, Validation, validate,
};

/// Prints where the wheel lies, without importing it.
const FIND: &str = "import importlib.util as u, sys\n\
    f = u.find_spec('up_fast_downward')\n\
    t = u.find_spec('fast_downward')\n\
    sys.stdout.write(f.submodule_search_locations[0] if f and t else '')";
/// How long looking for the wheel may take, nanoseconds.
const FIND_NS_MAX: u64 = 60_000_000_000;
/// What is written when it is not there.
const HOW: &str = "pip install up-fast-downward (and name its python in planner.options.python), \
    or planner.options.program = \"…/fast-downward.py\"";

/// `[planner.options]` of the planner "fast-downward".
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// The Python that has the wheel `up-fast-downward`, and that runs a `program` that ends with
    /// ".py".
    python: String,
    /// An installed driver, such as "/opt/fast-downward/fast-downward.py"; without the key the wheel
    /// is used.
    program: Option<PathBuf>,
    /// Whether a cheapest plan is asked for.
    optimal: bool,
    /// The search for any plan.
    satisficing_search: String,
    /// The search for a cheapest plan; what it finds counts as proven.
    optimal_search: String,
    /// Longest call, seconds of wall time.
    #[schemars(range(min = 1))]
    timeout_s: u32,
    /// Most address space of each process, megabytes.
    #[schemars(range(min = 1))]
    memory_mb: u32,
}

/// Fast Downward, found and ready to be asked.
#[derive(Debug)]
pub struct FastDownward {
    options: Options,
    parts: Parts,
}

/// What is run.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Parts {
    /// The driver does both halves.
    Driver(PathBuf),
    /// The wheel's translator module, and this search program.
    Wheel(PathBuf),
}

/// What one call came to, and what it took.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BackendAnswer {
    /// The answer.
    pub outcome: Outcome,
    /// States that it says it has expanded.
    pub expanded: u64,
    /// Processor time of its processes, nanoseconds.
    pub cpu_ns: u64,
    /// Wall time, nanoseconds.
    pub wall_ns: u64,
}

/// The entry of the table of planners.
pub(super) const PART: Part<dyn Planner> = Part {
    name: "fast-downward",
    help: "Fast Downward in a process of its own, from its Python wheel or an installation",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, dyn Planner>) -> Result<Box<dyn Planner>, PartError> {
    Ok(Box::new(FastDownward::new(context)?))
}

impl FastDownward {
    /// Reads `[planner.options]` and looks for the program.
    ///
    /// # Errors
    /// [`PartError::Options`] for options that cannot be, [`PartError::Missing`] when there is no
    /// Fast Downward.
    pub fn new(context: &PartContext<'_, dyn Planner>) -> Result<Self, PartError> {
        let mut options: Options = context.options()?;
        if options.python.contains('/') {
            let python = context.choice.folder.join(&options.python);
            options.python = python.to_str().unwrap_or(&options.python).to_owned();
        }
        let parts = match &options.program {
            Some(program) => driver(&context.choice.folder.join(program))?,
            None => wheel(&options)?,
        };
        Ok(Self { options, parts })
    }

    /// Asks once. Plans are checked by the independent validator before they are believed.
    pub fn solve(
        &self,
        domain: &Domain,
        request: &PlanRequest<'_>,
        interrupt: &dyn Fn() -> bool,
    ) -> BackendAnswer {
        let started_ns = monotonic_ns();
        let deadline_ns = started_ns + u64::from(self.options.timeout_s) * 1_000_000_000;
        let memory_bytes = u64::from(self.options.memory_mb) << 20;
        let limits = Limits { deadline_ns, memory_bytes, interrupt };
        let mut call = Call::new(&self.options, &self.parts, limits);
        let outcome = match encode(domain, request) {
            Ok(encoded) => match call.plan(&encoded) {
                Ok(steps) => self.checked(steps, domain, request),
                Err(outcome) => outcome,
            },
            Err(feature) => Outcome::Unsupported { feature: named(feature) },
        };
        let Call { cpu_ns, expanded, .. } = call;
        BackendAnswer { outcome, expanded, cpu_ns, wall_ns: monotonic_ns() - started_ns }
    }

    fn checked(&self, steps: Vec<Step>, domain: &Domain, request: &PlanRequest<'_>) -> Outcome {
        match validate(domain, request, &steps) {
            Validation::Invalid { reason, .. } => {
                Outcome::BadInput { reason: named(format!("its plan is wrong: {reason}")) }
            }
            Validation::Valid { cost } => {
                let cost_unit = Number::new(1, cost.decimals());
                let one = Number::ONE.scaled(cost.decimals()).unwrap_or(0);
                let units = |n: i128| u64::try_from(n).unwrap_or(u64::MAX);
                let penalty = |step| request.penalties.get(step).map_or(0, |&p| i128::from(p));
                let penalty = units(steps.iter().map(penalty).sum::<i128>().saturating_mul(one));
                let cost = units(cost.scaled(cost.decimals()).unwrap_or(i128::MAX));
                let total = cost.saturating_add(penalty);
                Outcome::Solved(Plan {
                    cost,
                    cost_unit,
                    penalty,
                    lower_bound: if self.options.optimal { total } else { 0 },
                    proven_optimal: self.options.optimal,
                    steps,
                })
            }
        }
    }
}

impl Planner for FastDownward {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        let answer = self.solve(query.domain, &query.request(), query.deadlines.hard);
        let BackendAnswer { outcome, expanded, cpu_ns, .. } = answer;
        let phase = Phase { name: PART.name, expanded, generated: 0, evaluated: 0 };
        let phases = vec![phase];
        let statistics = Statistics { phases, process_cpu_ns: cpu_ns, ..Statistics::default() };
        PlanAnswer { outcome, statistics }
    }
}

/// A sentence of this backend.
fn named(text: impl std::fmt::Display) -> String {
    format!("fast-downward: {text}")
}

fn missing(what: impl std::fmt::Display) -> PartError {
    PartError::missing(format!("Fast Downward ({what})"), HOW)
}

fn driver(program: &Path) -> Result<Parts, PartError> {
    if program.is_file() {
        Ok(Parts::Driver(program.to_owned()))
    } else {
        Err(missing(format!("{} is no file", program.display())))
    }
}

fn wheel(options: &Options) -> Result<Parts, PartError> {
    let limits = Limits {
        deadline_ns: monotonic_ns() + FIND_NS_MAX,
        memory_bytes: u64::from(options.memory_mb) << 20,
        interrupt: &|| false,
    };
    let python = &options.python;
    let mut command = Command::new(python);
    command.args(["-c", FIND]).stdin(Stdio::null());
    let ended =
        process::run(&mut command, limits).map_err(|e| missing(format!("{python}: {e}")))?;
    let folder = ended.stdout.trim();
    if ended.end != End::Exit(0) || folder.is_empty() {
        return Err(missing(format!("{python} has no up_fast_downward")));
    }
    let search = Path::new(folder).join("downward/builds/release/bin/downward");
    if search.is_file() {
        Ok(Parts::Wheel(search))
    } else {
        Err(missing(format!("{} is no file", search.display())))
    }
}
