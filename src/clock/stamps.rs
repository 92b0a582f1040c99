//! The stamps of a device, held against the clock of who reads them.

use std::cmp::Ordering;

use thiserror::Error;

use super::ClockKind;
use crate::messages::FrameFault;

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

    /// As [`Stamps::take`], but a message counts once, and none does behind a later one.
    ///
    /// # Errors
    /// Why the stamp cannot be, or that it is no news.
    pub fn take_once(
        &mut self,
        sequence: u64,
        capture_ns: u64,
        now_ns: u64,
    ) -> Result<(), StampFault> {
        let kind = match self.last {
            Some([was, before]) if self.clock == ClockKind::Realtime => {
                match [sequence.cmp(&was), capture_ns.cmp(&before)] {
                    [Ordering::Equal, Ordering::Equal] => Some(FrameFault::Repeated),
                    [Ordering::Less, Ordering::Less | Ordering::Equal] => Some(FrameFault::Late),
                    _ => None,
                }
            }
            _ => None,
        };
        match kind {
            Some(FrameFault::Repeated) => {
                let reason = format!("message {sequence} has come already");
                Err(StampFault::new(FrameFault::Repeated, reason))
            }
            Some(kind) => {
                let reason = format!("message {sequence} comes behind a later one");
                Err(StampFault::new(kind, reason))
            }
            None => self.take(sequence, capture_ns, now_ns),
        }
    }

    /// Takes the number and stamp of a message that came at `now_ns`.
    ///
    /// # Errors
    /// Why the stamp cannot be.
    pub fn take(&mut self, sequence: u64, capture_ns: u64, now_ns: u64) -> Result<(), StampFault> {
        if self.clock == ClockKind::Lockstep {
            return Ok(());
        }
        let last = self.last;
        let remedy = "stamp with CLOCK_MONOTONIC of this machine";
        if capture_ns == 0 {
            return Err(StampFault::new(
                FrameFault::BadStamp,
                format!("capture_ns is 0: {remedy}"),
            ));
        }
        let ahead_ns = capture_ns.saturating_sub(now_ns);
        if ahead_ns > AHEAD_NS_MAX {
            let ahead_s = ahead_ns as f64 / 1e9;
            let reason = format!("capture_ns is {ahead_s:.1} s in the future: {remedy}");
            return Err(StampFault::new(FrameFault::Ahead, reason));
        }
        self.last = Some([sequence, capture_ns]);
        match last {
            Some([was, before]) if sequence > was && capture_ns <= before => {
                let apart_ms = (before - capture_ns) as f64 / 1e6;
                let is_still = capture_ns == before;
                let kind = if is_still { FrameFault::BadStamp } else { FrameFault::Late };
                let reason = format!(
                    "capture_ns of message {sequence} is {apart_ms:.1} ms before that of {was}, it must \
                     grow: {remedy}"
                );
                Err(StampFault::new(kind, reason))
            }
            _ => Ok(()),
        }
    }
}

/// A stamp cannot be, or it is that of a message that is not wanted any more.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{reason}")]
pub struct StampFault {
    /// What is wrong with it.
    pub kind: FrameFault,
    /// The same in words.
    pub reason: String,
}

impl StampFault {
    fn new(kind: FrameFault, reason: String) -> Self {
        Self { kind, reason }
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
        let said = read.take(last[0], last[1], NOW).unwrap_err().to_string();
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

    #[test]
    fn each_kind_of_fault_is_told_apart() {
        let mut read = Stamps::new(ClockKind::Realtime);
        for (sequence, stamp, kind) in [
            (7, NOW - 9, None),
            (7, NOW - 9, Some(FrameFault::Repeated)),
            (6, NOW - 10, Some(FrameFault::Late)),
            (8, 0, Some(FrameFault::BadStamp)),
            (8, NOW + SECOND, Some(FrameFault::Ahead)),
            (8, NOW - 8, None),
            (9, NOW - 8, Some(FrameFault::BadStamp)),
            (10, NOW - 20, Some(FrameFault::Late)),
            (11, NOW - 5, None),
            (0, NOW - 4, None), // a device that was started anew
        ] {
            let taken = read.take_once(sequence, stamp, NOW);
            assert_eq!(taken.err().map(|fault| fault.kind), kind, "{sequence}");
        }
        let mut lockstep = Stamps::new(ClockKind::Lockstep);
        assert_eq!([(); 2].map(|()| lockstep.take_once(1, 0, NOW)), [Ok(()), Ok(())]);
    }
}
