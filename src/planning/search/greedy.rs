//! Greedy best-first search with deferred evaluation and preferred actions: any plan, soon.
//!
//! Two estimates take turns, each with a queue of all actions and one of those that either of them
//! prefers.
//!
//! Source: Helmert: The Fast Downward planning system, 2006, section 5; Richter, Helmert:
//! Preferred operators and deferred evaluation in satisficing planning, 2009; Richter, Westphal:
//! The LAMA planner, 2010.

use std::collections::{BTreeMap, VecDeque};

use super::{End, Limits, Space};
use crate::planning::heuristics::{FastForward, Heuristic as _, Landmarks};
use crate::planning::outcome::Phase;
use crate::planning::task::Task;

/// How many expansions the queues of preferred actions gain whenever an estimate improves.
const BOOST: i64 = 1000;
/// Rough memory of one queue entry, in bytes.
const ENTRY_BYTES: usize = 8;

/// A search from a state for any plan that can be stopped and resumed.
pub(in crate::planning) struct Greedy<'a> {
    space: Space<'a>,
    heuristic: FastForward<'a>,
    guide: Guide,
    /// The state to be looked at next, and how it was reached.
    state: Vec<u64>,
    from: (u32, u32),
    /// Its number, when the search was stopped at it.
    stopped_at: Option<u32>,
    applicable: Vec<u32>,
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

/// The queues of one estimate.
#[derive(Default)]
struct Queues {
    preferred: Queue,
    all: Queue,
    best: Option<u64>,
}

/// The queues, and which landmarks each state's path has reached.
struct Guide {
    landmarks: Option<Landmarks>,
    /// By state, as many words each as a set of landmarks has.
    reached: Vec<u64>,
    /// By estimate.
    queues: Vec<Queues>,
    preferred: Vec<u32>,
}

impl Guide {
    fn new(landmarks: Option<Landmarks>) -> Self {
        let mut queues = vec![Queues::default()];
        queues.extend(landmarks.as_ref().map(|_| Queues::default()));
        Self { landmarks, reached: Vec::new(), queues, preferred: Vec::new() }
    }

    /// Notes which landmarks a new state's path has reached, and counts those that are left.
    fn count(&mut self, state: &[u64], parent: u32) -> Option<u64> {
        let landmarks = self.landmarks.as_mut()?;
        let (words, start) = (landmarks.words(), self.reached.len());
        if parent == u32::MAX {
            self.reached.resize(words, 0);
        } else {
            let parent = parent as usize * words;
            self.reached.extend_from_within(parent..parent + words);
        }
        Some(landmarks.count(state, &mut self.reached[start..]))
    }

    /// Queues the successors of the state counted last, which has this number and these estimates.
    fn extend(&mut self, number: u32, estimates: [Option<u64>; 2], actions: [&[u32]; 2]) {
        let [preferred, applicable] = actions;
        self.preferred.clear();
        self.preferred.extend_from_slice(preferred);
        if let Some(landmarks) = &self.landmarks {
            let reached = &self.reached[self.reached.len() - landmarks.words()..];
            landmarks.preferred(reached, applicable, &mut self.preferred);
            self.preferred.sort_unstable();
            self.preferred.dedup();
        }
        let mut n_improved = 0;
        for (queues, estimate) in self.queues.iter_mut().zip(estimates.into_iter().flatten()) {
            if queues.best.is_none_or(|best| estimate < best) {
                queues.best = Some(estimate);
                n_improved += 1;
            }
            queues.preferred.extend(estimate, number, &self.preferred);
            queues.all.extend(estimate, number, applicable);
        }
        self.queues.iter_mut().for_each(|queues| queues.preferred.priority -= BOOST * n_improved);
    }

    /// The next state to look at, as parent and action: from the queue that is most in arrears.
    fn next(&mut self) -> Option<(u32, u32)> {
        let queues = self.queues.iter_mut().flat_map(|q| [&mut q.preferred, &mut q.all]);
        queues.filter(|queue| queue.len > 0).min_by_key(|queue| queue.priority)?.pop()
    }

    fn bytes(&self) -> usize {
        let entries = self.queues.iter().map(|q| q.preferred.len + q.all.len);
        entries.sum::<usize>() * ENTRY_BYTES + self.reached.len() * 8
    }
}

impl<'a> Greedy<'a> {
    pub(in crate::planning) fn new(
        task: &'a Task,
        initial: &[u64],
        heuristic: FastForward<'a>,
        landmarks: Option<Landmarks>,
        limits: Limits<'a>,
    ) -> Self {
        Self {
            space: Space::new(task, limits, "greedy"),
            heuristic,
            guide: Guide::new(landmarks),
            state: initial.to_vec(),
            from: (u32::MAX, u32::MAX),
            stopped_at: None,
            applicable: Vec::new(),
        }
    }

    /// What was done so far.
    pub(in crate::planning) fn phase(&self) -> Phase {
        self.space.phase.clone()
    }

    /// Elementary steps so far.
    pub(in crate::planning) fn work(&self) -> u64 {
        self.space.work
    }

    /// Goes on until that many states have been expanded in all, at most.
    pub(in crate::planning) fn run(&mut self, expansions_max: u64) -> End {
        self.space.limits.expansions_max = expansions_max;
        let task = self.space.task;
        loop {
            let mut new = self.stopped_at.take();
            if new.is_none() {
                let (number, is_new) = self.space.insert(&self.state, self.from.0, self.from.1);
                if is_new && task.is_goal(&self.state) {
                    return End::Found(self.space.path(number));
                }
                new = is_new.then_some(number);
            }
            if let Some(number) = new {
                if let Some(end) = self.space.limit() {
                    self.stopped_at = Some(number);
                    return end;
                }
                self.look_at(number);
            }
            let Some(entry) = self.guide.next() else {
                return End::Exhausted(self.space.store.len());
            };
            self.from = entry;
            self.space.phase.generated += 1;
            let operator = &task.operators[entry.1 as usize];
            task.apply(operator, self.space.store.get(entry.0), &mut self.state);
            self.space.queue_bytes = self.guide.bytes();
        }
    }

    /// Estimates a new state and queues its successors.
    fn look_at(&mut self, number: u32) {
        let task = self.space.task;
        self.space.phase.evaluated += 1;
        let left = self.guide.count(&self.state, self.from.0);
        let estimate = self.heuristic.estimate(&self.state);
        self.space.work += self.heuristic.work();
        if estimate.is_some() {
            self.space.phase.expanded += 1;
            task.successors.find(&task.operators, &self.state, &mut self.applicable);
            self.space.work += (self.applicable.len() * task.words) as u64;
            let actions = [self.heuristic.preferred(), &self.applicable];
            self.guide.extend(number, [estimate, left], actions);
        }
    }
}
