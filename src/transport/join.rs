//! Taking part in a run from another process, or from another place in this one.

use super::convert::{WireContext, event_from_wire, run_from_wire};
use super::topics::{EVENT, RUN};
use super::wire::{DeviceHeader, StreamHeader};
use super::{Bus, Depth, Received, Subscriber, TransportError};
use crate::messages::{EventMessage, RunDescriptor};

/// Events that a reader has waiting at most.
const EVENTS_DEPTH: usize = 64;

/// Waits until the run of this bus describes itself; gives the description, and what is needed to
/// read the run's other topics.
///
/// # Errors
/// [`TransportError`] when the topic cannot be opened or read. A description that cannot be used is
/// told in the log and waited past.
pub async fn join(bus: &Bus) -> Result<(RunDescriptor, WireContext), TransportError> {
    let mut descriptions: Subscriber<DeviceHeader, u8> = bus.subscriber(&RUN, Depth::newest())?;
    descriptions.newest_of(|message| run_from_wire(message.records())).await
}

/// Reads a run's events. Opened before the run starts it misses none.
#[derive(Debug)]
pub struct EventReader {
    descriptions: Subscriber<DeviceHeader, u8>,
    events: Subscriber<StreamHeader, u8>,
    context: Option<WireContext>,
    last: Option<u64>,
}

impl EventReader {
    /// Opens the topics; the run may start later.
    ///
    /// # Errors
    /// [`TransportError`] naming the topic.
    pub fn open(bus: &Bus) -> Result<Self, TransportError> {
        Ok(Self {
            descriptions: bus.subscriber(&RUN, Depth::newest())?,
            events: bus.subscriber(&EVENT, Depth::all(EVENTS_DEPTH))?,
            context: None,
            last: None,
        })
    }

    /// Waits for the next event. Cancel-safe.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn next(&mut self) -> Result<EventMessage, TransportError> {
        if self.context.is_none() {
            let read = |message: Received<_, _>| run_from_wire(message.records());
            self.context = Some(self.descriptions.newest_of(read).await?.1);
        }
        loop {
            if let Some(event) = self.poll()? {
                return Ok(event);
            }
            self.events.wait().await?;
        }
    }

    /// The next event that is here already, if any.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub fn poll(&mut self) -> Result<Option<EventMessage>, TransportError> {
        if self.context.is_none() {
            let read = |message: Received<_, _>| run_from_wire(message.records());
            self.context = self.descriptions.drain_newest_of(read)?.map(|(_, context)| context);
        }
        let Some(context) = &self.context else { return Ok(None) };
        while let Some(message) = self.events.poll_next()? {
            match event_from_wire(message.header(), message.records(), context) {
                // A restarted executor says again what it said of the cycle that it failed on.
                Ok(event) if self.last.is_some_and(|last| event.sequence <= last) => {}
                Ok(event) => {
                    self.last = Some(event.sequence);
                    return Ok(Some(event));
                }
                Err(error) => tracing::warn!(topic = EVENT.name, %error, "rejected"),
            }
        }
        Ok(None)
    }
}
