//! Who changes a predicate: nobody, actions, or rules.

use super::lowering::Symbols;
use crate::pddl::{Domain, Effect, Name};

/// Who changes a predicate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PredicateKind {
    /// Nobody: its atoms are as in the given facts.
    Static,
    /// Actions.
    Fluent,
    /// Rules.
    Derived,
}

/// Predicates that no action changes and no rule derives.
pub(crate) fn static_predicates(domain: &Domain) -> Vec<Name> {
    let symbols = Symbols::new(domain, &[]);
    let kinds = kinds(domain, &symbols).into_iter().zip(&symbols.predicates);
    let statics = kinds.filter(|(kind, _)| *kind == PredicateKind::Static);
    statics.map(|(_, name)| (*name).clone()).collect()
}

/// Who changes each predicate.
pub(super) fn kinds(domain: &Domain, symbols: &Symbols<'_>) -> Vec<PredicateKind> {
    fn mark(effect: &Effect, symbols: &Symbols<'_>, kinds: &mut [PredicateKind]) {
        match effect {
            Effect::And(parts) => parts.iter().for_each(|p| mark(p, symbols, kinds)),
            Effect::Add(literal) | Effect::Delete(literal) => {
                if let Some(predicate) = symbols.predicate(&literal.predicate) {
                    kinds[predicate as usize] = PredicateKind::Fluent;
                }
            }
            Effect::When(_, inner) | Effect::Forall(_, inner) => mark(inner, symbols, kinds),
            Effect::Cost(_) => {}
        }
    }
    let mut kinds = vec![PredicateKind::Static; symbols.predicates.len()];
    domain.actions.iter().for_each(|action| mark(&action.effect, symbols, &mut kinds));
    for axiom in &domain.axioms {
        if let Some(predicate) = symbols.predicate(&axiom.head.name) {
            kinds[predicate as usize] = PredicateKind::Derived;
        }
    }
    kinds
}
