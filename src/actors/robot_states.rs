//! What the robot says of itself, with stamps that can be.

use crate::clock::{ClockKind, Stamps, monotonic_ns};
use crate::messages::RobotState;
use crate::transport::convert::robot_state_from_wire;
use crate::transport::topics::ROBOT_STATE;
use crate::transport::wire::{DeviceHeader, RobotStateRecord};
use crate::transport::{Bus, Depth, Drops, Received, Subscriber, TopicSilence, TransportError};

/// The newest state of the robot.
#[derive(Debug)]
pub(super) struct RobotStates {
    subscriber: Subscriber<DeviceHeader, RobotStateRecord>,
    stamps: Stamps,
    refused: Option<String>,
    /// What the topic's reader had missed when the last state came.
    heard_with: Drops,
}

impl RobotStates {
    /// Opens the topic.
    pub(super) fn open(bus: &Bus, clock: ClockKind) -> Result<Self, TransportError> {
        let subscriber = bus.subscriber(&ROBOT_STATE, Depth::newest())?;
        let (stamps, heard_with) = (Stamps::new(clock), Drops::default());
        Ok(Self { subscriber, stamps, refused: None, heard_with })
    }

    /// Waits for the next state that can be used. Cancel-safe.
    pub(super) async fn next(&mut self) -> Result<RobotState, TransportError> {
        let Self { subscriber, stamps, refused, heard_with } = self;
        let state = subscriber.newest_of(|message| read(stamps, refused, &message)).await?;
        *heard_with = subscriber.drops();
        Ok(state)
    }

    /// The newest state that has come, if any.
    pub(super) fn drain(&mut self) -> Result<Option<RobotState>, TransportError> {
        let Self { subscriber, stamps, refused, heard_with } = self;
        let newest = subscriber.drain_newest_of(|message| read(stamps, refused, &message))?;
        if newest.is_some() {
            *heard_with = subscriber.drops();
        }
        Ok(newest)
    }

    /// Why the last state that came could not be used, if it could not.
    pub(super) fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Why nothing has come since the last state.
    pub(super) fn silence(&mut self, bus: &Bus) -> Result<TopicSilence, TransportError> {
        bus.silence(&ROBOT_STATE, &mut self.subscriber, self.heard_with)
    }
}

fn read(
    stamps: &mut Stamps,
    refused: &mut Option<String>,
    message: &Received<DeviceHeader, RobotStateRecord>,
) -> Result<RobotState, String> {
    let DeviceHeader { sequence, capture_ns, .. } = *message.header();
    let stamp = stamps.take(sequence, capture_ns, monotonic_ns()).map_err(|e| e.to_string());
    let state = stamp.and_then(|()| {
        robot_state_from_wire(message.header(), message.records()).map_err(|e| e.to_string())
    });
    *refused = state.as_ref().err().cloned();
    state
}
