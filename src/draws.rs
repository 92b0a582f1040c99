//! Seeded random numbers: the only source of chance outside the simulator, which has its own. Equal seeds give equal
//! numbers on every machine.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// A row of random numbers.
#[derive(Debug, Clone)]
pub struct Draws(ChaCha8Rng);

impl Draws {
    /// The draws of one thing among many of a seed: of a scene, or of one occurrence of a fault. They depend on the
    /// key and on nothing else.
    pub fn of_key(key: [u64; 4]) -> Self {
        let mut seed = [0; 32];
        for (bytes, number) in seed.chunks_exact_mut(8).zip(key) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(seed))
    }

    /// A stream of a seed, of which each has many that are independent of each other.
    pub fn stream(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self(generator)
    }

    /// A number in `[0, 1)` with 53 random bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A sample of the standard normal distribution (Box and Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }

    /// A seed for something else.
    pub fn seed(&mut self) -> u64 {
        // Small enough for a signed number in a file.
        self.0.next_u64() >> 1
    }

    /// A number between two others, the upper one left out.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
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
    fn draws_depend_on_their_key_and_stay_in_their_range() {
        let drawn = |seed, number| {
            let mut draws = Draws::of_key([seed, number, 0, 0]);
            (draws.seed(), draws.below(1000), draws.between(2.0, 3.0).to_bits())
        };
        assert_eq!(drawn(1, 2), drawn(1, 2));
        assert!(drawn(1, 2) != drawn(2, 2) && drawn(1, 2) != drawn(1, 3));
        let mut draws = Draws::of_key([1, 1, 0, 0]);
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
