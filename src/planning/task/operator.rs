//! Ground actions, packed.

use super::formula::{Formula, Test};
use super::ground::GroundEffect;
use crate::pddl::Step;

/// A ground action.
#[derive(Debug, Clone)]
pub(crate) struct Operator {
    pub(in crate::planning) step: Step,
    /// In units of the task's `cost_unit`, without penalties.
    pub(in crate::planning) cost: u64,
    pub(in crate::planning) precondition: Formula,
    pub(in crate::planning) effects: Vec<GroundEffect>,
    /// The precondition, packed.
    pub(in crate::planning) test: Test,
    /// The effects, packed.
    pub(in crate::planning) changes: Vec<PackedEffect>,
}

/// Bits of one word of a packed state: (word, bits).
pub(in crate::planning) type WordMask = (u32, u64);

/// Literals on one word of a packed state: (word, bits that matter, their wanted values).
pub(crate) type LiteralMask = (u32, u64, u64);

/// Changes under one condition, as masks.
#[derive(Debug, Clone)]
pub(in crate::planning) struct PackedEffect {
    pub(in crate::planning) test: Test,
    pub(in crate::planning) clear: Vec<WordMask>,
    pub(in crate::planning) set: Vec<WordMask>,
}

impl Operator {
    /// The step that it is an instance for.
    pub(crate) fn step(&self) -> &Step {
        &self.step
    }

    /// Its own cost, in units of the task's `cost_unit`.
    pub(crate) fn cost(&self) -> u64 {
        self.cost
    }

    /// Whether the precondition holds.
    pub(crate) fn applicable(&self, state: &[u64]) -> bool {
        self.test.holds(state)
    }

    /// The precondition as masks, when it is a conjunction of literals.
    pub(crate) fn literals(&self) -> Option<&[LiteralMask]> {
        self.test.literals()
    }

    /// The bits that it sets and those that it clears, word by word, when no effect is conditional.
    /// What is both cleared and set ends up set.
    pub(crate) fn unconditional_changes(
        &self,
    ) -> Option<(impl Iterator<Item = WordMask>, impl Iterator<Item = WordMask>)> {
        let unconditional = self.changes.iter().all(|effect| effect.test.is_empty());
        unconditional.then(|| {
            let set = self.changes.iter().flat_map(|effect| effect.set.iter().copied());
            (set, self.changes.iter().flat_map(|effect| effect.clear.iter().copied()))
        })
    }
}
