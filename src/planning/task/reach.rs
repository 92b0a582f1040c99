//! The actions that can happen from given facts, judged by the relaxation in which nothing ever stops
//! being possible: instances are joined as their preconditions become reachable, and no others are made.
//!
//! Source: Helmert: Concise finite-domain representations for PDDL planning tasks, 2009, section 6.

use std::collections::{BTreeSet, VecDeque};

use super::ground::Grounder;
use super::instance::{DraftAction, ground_action};
use super::instantiate::{Relation, Schema};
use super::lowering::{LiftedAction, SlotAtom, SlotTerm};
use super::predicate_kind::PredicateKind;
use super::seeds::{Mentions, Seed};
use super::{Fact, TaskError};
use crate::planning::GroundingLimits;

/// The instances of all actions that may be applied in some state reachable from the facts, in the
/// order of the domain and of their arguments.
///
/// `relations` has the static facts; the others become part of it.
pub(super) fn reachable(
    lifted: &[LiftedAction],
    (mentions, fluents): (&Mentions, &[Fact]),
    mut relations: Vec<Relation>,
    grounder: &mut Grounder<'_>,
    limits: &GroundingLimits,
) -> Result<Vec<DraftAction>, TaskError> {
    let schemas: Vec<Schema<'_>> =
        lifted.iter().map(|schema| Schema::new(schema, grounder, true)).collect();
    let seeds: Vec<BTreeSet<Seed>> = lifted.iter().map(|schema| mentions.seeds(schema)).collect();
    let mut reach = Reach {
        lifted,
        known: vec![BTreeSet::new(); lifted.len()],
        actions: Vec::new(),
        waiting: Vec::new(),
        holds: Vec::new(),
        open: VecDeque::new(),
        limits,
    };
    for (predicate, args) in fluents {
        let atom = grounder.atom(*predicate, args.clone())?;
        reach.reach(atom);
    }
    let is_fluent = |atom: &SlotAtom, grounder: &Grounder<'_>| {
        grounder.kind(atom.predicate) == PredicateKind::Fluent
    };
    for (idx, schema) in schemas.iter().enumerate() {
        if !schema.atoms().iter().any(|atom| is_fluent(atom, grounder)) {
            for seed in &seeds[idx] {
                let tuples = schema.extensions(seed, &relations, grounder)?;
                reach.extend(idx, tuples, grounder)?;
            }
        }
    }
    loop {
        while let Some(atom) = reach.open.pop_front() {
            let (predicate, args) = grounder.atoms[atom as usize].clone();
            relations[predicate as usize].push(args.clone());
            for (idx, schema) in schemas.iter().enumerate() {
                let joined = schema.atoms().iter().filter(|atom| atom.predicate == predicate);
                for seed in joined.flat_map(|atom| bound(atom, &args, &seeds[idx])) {
                    let tuples = schema.extensions(&seed, &relations, grounder)?;
                    reach.extend(idx, tuples, grounder)?;
                }
            }
        }
        if !reach.look_again(grounder) {
            break;
        }
    }
    let mut actions = reach.actions;
    actions.sort_by(|a, b| (a.action, &a.args).cmp(&(b.action, &b.args)));
    Ok(actions)
}

/// The seeds, each with what an atom that holds binds; those that disagree with it are left out.
fn bound<'s>(
    atom: &'s SlotAtom,
    args: &'s [u32],
    seeds: &'s BTreeSet<Seed>,
) -> impl Iterator<Item = Seed> + 's {
    seeds.iter().filter_map(move |seed| {
        let mut seed = seed.clone();
        let agree = atom.args.iter().zip(args).all(|(term, &value)| match *term {
            SlotTerm::Object(object) => object == value,
            SlotTerm::Slot(slot) => *seed[slot].get_or_insert(value) == value,
        });
        agree.then_some(seed)
    })
}

/// What has been reached so far.
struct Reach<'a> {
    lifted: &'a [LiftedAction],
    /// The argument tuples of each action that were made.
    known: Vec<BTreeSet<Vec<u32>>>,
    actions: Vec<DraftAction>,
    /// Effects, as (action, effect), whose conditions were not possible when they were looked at last.
    waiting: Vec<(usize, usize)>,
    /// By atom: whether it may hold.
    holds: Vec<bool>,
    /// Atoms that may hold and are not joined yet.
    open: VecDeque<u32>,
    limits: &'a GroundingLimits,
}

impl Reach<'_> {
    /// Notes that an atom may hold.
    fn reach(&mut self, atom: u32) {
        let atom_idx = atom as usize;
        if atom_idx >= self.holds.len() {
            self.holds.resize(atom_idx + 1, false);
        }
        if !std::mem::replace(&mut self.holds[atom_idx], true) {
            self.open.push_back(atom);
        }
    }

    /// Takes in instances of an action.
    fn extend(
        &mut self,
        idx: usize,
        tuples: Vec<Vec<u32>>,
        grounder: &mut Grounder<'_>,
    ) -> Result<(), TaskError> {
        for args in tuples {
            if !self.known[idx].insert(args.clone()) {
                continue;
            }
            let Some(action) = ground_action(idx, &self.lifted[idx], args, grounder)? else {
                continue;
            };
            if self.actions.len() == self.limits.actions_max {
                let value = self.limits.actions_max as u64;
                return Err(TaskError::limit("grounding.actions_max", value));
            }
            let n_effects = action.effects.len();
            self.actions.push(action);
            let number = self.actions.len() - 1;
            self.waiting.extend((0..n_effects).map(|effect| (number, effect)));
            self.fire_from(self.waiting.len() - n_effects, grounder);
        }
        Ok(())
    }

    /// Looks at what waited; whether any of it has become possible.
    fn look_again(&mut self, grounder: &Grounder<'_>) -> bool {
        let before = self.waiting.len();
        self.fire_from(0, grounder);
        self.waiting.len() < before && !self.open.is_empty()
    }

    /// Lets the effects from one place of the waiting list on happen, where they are possible.
    fn fire_from(&mut self, start: usize, grounder: &Grounder<'_>) {
        let mut kept = start;
        for at in start..self.waiting.len() {
            let (number, effect) = self.waiting[at];
            let action = &self.actions[number];
            let possible = |atom: u32, wanted: bool| {
                let predicate = grounder.atoms[atom as usize].0;
                !wanted
                    || grounder.kind(predicate) != PredicateKind::Fluent
                    || self.holds.get(atom as usize).is_some_and(|holds| *holds)
            };
            let effect = &action.effects[effect];
            if action.precondition.holds_where(&possible) && effect.condition.holds_where(&possible)
            {
                let added = effect.changes.iter().filter(|(_, added)| *added);
                let added: Vec<u32> = added.map(|(atom, _)| *atom).collect();
                for atom in added {
                    self.reach(atom);
                }
            } else {
                self.waiting[kept] = self.waiting[at];
                kept += 1;
            }
        }
        self.waiting.truncate(kept);
    }
}
