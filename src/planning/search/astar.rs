//! A*: cheapest plans, given an admissible heuristic.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{End, Limits, Space};
use crate::planning::heuristics::Heuristic;
use crate::planning::outcome::Phase;
use crate::planning::task::Task;

/// Searches from a state for a cheapest plan; returns a lower bound of its cost too. Ties go to the smaller estimate, then to the state
/// found first.
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
    /// Estimated rest; `None` for a dead end.
    estimate: Option<u64>,
}

fn search(
    space: &mut Space<'_>,
    initial: &[u64],
    costs: &[u64],
    heuristic: &mut dyn Heuristic,
) -> (End, u64) {
    let task = space.task;
    let mut known: Vec<Known> = Vec::new();
    // (path cost + estimate, estimate, order of discovery, state, path cost)
    let mut open = BinaryHeap::new();
    let mut n_pushed = 0_u64;
    space.insert(initial, u32::MAX, u32::MAX);
    space.phase.evaluated += 1;
    let estimate = heuristic.estimate(initial);
    known.push(Known { path_cost: 0, estimate });
    open.extend(estimate.map(|h| Reverse((h, h, n_pushed, 0_u32, 0_u64))));
    let (mut applicable, mut before, mut after) = (Vec::new(), Vec::new(), Vec::new());
    // The estimates need not be consistent, so that totals may fall again.
    let mut lower_bound = 0;
    while let Some(Reverse((total, _, _, number, path_cost))) = open.pop() {
        if path_cost > known[number as usize].path_cost {
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
        space.phase.expanded += 1;
        task.successors.find(&task.operators, &before, &mut applicable);
        for &action in &applicable {
            space.phase.generated += 1;
            task.apply(&task.operators[action as usize], &before, &mut after);
            let next_cost = path_cost.saturating_add(costs[action as usize]);
            let (next, new) = space.insert(&after, number, action);
            if new {
                space.phase.evaluated += 1;
                known.push(Known { path_cost: next_cost, estimate: heuristic.estimate(&after) });
            } else if next_cost < known[next as usize].path_cost {
                known[next as usize].path_cost = next_cost;
                space.reached_by[next as usize] = (number, action);
            } else {
                continue;
            }
            if let Some(estimate) = known[next as usize].estimate {
                n_pushed += 1;
                let total = next_cost.saturating_add(estimate);
                open.push(Reverse((total, estimate, n_pushed, next, next_cost)));
            }
        }
        space.queue_bytes = open.len() * 40 + known.len() * 24;
    }
    (End::Exhausted(space.store.len()), u64::MAX)
}
