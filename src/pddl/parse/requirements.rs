//! `:requirements`: what was declared, what is used, what is known.

use std::collections::BTreeSet;

use super::super::Name;
use super::Reader;

/// A part of PDDL that a domain should declare before using it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feature {
    Typing,
    NegativePreconditions,
    DisjunctivePreconditions,
    ExistentialPreconditions,
    UniversalPreconditions,
    ConditionalEffects,
    Equality,
    ActionCosts,
    DerivedPredicates,
}

impl Feature {
    /// Requirements that cover the feature, the most exact one first.
    fn covered_by(self) -> &'static [&'static str] {
        match self {
            Self::Typing => &[":typing", ":adl"],
            Self::NegativePreconditions => &[":negative-preconditions", ":adl"],
            Self::DisjunctivePreconditions => &[":disjunctive-preconditions", ":adl"],
            Self::ExistentialPreconditions => {
                &[":existential-preconditions", ":quantified-preconditions", ":adl"]
            }
            Self::UniversalPreconditions => {
                &[":universal-preconditions", ":quantified-preconditions", ":adl"]
            }
            Self::ConditionalEffects => &[":conditional-effects", ":adl"],
            Self::Equality => &[":equality", ":adl"],
            Self::ActionCosts => &[":action-costs", ":fluents", ":numeric-fluents"],
            Self::DerivedPredicates => &[":derived-predicates", ":domain-axioms"],
        }
    }
}

/// Requirements that are understood.
const KNOWN: &[&str] = &[
    ":action-costs",
    ":adl",
    ":conditional-effects",
    ":derived-predicates",
    ":disjunctive-preconditions",
    ":domain-axioms",
    ":equality",
    ":existential-preconditions",
    ":negative-preconditions",
    ":quantified-preconditions",
    ":strips",
    ":typing",
    ":universal-preconditions",
];

impl Reader<'_> {
    /// Warns about requirements that are not understood; using such a feature is the error.
    pub(super) fn warn_of_unknown(&mut self, name: &Name, span: super::Span) {
        if !KNOWN.contains(&name.as_str()) {
            let message = format!("the requirement `{name}` is declared but not understood");
            self.warn(name.as_str(), span, message);
        }
    }

    /// Warns about every feature that was used without being declared.
    pub(super) fn warn_of_undeclared(&mut self, declared: &BTreeSet<Name>) {
        for (feature, span) in std::mem::take(&mut self.used) {
            let covering = feature.covered_by();
            if !covering.iter().any(|&r| declared.contains(r)) {
                let message = format!("`{}` is used here but not declared", covering[0]);
                self.warn(covering[0], span, message);
            }
        }
    }
}
