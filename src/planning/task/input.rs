//! What a task is made from, and why that may fail.

use std::collections::{BTreeMap, BTreeSet};

use crate::logic::CostError;
use crate::pddl::{Atom, Condition, Domain, Name, NotStratified, Number, Typed};

/// Which states a task has to serve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coverage {
    /// Those reachable from the given facts: the smallest task.
    Reachable,
    /// Every state over the given objects that agrees with the given facts on the predicates that
    /// no action changes. The goal may be asked for from any of them.
    AllStates,
}

/// What a task is made from.
#[derive(Debug, Clone, Copy)]
pub struct TaskInput<'a> {
    /// Types, predicates, actions and rules.
    pub domain: &'a Domain,
    /// The objects, with or without the domain's constants.
    pub objects: &'a [Typed],
    /// With [`Coverage::Reachable`] the facts to plan from; with [`Coverage::AllStates`] those of
    /// static predicates count alone.
    pub init: &'a BTreeSet<Atom>,
    /// What must hold at the end; may be anything that a precondition may be.
    pub goal: &'a Condition,
    /// Values of cost functions.
    pub costs: &'a BTreeMap<Atom, Number>,
    /// Whether actions cost what they add to `total-cost`; otherwise each costs 1.
    pub minimise_cost: bool,
}

/// Why a task could not be grounded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TaskError {
    /// One of [`GroundingLimits`](crate::planning::GroundingLimits) was met.
    #[error("{limit} ({value}) is used up")]
    OutOfBudget {
        /// Its key, such as `grounding.actions_max`.
        limit: &'static str,
        /// What it allows.
        value: u64,
    },
    /// The caller did not want to wait any longer.
    #[error("grounding was interrupted")]
    Interrupted,
    /// A condition, fact or goal names something that the domain or the objects lack.
    #[error("expected a declared predicate, object or variable, got `{name}`")]
    UnknownName {
        /// As it is written.
        name: Name,
    },
    /// An action has no cost.
    #[error(transparent)]
    Cost(#[from] CostError),
    /// The costs of the actions have no common unit that is both small and large enough.
    #[error("expected costs that are at most {max} of their common unit {unit}, got {cost}")]
    CostRange {
        /// The largest number that all costs are whole multiples of.
        unit: Number,
        /// The dearest action's.
        cost: Number,
        /// How many units an action may cost.
        max: u64,
    },
    /// The derived predicates depend on their own negation.
    #[error(transparent)]
    NotStratified(#[from] NotStratified),
}

impl TaskError {
    pub(crate) fn limit(limit: &'static str, value: u64) -> Self {
        Self::OutOfBudget { limit, value }
    }
}
