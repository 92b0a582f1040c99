//! The line to the robot. It outlives the executor's actor: whatever ends an episode, the last word is
//! *hold*.

use std::sync::{Mutex, PoisonError};

use super::ActorError;
use crate::messages::{Command, CommandKind};
use crate::transport::convert::{command_to_wire, device_header};
use crate::transport::topics::ROBOT_COMMAND;
use crate::transport::wire::{CommandRecord, DeviceHeader};
use crate::transport::{Bus, Publisher, TransportError};

/// What the robot is told, by one writer for all incarnations of the executor.
#[derive(Debug)]
pub struct CommandLine {
    publisher: Publisher<DeviceHeader, CommandRecord>,
    said: Mutex<Said>,
}

#[derive(Debug, Default)]
struct Said {
    n: u64,
    last: Option<Command>,
}

impl CommandLine {
    /// Opens the line.
    ///
    /// # Errors
    /// [`TransportError`] when the topic cannot be opened.
    pub fn open(bus: &Bus) -> Result<Self, TransportError> {
        Ok(Self { publisher: bus.publisher(&ROBOT_COMMAND)?, said: Mutex::default() })
    }

    /// Sends a command; returns its number.
    ///
    /// # Errors
    /// [`ActorError`] when the bus fails.
    pub fn send(&self, command: &Command) -> Result<u64, ActorError> {
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let sequence = said.n;
        let header = device_header(sequence, command.capture_ns);
        self.publisher.publish(header, &[command_to_wire(command)?])?;
        said.n += 1;
        said.last = Some(command.clone());
        Ok(sequence)
    }

    /// Says the last command again as another kind: `continue` while somebody watches, `hold` when
    /// nobody does. Nothing is said before the first command.
    ///
    /// # Errors
    /// [`ActorError`] when the bus fails.
    pub fn say_again(&self, kind: CommandKind) -> Result<(), ActorError> {
        let last = self.said.lock().unwrap_or_else(PoisonError::into_inner).last.clone();
        let Some(last) = last else { return Ok(()) };
        self.send(&Command { kind, step: None, ..last }).map(drop)
    }

    /// The motion that was commanded last and the frame that was answered last, where there is one: what comes
    /// after goes on from there.
    pub fn last(&self) -> Option<(u64, u64)> {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        said.last.as_ref().map(|command| (command.id, command.frame_sequence))
    }

    /// The last word of an episode, however it ends.
    pub fn hold(&self) {
        if let Err(error) = self.say_again(CommandKind::Hold) {
            tracing::warn!(%error, "robot/command: the robot is not told to hold");
        }
    }
}

impl Drop for CommandLine {
    fn drop(&mut self) {
        let said = self.said.get_mut().unwrap_or_else(PoisonError::into_inner);
        if said.last.as_ref().is_some_and(|last| last.kind != CommandKind::Hold) {
            self.hold();
        }
    }
}
