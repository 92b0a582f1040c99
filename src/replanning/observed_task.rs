//! A task that covers every state over its objects, and the way from facts to its packed states.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use super::CascadeSettings;
use super::name_index::NameIndex;
use crate::logic::Truth;
use crate::pddl::{Atom, Condition, Domain, Name, Step, Typed};
use crate::planning::{
    Coverage, MutexGroups, Solver, Task, TaskError, TaskInput, static_predicates,
};

/// A ground task with what it was grounded from, and an index of its atoms.
#[derive(Debug)]
pub struct ObservedTask {
    /// The task, with what searches derive from it.
    pub(super) solver: Solver,
    /// The objects, in the order in which they were given.
    pub(super) objects: Vec<Typed>,
    /// The atoms of static predicates that hold, in order.
    pub(super) statics: Vec<Atom>,
    /// Predicates that no action changes and no rule derives.
    static_predicates: Vec<Name>,
    /// The task's atoms, then the static ones.
    index: NameIndex,
    /// Static atoms, packed: all must be seen for the task to fit.
    statics_mask: Vec<u64>,
    /// The operators by their steps; made when first asked for.
    steps: OnceLock<NameIndex>,
    /// Atoms of which at most one holds in a right state.
    groups: MutexGroups,
    /// The same as masks: (word, bits).
    group_masks: Vec<Vec<(u32, u64)>>,
}

/// A scene's facts as a packed state.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct PackedState {
    /// The state; what is not known counts as false.
    pub(super) state: Vec<u64>,
    /// Static atoms that hold.
    statics: Vec<u64>,
    /// Whether anything is not known.
    pub(super) unknowns: bool,
    /// Whether facts hold that exclude each other.
    pub(super) inconsistent: bool,
}

impl ObservedTask {
    /// Grounds a task for every state over the objects in which the static facts are these.
    pub(super) fn new(
        domain: &Domain,
        objects: Vec<Typed>,
        statics: &BTreeSet<Atom>,
        goal: &Condition,
        settings: &CascadeSettings,
    ) -> Result<Self, TaskError> {
        let limits = &settings.grounding;
        let costs = &BTreeMap::new();
        let input = TaskInput {
            domain,
            objects: &objects,
            init: statics,
            goal,
            costs,
            minimise_cost: false,
        };
        let task = Task::new(&input, Coverage::AllStates, limits)?;
        let statics: Vec<Atom> = statics.iter().cloned().collect();
        let all: Vec<&Atom> = task.atoms().iter().chain(&statics).collect();
        let index = NameIndex::new(all.iter().map(|a| (&a.predicate, a.args.as_slice())));
        let mut statics_mask = vec![0; statics.len().div_ceil(64)];
        (0..statics.len()).for_each(|idx| statics_mask[idx / 64] |= 1 << (idx % 64));
        let static_predicates = static_predicates(domain);
        let groups = groups(&task, &settings.reference_states);
        let group_masks = groups.atoms(&task).iter().map(|group| masks(group)).collect();
        Ok(Self {
            solver: Solver::new(task),
            objects,
            statics,
            static_predicates,
            index,
            statics_mask,
            steps: OnceLock::new(),
            groups,
            group_masks,
        })
    }

    /// The task.
    pub(super) fn task(&self) -> &Task {
        self.solver.task()
    }

