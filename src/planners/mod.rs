//! Planners: state and goal to plan. Each is one file with one line in [`PLANNERS`].

mod config;
mod embedded;
mod fast_downward;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::parts::{Registry, Role};
use crate::pddl::{Atom, Condition, Domain, Number, Step, Typed};
use crate::planning::{Budget, PlanAnswer, PlanRequest, Solver};

pub use config::{GroundingConfig, PlannerConfig, TableConfig};
pub use fast_downward::{BackendAnswer, FastDownward};

/// What a planner is asked.
#[derive(Clone, Copy)]
pub struct PlanQuery<'a> {
    /// As the run's domain folder has it.
    pub domain: &'a Domain,
    /// All objects, the domain's constants included.
    pub objects: &'a [Typed],
    /// What holds; everything else does not.
    pub init: &'a BTreeSet<Atom>,
    /// What must hold after the last step.
    pub goal: &'a Condition,
    /// What fluents add to the costs of actions.
    pub costs: &'a BTreeMap<Atom, Number>,
    /// Whether these costs count; if not, plans are as cheap as they are short.
    pub minimise_cost: bool,
    /// Extra cost of single steps: those that have failed before.
    pub penalties: &'a BTreeMap<Step, u32>,
    /// The same question in packed form, where somebody has grounded it already.
    pub grounded: Option<Grounded<'a>>,
    /// How long the answer is waited for.
    pub deadlines: Deadlines<'a>,
}

/// How long an answer is waited for. Both are polled from the thread that plans, often.
#[derive(Clone, Copy)]
pub struct Deadlines<'a> {
    /// Soft deadline: polled during optimal search; `true` = switch to satisficing search.
    pub soft: &'a dyn Fn() -> bool,
    /// Hard deadline: polled during every search; `true` = answer with what there is.
    pub hard: &'a dyn Fn() -> bool,
}

impl Deadlines<'_> {
    /// As long as the counted limits allow.
    pub const NONE: Deadlines<'static> = Deadlines { soft: &|| false, hard: &|| false };
}

impl fmt::Debug for Deadlines<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Deadlines").finish_non_exhaustive()
    }
}

/// No action has a cost of its own: plans are as cheap as they are short.
pub static NO_COSTS: BTreeMap<Atom, Number> = BTreeMap::new();

impl<'a> PlanQuery<'a> {
    /// A question that is put once, and waited for as long as the counted limits allow.
    pub fn once(domain: &'a Domain, request: &PlanRequest<'a>) -> Self {
        let PlanRequest { objects, init, goal, costs, minimise_cost, penalties } = *request;
        let (grounded, deadlines) = (None, Deadlines::NONE);
        Self { domain, objects, init, goal, costs, minimise_cost, penalties, grounded, deadlines }
    }

    /// The question as a planning problem.
    pub fn request(&self) -> PlanRequest<'a> {
        PlanRequest {
            objects: self.objects,
            init: self.init,
            goal: self.goal,
            costs: self.costs,
            minimise_cost: self.minimise_cost,
            penalties: self.penalties,
        }
    }
}

/// A ground task with a packed state of it.
#[derive(Debug, Clone, Copy)]
pub struct Grounded<'a> {
    /// Its task covers every state over the objects.
    pub solver: &'a Solver,
    /// `init`, packed, with its derived atoms.
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
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer;
}

/// What planners are made from.
#[derive(Debug, Clone, Copy)]
pub struct PlannerInputs<'a> {
    /// How much one call may spend, in counts.
    pub budget: &'a Budget,
}

impl Role for dyn Planner {
    type Inputs<'a> = PlannerInputs<'a>;
    const NAME: &'static str = "planner";
    const KEY: &'static str = "planner.name";
    const OPTIONS: &'static str = "planner.options";
}

/// Every planner by its name in configuration files, in alphabetical order.
pub static PLANNERS: Registry<dyn Planner> = Registry(&[embedded::PART, fast_downward::PART]);
