//! Waiting for what may never answer.

use std::sync::mpsc::channel;
use std::time::Duration;

/// What a call comes to within a time; nothing when it does not come back by then. It goes on in a thread of its
/// own, and nobody waits for it.
pub(super) fn within<T: Send + 'static>(
    wait: Duration,
    call: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (answer, answered) = channel();
    let started = std::thread::Builder::new().name("bus".to_owned()).spawn(move || {
        // Whoever asked may be gone.
        drop(answer.send(call()));
    });
    if let Err(error) = started {
        tracing::warn!(%error, "no thread to join the bus with");
    }
    answered.recv_timeout(wait).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_that_never_comes_back_is_left() {
        assert_eq!(within(Duration::MAX, || 7), Some(7));
        let (hold, held) = channel::<()>();
        let lost = within(Duration::ZERO, move || held.recv().is_ok());
        assert_eq!(lost, None);
        drop(hold);
    }
}
