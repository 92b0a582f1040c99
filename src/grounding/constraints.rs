//! `[constraints]` of `perception.toml`: what every consistent set of observed facts obeys.

use serde::Deserialize;

use super::perception::{PerceptionError, arity, value};
use crate::pddl::{Domain, Name};

/// Properties that every consistent set of observed facts has.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constraints {
    /// Binary predicates with at most one second argument per first.
    #[serde(default)]
    pub functional: Vec<Name>,
    /// Binary predicates with at most one first argument per second.
    #[serde(default)]
    pub inverse_functional: Vec<Name>,
    /// Binary predicates that are irreflexive, antisymmetric and transitive.
    #[serde(default)]
    pub strict_order: Vec<Name>,
    /// Binary predicates with exactly one second argument per first.
    #[serde(default)]
    pub exactly_one: Vec<Name>,
    /// Binary predicates that no object has to itself.
    #[serde(default)]
    pub irreflexive: Vec<Name>,
}

impl Constraints {
    pub(super) fn check(&self, domain: &Domain) -> Result<(), PerceptionError> {
        let lists = [
            ("constraints.functional", &self.functional),
            ("constraints.inverse_functional", &self.inverse_functional),
            ("constraints.strict_order", &self.strict_order),
            ("constraints.exactly_one", &self.exactly_one),
            ("constraints.irreflexive", &self.irreflexive),
        ];
        for (field, names) in lists {
            for name in names {
                if arity(domain, field, name)? != 2 {
                    return Err(value(field, "predicates of two objects", name));
                }
            }
        }
        Ok(())
    }
}
