//! PDDL: text to a checked, typed tree and back.

mod name;
mod ast;

pub use ast::{
    Action, Atom, Axiom, Condition, CostTerm, Domain, Effect, Literal, Problem, Signature, Term,
    Typed, Types,
};
pub use name::Name;
