//! What must hold at each step of a plan so that its rest reaches the goal.

use crate::planning::task::{Formula, Operator, PackedEffect, Task, bit};

/// Atoms that matter and the values they must have, packed like states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Target {
    care: Vec<u64>,
    value: Vec<u64>,
}

impl Target {
    fn new(words: usize) -> Self {
        Self { care: vec![0; words], value: vec![0; words] }
    }

    /// Asks for the value that an atom has in a state.
    fn fix(&mut self, atom: u32, state: &[u64]) {
        let (word, mask) = (atom as usize / 64, 1 << (atom % 64));
        self.care[word] |= mask;
        self.value[word] = self.value[word] & !mask | state[word] & mask;
    }

    /// Whether a state has all the values.
    pub(super) fn holds(&self, state: &[u64]) -> bool {
        let words = state.iter().zip(&self.care).zip(&self.value);
        words.into_iter().all(|((state, care), value)| state & care == *value)
    }

    /// As a condition.
    pub(super) fn formula(&self, task: &Task) -> Formula {
        let atoms = (0..task.n_atoms() as u32).filter(|&atom| bit(&self.care, atom));
        Formula::and(atoms.map(|atom| Formula::literal(atom, bit(&self.value, atom))))
    }

    fn cares_below(&self, n_atoms: u32) -> bool {
        let mut above = self.care.iter().enumerate().map(|(word, care)| {
            let first = word as u32 * 64;
            let below = n_atoms.saturating_sub(first).min(64);
            if below == 64 { 0 } else { care >> below << below }
        });
        above.all(|care| care == 0)
    }
}

/// The targets before each step and after the last one; `states` are those that the plan visits.
///
/// A part of a condition that is no literal is replaced by the values of its atoms in the visited
/// state, and derived atoms by the whole state: narrower than need be, never wrong.
pub(super) fn targets(task: &Task, states: &[Vec<u64>], plan: &[u32]) -> Vec<Target> {
    let n_fluents = task.axioms.first().min(task.n_atoms() as u32);
    let whole = |state: &[u64]| {
        let mut target = Target::new(task.words);
        (0..n_fluents).for_each(|atom| target.fix(atom, state));
        target
    };
    let or_whole = |target: Target, state: &[u64]| {
        if target.cares_below(n_fluents) { target } else { whole(state) }
    };
    let last = &states[plan.len()];
    let mut target = Target::new(task.words);
    fix_condition(&mut target, &task.goal, last);
    target = or_whole(target, last);
    let mut targets = vec![target];
    for (&action, state) in plan.iter().zip(states).rev() {
        let operator = &task.operators[action as usize];
        let after = &targets[targets.len() - 1];
        targets.push(or_whole(before(after, operator, state), state));
    }
    targets.reverse();
    targets
}

/// What must hold before an action so that `after` holds after it.
fn before(after: &Target, operator: &Operator, state: &[u64]) -> Target {
    let mut target = after.clone();
    let fires = |e: &&PackedEffect| e.test.is_empty() || e.test.holds(state);
    for effect in operator.changes.iter().filter(fires) {
        for &(word, bits) in effect.clear.iter().chain(&effect.set) {
            target.care[word as usize] &= !bits;
            target.value[word as usize] &= !bits;
        }
    }
    fix_condition(&mut target, &operator.precondition, state);
    for effect in &operator.effects {
        fix_condition(&mut target, &effect.condition, state);
    }
    target
}

fn fix_condition(target: &mut Target, condition: &Formula, state: &[u64]) {
    condition.each_literal(&mut |atom, _| target.fix(atom, state));
}
