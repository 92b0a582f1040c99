//! One thing that an instruction asks for.

use super::Span;
use crate::pddl::{Condition, Literal, Name, Term, Typed};

/// An argument of a claim.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Arg {
    One(Name),
    Every(Name),
}

/// One atom of the goal, possibly over every object of a type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Claim {
    pub(super) predicate: Name,
    pub(super) args: Vec<Arg>,
    /// Whether it is not to hold.
    pub(super) is_denied: bool,
    pub(super) span: Span,
}

impl Claim {
    pub(super) fn says_same(&self, other: &Self) -> bool {
        let said = |claim: &Self| (claim.predicate.clone(), claim.args.clone(), claim.is_denied);
        said(self) == said(other)
    }

    /// The claim as PDDL.
    pub(super) fn condition(&self) -> Condition {
        let mut variables: Vec<Typed> = Vec::new();
        let args = self
            .args
            .iter()
            .zip(["x", "y"])
            .map(|(arg, variable)| match arg {
                Arg::One(name) => Term::Object(name.clone()),
                Arg::Every(type_name) => {
                    variables.push(Typed::new(variable, type_name.clone()));
                    Term::Var(variable.into())
                }
            })
            .collect();
        let atom = Condition::Atom(Literal { predicate: self.predicate.clone(), args });
        let said = if self.is_denied { Condition::Not(Box::new(atom)) } else { atom };
        if variables.is_empty() { said } else { Condition::Forall(variables, Box::new(said)) }
    }
}
