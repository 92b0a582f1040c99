//! Derived atoms of packed states.

use super::formula::{Test, bit};

/// Ground rules, stratum by stratum.
#[derive(Debug, Clone, Default)]
pub(in crate::planning) struct Axioms {
    strata: Vec<RuleSet>,
    /// First derived atom; all later ones are derived too.
    first: u32,
}

/// The ground rules of one stratum.
#[derive(Debug, Clone)]
pub(in crate::planning) struct RuleSet {
    /// (head, body) of each rule.
    pub(in crate::planning) rules: Vec<(u32, Test)>,
    /// Whether bodies may ask for heads of this set.
    pub(in crate::planning) recursive: bool,
}

impl Axioms {
    /// `first` is the number of the first derived atom.
    pub(in crate::planning) fn new(strata: Vec<RuleSet>, first: u32) -> Self {
        let strata = strata.into_iter().filter(|set| !set.rules.is_empty()).collect();
        Self { strata, first }
    }

    /// Whether there are no rules.
    pub(in crate::planning) fn is_empty(&self) -> bool {
        self.strata.is_empty()
    }

    /// Number of the first derived atom; all later ones are derived too.
    pub(in crate::planning) fn first(&self) -> u32 {
        self.first
    }

    /// Recomputes the derived atoms of a state: the least fixpoint of each stratum in turn.
    pub(in crate::planning) fn complete(&self, state: &mut [u64]) {
        if self.strata.is_empty() {
            return;
        }
        let word = self.first as usize / 64;
        state[word] &= (1 << (self.first % 64)) - 1;
        state[word + 1..].fill(0);
        for RuleSet { rules, recursive } in &self.strata {
            while pass(rules, state) && *recursive {}
        }
    }
}

/// Applies each rule once; returns whether that made anything true.
fn pass(rules: &[(u32, Test)], state: &mut [u64]) -> bool {
    let mut changed = false;
    for (head, body) in rules {
        if !bit(state, *head) && body.holds(state) {
            state[*head as usize / 64] |= 1 << (*head % 64);
            changed = true;
        }
    }
    changed
}
