//! Binary images, one bit a pixel, with the morphology that cleans them.
//!
//! Sixty-four pixels are worked on at a time, and only rows and words that hold something, so that
//! cleaning a dozen colour classes of a 640×480 frame costs well below a millisecond.

/// A binary image. Bits beyond the width are always zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct BitMask {
    width: usize,
    height: usize,
    /// Words per row.
    stride: usize,
    words: Vec<u64>,
}

impl BitMask {
    /// An empty image.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let stride = width.div_ceil(64);
        Self { width, height, stride, words: vec![0; stride * height] }
    }

    /// Width in pixels.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// The words of one row.
    pub(super) fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// The words of one row.
    pub(super) fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// Clears every pixel.
    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Sets one pixel.
    #[cfg(test)]
    pub(super) fn set(&mut self, x: usize, y: usize) {
        self.row_mut(y)[x / 64] |= 1 << (x % 64);
    }

    /// Number of pixels set.
    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// First and one past the last row and word column that hold something, `None` when empty:
    /// `[y_start, y_end, word_start, word_end]`.
    fn bounds(&self) -> Option<[usize; 4]> {
        let used = |y: &usize| self.row(*y).iter().any(|&w| w != 0);
        let y_start = (0..self.height).find(used)?;
        let y_end = (0..self.height).rfind(used)? + 1;
        let column = |w: &usize| (y_start..y_end).any(|y| self.row(y)[*w] != 0);
        let w_start = (0..self.stride).find(column)?;
        let w_end = (0..self.stride).rfind(column)? + 1;
        Some([y_start, y_end, w_start, w_end])
    }

    /// Removes what a `width` × `height` rectangle does not fit into.
    pub(super) fn open(&self, width: usize, height: usize) -> Self {
        self.cropped(0, 0, |m| m.eroded(width, height).dilated(width, height))
    }

    /// Fills what a `width` × `height` rectangle of background does not fit into.
    pub(super) fn close(&self, width: usize, height: usize) -> Self {
        let opened_complement = |m: &Self| {
            let holes = m.complement();
            holes.eroded(width, height).dilated(width, height).complement()
        };
        self.cropped(width, height, opened_complement)
    }

    /// Grows by `dx` pixels to both sides and `dy` up and down.
    pub(super) fn grow(&self, dx: usize, dy: usize) -> Self {
        let grown = |m: &Self| m.dilated(dx + 1, dy + 1).shifted_dilated(dx + 1, dy + 1);
        self.cropped(dx, dy, grown)
    }

    /// This without the pixels of the other.
    pub(super) fn without(&self, other: &Self) -> Self {
        let words = self.words.iter().zip(&other.words).map(|(a, b)| a & !b).collect();
        Self { words, ..*self }
    }

    /// Works on the used part with a margin, also beyond the image; what lies there is background
    /// before and dropped after.
    fn cropped(&self, dx: usize, dy: usize, work: impl Fn(&Self) -> Self) -> Self {
        let Some([y0, y1, w0, w1]) = self.bounds() else { return self.clone() };
        let margin = dx.div_ceil(64);
        let mut part = Self::new(64 * (w1 - w0 + 2 * margin), y1 - y0 + 2 * dy);
        for y in y0..y1 {
            let target = &mut part.row_mut(y - y0 + dy)[margin..margin + w1 - w0];
            target.copy_from_slice(&self.row(y)[w0..w1]);
        }
        let part = work(&part);
        let mut whole = Self::new(self.width, self.height);
        // Columns and rows of the whole that the part covers, and where they are in the part.
        let (from_w, to_w) = (w0.saturating_sub(margin), (w1 + margin).min(self.stride));
        let (from_y, to_y) = (y0.saturating_sub(dy), (y1 + dy).min(self.height));
        let shift = from_w + margin - w0;
        for y in from_y..to_y {
            let source = &part.row(y + dy - y0)[shift..shift + to_w - from_w];
            whole.row_mut(y)[from_w..to_w].copy_from_slice(source);
        }
        whole.mask_tail();
        whole
    }

    fn complement(&self) -> Self {
        let mut out = self.clone();
        for y in 0..out.height {
            for word in out.row_mut(y) {
                *word = !*word;
            }
        }
        out.mask_tail();
        out
    }

    fn mask_tail(&mut self) {
        let used = self.width % 64;
        if used != 0 {
            for y in 0..self.height {
                if let Some(last) = self.row_mut(y).last_mut() {
                    *last &= (1 << used) - 1;
                }
            }
        }
    }

    /// Pixels that start a full `width` × `height` rectangle (its top-left corners).
    fn eroded(&self, width: usize, height: usize) -> Self {
        let mut out = self.clone();
        spans(width, |n| out.combine_columns(n, true, |a, b| a & b));
        spans(height, |n| out.combine_rows(n, true, |a, b| a & b));
        out
    }

    /// Every pixel of the rectangles whose top-left corners are set.
    fn dilated(&self, width: usize, height: usize) -> Self {
        let mut out = self.clone();
        spans(width, |n| out.combine_columns(n, false, |a, b| a | b));
        spans(height, |n| out.combine_rows(n, false, |a, b| a | b));
        out.mask_tail();
        out
    }

    /// Every pixel of the rectangles whose bottom-right corners are set.
    fn shifted_dilated(&self, width: usize, height: usize) -> Self {
        let mut out = self.clone();
        spans(width, |n| out.combine_columns(n, true, |a, b| a | b));
        spans(height, |n| out.combine_rows(n, true, |a, b| a | b));
        out
    }

    /// Combines each pixel with the one `n` to its right (`from_after`) or left.
    fn combine_columns(&mut self, n: usize, from_after: bool, f: impl Fn(u64, u64) -> u64) {
        let mut old = vec![0; self.stride];
        for y in 0..self.height {
            old.copy_from_slice(self.row(y));
            let moved =
                |i| if from_after { word_after(&old, i, n) } else { word_before(&old, i, n) };
            for (i, word) in self.row_mut(y).iter_mut().enumerate() {
                *word = f(*word, moved(i));
            }
        }
    }

    /// Combines each row with the one `n` below (`from_after`) or above.
    fn combine_rows(&mut self, n: usize, from_after: bool, f: impl Fn(u64, u64) -> u64) {
        let (stride, len) = (self.stride, self.words.len());
        let offset = (n * stride).min(len);
        if from_after {
            for i in 0..len {
                let moved = self.words.get(i + offset).copied().unwrap_or(0);
                self.words[i] = f(self.words[i], moved);
            }
        } else {
            for i in (0..len).rev() {
                let moved = i.checked_sub(offset).map_or(0, |j| self.words[j]);
                self.words[i] = f(self.words[i], moved);
            }
        }
    }
}

