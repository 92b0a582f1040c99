//! The ground task: packed atoms, actions, rules and goal.
//!
//! A pipeline, one file for each stage; [`Task::new`] is its order:
//!
//! ```text
//!  domain, objects, init, goal
//!    ─ lowering ────► names are numbers, variables are slots          (Lifted)
//!    ─ instantiate ─► argument tuples whose static conditions hold;
//!                     seeds leaves out what nobody asks for, reach what cannot happen
//!    ─ ground ──────► quantifiers expanded, static parts evaluated    (Formula)
//!    ─ draft ───────► every action, rule and the goal, ground         (Draft)
//!    ─ prune ───────► without what cannot happen or cannot matter
//!    ─ pack ────────► atoms are bits, conditions and effects masks    (Task)
//! ```
//!
//! What heuristics derive from a task is not kept here but by [`Solver`](super::Solver).

mod input;
mod formula;
mod lowering;
mod predicate_kind;
mod ground;
mod seeds;
mod instantiate;
mod instance;
mod reach;
mod draft;
mod prune;
mod axioms;
mod costs;
mod operator;
mod successors;
mod pack;
mod state_registry;

use std::collections::{BTreeMap, BTreeSet};

use super::GroundingLimits;
use crate::pddl::{Atom, Domain, Name, Number};
use axioms::Axioms;
use ground::Grounder;
use lowering::Symbols;
use pack::Packing;
use predicate_kind::PredicateKind;
use successors::Successors;

pub(super) use formula::{Formula, Test, bit};
pub use input::{Coverage, TaskError, TaskInput};
pub(super) use operator::PackedEffect;
pub(crate) use operator::{LiteralMask, Operator};
pub(crate) use predicate_kind::static_predicates;
pub(crate) use state_registry::StateRegistry;

/// A task, ready to be searched. States are packed: `words` words of 64 atoms each.
#[derive(Debug, Clone)]
pub struct Task {
    /// The atoms in bit order: those that actions change, then the derived ones.
    pub(super) atoms: Vec<Atom>,
    pub(super) ids: BTreeMap<Atom, u32>,
    /// Words of a packed state.
    pub(super) words: usize,
    pub(super) operators: Vec<Operator>,
    pub(super) successors: Successors,
    pub(super) goal: Formula,
    pub(super) goal_test: Test,
    /// (head, body) of every rule.
    pub(super) rules: Vec<(u32, Formula)>,
    /// Derived atoms that depend on themselves.
    pub(super) recursive: BTreeSet<u32>,
    pub(super) axioms: Axioms,
    /// What an operator's cost of 1 stands for.
    pub(super) cost_unit: Number,
}

impl Task {
    /// Grounds a task.
    ///
    /// # Errors
    /// A limit that was met, a name that is not declared, a cost without a value.
    pub fn new(
        input: &TaskInput<'_>,
        coverage: Coverage,
        limits: &GroundingLimits,
    ) -> Result<Self, TaskError> {
        Self::until(input, coverage, limits, &|| false)
    }

    /// As [`Self::new`]; `interrupt` is polled, and `true` ends it.
    ///
    /// # Errors
    /// Those of [`Self::new`], and [`TaskError::Interrupted`].
    pub fn until(
        input: &TaskInput<'_>,
        coverage: Coverage,
        limits: &GroundingLimits,
        interrupt: &dyn Fn() -> bool,
    ) -> Result<Self, TaskError> {
        let symbols = Symbols::new(input.domain, input.objects);
        check_sizes(input.domain, &symbols, limits)?;
        let kinds = predicate_kind::kinds(input.domain, &symbols);
        let facts = numbered(input.init, &symbols)?;
        let is_static = |(p, _): &&(u32, Vec<u32>)| kinds[*p as usize] == PredicateKind::Static;
        let statics: Vec<_> = facts.iter().filter(is_static).cloned().collect();
        let mut grounder = Grounder::new(&symbols, kinds, &statics, (limits, interrupt));
        let is_fluent = |(p, _): &&Fact| grounder.kind(*p) == PredicateKind::Fluent;
        let fluents: Option<Vec<Fact>> = (coverage == Coverage::Reachable)
            .then(|| facts.iter().filter(is_fluent).cloned().collect());
        let facts = (statics.as_slice(), fluents.as_deref());
        let mut draft = draft::draft(input, &symbols, facts, &mut grounder, limits)?;
        if let Some(fluents) = fluents {
            let mut initial = vec![false; grounder.atoms.len()];
            for (predicate, args) in fluents {
                initial[grounder.atom(predicate, args)? as usize] = true;
            }
            prune::unreachable(&mut draft, &initial);
        }
        Packing { input, symbols: &symbols, grounder: &grounder }.pack(draft)
    }

