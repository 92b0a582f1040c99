//! Waiting for what may be missing, in time in which this process runs.

use std::time::Duration;

use tokio::time::{Instant, sleep_until};

/// So often a wait looks at the clock, in shares of the wait.
const BEATS: u32 = 8;
/// A beat that comes later than this share of the wait says that the process was stopped.
const STOPPED_SHARE: u32 = 2;

/// How a wait has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Waited {
    /// The time is over.
    Out,
    /// This process stood still for so long (SIGSTOP, a terminal's Ctrl-Z, a machine that slept): what
    /// did not come could not come.
    Stopped(Duration),
}

/// Waits until `deadline`, which is that of a wait of this length. Cancel-safe.
pub(super) async fn waited(deadline: Instant, wait: Duration) -> Waited {
    loop {
        let beat = deadline.min(Instant::now() + wait / BEATS);
        sleep_until(beat).await;
        let late = beat.elapsed();
        if let Some(stopped) = was_stopped(late, wait) {
            tracing::warn!(
                "this process stood still for {:.1} s: waiting anew",
                stopped.as_secs_f64()
            );
            return Waited::Stopped(stopped);
        }
        if beat >= deadline {
            return Waited::Out;
        }
    }
}

/// For how long the process stood still, where a beat that comes so late says that it did.
pub(super) fn was_stopped(late: Duration, wait: Duration) -> Option<Duration> {
    (late > wait / STOPPED_SHARE).then_some(late)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_beat_is_a_stop_and_a_busy_machine_is_none() {
        let wait = Duration::from_secs(10);
        assert_eq!(was_stopped(Duration::from_secs(2), wait), None);
        let late = Duration::from_secs(9);
        assert_eq!(was_stopped(late, wait), Some(late));
    }
}
