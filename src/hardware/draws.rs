//! Whether a fault happens, drawn from the run's seed: apart from everything else that is random.

use crate::draws::Draws;

/// The purpose of this draw among those of one occurrence of a fault.
const CHANCE: u64 = 0;

/// Whether one occurrence of a fault happens. It depends on the seed, the fault's place in the run file, the number
/// of its occurrence and the probability, and on nothing else.
pub fn is_drawn(seed: u64, (fault, occurrence): (usize, u64), probability: f64) -> bool {
    Draws::of_key([seed, fault as u64, occurrence, CHANCE]).unit() < probability
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_depends_on_seed_place_and_occurrence() {
        let drawn = |seed, fault| -> Vec<bool> {
            (1..=400).map(|n| is_drawn(seed, (fault, n), 0.3)).collect()
        };
        let n = drawn(1, 0).iter().filter(|drawn| **drawn).count();
        assert!((90..150).contains(&n), "{n} of 400");
        assert_eq!(drawn(1, 0), drawn(1, 0));
        assert_ne!(drawn(1, 0), drawn(2, 0));
        assert_ne!(drawn(1, 0), drawn(1, 1));
        assert!(is_drawn(1, (0, 1), 1.0) && !is_drawn(1, (0, 1), 0.0));
    }
}
