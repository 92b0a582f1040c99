//! What has been told already: a fault that comes with every message is told a few times, then counted.

use std::collections::BTreeMap;

/// So many of a kind are told one by one.
const TOLD_EACH: u64 = 3;
/// Kinds that are told apart; all further ones count as one.
const KINDS_MAX: usize = 32;

/// How often each kind of fault has come.
#[derive(Debug, Clone, Default)]
pub struct Told {
    counts: BTreeMap<String, u64>,
}

impl Told {
    /// Counts a fault. Its number among those of its kind when it is to be told: the first few, then
    /// the 10th, the 100th and so on. Faults are of one kind when they differ in digits only.
    pub fn count(&mut self, fault: &str) -> Option<u64> {
        let mut kind: String = fault.chars().filter(|c| !c.is_ascii_digit()).collect();
        if self.counts.len() >= KINDS_MAX && !self.counts.contains_key(&kind) {
            kind.clear();
        }
        let n = self.counts.entry(kind).or_default();
        *n += 1;
        (*n <= TOLD_EACH || 10_u64.pow(n.ilog10()) == *n).then_some(*n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_few_are_told_then_every_tenfold() {
        let mut told = Told::default();
        let counted: Vec<u64> =
            (0..1_000).filter_map(|n| told.count(&format!("frame {n} is bad"))).collect();
        assert_eq!(counted, [1, 2, 3, 10, 100, 1_000]);
        assert_eq!(told.count("another"), Some(1));
    }

    #[test]
    fn kinds_are_bounded() {
        let mut told = Told::default();
        for c in 0..10_000_u32 {
            let kind: String =
                (0..14).map(|bit| if c >> bit & 1 == 1 { 'a' } else { 'b' }).collect();
            told.count(&kind);
        }
        assert!(told.counts.len() <= KINDS_MAX + 1);
    }
}
