//! Topics over iceoryx2: shared memory between actors, whether they share a process or not.

pub mod wire;
pub mod topics;
mod services;
mod outbox;
mod told;
mod place;
mod patience;
mod reserve;
mod wakeups;
mod ports;
mod bus;
mod census;
mod silence;
pub mod convert;
mod join;
mod task_client;
mod taps;
mod reason;

use thiserror::Error;

pub use bus::{Bus, BusConfig};
pub use census::{BusCensus, BusProcess, Leftover};
pub use join::{EventReader, join};
pub use outbox::{Delivery, Outgoing, SendHook};
pub use place::{
    MissingRoom, OpenFilesLimit, RUN_NAME_BYTES_MAX, RootFolder, SharedMemory, missing_room,
    room_for, run_name_fault,
};
pub use ports::{Depth, Drops, Publisher, Received, Subscriber};
use reason::reason;
pub use services::Record;
pub use silence::{SilenceCause, TopicSilence};
pub use taps::{Tap, TappedMessage};
pub use task_client::TaskClient;
pub use told::Told;

use convert::WireError;

/// The bus does not work.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TransportError {
    /// A node or topic cannot be opened.
    #[error("cannot open shared memory for {what}: {reason}")]
    Open {
        /// The directory or topic.
        what: String,
        /// Why, and what to do about it.
        reason: String,
    },
    /// A reader asks for more messages to wait than the topic allows.
    #[error("cannot open topic {topic}: {waiting} messages waiting, at most {depth_max}")]
    Depth {
        /// Its name below the run.
        topic: &'static str,
        /// How many were asked for.
        waiting: usize,
        /// How many there may be.
        depth_max: usize,
    },
    /// Another process writes a topic that has one writer.
    #[error(
        "{topic} of run \"{run}\" has a writer already: another process does the same; end it, or give \
         the run another name (--run)"
    )]
    Taken {
        /// Its name below the run.
        topic: &'static str,
        /// The run.
        run: String,
    },
    /// The name of a run that cannot be one.
    #[error("the run \"{run}\": expected {expected}")]
    Name {
        /// The name.
        run: String,
        /// What a name is.
        expected: String,
    },
    /// What is to be sent is not what it should be.
    #[error("{}: expected {}, got {}", .0.field, .0.expected, .0.got)]
    Unsayable(#[from] WireError),
    /// A message cannot be sent.
    #[error("cannot send on {topic}: {reason}")]
    Send {
        /// Its name below the run.
        topic: &'static str,
        /// Why, and what to do about it.
        reason: String,
    },
    /// Shared memory is full: a message may not be written.
    #[error(
        "no room in shared memory for {topic}: it needs {} kB of /dev/shm, where {} kB are free; remove what lies \
         there, or raise --shm-size of the container",
        needed_bytes.div_ceil(1024),
        free_bytes / 1024
    )]
    Full {
        /// Its name below the run, or "the bus".
        topic: &'static str,
        /// What it needs.
        needed_bytes: u64,
        /// What is free.
        free_bytes: u64,
    },
    /// Messages cannot be received.
    #[error("cannot receive on {topic}: {reason}")]
    Receive {
        /// Its name below the run.
        topic: &'static str,
        /// Why, and what to do about it.
        reason: String,
    },
}

impl TransportError {
    fn open(topic: &str, error: &dyn std::fmt::Display) -> Self {
        Self::Open { what: format!("topic {topic}"), reason: reason(error) }
    }
}
