//! Planners: state and goal to plan. Each is one file with one line in [`PLANNERS`].

mod config;
mod embedded;
mod fast_downward;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use thiserror::Error;

use crate::pddl::{Atom, Condition, Domain, Step, Typed};
use crate::planning::{Answer, PlanRequest, Task};

pub use config::{PlannerConfig, TableConfig};
pub use fast_downward::{BackendAnswer, FastDownward};

/// What a planner is asked.
#[derive(Clone, Copy)]
pub struct PlanQuery<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// All objects, the domain's constants included.
    pub objects: &'a [Typed],
    /// What holds; everything else does not.
    pub init: &'a BTreeSet<Atom>,
    /// What must hold.
    pub goal: &'a Condition,
    /// Extra cost of single steps: those that have failed before.
    pub penalties: &'a BTreeMap<Step, u32>,
    /// The same question in packed form, where somebody has grounded it already.
    pub grounded: Option<Grounded<'a>>,
    /// Asked now and then by a search for a cheapest plan, where a search for any plan may follow:
    /// `true` means that it is time for that one.
    pub hurry: &'a dyn Fn() -> bool,
    /// Asked now and then by planners that take long: `true` means that nobody waits any more.
    pub interrupt: &'a dyn Fn() -> bool,
}

/// No action has a cost of its own: plans are as cheap as they are short.
static NO_COSTS: BTreeMap<Atom, f64> = BTreeMap::new();

impl<'a> PlanQuery<'a> {
    /// The question as a planning problem.
    pub fn request(&self) -> PlanRequest<'a> {
        PlanRequest {
            objects: self.objects,
            init: self.init,
            goal: self.goal,
            costs: &NO_COSTS,
            minimise_cost: false,
            penalties: self.penalties,
        }
    }
}

/// A ground task with a packed state of it.
#[derive(Debug, Clone, Copy)]
pub struct Grounded<'a> {
    /// The task; it covers every state over its objects.
    pub task: &'a Task,
    /// The state.
    pub state: &'a [u64],
}

impl fmt::Debug for PlanQuery<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlanQuery").field("objects", &self.objects).finish_non_exhaustive()
    }
}

/// A planner. Deterministic, unless it is interrupted: the same query gets the same answer.
pub trait Planner: fmt::Debug + Send + Sync {
    /// Plans once, within its configured limits.
    fn plan(&self, query: &PlanQuery<'_>) -> Answer;
}

/// A planner cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PlannerError {
    /// A program that it needs is not installed: exit code 5.
    #[error("{what} is missing: {how}")]
    Missing {
        /// What.
        what: String,
        /// How to get it: a line to type.
        how: String,
    },
    /// Its own options are not of the documented form.
    #[error("{file}: planner.options{field}: {message}")]
    Options {
        /// The file that they stand in.
        file: String,
        /// The option, with a point before it; empty when several are meant.
        field: String,
        /// What may stand there and what does.
        message: String,
    },
}

/// What a planner is made from.
#[derive(Debug, Clone, Copy)]
pub struct PlannerSettings<'a> {
    /// `[planner]`.
    pub config: &'a PlannerConfig,
    /// The file that it was read from, for messages.
    pub file: &'a str,
    /// What relative paths in options start from.
    pub folder: &'a Path,
}

impl PlannerSettings<'_> {
    /// Refuses options of a planner that has none.
    fn no_options(&self) -> Result<(), PlannerError> {
        match self.config.options.as_ref().and_then(|options| options.keys().next()) {
            None => Ok(()),
            Some(key) => Err(PlannerError::Options {
                file: self.file.to_owned(),
                field: format!(".{key}"),
                message: format!("the planner \"{}\" has no options", self.config.name),
            }),
        }
    }
}

/// Makes a planner.
pub type Build = fn(&PlannerSettings<'_>) -> Result<Box<dyn Planner>, PlannerError>;

/// Every planner by its name in configuration files, in alphabetical order.
pub const PLANNERS: &[(&str, Build)] =
    &[("embedded", embedded::build), ("fast-downward", fast_downward::build)];
