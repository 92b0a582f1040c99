//! Packed states, each stored once.

/// All states met by a search; a state's number is its place in the order of discovery.
///
/// A state is `words` 64-bit words, one bit for each atom.
#[derive(Debug, Clone)]
pub(crate) struct StateRegistry {
    words: usize,
    data: Vec<u64>,
    /// Open addressing; an entry is a state's number plus one, 0 when free. The length is a power
    /// of two. Only looked up, never iterated, so its order decides nothing.
    table: Vec<u32>,
    n_states: usize,
}

impl StateRegistry {
    /// An empty store for states of `words` words.
    pub(crate) fn new(words: usize) -> Self {
        Self { words, data: Vec::new(), table: vec![0; 64], n_states: 0 }
    }

    /// How many states are stored.
    pub(crate) fn len(&self) -> usize {
        self.n_states
    }

    /// Memory held, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.data.capacity() * 8 + self.table.len() * 4
    }

    /// The state of that number.
    pub(crate) fn get(&self, number: u32) -> &[u64] {
        let start = number as usize * self.words;
        &self.data[start..start + self.words]
    }

    /// The number of a state, if it is stored.
    pub(crate) fn find(&self, state: &[u64]) -> Option<u32> {
        let mask = self.table.len() - 1;
        let mut slot = hash(state) as usize & mask;
        loop {
            match self.table[slot] {
                0 => return None,
                entry if self.get(entry - 1) == state => return Some(entry - 1),
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// The number of a state and whether it is new.
    pub(crate) fn insert(&mut self, state: &[u64]) -> (u32, bool) {
        if self.n_states * 2 >= self.table.len() {
            self.grow();
        }
        let mask = self.table.len() - 1;
        let mut slot = hash(state) as usize & mask;
        loop {
            match self.table[slot] {
                0 => break,
                entry if self.get(entry - 1) == state => return (entry - 1, false),
                _ => slot = (slot + 1) & mask,
            }
        }
        let number = self.n_states as u32;
        self.data.extend_from_slice(state);
        self.n_states += 1;
        self.table[slot] = number + 1;
        (number, true)
    }

    /// Gives back memory that is held for more states.
    pub(crate) fn shrink(&mut self) {
        self.data.shrink_to_fit();
    }

    fn grow(&mut self) {
        let mask = self.table.len() * 2 - 1;
        let mut table = vec![0; mask + 1];
        for number in 0..self.n_states as u32 {
            let mut slot = hash(self.get(number)) as usize & mask;
            while table[slot] != 0 {
                slot = (slot + 1) & mask;
            }
            table[slot] = number + 1;
        }
        self.table = table;
    }
}

/// Multiply-and-fold over the words.
fn hash(state: &[u64]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    state.iter().fold(FACTOR, |hash, &word| {
        let product = u128::from(hash ^ word) * u128::from(FACTOR | 1);
        (product as u64) ^ (product >> 64) as u64
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_states_get_one_number() {
        let mut store = StateRegistry::new(2);
        for round in 0..2 {
            for i in 0..10_000_u64 {
                let (number, new) = store.insert(&[i % 100, i / 100]);
                assert_eq!((u64::from(number), new), (i, round == 0));
            }
        }
        assert_eq!(store.get(1234), [34, 12]);
        assert_eq!(store.len(), 10_000);
    }
}
