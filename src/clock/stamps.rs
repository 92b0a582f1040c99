//! The stamps of a device, held against the clock of who reads them.

use super::ClockKind;

/// How far ahead of the reader's clock a stamp may be, nanoseconds: threads that read one clock at
/// nearly one time.
const AHEAD_NS_MAX: u64 = 50_000_000;

/// What has been read of one stream.
///
/// In realtime ages are what a robot moves on. A stamp of another clock would make an old picture new,
/// so that one that cannot be of `CLOCK_MONOTONIC` is refused: none at all, one that lies in the
/// future, and one that stands still while the numbers grow.
#[derive(Debug, Clone)]
pub struct Stamps {
    clock: ClockKind,
    last: Option<[u64; 2]>,
}

impl Stamps {
    /// Nothing has been read. In lockstep every stamp is as good as another.
    pub fn new(clock: ClockKind) -> Self {
        Self { clock, last: None }
    }

    /// Takes the number and stamp of a message that came at `now_ns`.
    ///
    /// # Errors
    /// Why the stamp cannot be.
    pub fn take(&mut self, sequence: u64, capture_ns: u64, now_ns: u64) -> Result<(), String> {
        if self.clock == ClockKind::Lockstep {
            return Ok(());
        }
        let last = self.last;
        let remedy = "stamp with CLOCK_MONOTONIC of this machine";
        if capture_ns == 0 {
            return Err(format!("capture_ns is 0: {remedy}"));
        }
        let ahead_ns = capture_ns.saturating_sub(now_ns);
        if ahead_ns > AHEAD_NS_MAX {
            let ahead_s = ahead_ns as f64 / 1e9;
            return Err(format!("capture_ns is {ahead_s:.1} s in the future: {remedy}"));
        }
        self.last = Some([sequence, capture_ns]);
        match last {
            Some([was, before]) if sequence > was && capture_ns <= before => {
                let apart_ms = (before - capture_ns) as f64 / 1e6;
                Err(format!(
                    "capture_ns of message {sequence} is {apart_ms:.1} ms before that of {was}, it must \
                     grow: {remedy}"
                ))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;
    const NOW: u64 = 5_000 * SECOND;

    #[track_caller]
    fn refused(stamps: &[[u64; 2]], expect: &str) {
        let mut read = Stamps::new(ClockKind::Realtime);
        let (last, before) = stamps.split_last().unwrap();
        for [sequence, stamp] in before {
            read.take(*sequence, *stamp, NOW).unwrap();
        }
        let said = read.take(last[0], last[1], NOW).unwrap_err();
        assert!(said.contains(expect), "{said}");
    }

    #[test]
    fn stamps_of_another_clock_are_refused() {
        refused(&[[1, 0]], "is 0");
        refused(&[[1, 1_796_000_000 * SECOND]], "in the future");
        refused(&[[1, NOW - 1], [2, NOW - 1]], "must grow");
        refused(&[[1, NOW - 1], [2, NOW], [3, NOW - 1]], "must grow");
    }

    #[test]
    fn old_pictures_restarted_devices_and_lockstep_are_fine() {
        let mut read = Stamps::new(ClockKind::Realtime);
        for [sequence, stamp] in [[7, NOW - 60 * SECOND], [8, NOW - 2], [8, NOW - 2], [0, NOW - 1]]
        {
            assert_eq!(read.take(sequence, stamp, NOW), Ok(()));
        }
        assert_eq!(Stamps::new(ClockKind::Lockstep).take(1, 0, NOW), Ok(()));
    }
}
