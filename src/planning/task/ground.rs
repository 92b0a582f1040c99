//! Conditions and effects over objects: quantifiers expanded, static parts evaluated.

use std::collections::{BTreeMap, BTreeSet};

use super::TaskError;
use super::formula::Formula;
use super::lowering::{Ranges, SlotAtom, SlotCondition, SlotEffect, SlotTerm, Symbols};
use super::predicate_kind::PredicateKind;
use crate::pddl::{Name, Number};
use crate::planning::GroundingLimits;

/// Changes under one condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::planning) struct GroundEffect {
    pub(in crate::planning) condition: Formula,
    /// (atom, whether it becomes true).
    pub(in crate::planning) changes: Vec<(u32, bool)>,
}

/// What an action adds to `total-cost`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct GroundCost {
    pub(super) numbers: Vec<Number>,
    pub(super) functions: Vec<(Name, Vec<u32>)>,
}

/// How many steps pass between two questions to `interrupt`: about a millisecond.
const INTERRUPT_EVERY: u64 = 4096;

/// Looks at one binding; answers whether that is enough.
type Visit<'v, 'a> = dyn FnMut(&mut Grounder<'a>, &mut [u32]) -> Result<bool, TaskError> + 'v;

/// Grounds conditions and effects and numbers the atoms it meets.
pub(super) struct Grounder<'a> {
    symbols: &'a Symbols<'a>,
    kinds: Vec<PredicateKind>,
    statics: BTreeSet<u128>,
    index: BTreeMap<u128, u32>,
    /// Predicate and arguments of each numbered atom.
    pub(super) atoms: Vec<(u32, Vec<u32>)>,
    limits: &'a GroundingLimits,
    interrupt: &'a dyn Fn() -> bool,
    steps: u64,
}

impl<'a> Grounder<'a> {
    /// `statics` are the true atoms of static predicates.
    pub(super) fn new(
        symbols: &'a Symbols<'a>,
        kinds: Vec<PredicateKind>,
        statics: &[(u32, Vec<u32>)],
        (limits, interrupt): (&'a GroundingLimits, &'a dyn Fn() -> bool),
    ) -> Self {
        let (index, atoms) = (BTreeMap::new(), Vec::new());
        let mut grounder = Self {
            symbols,
            kinds,
            statics: BTreeSet::new(),
            index,
            atoms,
            limits,
            interrupt,
            steps: 0,
        };
        grounder.statics = statics.iter().map(|(p, args)| grounder.key(*p, args)).collect();
        grounder
    }

    /// Who changes the predicate.
    pub(super) fn kind(&self, predicate: u32) -> PredicateKind {
        self.kinds[predicate as usize]
    }

    /// A number that only this atom has. `Task` checks beforehand that it fits.
    fn key(&self, predicate: u32, args: &[u32]) -> u128 {
        let n_objects = self.symbols.objects.len() as u128;
        let args = args.iter().fold(0_u128, |key, &arg| key * n_objects + u128::from(arg));
        args * self.symbols.predicates.len() as u128 + u128::from(predicate)
    }

    /// Counts one elementary step.
    pub(super) fn step(&mut self) -> Result<(), TaskError> {
        self.steps += 1;
        if self.steps > self.limits.steps_max {
            return Err(TaskError::limit("grounding.steps_max", self.limits.steps_max));
        }
        if self.steps.is_multiple_of(INTERRUPT_EVERY) && (self.interrupt)() {
            return Err(TaskError::Interrupted);
        }
        Ok(())
    }

    /// The number of an atom that is not static.
    pub(super) fn atom(&mut self, predicate: u32, args: Vec<u32>) -> Result<u32, TaskError> {
        let key = self.key(predicate, &args);
        if let Some(&number) = self.index.get(&key) {
            return Ok(number);
        }
        if self.atoms.len() >= self.limits.atoms_max {
            return Err(TaskError::limit("grounding.atoms_max", self.limits.atoms_max as u64));
        }
        let number = self.atoms.len() as u32;
        self.index.insert(key, number);
        self.atoms.push((predicate, args));
        Ok(number)
    }

