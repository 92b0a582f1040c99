//! Leaves out what cannot happen from the initial state and what cannot matter to the goal.

use super::draft::Draft;
use super::formula::Formula;
use super::ground::GroundEffect;

/// What may become of each atom.
struct Possible {
    /// Whether it may be true.
    holds: Vec<bool>,
    /// Whether it may be false.
    fails: Vec<bool>,
}

impl Possible {
    fn allows(&self, formula: &Formula) -> bool {
        formula.holds_where(&|atom, wanted| {
            let side = if wanted { &self.holds } else { &self.fails };
            side[atom as usize]
        })
    }

    /// Notes changes that may happen; returns whether any of them is news.
    fn extend(&mut self, changes: &[(u32, bool)]) -> bool {
        let mut news = false;
        for &(atom, added) in changes {
            let side = if added { &mut self.holds } else { &mut self.fails };
            news |= !std::mem::replace(&mut side[atom as usize], true);
        }
        news
    }
}

/// Removes actions, effects and atoms that cannot occur in any state reachable from `initial`
/// (the value of each atom), judged by the relaxation in which nothing ever stops being possible.
pub(super) fn unreachable(draft: &mut Draft, initial: &[bool]) {
    let possible = relaxed_fixpoint(draft, initial);
    let constant = |atom: u32, wanted: bool| {
        let idx = atom as usize;
        let (same, other) = if wanted {
            (possible.holds[idx], possible.fails[idx])
        } else {
            (possible.fails[idx], possible.holds[idx])
        };
        match (same, other) {
            (true, true) => Formula::literal(atom, wanted),
            (true, false) => Formula::True,
            (false, _) => Formula::False,
        }
    };
    draft.replace(&constant);
}

fn relaxed_fixpoint(draft: &Draft, initial: &[bool]) -> Possible {
    let mut possible =
        Possible { holds: initial.to_vec(), fails: initial.iter().map(|b| !b).collect() };
    // A derived atom may be false at any time; that is more than is true, so nothing is lost.
    for (head, _) in &draft.rules {
        possible.fails[*head as usize] = true;
    }
    let effects = draft.actions.iter().flat_map(|a| a.effects.iter().map(|e| (&a.precondition, e)));
    // Those that have not been possible yet.
    let mut waiting: Vec<(&Formula, &GroundEffect)> = effects.collect();
    loop {
        let mut changed = false;
        waiting.retain(|(precondition, effect)| {
            let happens = possible.allows(precondition) && possible.allows(&effect.condition);
            changed |= happens && possible.extend(&effect.changes);
            !happens
        });
        for (head, body) in &draft.rules {
            if !possible.holds[*head as usize] && possible.allows(body) {
                possible.holds[*head as usize] = true;
                changed = true;
            }
        }
        if !changed {
            return possible;
        }
    }
}

/// Marks the atoms that the goal depends on, through actions and rules, and removes every change,
/// action and rule that concerns others only.
pub(super) fn irrelevant(draft: &mut Draft, n_atoms: usize) -> Vec<bool> {
    let mut relevant = vec![false; n_atoms];
    draft.goal.each_literal(&mut |atom, _| relevant[atom as usize] = true);
    loop {
        let mut changed = false;
        let mut mark = |formula: &Formula, relevant: &mut Vec<bool>| {
            formula.each_literal(&mut |atom, _| {
                changed |= !relevant[atom as usize];
                relevant[atom as usize] = true;
            });
        };
        for action in &draft.actions {
            let mut matters = false;
            for effect in &action.effects {
                if effect.changes.iter().any(|(atom, _)| relevant[*atom as usize]) {
                    matters = true;
                    mark(&effect.condition, &mut relevant);
                }
            }
            if matters {
                mark(&action.precondition, &mut relevant);
            }
        }
        for (head, body) in &draft.rules {
            if relevant[*head as usize] {
                mark(body, &mut relevant);
            }
        }
        if !changed {
            break;
        }
    }
    for action in &mut draft.actions {
        for effect in &mut action.effects {
            effect.changes.retain(|(atom, _)| relevant[*atom as usize]);
        }
        action.effects.retain(|e| !e.changes.is_empty());
    }
    draft.actions.retain(|a| !a.effects.is_empty());
    draft.rules.retain(|(head, _)| relevant[*head as usize]);
    relevant
}
