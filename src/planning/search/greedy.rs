//! Greedy best-first search with deferred evaluation and preferred actions: any plan, soon.
//!
//! Source: Helmert: The Fast Downward planning system, 2006, section 5; Richter, Helmert:
//! Preferred operators and deferred evaluation in satisficing planning, 2009.

use std::collections::{BTreeMap, VecDeque};

use super::{End, Limits, Space};
use crate::planning::heuristics::Heuristic;
use crate::planning::outcome::Phase;
use crate::planning::task::Task;

/// How many expansions the queue of preferred actions gains whenever the estimate improves.
const BOOST: i64 = 1000;
/// Rough memory of one queue entry, in bytes.
const ENTRY_BYTES: usize = 16;

/// Searches from a state for any plan.
pub(in crate::planning) fn greedy(
    task: &Task,
    initial: &[u64],
    heuristic: &mut dyn Heuristic,
    limits: Limits<'_>,
) -> (End, Phase) {
    let mut space = Space::new(task, limits, "greedy");
    let end = search(&mut space, initial, heuristic);
    (end, space.phase)
}

/// States to come, as (parent, action), by the parent's estimate; first in, first out.
#[derive(Default)]
struct Queue {
    by_estimate: BTreeMap<u64, VecDeque<(u32, u32)>>,
    len: usize,
    /// Entries taken so far, less the boosts received.
    priority: i64,
}

impl Queue {
    fn extend(&mut self, estimate: u64, parent: u32, actions: &[u32]) {
        if !actions.is_empty() {
            let entries = self.by_estimate.entry(estimate).or_default();
            entries.extend(actions.iter().map(|&action| (parent, action)));
            self.len += actions.len();
        }
    }

    fn pop(&mut self) -> Option<(u32, u32)> {
        let mut best = self.by_estimate.first_entry()?;
        let entry = best.get_mut().pop_front();
        if best.get().is_empty() {
            best.remove();
        }
        self.len -= 1;
        self.priority += 1;
        entry
    }
}

fn search(space: &mut Space<'_>, initial: &[u64], heuristic: &mut dyn Heuristic) -> End {
    let task = space.task;
    let (mut all, mut preferred) = (Queue::default(), Queue::default());
    let mut best: Option<u64> = None;
    let (mut applicable, mut state) = (Vec::new(), initial.to_vec());
    let (mut parent, mut action) = (u32::MAX, u32::MAX);
    loop {
        let (number, new) = space.insert(&state, parent, action);
        if new {
            if task.is_goal(&state) {
                return End::Found(space.path(number));
            }
            if let Some(end) = space.limit() {
                return end;
            }
            space.phase.evaluated += 1;
            if let Some(estimate) = heuristic.estimate(&state) {
                if best.is_none_or(|b| estimate < b) {
                    best = Some(estimate);
                    preferred.priority -= BOOST;
                }
                space.phase.expanded += 1;
                task.successors.find(&task.operators, &state, &mut applicable);
                all.extend(estimate, number, &applicable);
                preferred.extend(estimate, number, heuristic.preferred());
            }
        }
        let first = if preferred.priority <= all.priority { [true, false] } else { [false, true] };
        let next = first
            .into_iter()
            .find_map(|from_preferred| if from_preferred { preferred.pop() } else { all.pop() });
        let Some(entry) = next else { return End::Exhausted(space.store.len()) };
        (parent, action) = entry;
        space.phase.generated += 1;
        task.apply(&task.operators[action as usize], space.store.get(parent), &mut state);
        space.queue_bytes = (all.len + preferred.len) * ENTRY_BYTES;
    }
}
