//! Actions and rules with numbers in place of names, ready to be instantiated.

use std::collections::BTreeMap;

use super::TaskError;
use crate::logic::Universe;
use crate::pddl::{Condition, CostTerm, Domain, Effect, Literal, Name, Number, Term, Typed, Types};

/// Numbers for objects and predicates.
pub(super) struct Symbols<'a> {
    /// All objects, constants first; an object's number is its place.
    pub(super) objects: Vec<Typed>,
    types: &'a Types,
    object_ids: BTreeMap<Name, u32>,
    /// Predicates in the domain's order.
    pub(super) predicates: Vec<&'a Name>,
    predicate_ids: BTreeMap<&'a Name, u32>,
}

/// A variable's slot or an object's number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SlotTerm {
    Slot(usize),
    Object(u32),
}

/// An atom over slots.
#[derive(Debug, Clone)]
pub(super) struct SlotAtom {
    pub(super) predicate: u32,
    pub(super) args: Vec<SlotTerm>,
}

/// Slots of quantified variables, each with the objects it ranges over.
pub(super) type Ranges = Vec<(usize, Vec<u32>)>;

/// A condition over slots; every quantifier has slots of its own, so nothing is hidden.
#[derive(Debug, Clone)]
pub(super) enum SlotCondition {
    True,
    False,
    Atom(SlotAtom),
    Equal(SlotTerm, SlotTerm),
    Not(Box<SlotCondition>),
    And(Vec<SlotCondition>),
    Or(Vec<SlotCondition>),
    Exists(Ranges, Box<SlotCondition>),
    Forall(Ranges, Box<SlotCondition>),
}

/// An effect over slots.
#[derive(Debug, Clone)]
pub(super) enum SlotEffect {
    And(Vec<SlotEffect>),
    Change(SlotAtom, bool),
    When(SlotCondition, Box<SlotEffect>),
    Forall(Ranges, Box<SlotEffect>),
    Number(Number),
    Function(Name, Vec<SlotTerm>),
}

/// An action, rule or goal over slots; the parameters have the first slots.
#[derive(Debug)]
pub(super) struct Lifted<T> {
    /// The objects each parameter ranges over.
    pub(super) params: Vec<Vec<u32>>,
    /// Number of slots, parameters included.
    pub(super) n_slots: usize,
    pub(super) condition: SlotCondition,
    /// The effect of an action, the head of a rule.
    pub(super) result: T,
}

impl<'a> Symbols<'a> {
    pub(super) fn new(domain: &'a Domain, objects: &[Typed]) -> Self {
        let mut all: Vec<Typed> = domain.constants.clone();
        let mut ids: BTreeMap<Name, u32> =
            all.iter().zip(0..).map(|(o, idx)| (o.name.clone(), idx)).collect();
        for object in objects {
            if !ids.contains_key(&object.name) {
                ids.insert(object.name.clone(), all.len() as u32);
                all.push(object.clone());
            }
        }
        let predicates: Vec<&Name> = domain.predicates.iter().map(|p| &p.name).collect();
        let predicate_ids = predicates.iter().copied().zip(0..).collect();
        Self { objects: all, types: &domain.types, object_ids: ids, predicates, predicate_ids }
    }

    pub(super) fn object(&self, name: &Name) -> Option<u32> {
        self.object_ids.get(name).copied()
    }

    pub(super) fn predicate(&self, name: &Name) -> Option<u32> {
        self.predicate_ids.get(name).copied()
    }

    /// The objects of the given types.
    fn range(&self, types: &[Name]) -> Vec<u32> {
        let universe = Universe { types: self.types, objects: &self.objects };
        universe.of(types).filter_map(|name| self.object(name)).collect()
    }
}

/// An action schema.
pub(super) type LiftedAction = Lifted<SlotEffect>;

/// A rule; the result is the predicate of its head.
pub(super) type LiftedRule = Lifted<u32>;

/// Lowers one action, rule or goal: names become numbers, variables become slots.
pub(super) struct Lowering<'a> {
    symbols: &'a Symbols<'a>,
    /// Visible variables, innermost last.
    scope: Vec<(Name, usize)>,
    n_slots: usize,
}

impl<'a> Lowering<'a> {
    pub(super) fn new(symbols: &'a Symbols<'a>) -> Self {
        Self { symbols, scope: Vec::new(), n_slots: 0 }
    }

    /// A goal: no parameters, no result.
    pub(super) fn goal(mut self, goal: &Condition) -> Result<Lifted<()>, TaskError> {
        let condition = self.condition(goal)?;
        Ok(Lifted { params: Vec::new(), n_slots: self.n_slots, condition, result: () })
    }

    /// An action with its precondition and effect.
    pub(super) fn action(
        mut self,
        action: &crate::pddl::Action,
    ) -> Result<LiftedAction, TaskError> {
        let params = self.enter(&action.params).into_iter().map(|(_, range)| range).collect();
        let condition = self.condition(&action.precondition)?;
        let result = self.effect(&action.effect)?;
        Ok(Lifted { params, n_slots: self.n_slots, condition, result })
    }

