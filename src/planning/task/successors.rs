//! Finds the actions that are applicable in a state without testing all of them.

use super::Operator;
use super::formula::{Formula, bit};

/// Actions sorted by one atom that each of them needs.
#[derive(Debug, Clone, Default)]
pub(in crate::planning) struct Successors {
    /// Actions that need atom `a`, at `[a]`.
    by_atom: Vec<Vec<u32>>,
    /// Actions that need no atom to hold.
    rest: Vec<u32>,
    /// Atoms that some action is sorted under, packed like a state.
    watched: Vec<u64>,
}

impl Successors {
    /// Sorts each action under the needed atom that the fewest actions need.
    pub(in crate::planning) fn new(operators: &[Operator], n_atoms: usize, words: usize) -> Self {
        let mut n_needing = vec![0_usize; n_atoms];
        for operator in operators {
            needed(&operator.precondition).for_each(|atom| n_needing[atom as usize] += 1);
        }
        let mut successors =
            Self { by_atom: vec![Vec::new(); n_atoms], rest: Vec::new(), watched: vec![0; words] };
        for (idx, operator) in (0..).zip(operators) {
            match needed(&operator.precondition).min_by_key(|&a| n_needing[a as usize]) {
                None => successors.rest.push(idx),
                Some(atom) => {
                    successors.by_atom[atom as usize].push(idx);
                    successors.watched[atom as usize / 64] |= 1 << (atom % 64);
                }
            }
        }
        successors
    }

    /// Puts the numbers of all applicable actions into `applicable`, in rising order.
    pub(in crate::planning) fn find(
        &self,
        operators: &[Operator],
        state: &[u64],
        applicable: &mut Vec<u32>,
    ) {
        applicable.clear();
        let test = |idx: &u32| operators[*idx as usize].applicable(state);
        applicable.extend(self.rest.iter().copied().filter(test));
        for (word, (&bits, &watched)) in state.iter().zip(&self.watched).enumerate() {
            let mut open = bits & watched;
            while open != 0 {
                let atom = word * 64 + open.trailing_zeros() as usize;
                open &= open - 1;
                debug_assert!(bit(state, atom as u32));
                applicable.extend(self.by_atom[atom].iter().copied().filter(test));
            }
        }
        applicable.sort_unstable();
    }
}

/// The atoms that must hold for the formula to hold.
fn needed(formula: &Formula) -> impl Iterator<Item = u32> {
    let parts = match formula {
        Formula::And(parts) => parts.as_slice(),
        Formula::True | Formula::False | Formula::Holds(_) | Formula::Fails(_) | Formula::Or(_) => {
            std::slice::from_ref(formula)
        }
    };
    parts.iter().filter_map(|part| match part {
        Formula::Holds(atom) => Some(*atom),
        Formula::True | Formula::False | Formula::Fails(_) | Formula::And(_) | Formula::Or(_) => {
            None
        }
    })
}
