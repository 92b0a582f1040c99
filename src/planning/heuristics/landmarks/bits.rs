//! Sets of small numbers as words of bits.

/// How many words a set of numbers below `n` takes.
pub(super) fn n_words(n: usize) -> usize {
    n.div_ceil(64)
}

pub(super) fn contains(set: &[u64], number: usize) -> bool {
    set[number / 64] >> (number % 64) & 1 == 1
}

pub(super) fn insert(set: &mut [u64], number: usize) {
    set[number / 64] |= 1 << (number % 64);
}

pub(super) fn is_subset(small: &[u64], large: &[u64]) -> bool {
    small.iter().zip(large).all(|(small, large)| small & !large == 0)
}

/// The members in rising order.
pub(super) fn members(set: &[u64]) -> impl Iterator<Item = usize> {
    set.iter().enumerate().flat_map(|(word, &bits)| {
        let mut open = bits;
        std::iter::from_fn(move || {
            (open != 0).then(|| {
                let bit = open.trailing_zeros() as usize;
                open &= open - 1;
                word * 64 + bit
            })
        })
    })
}

/// Sets of numbers below `n`, one for each row.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    words: usize,
    data: Vec<u64>,
}

impl Rows {
    pub(super) fn new(n_rows: usize, n: usize) -> Self {
        let words = n_words(n);
        Self { words, data: vec![0; n_rows * words] }
    }

    pub(super) fn get(&self, row: usize) -> &[u64] {
        &self.data[row * self.words..(row + 1) * self.words]
    }

    pub(super) fn get_mut(&mut self, row: usize) -> &mut [u64] {
        &mut self.data[row * self.words..(row + 1) * self.words]
    }
}
