//! Groups of atoms of which at most one can hold, found from what the actions do.
//!
//! A candidate says which atoms belong together: `{(holding x), (ontable x), (on x _)}` for every
//! `x`. It is an invariant when no action can raise the number of its atoms that hold from one to
//! two. Candidates that fail are extended by an atom that the culprit removes, and tried again.
//!
//! That no action raises the number does not say that it ever was one: [`MutexGroups::hold_in`]
//! asks states that are known to be right.
//!
//! Source: Helmert: Concise finite-domain representations for PDDL planning tasks, 2009, section 5
//! (guess, check, repair); here actions are checked as they are grounded over the present objects,
//! so that quantified and conditional effects need no rules of their own.

use std::collections::{BTreeMap, BTreeSet};

use super::task::{Formula, Operator, Task};
use crate::pddl::{Atom, Name};

/// Most candidates that are tried for one task.
const CANDIDATES_MAX: usize = 300;
/// Most disjuncts that a precondition is split into; beyond it, less is concluded from it.
const BRANCHES_MAX: usize = 16;

/// Groups of atoms of which at most one can hold in a right state.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MutexGroups {
    candidates: Vec<Candidate>,
}

/// Atoms that exclude each other, of which several hold.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Violation {
    /// In order; two or more.
    pub atoms: Vec<Atom>,
}

/// Which atoms belong together: those that agree in all parameters.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    n_params: usize,
    parts: BTreeSet<Part>,
}

/// Atoms of one predicate; each argument is a parameter, or counted over (at most one is).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    predicate: Name,
    /// The parameter at each place, `None` for the counted one.
    args: Vec<Option<usize>>,
}

impl Part {
    /// The values of the parameters for which an atom is of this part.
    fn key<'a>(&self, atom: &'a Atom, n_params: usize) -> Option<Vec<&'a Name>> {
        if atom.predicate != self.predicate || atom.args.len() != self.args.len() {
            return None;
        }
        let value = |param| {
            let place = self.args.iter().position(|arg| *arg == Some(param))?;
            Some(&atom.args[place])
        };
        (0..n_params).map(value).collect()
    }
}

impl Candidate {
    fn keys<'a>(&self, atom: &'a Atom) -> impl Iterator<Item = Vec<&'a Name>> + use<'a, '_> {
        self.parts.iter().filter_map(move |part| part.key(atom, self.n_params))
    }

    fn covers(&self, atom: &Atom, key: &[&Name]) -> bool {
        self.keys(atom).any(|k| k == key)
    }

    /// Whether its groups are single atoms, which exclude nothing.
    fn is_single(&self) -> bool {
        self.parts.len() == 1 && self.parts.iter().all(|p| p.args.iter().all(Option::is_some))
    }

    /// Whether actions add to every predicate that is counted over. Of what no action brings about
    /// the world may hold any number.
    fn counts_what_is_added(&self, task: &Task) -> bool {
        let changes = task.operators.iter().flat_map(|o| &o.effects).flat_map(|e| &e.changes);
        let added: BTreeSet<&Name> = changes
            .filter(|(_, added)| *added)
            .map(|(atom, _)| &task.atoms[*atom as usize].predicate)
            .collect();
        let counted = self.parts.iter().filter(|part| part.args.contains(&None));
        counted.into_iter().all(|part| added.contains(&part.predicate))
    }

    /// Whether every group of `other` is contained in one of this candidate's.
    fn includes(&self, other: &Self) -> bool {
        self.n_params == other.n_params && other.parts.is_subset(&self.parts)
    }
}

impl MutexGroups {
    /// Finds the groups that hold by what the task's actions do.
    pub fn synthesise(task: &Task) -> Self {
        let transitions: Vec<Transition<'_>> =
            task.operators.iter().flat_map(|o| transitions(task, o)).collect();
        let mut open: Vec<Candidate> = simple_candidates(task).into_iter().collect();
        let mut tried: BTreeSet<Candidate> = open.iter().cloned().collect();
        let mut found: Vec<Candidate> = Vec::new();
        let mut next = 0;
        while next < open.len().min(CANDIDATES_MAX) {
            let candidate = open[next].clone();
            next += 1;
            let repairs = if candidate.is_single() {
                transitions.iter().find_map(|t| t.exchanges(&candidate))
            } else {
                let repairs = transitions.iter().find_map(|t| t.raises(&candidate));
                if repairs.is_none() {
                    found.push(candidate);
                }
                repairs
            };
            let repairs = repairs.into_iter().flatten();
            open.extend(repairs.filter(|c| tried.insert(c.clone())));
        }
        found.retain(|candidate| candidate.counts_what_is_added(task));
        let widest = |c: &&Candidate| !found.iter().any(|other| other != *c && other.includes(c));
        let mut candidates: Vec<Candidate> = found.iter().filter(widest).cloned().collect();
        candidates.sort_unstable();
        Self { candidates }
    }

