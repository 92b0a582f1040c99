//! Predicates that constrain by number only: which atoms are accepted, which stay unknown.

use std::collections::BTreeMap;

use super::alignment::Alignment;
use super::assignment::{Assignment, BAND};
use super::branch_and_bound::{Choice, Row, choose};
use crate::logic::Truth;
use crate::pddl::Name;
use crate::perception::model::constraints::{Constraints, PredicateArgument};

/// The least evidence for the best atom of an object that must have one. Below it, every example that
/// holds is more than twice as far as one that does not: what the object belongs to is not in sight.
const FLOOR: f64 = -1.0 / 3.0;

/// Which constraints hold without exception in the labelled examples.
#[derive(Debug, Clone, Default)]
pub(super) struct Required {
    /// For `exactly_one`: its predicates.
    pub(super) predicates: Vec<Name>,
    /// For each group of `exactly_one_of`.
    pub(super) groups: Vec<bool>,
}

/// What only one atom may have.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    /// An object in a group of places.
    Group(usize, usize),
    /// A predicate and its first argument.
    First(Name, usize),
    /// A predicate and its second argument.
    Second(Name, usize),
    /// An atom alone.
    Atom(usize),
}

/// Rows in the making: the places of their atoms, and which object must have one.
#[derive(Debug, Default)]
struct Rows {
    list: Vec<Row>,
    places: Vec<Vec<usize>>,
    /// The object that the row is about, where it must have an atom.
    required: Vec<Option<usize>>,
}

/// Decides every predicate of `predicates`.
pub(super) fn decide(
    assignment: &mut Assignment,
    predicates: &[&Name],
    constraints: &Constraints,
    (required, alignment): (&Required, &Alignment),
) {
    let (rows, n_columns) = build(assignment, predicates, constraints, (required, alignment));
    let chosen = choose(&rows.list, n_columns);
    let mut taken = vec![false; n_columns];
    for (row, choice) in rows.list.iter().zip(&chosen) {
        let columns = choice.iter().flat_map(|&choice| &row.choices[choice].columns);
        columns.for_each(|&column| taken[column] = true);
    }
    for (idx, row) in rows.list.iter().enumerate() {
        settle(assignment, row, chosen[idx], &rows.places[idx], &taken);
        if let (Some(object), None) = (rows.required[idx], chosen[idx]) {
            let atoms = rows.places[idx].iter().map(|&place| &assignment.judged[place].atom);
            let mut names: Vec<String> = atoms.map(|atom| atom.predicate.to_string()).collect();
            names.dedup();
            rows.places[idx].iter().for_each(|&place| assignment.decide(place, Truth::Unknown));
            assignment.anomaly(format!("no {} of", names.join(" or ")), &[object]);
        }
    }
}

/// The truth of one row's atoms: what nearly equals the accepted one is as unknown as that.
fn settle(
    assignment: &mut Assignment,
    row: &Row,
    chosen: Option<usize>,
    places: &[usize],
    taken: &[bool],
) {
    let is_free = |choice: &Choice| choice.columns.iter().all(|&column| !taken[column]);
    // An atom that need not be true competes with none being true.
    let none = if row.floor < 0.0 { f64::NEG_INFINITY } else { 0.0 };
    let accepted = chosen.map_or(none, |choice| row.choices[choice].weight);
    let rivals = row.choices.iter().enumerate();
    let rivals = rivals.filter(|&(at, choice)| Some(at) != chosen && is_free(choice));
    let best_rival = rivals.map(|(_, choice)| choice.weight).fold(none, f64::max);
    for (at, choice) in row.choices.iter().enumerate() {
        let truth = if Some(at) == chosen {
            let clear = accepted - best_rival >= BAND;
            if clear { Truth::True } else { Truth::Unknown }
        } else {
            let near = accepted - choice.weight < BAND && is_free(choice);
            if near { Truth::Unknown } else { Truth::False }
        };
        assignment.decide(places[at], truth);
    }
}