    /// The packed state of some facts; what the task does not mention is left out.
    pub(crate) fn state(&self, facts: &BTreeSet<Atom>) -> Vec<u64> {
        let mut state = vec![0; self.words];
        for id in facts.iter().filter_map(|atom| self.ids.get(atom)) {
            state[*id as usize / 64] |= 1 << (id % 64);
        }
        self.axioms.complete(&mut state);
        state
    }

    /// Whether the goal holds in a packed state.
    pub(crate) fn is_goal(&self, state: &[u64]) -> bool {
        self.goal_test.holds(state)
    }

    /// Writes the state after an action into `after`.
    pub(crate) fn apply(&self, operator: &Operator, before: &[u64], after: &mut Vec<u64>) {
        after.clear();
        after.extend_from_slice(before);
        // Two passes: whatever is deleted first may be added after, so adding wins.
        let fires = |e: &&PackedEffect| e.test.is_empty() || e.test.holds(before);
        for effect in operator.changes.iter().filter(fires) {
            effect.clear.iter().for_each(|&(word, bits)| after[word as usize] &= !bits);
        }
        for effect in operator.changes.iter().filter(fires) {
            effect.set.iter().for_each(|&(word, bits)| after[word as usize] |= bits);
        }
        self.axioms.complete(after);
    }

    /// Recomputes the derived atoms of a packed state.
    pub(crate) fn complete(&self, state: &mut [u64]) {
        self.axioms.complete(state);
    }

    /// Puts the numbers of all applicable operators into `applicable`, in rising order.
    pub(crate) fn applicable(&self, state: &[u64], applicable: &mut Vec<u32>) {
        self.successors.find(&self.operators, state, applicable);
    }

    /// The atoms in bit order: those that actions change, then the derived ones.
    pub(crate) fn atoms(&self) -> &[Atom] {
        &self.atoms
    }

    /// Words of a packed state.
    pub(crate) fn words(&self) -> usize {
        self.words
    }

    /// The ground actions, by their numbers.
    pub(crate) fn operators(&self) -> &[Operator] {
        &self.operators
    }

    /// A penalty in units of cost, rounded up where it is no whole number of them.
    pub(crate) fn penalty(&self, penalty: u32) -> u64 {
        costs::in_units(penalty, self.cost_unit)
    }

    /// The goal as masks, when it is a conjunction of literals over atoms that are not derived by
    /// rules.
    pub(crate) fn goal_literals(&self) -> Option<&[LiteralMask]> {
        self.goal_test.literals().filter(|_| self.axioms.is_empty())
    }

    /// How many atoms can change, derived ones included.
    pub fn n_atoms(&self) -> usize {
        self.atoms.len()
    }

    /// How many ground actions there are.
    pub fn n_actions(&self) -> usize {
        self.operators.len()
    }
}

/// A predicate with its arguments, as numbers.
type Fact = (u32, Vec<u32>);

/// Refuses tasks whose atoms cannot be numbered by mixed radix.
fn check_sizes(
    domain: &Domain,
    symbols: &Symbols<'_>,
    limits: &GroundingLimits,
) -> Result<(), TaskError> {
    let (n_objects, n_predicates) =
        (symbols.objects.len() as u128, symbols.predicates.len() as u128);
    let fits = domain.predicates.iter().all(|p| {
        let n_args = u32::try_from(p.params.len()).unwrap_or(u32::MAX);
        n_objects.checked_pow(n_args).and_then(|n| n.checked_mul(n_predicates)).is_some()
    });
    if fits {
        Ok(())
    } else {
        Err(TaskError::limit("grounding.atoms_max", limits.atoms_max as u64))
    }
}

/// The facts with numbers in place of names.
fn numbered(
    facts: &BTreeSet<Atom>,
    symbols: &Symbols<'_>,
) -> Result<Vec<(u32, Vec<u32>)>, TaskError> {
    let known = |id: Option<u32>, name: &Name| {
        id.ok_or_else(|| TaskError::UnknownName { name: name.clone() })
    };
    let number = |atom: &Atom| {
        let predicate = known(symbols.predicate(&atom.predicate), &atom.predicate)?;
        let args = atom.args.iter().map(|a| known(symbols.object(a), a));
        Ok((predicate, args.collect::<Result<_, _>>()?))
    };
    facts.iter().map(number).collect()
}
