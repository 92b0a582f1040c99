//! For how long frames have said the same.

/// A camera's frames as they come, and how long what they say must last to be believed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Time since the frame before, nanoseconds.
    pub(super) frame_ns: u64,
    /// `perception.belief.confirm_s` in nanoseconds.
    pub(super) confirm_ns: u64,
}

/// Frames that say the same, and none between them that says otherwise. Each counts for the time since the frame
/// before it, the first for none: so two frames are needed at least, unless nothing has to last.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Streak {
    ns: u64,
}

impl Streak {
    /// One frame more.
    pub(super) fn go_on(&mut self, pace: Pace) {
        self.ns = self.ns.saturating_add(pace.frame_ns);
    }

    /// Whether it has lasted for long enough to be believed.
    pub(super) fn is_confirmed(self, pace: Pace) -> bool {
        self.ns >= pace.confirm_ns
    }

    /// For how long it has lasted, nanoseconds.
    pub(super) fn ns(self) -> u64 {
        self.ns
    }
}
