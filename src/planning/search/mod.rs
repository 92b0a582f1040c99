//! Searches over packed states.

mod astar;
mod greedy;
mod improve;
mod regress;
mod shorten;

pub(super) use astar::AStar;
pub(super) use greedy::Greedy;
pub(super) use improve::improve;
pub(super) use shorten::shorten;

use super::outcome::Phase;
use super::task::{StateRegistry, Task};

/// Limits of one search; the caller knows which keys of [`Budget`](super::Budget) they are.
#[derive(Clone, Copy)]
pub(super) struct Limits<'a> {
    pub(super) expansions_max: u64,
    /// Most elementary steps until the search pauses.
    pub(super) work_max: u64,
    pub(super) states_max: usize,
    pub(super) bytes_max: usize,
    /// Asked now and then; ends the search when it says yes.
    pub(super) interrupt: &'a dyn Fn() -> bool,
}

/// How many elementary steps are as much as an expansion, at least: those of a table top have fewer.
const WORK_PER_EXPANSION: u64 = 1024;

/// How many expansions pass between two questions to `interrupt`: below a millisecond of work, and
/// far more work than the question.
pub(super) const INTERRUPT_EVERY: u64 = 16;

/// How a search ends, in numbers of the task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum End {
    /// The actions of a plan.
    Found(Vec<u32>),
    /// Every reachable state was looked at or proved hopeless; that many were.
    Exhausted(usize),
    /// One of [`Limits`] was met; the search can be resumed with a higher one.
    Limit(Limit),
    /// No plan is cheaper than one that is known.
    Enough,
    /// The caller has said that it is enough.
    Interrupted,
}

/// Which of [`Limits`] was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Limit {
    Expansions,
    States,
    Bytes,
    /// No limit of the caller's: a pause for other searches.
    Work,
    /// Paths cost more than can be said.
    Cost,
}

/// The states of a search with the way each was reached.
struct Space<'a> {
    task: &'a Task,
    store: StateRegistry,
    /// Parent state and action; `u32::MAX` for the first state.
    reached_by: Vec<(u32, u32)>,
    limits: Limits<'a>,
    phase: Phase,
    /// Memory of the queue, in bytes.
    queue_bytes: usize,
    /// Elementary steps so far: words of states made, parts of heuristics looked at.
    work: u64,
}

impl<'a> Space<'a> {
    fn new(task: &'a Task, limits: Limits<'a>, name: &'static str) -> Self {
        let store = StateRegistry::new(task.words);
        let phase = Phase { name, expanded: 0, generated: 0, evaluated: 0 };
        Self { task, store, reached_by: Vec::new(), limits, phase, queue_bytes: 0, work: 0 }
    }

    /// The number of a state and whether it is new; a new one remembers how it was reached.
    fn insert(&mut self, state: &[u64], parent: u32, action: u32) -> (u32, bool) {
        let (number, new) = self.store.insert(state);
        if new {
            self.reached_by.push((parent, action));
        }
        (number, new)
    }

    /// What was spent of the expansions: those of large tasks count for several.
    fn spent(&self) -> u64 {
        self.phase.expanded.max(self.work / WORK_PER_EXPANSION)
    }

    /// The limit that has been met, if any.
    fn limit(&self) -> Option<End> {
        let Limits { expansions_max, work_max, states_max, bytes_max, interrupt } = self.limits;
        // A state's number is 32 bits wide, and one value is reserved.
        let states_max = states_max.min(u32::MAX as usize - 2);
        if self.spent() >= expansions_max {
            Some(End::Limit(Limit::Expansions))
        } else if self.work >= work_max {
            Some(End::Limit(Limit::Work))
        } else if self.store.len() >= states_max {
            Some(End::Limit(Limit::States))
        } else if self.store.bytes() + self.reached_by.len() * 8 + self.queue_bytes >= bytes_max {
            Some(End::Limit(Limit::Bytes))
        } else if self.phase.expanded.is_multiple_of(INTERRUPT_EVERY) && interrupt() {
            Some(End::Interrupted)
        } else {
            None
        }
    }

    /// The actions from the first state to this one.
    fn path(&self, state: u32) -> Vec<u32> {
        let mut path = Vec::new();
        let mut at = state;
        loop {
            let (parent, action) = self.reached_by[at as usize];
            if parent == u32::MAX {
                break;
            }
            path.push(action);
            at = parent;
        }
        path.reverse();
        path
    }
}
