//! A*: cheapest plans, given an admissible heuristic.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{End, Limits, Space};
use crate::planning::heuristics::Heuristic;
use crate::planning::outcome::Phase;
use crate::planning::task::Task;

/// Searches from a state for a cheapest plan; returns a lower bound of its cost too. Ties go to the smaller estimate, then to the state
/// found last.
pub(in crate::planning) fn astar(
    task: &Task,
    initial: &[u64],
    costs: &[u64],
    heuristic: &mut dyn Heuristic,
    limits: Limits<'_>,
) -> (End, u64, Phase) {
    let mut space = Space::new(task, limits, "astar");
    let (end, lower_bound) = search(&mut space, initial, costs, heuristic);
    (end, lower_bound, space.phase)
}

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
type Entry = Reverse<(u64, u64, Reverse<u64>, u32, u64)>;

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
        self.queue.push(Reverse((total, estimate, Reverse(self.n_pushed), number, path_cost)));
    }
}

fn search(
    space: &mut Space<'_>,
    initial: &[u64],
    costs: &[u64],
    heuristic: &mut dyn Heuristic,
) -> (End, u64) {
    let task = space.task;
    let mut open = Open::default();
    space.insert(initial, u32::MAX, u32::MAX);
    open.known.push(Known { path_cost: 0, estimate: 0, evaluated: false });
    open.push(0);
    // The estimates need not be consistent, so that totals may fall again.
    let mut lower_bound = 0;
    let (mut applicable, mut before, mut after) = (Vec::new(), Vec::new(), Vec::new());
    while let Some(Reverse((total, bound, _, number, path_cost))) = open.queue.pop() {
        let known = &mut open.known[number as usize];
        if path_cost > known.path_cost || bound < known.estimate {
            continue;
        }
        lower_bound = total.max(lower_bound);
        before.clear();
        before.extend_from_slice(space.store.get(number));
        if task.is_goal(&before) {
            return (End::Found(space.path(number)), path_cost);
        }
        if let Some(end) = space.limit() {
            return (end, lower_bound);
        }
        if !std::mem::replace(&mut known.evaluated, true) {
            space.phase.evaluated += 1;
            known.estimate = heuristic.estimate(&before).unwrap_or(u64::MAX).max(bound);
            if known.estimate > bound {
                if known.estimate < u64::MAX {
                    open.push(number);
                }
                continue;
            }
        }
        let estimate = known.estimate;
        space.phase.expanded += 1;
        task.successors.find(&task.operators, &before, &mut applicable);
        for &action in &applicable {
            space.phase.generated += 1;
            task.apply(&task.operators[action as usize], &before, &mut after);
            let cost = costs[action as usize];
            let path_cost = path_cost.saturating_add(cost);
            let (next, new) = space.insert(&after, number, action);
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
    (End::Exhausted(space.store.len()), u64::MAX)
}
