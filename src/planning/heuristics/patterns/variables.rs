//! Atoms sorted into variables: each has one value for each of its atoms, and one for none of them.

use std::collections::BTreeSet;

use crate::planning::mutex::MutexGroups;
use crate::planning::task::{Task, bit};

/// Variables of a task. An atom may belong to several: where a block is and what lies below it.
#[derive(Debug)]
pub(super) struct Variables {
    /// The atoms of each variable; at most one of them holds in a right state.
    pub(super) atoms: Vec<Vec<u32>>,
    /// The variables of each atom with the value that stands for it there.
    of_atom: Vec<Vec<(u32, usize)>>,
}

impl Variables {
    /// Every mutex group, and every atom alone that is in none.
    pub(super) fn new(task: &Task) -> Self {
        let mut atoms = MutexGroups::synthesise(task).atoms(task);
        let mut of_atom = vec![Vec::new(); task.n_atoms()];
        let mut enter = |variable: usize, atoms: &[u32]| {
            for (place, &atom) in atoms.iter().enumerate() {
                of_atom[atom as usize].push((variable as u32, place + 1));
            }
        };
        for (variable, group) in atoms.iter().enumerate() {
            enter(variable, group);
        }
        let grouped: BTreeSet<u32> = atoms.iter().flatten().copied().collect();
        for atom in (0..task.n_atoms() as u32).filter(|atom| !grouped.contains(atom)) {
            enter(atoms.len(), &[atom]);
            atoms.push(vec![atom]);
        }
        Self { atoms, of_atom }
    }

    /// The variables of an atom with the value that stands for it there.
    pub(super) fn of(&self, atom: u32) -> &[(u32, usize)] {
        &self.of_atom[atom as usize]
    }

    /// How many values a variable has.
    pub(super) fn n_values(&self, variable: u32) -> usize {
        self.atoms[variable as usize].len() + 1
    }

    /// The value in a packed state; none when several atoms hold.
    pub(super) fn value(&self, variable: u32, state: &[u64]) -> Option<usize> {
        let atoms = self.atoms[variable as usize].iter();
        let mut holding = atoms.enumerate().filter(|(_, atom)| bit(state, **atom));
        let value = holding.next().map_or(0, |(place, _)| place + 1);
        holding.next().is_none().then_some(value)
    }
}
