//! Random numbers of one scene.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// What is drawn for one scene: it depends on the data set's seed and the scene's number, and on nothing else.
#[derive(Debug, Clone)]
pub struct Draws(ChaCha8Rng);

impl Draws {
    /// The draws of a scene.
    pub fn new(seed: u64, number: u64) -> Self {
        let mut key = [0; 32];
        for (bytes, number) in key.chunks_exact_mut(8).zip([seed, number]) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(key))
    }

    /// A seed for something else.
    pub fn seed(&mut self) -> u64 {
        // Small enough for a signed number in a file.
        self.0.next_u64() >> 1
    }

    /// A number between two others, the upper one left out.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        // 53 random bits, in [0, 1).
        let unit = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// A whole number below another one; 0 where there is none.
    pub fn below(&mut self, n: usize) -> usize {
        let wide = u128::from(self.0.next_u64()) * n as u128;
        usize::try_from(wide >> 64).unwrap_or_default()
    }

    /// Puts values in a random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, values: &mut [T]) {
        for last in (1..values.len()).rev() {
            values.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_depend_on_seed_and_number_and_stay_in_their_range() {
        let drawn = |seed, number| {
            let mut draws = Draws::new(seed, number);
            (draws.seed(), draws.below(1000), draws.between(2.0, 3.0).to_bits())
        };
        assert_eq!(drawn(1, 2), drawn(1, 2));
        assert!(drawn(1, 2) != drawn(2, 2) && drawn(1, 2) != drawn(1, 3));
        let mut draws = Draws::new(1, 1);
        let mut counts = [0; 4];
        for _ in 0..400 {
            counts[draws.below(4)] += 1;
            assert!((2.0..3.0).contains(&draws.between(2.0, 3.0)));
        }
        assert!(counts.iter().all(|n| (60..140).contains(n)), "{counts:?}");
        let mut order: Vec<u32> = (0..20).collect();
        draws.shuffle(&mut order);
        assert!(!order.is_sorted());
        order.sort_unstable();
        assert!(order.into_iter().eq(0..20));
    }
}