    /// Keeps the groups of which at most one atom holds in a state that is known to be right.
    pub fn hold_in(mut self, facts: &BTreeSet<Atom>) -> Self {
        self.candidates.retain(|candidate| !sorted(candidate, facts.iter()).any(|g| g.len() > 1));
        self
    }

    /// Every group of which several atoms are among `facts`.
    pub fn violations(&self, facts: &BTreeSet<Atom>) -> BTreeSet<Violation> {
        let groups = self.candidates.iter().flat_map(|c| sorted(c, facts.iter()));
        let atoms = groups.filter(|group| group.len() > 1);
        atoms.map(|group| Violation { atoms: group.into_iter().cloned().collect() }).collect()
    }

    /// The task's atoms by group, by number; groups of one are left out.
    pub(crate) fn atoms(&self, task: &Task) -> Vec<Vec<u32>> {
        let number = |atom: &Atom| task.ids.get(atom).copied();
        let groups = self.candidates.iter().flat_map(|c| sorted(c, task.atoms.iter()));
        let groups = groups.filter(|group| group.len() > 1);
        groups.map(|group| group.into_iter().filter_map(number).collect()).collect()
    }
}

/// The atoms that a candidate covers, by group.
fn sorted<'a>(
    candidate: &Candidate,
    atoms: impl Iterator<Item = &'a Atom>,
) -> impl Iterator<Item = BTreeSet<&'a Atom>> {
    let mut groups: BTreeMap<Vec<&'a Name>, BTreeSet<&'a Atom>> = BTreeMap::new();
    for atom in atoms {
        for key in candidate.keys(atom) {
            groups.entry(key).or_default().insert(atom);
        }
    }
    groups.into_values()
}

/// One predicate alone, with one argument counted or none.
fn simple_candidates(task: &Task) -> BTreeSet<Candidate> {
    let changed = task.operators.iter().flat_map(|o| &o.effects).flat_map(|e| &e.changes);
    let shapes: BTreeSet<(Name, usize)> = changed
        .map(|&(atom, _)| &task.atoms[atom as usize])
        .map(|atom| (atom.predicate.clone(), atom.args.len()))
        .collect();
    let of_shape = |(predicate, arity): (Name, usize)| {
        let counted = (0..arity).map(Some).chain([None]);
        counted.map(move |counted| {
            let mut n_params = 0;
            let param = |place| {
                (Some(place) != counted).then(|| {
                    n_params += 1;
                    n_params - 1
                })
            };
            let args = (0..arity).map(param).collect();
            let parts = BTreeSet::from([Part { predicate: predicate.clone(), args }]);
            Candidate { n_params, parts }
        })
    };
    shapes.into_iter().flat_map(of_shape).collect()
}

/// An action under one set of conditions that decide which of its effects happen.
struct Transition<'a> {
    task: &'a Task,
    /// What holds and what fails before, as far as it is known.
    before: Literals,
    /// (what must hold and fail too, atom) of each addition and each removal.
    adds: Vec<(Literals, u32)>,
    removes: Vec<(Literals, u32)>,
}

/// Atoms that are known to hold and to fail.
#[derive(Debug, Clone, Default)]
struct Literals {
    holds: BTreeSet<u32>,
    fails: BTreeSet<u32>,
}

impl Literals {
    fn and(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.holds.extend(&other.holds);
        both.fails.extend(&other.fails);
        both
    }

    fn is_contradictory(&self) -> bool {
        !self.holds.is_disjoint(&self.fails)
    }

    fn includes(&self, other: &Self) -> bool {
        other.holds.is_subset(&self.holds) && other.fails.is_subset(&self.fails)
    }
}

/// A formula as a disjunction of conjunctions.
struct Branches {
    all: Vec<Literals>,
    /// Whether they say all that the formula says; if not, they say less.
    exact: bool,
}

fn branches(formula: &Formula) -> Branches {
    let one = |literals| Branches { all: vec![literals], exact: true };
    match formula {
        Formula::True => one(Literals::default()),
        Formula::False => Branches { all: Vec::new(), exact: true },
        Formula::Holds(atom) => {
            one(Literals { holds: BTreeSet::from([*atom]), ..Literals::default() })
        }
        Formula::Fails(atom) => {
            one(Literals { fails: BTreeSet::from([*atom]), ..Literals::default() })
        }
        Formula::Or(parts) => {
            let parts: Vec<Branches> = parts.iter().map(branches).collect();
            let exact = parts.iter().all(|part| part.exact);
            let all: Vec<Literals> = parts.into_iter().flat_map(|part| part.all).collect();
            if all.len() > BRANCHES_MAX {
                return Branches { all: vec![Literals::default()], exact: false };
            }
            Branches { all, exact }
        }
        Formula::And(parts) => {
            let mut both = one(Literals::default());
            for part in parts.iter().map(branches) {
                both.exact &= part.exact && both.all.len() * part.all.len() <= BRANCHES_MAX;
                if both.all.len() * part.all.len() <= BRANCHES_MAX {
                    let with = |a: &Literals| part.all.iter().map(|b| a.and(b)).collect::<Vec<_>>();
                    both.all = both.all.iter().flat_map(with).collect();
                }
            }
            both.all.retain(|literals| !literals.is_contradictory());
            both
        }
    }
}