/// Word `i` of a row moved by `n` pixels to the left: what was to the right of each pixel.
fn word_after(row: &[u64], i: usize, n: usize) -> u64 {
    let at = |i: usize| row.get(i).copied().unwrap_or(0);
    let (near, far) = (at(i + n / 64), at(i + n / 64 + 1));
    if n.is_multiple_of(64) { near } else { near >> (n % 64) | far << (64 - n % 64) }
}

/// Word `i` of a row moved by `n` pixels to the right: what was to the left of each pixel.
fn word_before(row: &[u64], i: usize, n: usize) -> u64 {
    let at = |i: Option<usize>| i.and_then(|i| row.get(i)).copied().unwrap_or(0);
    let (near, far) = (at(i.checked_sub(n / 64)), at(i.checked_sub(n / 64 + 1)));
    if n.is_multiple_of(64) { near } else { near << (n % 64) | far >> (64 - n % 64) }
}

/// Calls `step` with the offsets that widen a one-pixel window to `length` by doubling.
fn spans(length: usize, mut step: impl FnMut(usize)) {
    let mut reached = 1;
    while reached < length {
        let n = reached.min(length - reached);
        step(n);
        reached += n;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn picture(rows: &[&str]) -> BitMask {
        let mut mask = BitMask::new(rows[0].len(), rows.len());
        for (y, row) in rows.iter().enumerate() {
            for (x, c) in row.bytes().enumerate() {
                if c == b'#' {
                    mask.set(x, y);
                }
            }
        }
        mask
    }

    #[test]
    fn opening_removes_specks_and_thin_lines() {
        let mask = picture(&["#....", "..###", "..###", "..#..", "..#.."]);
        assert_eq!(mask.open(2, 2), picture(&[".....", "..###", "..###", ".....", "....."]));
    }

    #[test]
    fn closing_fills_holes_and_keeps_corners() {
        let mask = picture(&[".....", ".###.", ".#.#.", ".###.", "....."]);
        assert_eq!(mask.close(2, 2), picture(&[".....", ".###.", ".###.", ".###.", "....."]));
    }

    #[test]
    fn closing_does_not_reach_for_the_border() {
        let mask = picture(&["...", "##.", "##.", "..."]);
        assert_eq!(mask.close(3, 3), mask);
    }

    #[test]
    fn growing_goes_both_ways() {
        let mask = picture(&[".....", ".....", "..#..", ".....", "....."]);
        assert_eq!(mask.grow(1, 0), picture(&[".....", ".....", ".###.", ".....", "....."]));
        assert_eq!(mask.grow(0, 2), picture(&["..#..", "..#..", "..#..", "..#..", "..#.."]));
    }

    proptest! {
        /// The words must agree with a plain pixel loop, across word boundaries too.
        #[test]
        fn opening_agrees_with_the_definition(
            bits in proptest::collection::vec(any::<bool>(), 150 * 5),
            width in 1..9_usize,
            height in 1..4_usize,
        ) {
            let (w, h) = (150, 5);
            let mut mask = BitMask::new(w, h);
            let on = |x: usize, y: usize| bits[y * w + x] || !(x / 20 + y).is_multiple_of(3);
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                if on(x, y) {
                    mask.set(x, y);
                }
            }
            let mut expect = BitMask::new(w, h);
            for (x0, y0) in (0..=h - height).flat_map(|y| (0..=w - width).map(move |x| (x, y))) {
                let window = || (y0..y0 + height).flat_map(|y| (x0..x0 + width).map(move |x| (x, y)));
                if window().all(|(x, y)| on(x, y)) {
                    window().for_each(|(x, y)| expect.set(x, y));
                }
            }
            prop_assert_eq!(mask.open(width, height), expect);
        }
    }
}
