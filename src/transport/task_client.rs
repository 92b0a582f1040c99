//! Asking a long-lived run for goals, from another process or from another place in this one.

use std::time::Duration;

use super::convert::{task_request_to_wire, task_status_from_wire};
use super::topics::{TASK, TASK_STATUS};
use super::wire::DeviceHeader;
use super::{Bus, Depth, Publisher, Subscriber, TransportError};
use crate::messages::{Submission, TaskRequest, TaskStatus};

/// How long nothing may be said of a goal before it is submitted again: messages may be lost.
const ASK_AGAIN: Duration = Duration::from_secs(1);
/// Statuses that wait at most.
const STATUSES_DEPTH: usize = 64;

/// The asking end of a long-lived run.
#[derive(Debug)]
pub struct TaskClient {
    requests: Publisher<DeviceHeader, u8>,
    statuses: Subscriber<DeviceHeader, u8>,
    n_asked: u64,
}

impl TaskClient {
    /// Opens the topics; the run may start later.
    ///
    /// # Errors
    /// [`TransportError`] naming the topic.
    pub fn open(bus: &Bus) -> Result<Self, TransportError> {
        let statuses = bus.subscriber(&TASK_STATUS, Depth::all(STATUSES_DEPTH))?;
        Ok(Self { requests: bus.publisher(&TASK)?, statuses, n_asked: 0 })
    }

    /// Asks once. A request may be repeated: it is answered with what is known.
    ///
    /// # Errors
    /// [`TransportError::Unsayable`] naming the field, [`TransportError::Send`].
    pub fn ask(&mut self, request: &TaskRequest) -> Result<(), TransportError> {
        let (header, text) = task_request_to_wire(self.n_asked, request)?;
        self.n_asked += 1;
        self.requests.publish(header, &text)
    }

    /// Waits for what is said next of any goal; what the topic keeps comes first. Cancel-safe.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn next(&mut self) -> Result<TaskStatus, TransportError> {
        loop {
            let message = self.statuses.next().await?;
            match task_status_from_wire(message.records()) {
                Ok(status) => return Ok(status),
                Err(error) => tracing::warn!(topic = TASK_STATUS.name, %error, "rejected"),
            }
        }
    }

    /// Submits a goal, again until something is said of it, and waits until nothing more comes of it; `heard`
    /// is told everything that is said of it.
    ///
    /// # Errors
    /// As [`ask`](Self::ask) and [`next`](Self::next).
    pub async fn carry_out(
        &mut self,
        task: &Submission,
        mut heard: impl FnMut(&TaskStatus),
    ) -> Result<TaskStatus, TransportError> {
        let request = TaskRequest::Submit(task.clone());
        self.ask(&request)?;
        let mut is_known = false;
        loop {
            tokio::select! {
                status = self.next() => {
                    let status = status?;
                    if status.task.id == task.id {
                        is_known = true;
                        heard(&status);
                        if status.state.is_over() {
                            return Ok(status);
                        }
                    }
                }
                () = tokio::time::sleep(ASK_AGAIN), if !is_known => self.ask(&request)?,
            }
        }
    }
}
