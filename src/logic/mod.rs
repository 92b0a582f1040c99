//! What PDDL means: conditions, effects and derived predicates, in three truth values.

mod truth;
mod facts;
mod semantics;
mod variables;
mod extension;
mod demand;

pub use demand::Demand;
pub use extension::{Extension, derive};
pub use facts::Facts;
pub use semantics::{
    Changes, CostError, Universe, bind, cost_of, effects, evaluate, failing, mentioned_unknowns,
    unsatisfied,
};
pub use truth::Truth;
pub use variables::{Bindings, speaks_of_all, substitute};
