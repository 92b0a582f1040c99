//! The goals of a long-lived run: which waits, which runs, and what has become of the others. A pure value.

use std::collections::{BTreeMap, VecDeque};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::messages::{Submission, TaskRequest, TaskState, TaskStatus};

/// `[serve]`: the goals of `groundloop serve`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ServeConfig {
    /// Most goals that wait; what comes beyond is refused.
    pub queue_max: u32,
    /// Most goals that have ended and are remembered, the newest ones: one of them that is submitted again is
    /// answered with what became of it.
    pub known_max: u32,
}

/// What a request comes to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answer {
    /// What is said of the goal.
    pub(super) status: TaskStatus,
    /// Whether it was not so before: not where a request is repeated.
    pub(super) is_news: bool,
    /// Whether the running episode is to be stopped; the status of the goal follows when it has been.
    pub(super) stops_running: bool,
}

/// All goals of a long-lived run.
#[derive(Debug)]
pub(super) struct TaskQueue {
    config: ServeConfig,
    waiting: VecDeque<Submission>,
    running: Option<Submission>,
    /// What has ended, by its identity, and in which order.
    over: BTreeMap<String, TaskStatus>,
    order: VecDeque<String>,
}

impl TaskQueue {
    pub(super) fn new(config: ServeConfig) -> Self {
        let (waiting, over, order) = (VecDeque::new(), BTreeMap::new(), VecDeque::new());
        Self { config, waiting, running: None, over, order }
    }

    /// Takes a request in. One that is known already changes nothing.
    pub(super) fn take(&mut self, request: TaskRequest) -> Answer {
        match request {
            TaskRequest::Submit(task) => self.submit(task),
            TaskRequest::Cancel { id } => self.cancel(&id),
        }
    }

    /// The next goal begins, if there is one.
    pub(super) fn begin(&mut self) -> Option<TaskStatus> {
        let task = self.waiting.pop_front()?;
        self.running = Some(task.clone());
        Some(TaskStatus { task, state: TaskState::Running })
    }

    /// The running goal has ended.
    pub(super) fn end(&mut self, state: TaskState) -> Option<TaskStatus> {
        let task = self.running.take()?;
        Some(self.remember(TaskStatus { task, state }))
    }

    /// Nothing more is begun: what waits is cancelled.
    pub(super) fn close(&mut self, reason: &str) -> Vec<TaskStatus> {
        let waiting: Vec<Submission> = self.waiting.drain(..).collect();
        let cancelled =
            |task| TaskStatus { task, state: TaskState::Cancelled { reason: reason.to_owned() } };
        waiting.into_iter().map(|task| self.remember(cancelled(task))).collect()
    }

    fn submit(&mut self, task: Submission) -> Answer {
        if let Some(status) = self.known(&task.id) {
            return Answer { status, is_news: false, stops_running: false };
        }
        let waiting_max = self.config.queue_max;
        if self.waiting.len() >= waiting_max as usize {
            // It is not remembered: there may be room another time.
            let reason = format!("{waiting_max} goals wait already (serve.queue_max)");
            let status = TaskStatus { task, state: TaskState::Refused { reason } };
            return Answer { status, is_news: true, stops_running: false };
        }
        self.waiting.push_back(task.clone());
        let state = self.queued(self.waiting.len() - 1);
        Answer { status: TaskStatus { task, state }, is_news: true, stops_running: false }
    }

    fn cancel(&mut self, id: &str) -> Answer {
        if let Some(idx) = self.waiting.iter().position(|task| task.id == *id)
            && let Some(task) = self.waiting.remove(idx)
        {
            let reason = "on request, before it had begun".to_owned();
            let status = self.remember(TaskStatus { task, state: TaskState::Cancelled { reason } });
            return Answer { status, is_news: true, stops_running: false };
        }
        let stops_running = self.running.as_ref().is_some_and(|task| task.id == *id);
        let unknown = || TaskStatus {
            task: Submission { id: id.to_owned(), kind: None, text: String::new() },
            state: TaskState::Refused { reason: "no goal of this id is known".to_owned() },
        };
        let status = self.known(id).unwrap_or_else(unknown);
        Answer { status, is_news: false, stops_running }
    }

    /// What is known of a goal.
    fn known(&self, id: &str) -> Option<TaskStatus> {
        if let Some(task) = self.running.as_ref().filter(|task| task.id == *id) {
            return Some(TaskStatus { task: task.clone(), state: TaskState::Running });
        }
        let waiting = self.waiting.iter().position(|task| task.id == *id);
        if let Some((idx, task)) = waiting.and_then(|idx| Some((idx, self.waiting.get(idx)?))) {
            return Some(TaskStatus { task: task.clone(), state: self.queued(idx) });
        }
        self.over.get(id).cloned()
    }

