//! A*: cheapest plans, given an admissible heuristic.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{End, Limit, Limits, Space};
use crate::planning::heuristics::Heuristic;
use crate::planning::outcome::Phase;
use crate::planning::task::Task;

/// What A* knows of a state.
#[derive(Clone, Copy)]
struct Known {
    /// Cost of the cheapest path so far.
    path_cost: u64,
    /// A lower bound of the rest.
    estimate: u64,
    /// Whether the heuristic was asked. It is put off until the state's turn comes: until then,
    /// the parent's estimate says enough.
    evaluated: bool,
}

/// An open state: (path cost + estimate, estimate, order of discovery, state, path cost).
type Entry = Reverse<(u64, u64, u64, u32, u64)>;

#[derive(Default)]
struct Open {
    known: Vec<Known>,
    queue: BinaryHeap<Entry>,
    n_pushed: u64,
}

impl Open {
    fn push(&mut self, number: u32) {
        self.n_pushed += 1;
        let Known { path_cost, estimate, .. } = self.known[number as usize];
        let total = path_cost.saturating_add(estimate);
        self.queue.push(Reverse((total, estimate, self.n_pushed, number, path_cost)));
    }
}

/// A search from a state for a cheapest plan that can be stopped and resumed. Ties go to the smaller
/// estimate, then to the state found first: of equally cheap plans, the one with the actions that the
/// domain declares first.
pub(in crate::planning) struct AStar<'a> {
    space: Space<'a>,
    costs: &'a [u64],
    heuristic: Box<dyn Heuristic + 'a>,
    open: Open,
    lower_bound: u64,
    /// A lower bound that is high enough to stop; `u64::MAX` for none.
    pub(in crate::planning) enough: u64,
    /// Whether a path was left out because its cost cannot be said.
    is_cut: bool,
    scratch: Vec<u64>,
}

impl<'a> AStar<'a> {
    pub(in crate::planning) fn new(
        task: &'a Task,
        initial: &[u64],
        costs: &'a [u64],
        heuristic: (&'static str, Box<dyn Heuristic + 'a>),
        limits: Limits<'a>,
    ) -> Self {
        let (name, heuristic) = heuristic;
        let mut space = Space::new(task, limits, name);
        let mut open = Open::default();
        space.insert(initial, u32::MAX, u32::MAX);
        open.known.push(Known { path_cost: 0, estimate: 0, evaluated: false });
        open.push(0);
        let (lower_bound, enough, is_cut, scratch) = (0, u64::MAX, false, Vec::new());
        Self { space, costs, heuristic, open, lower_bound, enough, is_cut, scratch }
    }

    /// No plan is cheaper than this.
    pub(in crate::planning) fn lower_bound(&self) -> u64 {
        self.lower_bound
    }

    /// What was done so far.
    pub(in crate::planning) fn phase(&self) -> Phase {
        self.space.phase.clone()
    }

    /// Goes on until that many states have been expanded in all, or as much work was done, at most.
    pub(in crate::planning) fn run(&mut self, expansions_max: u64, work_max: u64) -> End {
        self.space.limits.expansions_max = expansions_max;
        self.space.limits.work_max = work_max;
        let (mut applicable, mut state) = (Vec::new(), Vec::new());
        while let Some(entry) = self.open.queue.pop() {
            let Reverse((total, bound, _, number, path_cost)) = entry;
            let known = &mut self.open.known[number as usize];
            if path_cost > known.path_cost || bound < known.estimate {
                continue;
            }
            // The estimates need not be consistent, so that totals may fall again.
            self.lower_bound = total.max(self.lower_bound);
            if self.enough < u64::MAX && self.lower_bound >= self.enough {
                self.open.queue.push(entry);
                return End::Enough;
            }
            state.clear();
            state.extend_from_slice(self.space.store.get(number));
            if self.space.task.is_goal(&state) {
                self.lower_bound = path_cost;
                return End::Found(self.space.path(number));
            }
            if let Some(end) = self.space.limit() {
                self.open.queue.push(entry);
                return end;
            }
            if !std::mem::replace(&mut known.evaluated, true) {
                self.space.phase.evaluated += 1;
                known.estimate = self.heuristic.estimate(&state).unwrap_or(u64::MAX).max(bound);
                self.space.work += self.heuristic.work();
            }
            let estimate = known.estimate;
            if estimate > bound && estimate < u64::MAX {
                self.open.push(number);
            }
            if estimate > bound {
                continue;
            }
            self.space.task.successors.find(&self.space.task.operators, &state, &mut applicable);
            self.expand(number, &state, &applicable);
        }
        if self.is_cut {
            return End::Limit(Limit::Cost);
        }
        self.lower_bound = u64::MAX;
        End::Exhausted(self.space.store.len())
    }

    fn expand(&mut self, number: u32, state: &[u64], applicable: &[u32]) {
        let Self { space, open, is_cut, .. } = self;
        let task = space.task;
        let Known { path_cost, estimate, .. } = open.known[number as usize];
        let after = &mut self.scratch;
        space.phase.expanded += 1;
        for &action in applicable {
            space.phase.generated += 1;
            let operator = &task.operators[action as usize];
            space.work += (task.words + operator.changes.len()) as u64;
            task.apply(operator, state, after);
            let cost = self.costs[action as usize];
            let Some(path_cost) = path_cost.checked_add(cost) else {
                *is_cut = true;
                continue;
            };
            let (next, new) = space.insert(after, number, action);
            if new {
                let estimate = estimate.saturating_sub(cost);
                open.known.push(Known { path_cost, estimate, evaluated: false });
            } else if path_cost < open.known[next as usize].path_cost {
                open.known[next as usize].path_cost = path_cost;
                space.reached_by[next as usize] = (number, action);
            } else {
                continue;
            }
            if open.known[next as usize].estimate < u64::MAX {
                open.push(next);
            }
        }
        space.queue_bytes = open.queue.len() * 40 + open.known.len() * 24;
    }
}