fn build(
    assignment: &Assignment,
    predicates: &[&Name],
    constraints: &Constraints,
    (required, alignment): (&Required, &Alignment),
) -> (Rows, usize) {
    let mut rows = Rows::default();
    let mut row_of: BTreeMap<Key, usize> = BTreeMap::new();
    let mut column_of: BTreeMap<Key, usize> = BTreeMap::new();
    for &predicate in predicates {
        let is_required = required.predicates.contains(predicate);
        let pooled = pooled(assignment, predicate, constraints, (is_required, alignment));
        for (at, (args, place)) in assignment.tuples(predicate).iter().enumerate() {
            let mut keys = keys(predicate, args, constraints);
            if keys.is_empty() {
                keys.push(Key::Atom(*place));
            }
            let row_key = keys.remove(0);
            let (object, must) = match &row_key {
                Key::Group(group, object) => {
                    (Some(*object), required.groups.get(*group) == Some(&true))
                }
                Key::First(_, object) => (Some(*object), is_required),
                Key::Second(..) | Key::Atom(_) => (None, false),
            };
            let row = *row_of.entry(row_key).or_insert_with(|| {
                let floor = if must { FLOOR } else { 0.0 };
                rows.list.push(Row { choices: Vec::new(), floor });
                rows.places.push(Vec::new());
                rows.required.push(object.filter(|_| must));
                rows.list.len() - 1
            });
            let columns = keys.into_iter().map(|key| {
                let n = column_of.len();
                *column_of.entry(key).or_insert(n)
            });
            let columns = columns.collect();
            rows.list[row].choices.push(Choice { weight: pooled[at], columns });
            rows.places[row].push(*place);
        }
    }
    (rows, column_of.len())
}

/// What only one atom may have of what this atom has; the first is what it is an answer to.
fn keys(predicate: &Name, args: &[usize], constraints: &Constraints) -> Vec<Key> {
    let mut keys = Vec::new();
    for (group, one_of) in constraints.exactly_one_of.iter().enumerate() {
        let here = |place: &&PredicateArgument| place.predicate == *predicate;
        let objects = one_of.arguments.iter().filter(here).filter_map(|p| args.get(p.argument));
        keys.extend(objects.map(|&object| Key::Group(group, object)));
    }
    if let [first, second] = *args {
        if constraints.exactly_one.contains(predicate) || constraints.functional.contains(predicate)
        {
            keys.push(Key::First(predicate.clone(), first));
        }
        if constraints.inverse_functional.contains(predicate) {
            keys.push(Key::Second(predicate.clone(), second));
        }
    }
    keys
}

/// The weights of a predicate's tuples, in order. Where each object must have one, how well objects
/// are aligned counts for and against; elsewhere only against. Objects over one another are in the
/// same place, so they are judged by what speaks for them together.
fn pooled(
    assignment: &Assignment,
    predicate: &Name,
    constraints: &Constraints,
    (is_required, alignment): (bool, &Alignment),
) -> Vec<f64> {
    let tuples = assignment.tuples(predicate);
    let most = if is_required { 1.0 } else { 0.0 };
    let weight = |(args, place): &(Vec<usize>, usize)| {
        let aligned = match args[..] {
            [first, second] => {
                let [first, second] = [first, second].map(|object| &assignment.extents[object]);
                alignment.evidence(predicate, first, second)
            }
            _ => None,
        };
        assignment.weights[*place] + aligned.unwrap_or_default().min(most)
    };
    let weights: Vec<f64> = tuples.iter().map(weight).collect();
    let is_stacked = constraints.support.iter().any(|s| s.stack_at.as_ref() == Some(predicate));
    if !(is_required && is_stacked) {
        return weights;
    }
    let column = columns(assignment, tuples);
    let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
    let key = |args: &[usize]| Some((column[*args.first()?], *args.get(1)?));
    for ((args, _), weight) in tuples.iter().zip(&weights) {
        let Some(key) = key(args) else { continue };
        let sum = sums.entry(key).or_insert((0.0, 0.0));
        *sum = (sum.0 + weight, sum.1 + 1.0);
    }
    let mean = |(args, _): &(Vec<usize>, usize)| {
        let (sum, count) = key(args).and_then(|key| sums.get(&key)).copied().unwrap_or((0.0, 1.0));
        sum / count
    };
    tuples.iter().map(mean).collect()
}

/// For every object the first one of those that it stands over or under, directly or through others.
fn columns(assignment: &Assignment, tuples: &[(Vec<usize>, usize)]) -> Vec<usize> {
    let mut firsts: Vec<usize> =
        tuples.iter().filter_map(|(args, _)| args.first()).copied().collect();
    firsts.dedup();
    let mut column: Vec<usize> = (0..assignment.names.len()).collect();
    for (at, &a) in firsts.iter().enumerate() {
        for &b in &firsts[..at] {
            if column[a] != column[b]
                && assignment.extents[a].is_in_column_with(&assignment.extents[b])
            {
                let (low, high) = (column[a].min(column[b]), column[a].max(column[b]));
                column.iter_mut().filter(|c| **c == high).for_each(|c| *c = low);
            }
        }
    }
    column
}
