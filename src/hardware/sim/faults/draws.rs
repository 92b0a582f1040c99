//! What the seed of a run draws for its faults: apart from everything else that is random.

use groundloop_sim::Random;

/// What is drawn for; each purpose has numbers of its own, 0 being whether it happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// When, between two times.
    Time = 1,
    /// Whom it concerns.
    Object = 2,
    /// How long it takes.
    Length = 3,
    /// Where in a picture, and whom of a detector's boxes.
    Picture = 4,
    /// What is new in each frame that it lasts.
    Noise = 5,
}

/// The numbers of one occurrence of a fault: they depend on the seed, the fault's place in the run file, the number
/// of its occurrence and the purpose, and on nothing else.
pub(super) fn draws(seed: u64, (fault, occurrence): (usize, u64), purpose: Purpose) -> Random {
    Random::of_key([seed, fault as u64, occurrence, purpose as u64])
}

/// The numbers of one frame while an occurrence lasts.
pub(super) fn frame_draws(seed: u64, (fault, occurrence): (usize, u64), sequence: u64) -> Random {
    // The purposes of an occurrence are below 256, so no two frames share their numbers.
    let purpose = Purpose::Noise as u64 | sequence << 8;
    Random::of_key([seed, fault as u64, occurrence, purpose])
}
