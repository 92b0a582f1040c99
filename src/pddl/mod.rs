//! PDDL: text to a checked, typed tree and back.

mod name;
mod number;
mod ast;
mod error;
mod decode;
mod sexpr;
mod check;
pub(crate) mod strata;
mod parse;
mod print;

pub use ast::{
    Action, Atom, Axiom, Condition, CostTerm, Domain, Effect, Literal, Problem, Signature, Step,
    Term, Typed, Types,
};
pub use error::{ErrorKind, Parsed, PddlError, SourcePosition, SourceText, Span, Warning};
pub use name::Name;
pub use number::{NUMBER_DIGITS_MAX, Number};
pub use parse::{parse_domain, parse_facts, parse_goal, parse_plan, parse_problem, parse_rules};
pub use print::{print_domain, print_problem};
pub use sexpr::{NESTING_MAX, SOURCE_BYTES_MAX};
pub use strata::{NotStratified, Stratum, stratify};
