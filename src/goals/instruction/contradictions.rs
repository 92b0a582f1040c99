//! Whether the atoms of a goal can hold together, by the rules of `language.toml`.

use std::collections::{BTreeMap, BTreeSet};

use super::super::{Language, Reason};
use super::{Fault, Span};
use crate::pddl::{Atom, Name};

/// An atom of the goal with its place in the instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct GroundAtom {
    pub(super) atom: Atom,
    pub(super) span: Span,
}

/// Reports the first pair of atoms that exclude each other, or the first circle.
pub(super) fn check(atoms: &[GroundAtom], language: &Language) -> Result<(), Fault> {
    for (idx, later) in atoms.iter().enumerate() {
        if language.acyclic.contains(&later.atom.predicate)
            && let Some(circle) = circle(&atoms[..=idx], later)
        {
            let circle = circle.iter().map(Name::as_str).collect::<Vec<_>>().join(" → ");
            return Err(Fault { span: later.span.clone(), reason: Reason::Circle { circle } });
        }
        for earlier in &atoms[..idx] {
            let broken = language
                .mutex_rules
                .iter()
                .find(|never| never.excludes(&earlier.atom, &later.atom));
            if let Some(never) = broken {
                return Err(Fault {
                    span: later.span.clone(),
                    reason: Reason::Contradiction {
                        first: earlier.atom.to_string(),
                        second: later.atom.to_string(),
                        because: never.because.clone(),
                    },
                });
            }
        }
    }
    Ok(())
}

/// The first circle that atoms of predicates without circles form, as text.
pub(in super::super) fn first_circle(atoms: &[Atom], acyclic: &[Name]) -> Option<String> {
    let atoms: Vec<GroundAtom> =
        atoms.iter().map(|atom| GroundAtom { atom: atom.clone(), span: 0..0 }).collect();
    let mut later = atoms.iter().enumerate();
    later.find_map(|(idx, later)| {
        let is_acyclic = acyclic.contains(&later.atom.predicate);
        let circle = is_acyclic.then(|| circle(&atoms[..=idx], later)).flatten()?;
        Some(circle.iter().map(Name::as_str).collect::<Vec<_>>().join(" → "))
    })
}

/// How many connected groups the atoms of a binary predicate form.
pub(super) fn groups(atoms: &[GroundAtom], predicate: &Name) -> usize {
    let mut groups: Vec<BTreeSet<&Name>> = Vec::new();
    for found in atoms.iter().filter(|found| found.atom.predicate == *predicate) {
        let mut joined: BTreeSet<&Name> = found.atom.args.iter().collect();
        groups.retain(|group| {
            let is_apart = group.is_disjoint(&joined);
            if !is_apart {
                joined.extend(group.iter().copied());
            }
            is_apart
        });
        groups.push(joined);
    }
    groups.len()
}

/// The way from the second argument of `last` back to its first, over atoms of its predicate.
fn circle(atoms: &[GroundAtom], last: &GroundAtom) -> Option<Vec<Name>> {
    let [from, to] = last.atom.args.as_slice() else { return None };
    let mut path = vec![from.clone(), to.clone()];
    if from == to {
        return Some(path);
    }
    // Breadth first with a parent per object: bounded by the number of objects.
    let mut parents: BTreeMap<&Name, &Name> = BTreeMap::new();
    let mut open = vec![to];
    while let Some(here) = open.pop() {
        let same = atoms.iter().filter(|found| found.atom.predicate == last.atom.predicate);
        for found in same {
            let [a, b] = found.atom.args.as_slice() else { continue };
            if a == here && b != to && !parents.contains_key(b) {
                parents.insert(b, here);
                open.push(b);
            }
        }
    }
    let mut back = vec![from];
    let mut here = from;
    while here != to {
        here = parents.get(here)?;
        back.push(here);
    }
    path.extend(back.iter().rev().skip(1).map(|&name| name.clone()));
    Some(path)
}