    /// The condition (or, unless `positive`, its negation) under a binding of the slots.
    pub(super) fn condition(
        &mut self,
        condition: &SlotCondition,
        binding: &mut [u32],
        positive: bool,
    ) -> Result<Formula, TaskError> {
        self.step()?;
        let truth = |value: bool| if value == positive { Formula::True } else { Formula::False };
        Ok(match condition {
            SlotCondition::True => truth(true),
            SlotCondition::False => truth(false),
            SlotCondition::Equal(a, b) => truth(object(*a, binding) == object(*b, binding)),
            SlotCondition::Not(inner) => self.condition(inner, binding, !positive)?,
            SlotCondition::Atom(atom) => {
                let args = objects(atom, binding);
                if self.kind(atom.predicate) == PredicateKind::Static {
                    truth(self.statics.contains(&self.key(atom.predicate, &args)))
                } else {
                    Formula::literal(self.atom(atom.predicate, args)?, positive)
                }
            }
            SlotCondition::And(parts) | SlotCondition::Or(parts) => {
                let conjunction = matches!(condition, SlotCondition::And(_)) == positive;
                let mut formulas = Vec::with_capacity(parts.len());
                for part in parts {
                    let formula = self.condition(part, binding, positive)?;
                    if formula == decisive(conjunction) {
                        return Ok(formula);
                    }
                    formulas.push(formula);
                }
                combine(conjunction, formulas)
            }
            SlotCondition::Exists(ranges, inner) | SlotCondition::Forall(ranges, inner) => {
                let conjunction = matches!(condition, SlotCondition::Forall(..)) == positive;
                let mut formulas = Vec::new();
                self.each_binding(ranges, binding, &mut |grounder, binding| {
                    let formula = grounder.condition(inner, binding, positive)?;
                    let decided = formula == decisive(conjunction);
                    formulas.push(formula);
                    Ok(decided)
                })?;
                combine(conjunction, formulas)
            }
        })
    }

    /// Runs `visit` under every binding of the ranges, until it says that it has seen enough.
    fn each_binding(
        &mut self,
        ranges: &Ranges,
        binding: &mut [u32],
        visit: &mut Visit<'_, 'a>,
    ) -> Result<(), TaskError> {
        if ranges.iter().any(|(_, range)| range.is_empty()) {
            return Ok(());
        }
        let mut digits = vec![0; ranges.len()];
        loop {
            for ((slot, range), &digit) in ranges.iter().zip(&digits) {
                binding[*slot] = range[digit];
            }
            if visit(self, binding)? {
                return Ok(());
            }
            // Count up, the last variable fastest.
            let mut place = ranges.len();
            loop {
                let Some(idx) = place.checked_sub(1) else { return Ok(()) };
                digits[idx] += 1;
                if digits[idx] < ranges[idx].1.len() {
                    break;
                }
                digits[idx] = 0;
                place = idx;
            }
        }
    }

    /// The effect under a binding of the slots. `condition` is that of the effects around it.
    pub(super) fn effect(
        &mut self,
        effect: &SlotEffect,
        binding: &mut [u32],
        condition: &Formula,
        out: &mut (Vec<GroundEffect>, GroundCost),
    ) -> Result<(), TaskError> {
        self.step()?;
        match effect {
            SlotEffect::And(parts) => {
                for part in parts {
                    self.effect(part, binding, condition, out)?;
                }
            }
            SlotEffect::Change(atom, added) => {
                let atom = self.atom(atom.predicate, objects(atom, binding))?;
                let change = (atom, *added);
                if let Some(effect) = out.0.iter_mut().find(|e| e.condition == *condition) {
                    effect.changes.push(change);
                } else {
                    let condition = condition.clone();
                    out.0.push(GroundEffect { condition, changes: vec![change] });
                }
            }
            SlotEffect::When(inner_condition, inner) => {
                let formula = self.condition(inner_condition, binding, true)?;
                let both = Formula::and([condition.clone(), formula]);
                if both != Formula::False {
                    self.effect(inner, binding, &both, out)?;
                }
            }
            SlotEffect::Forall(ranges, inner) => {
                self.each_binding(ranges, binding, &mut |grounder, binding| {
                    grounder.effect(inner, binding, condition, out)?;
                    Ok(false)
                })?;
            }
            SlotEffect::Number(number) => out.1.numbers.push(*number),
            SlotEffect::Function(name, args) => {
                let args = args.iter().map(|&a| object(a, binding)).collect();
                out.1.functions.push((name.clone(), args));
            }
        }
        Ok(())
    }
}

/// The part that decides a conjunction or disjunction alone.
fn decisive(conjunction: bool) -> Formula {
    if conjunction { Formula::False } else { Formula::True }
}

fn combine(conjunction: bool, parts: Vec<Formula>) -> Formula {
    if conjunction { Formula::and(parts) } else { Formula::or(parts) }
}

/// The object a term stands for.
pub(super) fn object(term: SlotTerm, binding: &[u32]) -> u32 {
    match term {
        SlotTerm::Slot(slot) => binding[slot],
        SlotTerm::Object(object) => object,
    }
}

fn objects(atom: &SlotAtom, binding: &[u32]) -> Vec<u32> {
    atom.args.iter().map(|&arg| object(arg, binding)).collect()
}
