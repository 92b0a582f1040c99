//! How a call of the searches ends, and when it is to end.

use std::fmt;

use super::outcome::{Phase, Proof};

/// Name of the limit of what a plan may cost, in units of cost.
pub(super) const COST: &str = "cost_units_max";

/// The answer of the searches over packed states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SearchAnswer {
    /// A plan as operators, or why there is none.
    pub(crate) end: SearchEnd,
    /// No plan is cheaper than this; 0 when nothing is known.
    pub(crate) lower_bound: u64,
    /// The limit that ended the call before its plan was proven cheapest.
    pub(crate) unproven: Option<(&'static str, u64)>,
    /// One entry for each search that ran.
    pub(crate) phases: Vec<Phase>,
}

/// How the searches over packed states ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SearchEnd {
    /// Operators that lead to the goal.
    Found {
        /// Numbers of the operators, in order.
        operators: Vec<u32>,
        /// Sum of the costs that were handed in.
        cost: u64,
        /// Whether no plan is cheaper.
        proven_optimal: bool,
    },
    /// There is no plan.
    Exhausted {
        /// Why that is certain.
        proof: Proof,
    },
    /// A limit was met.
    OutOfBudget {
        /// Its key in [`Budget`].
        limit: &'static str,
        /// What it allows.
        value: u64,
    },
    /// The caller did not want to wait any longer.
    Interrupted,
}

/// When a call is to end, polled often from the thread that plans.
#[derive(Clone, Copy)]
pub struct Interrupts<'a> {
    /// `true` ends the search for a cheapest plan: what is left of the time goes into finding a plan
    /// and making it cheaper.
    pub proof: &'a dyn Fn() -> bool,
    /// `true` ends the call with what there is.
    pub all: &'a dyn Fn() -> bool,
}

impl fmt::Debug for Interrupts<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Interrupts").finish_non_exhaustive()
    }
}
