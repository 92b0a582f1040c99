//! One pattern database: distances to the goal when all but a few variables are looked away from.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::variables::Variables;
use crate::planning::task::{Formula, Operator, Task};

/// Abstract state from which the goal cannot be reached.
const DEAD: u64 = u64::MAX;
/// Most conditional effects of one action whose condition a pattern does not decide; each doubles the
/// number of abstract successors.
const OPEN_EFFECTS_MAX: usize = 4;

/// Distances of the abstract states of one pattern.
#[derive(Debug)]
pub(super) struct Database {
    /// The variables, in rising order.
    pub(super) pattern: Vec<u32>,
    /// What one step of each variable's value adds to an abstract state's number.
    strides: Vec<usize>,
    distances: Vec<u64>,
    /// Actions that change a variable of the pattern.
    pub(super) relevant: Vec<u32>,
}

/// An action as a pattern sees it.
struct Abstract {
    cost: u64,
    /// (place in the pattern, value, whether it must be that value).
    condition: Vec<(usize, usize, bool)>,
    effects: Vec<AbstractEffect>,
}

/// What one effect changes in a pattern.
struct AbstractEffect {
    condition: Vec<(usize, usize, bool)>,
    /// Whether the condition asks for more than the pattern knows.
    open: bool,
    /// (place, value) that is left, and that is taken.
    leaves: Vec<(usize, usize)>,
    takes: Vec<(usize, usize)>,
}

/// How many abstract states a pattern has.
pub(super) fn n_states(variables: &Variables, pattern: &[u32]) -> usize {
    pattern.iter().fold(1, |n, &variable| n.saturating_mul(variables.n_values(variable)))
}

impl Database {
    /// Computes the database; none when an action has too many effects that the pattern leaves
    /// open, or when more actions would have to be looked at than `looks_left`.
    pub(super) fn new(
        task: &Task,
        variables: &Variables,
        pattern: Vec<u32>,
        looks_left: &mut usize,
    ) -> Option<Self> {
        let mut strides = Vec::with_capacity(pattern.len());
        let mut n_states = 1;
        for &variable in &pattern {
            strides.push(n_states);
            n_states *= variables.n_values(variable);
        }
        let view = View { variables, pattern: &pattern, strides: &strides };
        let mut relevant = Vec::new();
        let mut actions = Vec::new();
        for (idx, operator) in (0..).zip(&task.operators) {
            let action = view.action(operator);
            if action.effects.iter().filter(|effect| effect.open).count() > OPEN_EFFECTS_MAX {
                return None;
            }
            if !action.effects.is_empty() {
                relevant.push(idx);
                actions.push(action);
            }
        }
        *looks_left = looks_left.checked_sub(n_states.saturating_mul(actions.len()))?;
        let distances = view.distances(&task.goal, &actions, n_states);
        Some(Self { pattern, strides, distances, relevant })
    }

    /// The distance of a packed state's image; `None` proves that the goal cannot be reached. A
    /// state in which several atoms of one variable hold has no image and is taken for a goal.
    pub(super) fn distance(&self, variables: &Variables, state: &[u64]) -> Option<u64> {
        let mut number = 0;
        for (&variable, &stride) in self.pattern.iter().zip(&self.strides) {
            match variables.value(variable, state) {
                Some(value) => number += value * stride,
                None => return Some(0),
            }
        }
        Some(self.distances[number]).filter(|&distance| distance != DEAD)
    }

    /// How many abstract states there are.
    pub(super) fn len(&self) -> usize {
        self.distances.len()
    }
}

/// A task as a pattern sees it.
struct View<'a> {
    variables: &'a Variables,
    pattern: &'a [u32],
    strides: &'a [usize],
}

