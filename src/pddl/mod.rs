//! PDDL: text to a checked, typed tree and back, and what the tree means.

mod name;
mod ast;
mod error;
mod sexpr;
mod check;
mod strata;
mod parse;
mod print;
mod semantics;
mod variables;
mod extension;
mod demand;

pub use ast::{
    Action, Atom, Axiom, Condition, CostTerm, Domain, Effect, Literal, Problem, Signature, Step,
    Term, Typed, Types,
};
pub use demand::Demand;
pub use error::{ErrorKind, Parsed, PddlError, Place, SourceText, Span, Warning};
pub use extension::{Extension, derive};
pub use name::Name;
pub use parse::{parse_domain, parse_facts, parse_goal, parse_plan, parse_problem, parse_rules};
pub use print::{print_domain, print_problem};
pub use semantics::{
    Bindings, Changes, Universe, bind, effects, evaluate, mentioned_unknowns, unsatisfied,
};
pub use sexpr::{NESTING_MAX, SOURCE_BYTES_MAX};
pub use strata::{NotStratified, Stratum, stratify};
pub use variables::substitute;
