//! Wake-ups of a topic, as tokio waits for them.

use std::os::fd::{AsRawFd, RawFd};

use iceoryx2::port::listener::Listener;
use iceoryx2::prelude::FileDescriptorBased as _;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::TransportError;
use super::reason::reason;
use super::services::Service;
use super::topics::Topic;

/// A listener whose file descriptor tokio watches.
struct WatchedListener(Listener<Service>);

impl AsRawFd for WatchedListener {
    #[expect(unsafe_code, reason = "iceoryx2 hands the descriptor out through an unsafe call")]
    fn as_raw_fd(&self) -> RawFd {
        // SAFETY: the descriptor is only registered with tokio's reactor and never closed or read
        // through this handle; it lives as long as the listener, which `AsyncFd` owns.
        unsafe { self.0.file_descriptor().native_handle() }
    }
}

/// Wake-ups of one topic.
pub(super) struct Wakeups {
    fd: AsyncFd<WatchedListener>,
    pub(super) topic: &'static str,
}

impl Wakeups {
    #[expect(unsafe_code, reason = "tokio asks for a descriptor that stays the same; it does")]
    pub(super) fn new(listener: Listener<Service>, topic: &Topic) -> Result<Self, TransportError> {
        let watched = WatchedListener(listener);
        // SAFETY: `WatchedListener` owns its listener and returns the same open descriptor for as
        // long as it lives; `AsyncFd` deregisters before it drops the listener.
        let fd = unsafe { AsyncFd::register_with_interest(watched, Interest::READABLE) }
            .map_err(|e| TransportError::open(topic.name, &e))?;
        Ok(Self { fd, topic: topic.name })
    }

    /// Waits for the next wake-up and drains all that are pending.
    pub(super) async fn wait(&self) -> Result<(), TransportError> {
        let mut ready = self.fd.readable().await.map_err(|e| self.fault(&e))?;
        ready.clear_ready();
        self.drain(|| ())
    }

    /// Drains all wake-ups that are pending; each is counted.
    pub(super) fn drain(&self, mut count: impl FnMut()) -> Result<(), TransportError> {
        self.fd.get_ref().0.try_wait(|_| count()).map_err(|e| self.fault(&e))?;
        Ok(())
    }

    pub(super) fn fault(&self, error: &dyn std::fmt::Display) -> TransportError {
        TransportError::Receive { topic: self.topic, reason: reason(error) }
    }
}
