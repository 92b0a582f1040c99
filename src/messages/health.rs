//! How the actors of a run fare.

use std::fmt::{Display, Formatter};

/// Why a frame could not be used, where the frame itself is to blame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameFault {
    /// It is not laid out as it should be.
    Malformed,
    /// Its size is not that of the labelled examples, nor one that can be scaled to it.
    OtherSize,
    /// Its stamp is none, or stands still.
    BadStamp,
    /// Its stamp lies in the future.
    Ahead,
    /// It was captured before one that has come already.
    Late,
    /// It has come already.
    Repeated,
}

/// How many frames could not be used, by kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultCounts([u64; FrameFault::ALL.len()]);

impl FrameFault {
    /// All kinds, in the order of their counts.
    pub const ALL: [Self; 6] =
        [Self::Malformed, Self::OtherSize, Self::BadStamp, Self::Ahead, Self::Late, Self::Repeated];

    fn words(self) -> &'static str {
        match self {
            Self::Malformed => "malformed",
            Self::OtherSize => "of another size",
            Self::BadStamp => "with a stamp that stands still or is none",
            Self::Ahead => "from the future",
            Self::Late => "late",
            Self::Repeated => "repeated",
        }
    }
}

impl FaultCounts {
    /// From the counts of [`FrameFault::ALL`].
    pub fn new(counts: [u64; FrameFault::ALL.len()]) -> Self {
        Self(counts)
    }

    /// The counts of [`FrameFault::ALL`].
    pub fn counts(self) -> [u64; FrameFault::ALL.len()] {
        self.0
    }

    /// Counts one.
    pub fn add(&mut self, fault: FrameFault) {
        for (kind, count) in FrameFault::ALL.iter().zip(&mut self.0) {
            *count += u64::from(*kind == fault);
        }
    }
}

impl Display for FaultCounts {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let some = FrameFault::ALL.iter().zip(self.0).filter(|(_, count)| *count > 0);
        let words: Vec<String> =
            some.map(|(fault, count)| format!("{count} {}", fault.words())).collect();
        f.write_str(&words.join(", "))
    }
}

/// How one actor fares.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ActorHealth {
    /// Its name in the supervision tree.
    pub actor: String,
    /// Whether it runs now; an actor that waits for its restart does not.
    pub is_alive: bool,
    /// Messages that it has worked on.
    pub n_messages: u64,
    /// Failures that were followed by a restart.
    pub n_restarts: u32,
    /// Frames that newer ones have overtaken.
    pub n_missed: u64,
    /// Frames that could not be used.
    pub n_rejected: u64,
    /// Those of them that are to blame themselves, by kind.
    pub faults: FaultCounts,
    /// Why the last of them could not; empty without any.
    pub last_rejection: String,
}
