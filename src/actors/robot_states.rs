//! What the robot says of itself, with stamps that can be.

use crate::clock::{ClockKind, Stamps, monotonic_ns};
use crate::messages::RobotState;
use crate::transport::convert::robot_state_from_wire;
use crate::transport::topics::ROBOT_STATE;
use crate::transport::wire::{DeviceHeader, RobotStateRecord};
use crate::transport::{Bus, Depth, Received, Subscriber, TransportError};

/// The newest state of the robot.
#[derive(Debug)]
pub(super) struct RobotStates {
    subscriber: Subscriber<DeviceHeader, RobotStateRecord>,
    stamps: Stamps,
    refused: Option<String>,
}

impl RobotStates {
    /// Opens the topic.
    pub(super) fn open(bus: &Bus, clock: ClockKind) -> Result<Self, TransportError> {
        let subscriber = bus.subscriber(&ROBOT_STATE, Depth::newest())?;
        Ok(Self { subscriber, stamps: Stamps::new(clock), refused: None })
    }

    /// Waits for the next state that can be used. Cancel-safe.
    pub(super) async fn next(&mut self) -> Result<RobotState, TransportError> {
        let Self { subscriber, stamps, refused } = self;
        subscriber.newest_of(|message| read(stamps, refused, &message)).await
    }

    /// The newest state that has come, if any.
    pub(super) fn drain(&mut self) -> Result<Option<RobotState>, TransportError> {
        let Self { subscriber, stamps, refused } = self;
        subscriber.drain_newest_of(|message| read(stamps, refused, &message))
    }

    /// Why the last state that could not be used could not.
    pub(super) fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }
}

fn read(
    stamps: &mut Stamps,
    refused: &mut Option<String>,
    message: &Received<DeviceHeader, RobotStateRecord>,
) -> Result<RobotState, String> {
    let DeviceHeader { sequence, capture_ns, .. } = *message.header();
    let state = stamps.take(sequence, capture_ns, monotonic_ns()).and_then(|()| {
        robot_state_from_wire(message.header(), message.records()).map_err(|e| e.to_string())
    });
    state.inspect_err(|reason| *refused = Some(reason.clone()))
}
