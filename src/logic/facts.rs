//! A set of facts under the closed-world assumption, with exceptions that are unknown.

use std::collections::BTreeSet;

use super::Truth;
use crate::pddl::{Atom, Name};

/// What is true and what is unknown; everything else is false.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Facts {
    /// Atoms known to hold.
    pub known: BTreeSet<Atom>,
    /// Atoms of which nothing is known. Disjoint from `known`.
    pub unknown: BTreeSet<Atom>,
}

impl Facts {
    /// Facts without unknowns.
    pub fn new(known: BTreeSet<Atom>) -> Self {
        Self { known, unknown: BTreeSet::new() }
    }

    /// The truth value of an atom.
    pub fn truth(&self, atom: &Atom) -> Truth {
        if self.known.contains(atom) {
            Truth::True
        } else if self.unknown.contains(atom) {
            Truth::Unknown
        } else {
            Truth::False
        }
    }

    /// Gives an atom a truth value.
    pub fn set(&mut self, atom: Atom, truth: Truth) {
        self.known.remove(&atom);
        self.unknown.remove(&atom);
        match truth {
            Truth::False => {}
            Truth::Unknown => {
                self.unknown.insert(atom);
            }
            Truth::True => {
                self.known.insert(atom);
            }
        }
    }

    /// The known atoms of one predicate, in order.
    pub fn of<'a>(&'a self, predicate: &'a Name) -> impl Iterator<Item = &'a Atom> {
        self.known.iter().filter(move |atom| atom.predicate == *predicate)
    }
}