fn transitions<'a>(task: &'a Task, operator: &Operator) -> Vec<Transition<'a>> {
    let (mut adds, mut removes) = (Vec::new(), Vec::new());
    for effect in &operator.effects {
        let Branches { all, exact } = branches(&effect.condition);
        for condition in all {
            for &(atom, added) in &effect.changes {
                if added {
                    adds.push((condition.clone(), atom));
                } else if exact {
                    removes.push((condition.clone(), atom));
                }
            }
        }
    }
    let of = |before| Transition { task, before, adds: adds.clone(), removes: removes.clone() };
    branches(&operator.precondition).all.into_iter().map(of).collect()
}

impl Transition<'_> {
    fn atom(&self, number: u32) -> &Atom {
        &self.task.atoms[number as usize]
    }

    /// Whether the number of a group's atoms may rise from one to two; if so, the candidates that
    /// count something that disappears at the same time, too.
    fn raises(&self, candidate: &Candidate) -> Option<Vec<Candidate>> {
        for (condition, added) in &self.adds {
            for key in candidate.keys(self.atom(*added)) {
                let before = self.before.and(condition);
                if before.is_contradictory() {
                    continue;
                }
                if self.adds_another(candidate, &key, &before, *added) {
                    return Some(Vec::new());
                }
                if !self.balances(candidate, &key, &before, *added) {
                    return Some(self.repairs(candidate, &key, &before));
                }
            }
        }
        None
    }

    /// The candidates that count what disappears when one of the group's atoms appears.
    fn exchanges(&self, candidate: &Candidate) -> Option<Vec<Candidate>> {
        self.adds.iter().find_map(|(condition, added)| {
            let key = candidate.keys(self.atom(*added)).next()?;
            let before = self.before.and(condition);
            (!before.is_contradictory()).then(|| self.repairs(candidate, &key, &before))
        })
    }

    /// Whether an atom of the group other than `added` may be added as well.
    fn adds_another(
        &self,
        candidate: &Candidate,
        key: &[&Name],
        before: &Literals,
        added: u32,
    ) -> bool {
        self.adds.iter().any(|(condition, other)| {
            *other != added && candidate.covers(self.atom(*other), key) && {
                let before = before.and(condition);
                let in_group = |&&q: &&u32| candidate.covers(self.atom(q), key);
                // Two of the group cannot hold at once beforehand.
                !before.is_contradictory() && before.holds.iter().filter(in_group).count() < 2
            }
        })
    }

    /// Whether nothing of the group but `added` holds afterwards, if at most one atom did before.
    fn balances(
        &self,
        candidate: &Candidate,
        key: &[&Name],
        before: &Literals,
        added: u32,
    ) -> bool {
        let in_group = |&q: &u32| candidate.covers(self.atom(q), key);
        match before.holds.iter().copied().find(in_group) {
            Some(known) => known == added || self.removed(before, known),
            None => (0..self.task.atoms.len() as u32).filter(in_group).all(|q| {
                let mut before = before.clone();
                before.holds.insert(q);
                q == added || before.is_contradictory() || self.removed(&before, q)
            }),
        }
    }

    /// Whether an atom is removed for certain.
    fn removed(&self, before: &Literals, atom: u32) -> bool {
        self.removes.iter().any(|(condition, q)| *q == atom && before.includes(condition))
    }

    /// The candidate with one more part: an atom that holds before and is removed.
    fn repairs(&self, candidate: &Candidate, key: &[&Name], before: &Literals) -> Vec<Candidate> {
        let disappears = |(condition, q): &&(Literals, u32)| {
            before.includes(condition) && before.holds.contains(q)
        };
        let mut repairs = Vec::new();
        for (_, removed) in self.removes.iter().filter(disappears) {
            for part in parts_of(self.atom(*removed), key) {
                let mut repaired = candidate.clone();
                repaired.parts.insert(part);
                repairs.push(repaired);
            }
        }
        repairs
    }
}

/// The ways in which an atom contains every parameter once and at most one thing more.
fn parts_of(atom: &Atom, key: &[&Name]) -> Vec<Part> {
    let mut ways: Vec<Vec<Option<usize>>> = vec![vec![None; atom.args.len()]];
    for (param, value) in key.iter().enumerate() {
        let places = |way: &Vec<Option<usize>>| {
            let free = (0..way.len()).filter(|&p| way[p].is_none() && atom.args[p] == **value);
            let with = |place| {
                let mut way = way.clone();
                way[place] = Some(param);
                way
            };
            free.map(with).collect::<Vec<_>>()
        };
        ways = ways.iter().flat_map(places).collect();
    }
    ways.retain(|way| way.iter().filter(|arg| arg.is_none()).count() <= 1);
    ways.into_iter().map(|args| Part { predicate: atom.predicate.clone(), args }).collect()
}

#[cfg(test)]
mod tests;
