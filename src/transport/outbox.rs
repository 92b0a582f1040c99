//! Messages that are lost, doubled or late on purpose, between a writer and shared memory.

use std::num::NonZeroU32;
use std::sync::{Arc, Mutex, PoisonError};

use super::TransportError;
use super::services::Record;
use super::wire::WireHeader;

/// What becomes of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// It is sent.
    Sent,
    /// It is never sent.
    Lost,
    /// It is sent twice.
    Twice,
    /// It is sent after so many later messages of its writer.
    Late(NonZeroU32),
}

/// A message that is about to be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outgoing {
    /// Its topic's name below the run.
    pub topic: &'static str,
    /// Its number in its stream.
    pub sequence: u64,
    /// Run time that its content belongs to, nanoseconds; 0 where it belongs to none.
    pub capture_ns: u64,
}

/// Says what becomes of each message.
pub trait SendHook: std::fmt::Debug + Send + Sync {
    /// What becomes of this one.
    fn delivery(&self, message: Outgoing) -> Delivery;
}

/// What a writer holds back.
#[derive(Debug)]
pub(super) struct Outbox<H, R> {
    disturbance: Arc<dyn SendHook>,
    held: Mutex<Vec<Held<H, R>>>,
}

#[derive(Debug)]
struct Held<H, R> {
    /// Messages that go out before it.
    left: u32,
    header: H,
    records: Vec<R>,
}

impl<H: WireHeader, R: Record> Outbox<H, R> {
    pub(super) fn new(disturbance: Arc<dyn SendHook>) -> Self {
        Self { disturbance, held: Mutex::default() }
    }

    /// Sends a stamped message as often as it shall be sent, and behind it what has waited for it.
    pub(super) fn pass(
        &self,
        topic: &'static str,
        header: H,
        records: &[R],
        send: impl Fn(H, &[R]) -> Result<(), TransportError>,
    ) -> Result<(), TransportError> {
        let (sequence, capture_ns) = (header.sequence(), header.capture_ns());
        let delivery = self.disturbance.delivery(Outgoing { topic, sequence, capture_ns });
        let n_times = match delivery {
            Delivery::Sent => 1,
            Delivery::Twice => 2,
            Delivery::Lost | Delivery::Late(_) => 0,
        };
        for _ in 0..n_times {
            send(header, records)?;
        }
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.iter_mut().for_each(|held| held.left -= 1);
        for due in held.extract_if(.., |held| held.left == 0) {
            send(due.header, &due.records)?;
        }
        if let Delivery::Late(messages) = delivery {
            held.push(Held { left: messages.get(), header, records: records.to_vec() });
        }
        Ok(())
    }
}
