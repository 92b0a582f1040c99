//! What the seed of a run draws for its faults: apart from everything else that is random.

/// What is drawn for; each purpose has numbers of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Whether it happens.
    Chance = 0,
    /// When, between two times.
    Time = 1,
    /// Whom it concerns.
    Object = 2,
    /// How long it takes.
    Length = 3,
}

/// Numbers that depend on the seed, the fault, the number of its occurrence and the purpose, and on
/// nothing else.
#[derive(Debug, Clone)]
pub(super) struct Draws(u64);

/// A step between two numbers to be mixed (splitmix64, public domain).
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Draws {
    /// The numbers of one occurrence of a fault.
    pub(super) fn new(seed: u64, (fault, occurrence): (usize, u64), purpose: Purpose) -> Self {
        let parts = [fault as u64, occurrence, purpose as u64];
        Self(parts.iter().fold(mixed(seed), |state, part| mixed(state ^ mixed(*part))))
    }

    /// The next number, from 0 to below 1.
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(STEP);
        (mixed(self.0) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// The next number between two bounds.
    pub(super) fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Puts items into an order by chance (Fisher and Yates).
    pub(super) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let other = (self.unit() * (last + 1) as f64) as usize;
            items.swap(last, other.min(last));
        }
    }
}

fn mixed(number: u64) -> u64 {
    let mut z = number.wrapping_add(STEP);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
