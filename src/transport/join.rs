//! Taking part in a run from another process, or from another place in this one.

use std::collections::VecDeque;

use super::convert::{WireContext, event_from_wire, run_from_wire};
use super::topics::{EVENT, RUN};
use super::wire::{DeviceHeader, StreamHeader};
use super::{Bus, Depth, Subscriber, TransportError};
use crate::messages::{EventMessage, RunDescriptor};

/// Events that a reader has waiting at most.
const EVENTS_DEPTH: usize = 64;
/// Descriptions that a reader has waiting at most.
const DESCRIPTIONS_DEPTH: usize = 16;
/// Descriptions that are kept: events of goals that have ended may still wait.
const CONTEXTS_MAX: usize = 16;

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

/// Reads a run's events, over all its goals where it takes several. Opened before the run starts it misses none.
#[derive(Debug)]
pub struct EventReader {
    descriptions: Subscriber<DeviceHeader, u8>,
    events: Subscriber<StreamHeader, u8>,
    /// Of the newest descriptions, the newest one last: a run that takes goals has one for each.
    contexts: VecDeque<WireContext>,
    /// Of which run the last event was, and its number.
    last: Option<(u64, u64)>,
}

impl EventReader {
    /// Opens the topics; the run may start later.
    ///
    /// # Errors
    /// [`TransportError`] naming the topic.
    pub fn open(bus: &Bus) -> Result<Self, TransportError> {
        Ok(Self {
            descriptions: bus.subscriber(&RUN, Depth::all(DESCRIPTIONS_DEPTH))?,
            events: bus.subscriber(&EVENT, Depth::all(EVENTS_DEPTH))?,
            contexts: VecDeque::new(),
            last: None,
        })
    }

    /// Waits for the next event. Cancel-safe.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn next(&mut self) -> Result<EventMessage, TransportError> {
        loop {
            self.hear_descriptions()?;
            if !self.contexts.is_empty() {
                break;
            }
            self.descriptions.wait().await?;
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
        self.hear_descriptions()?;
        while !self.contexts.is_empty()
            && let Some(message) = self.events.poll_next()?
        {
            // A goal is described before anything happens for it.
            self.hear_descriptions()?;
            let run_id = message.header().run_id;
            let known = self.contexts.iter().rev().find(|context| context.run_id == run_id);
            let Some(context) = known.or(self.contexts.back()) else { break };
            match event_from_wire(message.header(), message.records(), context) {
                // A restarted executor says again what it said of the cycle that it failed on.
                Ok(event)
                    if self
                        .last
                        .is_some_and(|last| last.0 == run_id && event.sequence <= last.1) => {}
                Ok(event) => {
                    self.last = Some((run_id, event.sequence));
                    return Ok(Some(event));
                }
                Err(error) => tracing::warn!(topic = EVENT.name, %error, "rejected"),
            }
        }
        Ok(None)
    }

    /// Takes in how the run has described itself.
    fn hear_descriptions(&mut self) -> Result<(), TransportError> {
        while let Some(message) = self.descriptions.poll_next()? {
            match run_from_wire(message.records()) {
                Ok((_, context)) => self.contexts.push_back(context),
                Err(error) => tracing::warn!(topic = RUN.name, %error, "rejected"),
            }
        }
        let n_old = self.contexts.len().saturating_sub(CONTEXTS_MAX);
        self.contexts.drain(..n_old);
        Ok(())
    }
}