    fn queued(&self, n_before: usize) -> TaskState {
        TaskState::Queued { ahead: n_before as u64 + u64::from(self.running.is_some()) }
    }

    fn remember(&mut self, status: TaskStatus) -> TaskStatus {
        let id = &status.task.id;
        self.order.push_back(id.clone());
        self.over.insert(id.clone(), status.clone());
        if self.order.len() > self.config.known_max as usize
            && let Some(oldest) = self.order.pop_front()
        {
            self.over.remove(&oldest);
        }
        status
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn queue(queue_max: u32, known_max: u32) -> TaskQueue {
        TaskQueue::new(ServeConfig { queue_max, known_max })
    }

    fn submit(id: &str) -> TaskRequest {
        let (id, text) = (id.to_owned(), format!("goal {id}"));
        TaskRequest::Submit(Submission { id, kind: None, text })
    }

    fn cancel(id: &str) -> TaskRequest {
        TaskRequest::Cancel { id: id.to_owned() }
    }

    /// The word of a goal's state, and whether the running episode is to be stopped.
    fn take(queue: &mut TaskQueue, request: TaskRequest) -> (String, bool) {
        let Answer { status, stops_running, .. } = queue.take(request);
        (status.state.to_string(), stops_running)
    }

    fn begun(queue: &mut TaskQueue) -> Option<String> {
        queue.begin().map(|status| status.task.id)
    }

    fn failed() -> TaskState {
        TaskState::Failed { reason: "why".to_owned() }
    }

    #[test]
    fn goals_are_taken_in_their_order_and_each_once() {
        let mut queue = queue(4, 8);
        assert_eq!(begun(&mut queue), None);
        assert_eq!(take(&mut queue, submit("a")).0, "queued: next");
        assert_eq!(take(&mut queue, submit("b")).0, "queued: one goal before it");
        assert!(!queue.take(submit("a")).is_news, "asked again");
        assert_eq!(take(&mut queue, submit("a")).0, "queued: next");
        assert_eq!(begun(&mut queue).as_deref(), Some("a"));
        assert_eq!(take(&mut queue, submit("a")), ("running".to_owned(), false));
        assert_eq!(take(&mut queue, submit("b")).0, "queued: one goal before it");
        queue.end(failed()).unwrap();
        assert_eq!(take(&mut queue, submit("a")).0, "failed: why", "not carried out twice");
        assert_eq!(begun(&mut queue).as_deref(), Some("b"));
        queue.end(failed()).unwrap();
        assert_eq!(begun(&mut queue), None);
        assert_eq!(queue.end(failed()), None, "nothing runs");
    }

    #[test]
    fn what_waits_is_taken_away_and_what_runs_is_stopped() {
        let mut queue = queue(4, 8);
        for id in ["a", "b", "c"] {
            queue.take(submit(id));
        }
        begun(&mut queue).unwrap();
        assert_eq!(take(&mut queue, cancel("a")), ("running".to_owned(), true));
        let (told, stops) = take(&mut queue, cancel("b"));
        assert!(told.starts_with("cancelled: on request") && !stops, "{told}");
        assert_eq!(take(&mut queue, submit("b")).0, told, "it stays cancelled");
        assert_eq!(take(&mut queue, cancel("b")), (told, false));
        queue.end(failed()).unwrap();
        assert_eq!(begun(&mut queue).as_deref(), Some("c"));
        let (told, stops) = take(&mut queue, cancel("wibble"));
        assert_eq!((told.as_str(), stops), ("refused: no goal of this id is known", false));
    }

    #[test]
    fn what_does_not_fit_is_refused_and_may_come_again() {
        let mut queue = queue(1, 8);
        queue.take(submit("a"));
        let full = "refused: 1 goals wait already (serve.queue_max)";
        assert_eq!(take(&mut queue, submit("b")).0, full);
        begun(&mut queue).unwrap();
        assert_eq!(take(&mut queue, submit("b")).0, "queued: one goal before it");
        let closed = queue.close("the run ends");
        assert_eq!(closed.len(), 1);
        assert_eq!(closed[0].state.to_string(), "cancelled: the run ends");
        assert_eq!(begun(&mut queue), None);
    }

    #[test]
    fn as_many_are_remembered_as_are_to_be() {
        let mut queue = queue(4, 2);
        for id in ["a", "b", "c"] {
            queue.take(submit(id));
            begun(&mut queue).unwrap();
            queue.end(failed()).unwrap();
        }
        assert_eq!((queue.over.len(), queue.order.len()), (2, 2));
        assert_eq!(take(&mut queue, submit("b")).0, "failed: why");
        assert_eq!(take(&mut queue, submit("a")).0, "queued: next", "forgotten");
    }
}