impl View<'_> {
    /// The places of an atom in the pattern, each with the value that stands for it there.
    fn places(&self, atom: u32) -> impl Iterator<Item = (usize, usize)> {
        let placed = |&(variable, value): &(u32, usize)| {
            self.pattern.binary_search(&variable).ok().map(|place| (place, value))
        };
        self.variables.of(atom).iter().filter_map(placed)
    }

    fn value(&self, state: usize, place: usize) -> usize {
        state / self.strides[place] % self.variables.n_values(self.pattern[place])
    }

    /// The literals of a conjunction that the pattern knows, and whether that is all of it.
    fn known(&self, formula: &Formula) -> (Vec<(usize, usize, bool)>, bool) {
        let parts = match formula {
            Formula::And(parts) => parts.as_slice(),
            Formula::True => &[],
            Formula::False | Formula::Holds(_) | Formula::Fails(_) | Formula::Or(_) => {
                std::slice::from_ref(formula)
            }
        };
        let (mut known, mut is_all) = (Vec::new(), true);
        for part in parts {
            let (atom, wanted) = match part {
                Formula::Holds(atom) => (*atom, true),
                Formula::Fails(atom) => (*atom, false),
                Formula::True | Formula::False | Formula::And(_) | Formula::Or(_) => {
                    is_all = false;
                    continue;
                }
            };
            is_all &= self.places(atom).next().is_some();
            known.extend(self.places(atom).map(|(place, value)| (place, value, wanted)));
        }
        (known, is_all)
    }

    fn action(&self, operator: &Operator) -> Abstract {
        let mut effects = Vec::new();
        for effect in &operator.effects {
            let side = |added: bool| {
                let changes = effect.changes.iter().filter(move |(_, a)| *a == added);
                changes.flat_map(|&(atom, _)| self.places(atom)).collect::<Vec<_>>()
            };
            let (leaves, takes) = (side(false), side(true));
            if !leaves.is_empty() || !takes.is_empty() {
                let (condition, is_all) = self.known(&effect.condition);
                effects.push(AbstractEffect { condition, open: !is_all, leaves, takes });
            }
        }
        let (condition, _) = self.known(&operator.precondition);
        Abstract { cost: operator.cost, condition, effects }
    }

    fn holds(&self, condition: &[(usize, usize, bool)], state: usize) -> bool {
        let holds = |&(place, value, wanted): &(usize, usize, bool)| {
            (self.value(state, place) == value) == wanted
        };
        condition.iter().all(holds)
    }

    /// The abstract states that an action may lead to.
    fn successors(&self, action: &Abstract, state: usize, successors: &mut Vec<usize>) {
        successors.clear();
        if !self.holds(&action.condition, state) {
            return;
        }
        let fires = |effect: &&AbstractEffect| self.holds(&effect.condition, state);
        let (open, sure): (Vec<_>, Vec<_>) =
            action.effects.iter().filter(fires).partition(|effect| effect.open);
        for chosen in 0..1_usize << open.len() {
            let some = open.iter().enumerate().filter(|(idx, _)| chosen >> idx & 1 == 1);
            let effects: Vec<&AbstractEffect> =
                sure.iter().copied().chain(some.map(|(_, effect)| *effect)).collect();
            let mut values: Vec<usize> =
                (0..self.pattern.len()).map(|place| self.value(state, place)).collect();
            for &(place, value) in effects.iter().flat_map(|effect| &effect.leaves) {
                if values[place] == value {
                    values[place] = 0;
                }
            }
            for &(place, value) in effects.iter().flat_map(|effect| &effect.takes) {
                values[place] = value;
            }
            successors.push(values.iter().zip(self.strides).map(|(v, stride)| v * stride).sum());
        }
    }

    /// Uniform-cost search backwards from all abstract goal states.
    fn distances(&self, goal: &Formula, actions: &[Abstract], n_states: usize) -> Vec<u64> {
        let mut edges: Vec<(u32, u32, u64)> = Vec::new();
        let mut successors = Vec::new();
        for state in 0..n_states {
            for action in actions {
                self.successors(action, state, &mut successors);
                let edge = |&next: &usize| (next as u32, state as u32, action.cost);
                edges.extend(successors.iter().filter(|next| **next != state).map(edge));
            }
        }
        edges.sort_unstable();
        edges.dedup_by_key(|(next, state, _)| (*next, *state));
        let (goal, _) = self.known(goal);
        let mut distances = vec![DEAD; n_states];
        let mut open = BinaryHeap::new();
        for state in (0..n_states).filter(|&state| self.holds(&goal, state)) {
            distances[state] = 0;
            open.push(Reverse((0, state as u32)));
        }
        while let Some(Reverse((distance, state))) = open.pop() {
            if distance > distances[state as usize] {
                continue;
            }
            let first = edges.partition_point(|(next, ..)| *next < state);
            for &(_, before, cost) in edges[first..].iter().take_while(|(n, ..)| *n == state) {
                let through = distance.saturating_add(cost).min(DEAD - 1);
                if through < distances[before as usize] {
                    distances[before as usize] = through;
                    open.push(Reverse((through, before)));
                }
            }
        }
        distances
    }
}
