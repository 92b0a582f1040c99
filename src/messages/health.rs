//! How the actors of a run fare.

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
    /// Why the last of them could not; empty without any.
    pub last_rejection: String,
}
