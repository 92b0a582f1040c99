//! Pattern databases, rooted in the constant goal: made once for a task, good for every state.
//!
//! A pattern is a few variables; its database holds the cheapest way to the goal when everything
//! else is looked away from. Databases whose patterns no action changes both of may be added up;
//! the estimate is the largest of such sums. Admissible; consistent except from states in which
//! atoms hold that exclude each other. Supports costs and conditional effects, not axioms.
//!
//! Source: Edelkamp: Planning with pattern databases, 2001; Haslum et al.: Domain-independent
//! construction of pattern database heuristics, 2007 (the canonical heuristic).

mod database;
mod variables;

use std::collections::{BTreeMap, BTreeSet};

use super::Heuristic;
use crate::planning::task::{Formula, Task};
use database::{Database, n_states};
use variables::Variables;

/// Most abstract states of one pattern.
const PATTERN_STATES_MAX: usize = 4_000;
/// Most actions looked at in abstract states while all databases are made: about a second.
const LOOKS_MAX: usize = 10_000_000;
/// Most patterns.
const PATTERNS_MAX: usize = 150;

/// The databases of a task.
#[derive(Debug)]
pub(in crate::planning) struct Databases {
    variables: Variables,
    all: Vec<Database>,
    /// Databases that may be added up, by number.
    sums: Vec<Vec<u32>>,
}

impl Databases {
    /// Makes the databases at the actions' own costs: dearer actions (penalties) keep them
    /// admissible. None for a task with axioms, or when no pattern can be used.
    pub(in crate::planning) fn new(task: &Task) -> Option<Self> {
        if !task.axioms.is_empty() {
            return None;
        }
        let variables = Variables::new(task);
        let mut databases: Vec<Database> = Vec::new();
        let mut looks_left = LOOKS_MAX;
        for pattern in patterns(task, &variables).into_iter().take(PATTERNS_MAX) {
            databases.extend(Database::new(task, &variables, pattern, &mut looks_left));
        }
        let sums = sums(&databases);
        (!databases.is_empty()).then_some(Self { variables, all: databases, sums })
    }

    /// The largest sum, in which an action counts once.
    pub(in crate::planning) fn estimate(&self, state: &[u64]) -> Option<u64> {
        let distances = self.all.iter().map(|d| d.distance(&self.variables, state));
        let distances = distances.collect::<Option<Vec<u64>>>()?;
        let sum = |numbers: &Vec<u32>| {
            let parts = numbers.iter().map(|&number| distances[number as usize]);
            parts.fold(0, u64::saturating_add)
        };
        self.sums.iter().map(sum).max()
    }
}

/// Goal variables alone, with one that they depend on, and in pairs; the larger patterns first.
fn patterns(task: &Task, variables: &Variables) -> Vec<Vec<u32>> {
    let mut goal = BTreeSet::new();
    task.goal.each_literal(&mut |atom, _| {
        goal.extend(variables.of(atom).iter().map(|(variable, _)| *variable));
    });
    // How many actions that change one variable ask for another.
    let mut asks: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for operator in &task.operators {
        let mut asked = BTreeSet::new();
        let mut ask = |formula: &Formula| {
            formula.each_literal(&mut |atom, _| {
                asked.extend(variables.of(atom).iter().map(|(variable, _)| *variable));
            });
        };
        ask(&operator.precondition);
        operator.effects.iter().for_each(|effect| ask(&effect.condition));
        let changes = operator.effects.iter().flat_map(|effect| &effect.changes);
        let changed: BTreeSet<u32> =
            changes.flat_map(|(atom, _)| variables.of(*atom)).map(|(v, _)| *v).collect();
        for &variable in changed.intersection(&goal) {
            for &other in asked.iter().filter(|&&other| other != variable) {
                *asks.entry((variable, other)).or_default() += 1;
            }
        }
    }
    let mut pairs: Vec<((u32, u32), usize)> = asks.into_iter().collect();
    pairs.sort_by_key(|&(pair, n)| (std::cmp::Reverse(n), pair));
    let pairs = pairs.into_iter().map(|((a, b), _)| vec![a.min(b), a.max(b)]);
    let singles = goal.iter().map(|&variable| vec![variable]);
    let mut seen = BTreeSet::new();
    let fits = |pattern: &Vec<u32>| n_states(variables, pattern) <= PATTERN_STATES_MAX;
    // Singles are never left out for want of room.
    singles.chain(pairs).filter(fits).filter(|pattern| seen.insert(pattern.clone())).collect()
}

/// Sets of databases of which no two have an action in common; one set begins with each database.
fn sums(databases: &[Database]) -> Vec<Vec<u32>> {
    let relevant: Vec<BTreeSet<u32>> =
        databases.iter().map(|d| d.relevant.iter().copied().collect()).collect();
    // Those with few actions leave room for others; large ones know more.
    let (mut light, mut large): (Vec<usize>, Vec<usize>) =
        (0..databases.len()).map(|i| (i, i)).unzip();
    light.sort_by_key(|&idx| (relevant[idx].len(), idx));
    large.sort_by_key(|&idx| (std::cmp::Reverse(databases[idx].len()), idx));
    let from = |first: usize, order: &[usize]| {
        let mut sum = vec![first];
        for &idx in order {
            if sum.iter().all(|&other| relevant[other].is_disjoint(&relevant[idx])) {
                sum.push(idx);
            }
        }
        sum.sort_unstable();
        sum.into_iter().map(|idx| idx as u32).collect::<Vec<u32>>()
    };
    let firsts = 0..databases.len();
    let mut sums: Vec<Vec<u32>> =
        firsts.flat_map(|first| [from(first, &light), from(first, &large)]).collect();
    sums.sort_unstable();
    sums.dedup();
    sums
}

/// The heuristic of a task's databases.
pub(in crate::planning) struct Patterns<'a> {
    /// At the actions' own costs.
    pub(in crate::planning) databases: &'a Databases,
    /// How many units of these costs make 1 of those that are asked for.
    pub(in crate::planning) unit: u64,
}

impl Heuristic for Patterns<'_> {
    fn estimate(&mut self, state: &[u64]) -> Option<u64> {
        Some(self.databases.estimate(state)? / self.unit)
    }
}
