//! Which instances of an action can matter, judged by who asks for what it changes.
//!
//! An atom that only the goal asks for, by name, needs no other instances than those that change
//! it; that can be one instance in place of millions.

use std::collections::BTreeSet;

use super::lowering::{LiftedAction, SlotAtom, SlotCondition, SlotEffect, SlotTerm};

/// What conditions ask of each predicate.
pub(super) struct Mentions {
    by_predicate: Vec<Mention>,
}

/// What conditions ask of one predicate.
#[derive(Debug, Clone)]
enum Mention {
    /// These atoms only.
    Ground(BTreeSet<Vec<u32>>),
    /// Atoms with variables in them.
    Open,
}

/// A partial binding of an action's parameters.
pub(super) type Seed = Vec<Option<u32>>;

impl Mentions {
    /// Nothing is asked for yet.
    pub(super) fn new(n_predicates: usize) -> Self {
        Self { by_predicate: vec![Mention::Ground(BTreeSet::new()); n_predicates] }
    }

    /// Notes what a condition asks for.
    pub(super) fn condition(&mut self, condition: &SlotCondition) {
        match condition {
            SlotCondition::True | SlotCondition::False | SlotCondition::Equal(..) => {}
            SlotCondition::Atom(atom) => self.atom(atom),
            SlotCondition::And(parts) | SlotCondition::Or(parts) => {
                for part in parts {
                    self.condition(part);
                }
            }
            SlotCondition::Not(inner)
            | SlotCondition::Exists(_, inner)
            | SlotCondition::Forall(_, inner) => self.condition(inner),
        }
    }

    /// Notes what the conditions of an effect ask for.
    pub(super) fn effect(&mut self, effect: &SlotEffect) {
        match effect {
            SlotEffect::And(parts) => parts.iter().for_each(|p| self.effect(p)),
            SlotEffect::When(condition, inner) => {
                self.condition(condition);
                self.effect(inner);
            }
            SlotEffect::Forall(_, inner) => self.effect(inner),
            SlotEffect::Change(..) | SlotEffect::Number(_) | SlotEffect::Function(..) => {}
        }
    }

    fn atom(&mut self, atom: &SlotAtom) {
        let args = atom.args.iter().map(|arg| match arg {
            SlotTerm::Object(object) => Some(*object),
            SlotTerm::Slot(_) => None,
        });
        let mention = &mut self.by_predicate[atom.predicate as usize];
        match (args.collect::<Option<Vec<u32>>>(), &mut *mention) {
            (Some(args), Mention::Ground(atoms)) => {
                atoms.insert(args);
            }
            (Some(_), Mention::Open) => {}
            (None, _) => *mention = Mention::Open,
        }
    }

    /// Partial bindings of which every instance that can matter extends one.
    pub(super) fn seeds(&self, action: &LiftedAction) -> BTreeSet<Seed> {
        let mut seeds = BTreeSet::new();
        let free: Seed = vec![None; action.params.len()];
        self.collect(&action.result, &free, &mut seeds);
        if seeds.contains(&free) { BTreeSet::from([free]) } else { seeds }
    }

    fn collect(&self, effect: &SlotEffect, free: &Seed, seeds: &mut BTreeSet<Seed>) {
        match effect {
            SlotEffect::And(parts) => parts.iter().for_each(|p| self.collect(p, free, seeds)),
            SlotEffect::When(_, inner) | SlotEffect::Forall(_, inner) => {
                self.collect(inner, free, seeds);
            }
            SlotEffect::Number(_) | SlotEffect::Function(..) => {}
            SlotEffect::Change(atom, _) => match &self.by_predicate[atom.predicate as usize] {
                Mention::Open => {
                    seeds.insert(free.clone());
                }
                Mention::Ground(atoms) => {
                    seeds.extend(atoms.iter().filter_map(|args| unified(atom, args, free)));
                }
            },
        }
    }
}

/// The parameters' values for which an effect changes the given atom.
fn unified(atom: &SlotAtom, args: &[u32], free: &Seed) -> Option<Seed> {
    let mut seed = free.clone();
    for (term, &value) in atom.args.iter().zip(args) {
        let agrees = match *term {
            SlotTerm::Object(object) => object == value,
            // Slots beyond the parameters belong to quantifiers, which range over all objects.
            SlotTerm::Slot(slot) => {
                seed.get_mut(slot).is_none_or(|bound| *bound.get_or_insert(value) == value)
            }
        };
        if !agrees {
            return None;
        }
    }
    Some(seed)
}
