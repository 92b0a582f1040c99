//! Whether the loop is paused, as the requests on the topic `control` say.

use crate::messages::Control;
use crate::transport::Received;
use crate::transport::convert::control_from_wire;
use crate::transport::wire::{ControlRecord, DeviceHeader};

/// Which frames are answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Pace {
    /// Every frame.
    #[default]
    Free,
    /// One more, then none.
    Once,
    /// None.
    Paused,
}

/// What the requests so far come to. It outlives the actor.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Requests {
    pub(super) pace: Pace,
    /// When the newest request was sent that counts; a restarted reader hears the last ones again.
    last_ns: u64,
}

impl Requests {
    /// Those that are sent after a time, monotonic clock.
    pub(super) fn since(since_ns: u64) -> Self {
        Self { last_ns: since_ns, ..Self::default() }
    }

    /// Takes in a request; what it was, when it is a new one that can be read.
    pub(super) fn take(
        &mut self,
        message: &Received<DeviceHeader, ControlRecord>,
    ) -> Option<Control> {
        let send_ns = message.header().send_ns;
        if send_ns <= self.last_ns {
            return None;
        }
        let control = match control_from_wire(message.records()) {
            Ok(control) => control,
            Err(error) => {
                tracing::warn!(%error, "control");
                return None;
            }
        };
        self.last_ns = send_ns;
        self.pace = match control {
            Control::Stop(_) => self.pace,
            Control::Pause => Pace::Paused,
            Control::Resume => Pace::Free,
            Control::Step => Pace::Once,
        };
        Some(control)
    }
}