    /// A rule with its body; the result is the head's predicate.
    pub(super) fn rule(mut self, axiom: &crate::pddl::Axiom) -> Result<LiftedRule, TaskError> {
        let params = self.enter(&axiom.head.params).into_iter().map(|(_, range)| range).collect();
        let condition = self.condition(&axiom.body)?;
        let result = self.predicate(&axiom.head.name)?;
        Ok(Lifted { params, n_slots: self.n_slots, condition, result })
    }

    fn enter(&mut self, variables: &[Typed]) -> Ranges {
        let mut ranges = Vec::with_capacity(variables.len());
        for variable in variables {
            self.scope.push((variable.name.clone(), self.n_slots));
            ranges.push((self.n_slots, self.symbols.range(&variable.types)));
            self.n_slots += 1;
        }
        ranges
    }

    fn predicate(&self, name: &Name) -> Result<u32, TaskError> {
        let unknown = || TaskError::UnknownName { name: name.clone() };
        self.symbols.predicate(name).ok_or_else(unknown)
    }

    fn term(&self, term: &Term) -> Result<SlotTerm, TaskError> {
        let (found, name) = match term {
            Term::Var(name) => {
                let bound = self.scope.iter().rev().find(|(n, _)| n == name);
                (bound.map(|(_, slot)| SlotTerm::Slot(*slot)), name)
            }
            Term::Object(name) => (self.symbols.object(name).map(SlotTerm::Object), name),
        };
        found.ok_or_else(|| TaskError::UnknownName { name: name.clone() })
    }

    fn terms(&self, terms: &[Term]) -> Result<Vec<SlotTerm>, TaskError> {
        terms.iter().map(|t| self.term(t)).collect()
    }

    fn atom(&self, literal: &Literal) -> Result<SlotAtom, TaskError> {
        let predicate = self.predicate(&literal.predicate)?;
        Ok(SlotAtom { predicate, args: self.terms(&literal.args)? })
    }

    fn conditions(&mut self, parts: &[Condition]) -> Result<Vec<SlotCondition>, TaskError> {
        parts.iter().map(|p| self.condition(p)).collect()
    }

    fn condition(&mut self, condition: &Condition) -> Result<SlotCondition, TaskError> {
        Ok(match condition {
            Condition::True => SlotCondition::True,
            Condition::False => SlotCondition::False,
            Condition::Atom(literal) => SlotCondition::Atom(self.atom(literal)?),
            Condition::Equal(a, b) => SlotCondition::Equal(self.term(a)?, self.term(b)?),
            Condition::Not(inner) => SlotCondition::Not(Box::new(self.condition(inner)?)),
            Condition::And(parts) => SlotCondition::And(self.conditions(parts)?),
            Condition::Or(parts) => SlotCondition::Or(self.conditions(parts)?),
            Condition::Exists(variables, inner) => {
                let (ranges, inner) = self.below(variables, |c| c.condition(inner))?;
                SlotCondition::Exists(ranges, Box::new(inner))
            }
            Condition::Forall(variables, inner) => {
                let (ranges, inner) = self.below(variables, |c| c.condition(inner))?;
                SlotCondition::Forall(ranges, Box::new(inner))
            }
        })
    }

    fn effect(&mut self, effect: &Effect) -> Result<SlotEffect, TaskError> {
        Ok(match effect {
            Effect::And(parts) => {
                let parts = parts.iter().map(|p| self.effect(p));
                SlotEffect::And(parts.collect::<Result<_, _>>()?)
            }
            Effect::Add(literal) => SlotEffect::Change(self.atom(literal)?, true),
            Effect::Delete(literal) => SlotEffect::Change(self.atom(literal)?, false),
            Effect::When(condition, inner) => {
                let condition = self.condition(condition)?;
                SlotEffect::When(condition, Box::new(self.effect(inner)?))
            }
            Effect::Forall(variables, inner) => {
                let (ranges, inner) = self.below(variables, |c| c.effect(inner))?;
                SlotEffect::Forall(ranges, Box::new(inner))
            }
            Effect::Cost(CostTerm::Number(number)) => SlotEffect::Number(*number),
            Effect::Cost(CostTerm::Function(literal)) => {
                SlotEffect::Function(literal.predicate.clone(), self.terms(&literal.args)?)
            }
        })
    }

    fn below<T>(
        &mut self,
        variables: &[Typed],
        read: impl FnOnce(&mut Self) -> Result<T, TaskError>,
    ) -> Result<(Ranges, T), TaskError> {
        let before = self.scope.len();
        let ranges = self.enter(variables);
        let inner = read(self)?;
        self.scope.truncate(before);
        Ok((ranges, inner))
    }
}