    /// Packs facts into `packed`; `false` when their static facts are not those of this task.
    ///
    /// An atom that is told more than once counts as it was told last.
    pub(super) fn pack<'f>(
        &self,
        facts: impl Iterator<Item = (&'f Atom, Truth)>,
        packed: &mut PackedState,
    ) -> bool {
        let PackedState { state, statics, unknowns, inconsistent } = packed;
        state.clear();
        state.resize(self.task().words(), 0);
        statics.clear();
        statics.resize(self.statics_mask.len(), 0);
        *unknowns = false;
        let n_atoms = self.task().atoms().len() as u32;
        for (atom, truth) in facts {
            *unknowns |= truth == Truth::Unknown;
            let found = self.index.find(&atom.predicate, &atom.args, |n| self.atom(n) == atom);
            let (words, number) = match found {
                Some(number) if number < n_atoms => (&mut *state, number),
                Some(number) => (&mut *statics, number - n_atoms),
                // What no condition asks for does not matter, unless it is a new static fact.
                None if truth.is_true() && self.static_predicates.contains(&atom.predicate) => {
                    return false;
                }
                None => continue,
            };
            let (word, bit) = (&mut words[number as usize / 64], 1 << (number % 64));
            if truth.is_true() { *word |= bit } else { *word &= !bit }
        }
        self.task().complete(state);
        *inconsistent = self.group_masks.iter().any(|group| {
            let held = group.iter().map(|&(word, bits)| state[word as usize] & bits);
            held.map(u64::count_ones).sum::<u32>() > 1
        });
        *statics == self.statics_mask
    }

    /// The facts of a state that exclude each other.
    pub(super) fn violations(&self, state: &[u64]) -> Vec<Atom> {
        let facts = self.facts(state);
        let atoms = self.groups.violations(&facts).into_iter().flat_map(|v| v.atoms);
        atoms.collect::<BTreeSet<Atom>>().into_iter().collect()
    }

    /// The number of the operator that carries out a step.
    pub(super) fn operator(&self, step: &Step) -> Option<u32> {
        let operators = self.task().operators();
        let names = operators.iter().map(|o| (&o.step().action, o.step().args.as_slice()));
        let index = self.steps.get_or_init(|| NameIndex::new(names));
        index.find(&step.action, &step.args, |number| operators[number as usize].step() == step)
    }

    /// Operators by number, as steps.
    pub(super) fn steps_of(&self, operators: &[u32]) -> Vec<Step> {
        operators.iter().map(|&o| self.task().operators()[o as usize].step().clone()).collect()
    }

    fn atom(&self, number: u32) -> &Atom {
        let (number, n_atoms) = (number as usize, self.task().atoms().len());
        if number < n_atoms {
            &self.task().atoms()[number]
        } else {
            &self.statics[number - n_atoms]
        }
    }

    /// The facts that hold in a packed state, derived ones included.
    pub fn facts(&self, state: &[u64]) -> BTreeSet<Atom> {
        let holds = |number: &usize| state[number / 64] >> (number % 64) & 1 == 1;
        let fluents = (0..self.task().atoms().len()).filter(holds).map(|n| &self.task().atoms()[n]);
        fluents.chain(&self.statics).cloned().collect()
    }
}

/// The true facts of static predicates among the given ones.
pub(super) fn statics_of<'f>(
    domain: &Domain,
    facts: impl Iterator<Item = (&'f Atom, Truth)>,
) -> BTreeSet<Atom> {
    let predicates = static_predicates(domain);
    let mut statics = BTreeSet::new();
    for (atom, truth) in facts.filter(|(atom, _)| predicates.contains(&atom.predicate)) {
        if truth.is_true() {
            statics.insert(atom.clone());
        } else {
            statics.remove(atom);
        }
    }
    statics
}

/// What excludes each other by what the actions do, as far as it holds in states that are right.
/// Without any such state nothing is concluded: there may be several of what actions only move.
fn groups(task: &Task, reference_states: &[BTreeSet<Atom>]) -> MutexGroups {
    if reference_states.is_empty() {
        return MutexGroups::default();
    }
    let groups = MutexGroups::synthesise(task);
    reference_states.iter().fold(groups, MutexGroups::hold_in)
}

fn masks(atoms: &[u32]) -> Vec<(u32, u64)> {
    let mut words: BTreeMap<u32, u64> = BTreeMap::new();
    for atom in atoms {
        *words.entry(atom / 64).or_default() |= 1 << (atom % 64);
    }
    words.into_iter().collect()
}
