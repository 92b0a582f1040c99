//! Pixels whose colours lie side by side.

/// Rows that are RGB8 already.
pub(super) fn rgb<'a>(rows: impl Iterator<Item = &'a [u8]>) -> Vec<u8> {
    rows.collect::<Vec<_>>().concat()
}

/// Rows of pixels of `N` bytes, of which red, green and blue are those at the places `at`.
pub(super) fn of_pixels<'a, const N: usize>(
    rows: impl Iterator<Item = &'a [u8]>,
    at: [usize; 3],
) -> Vec<u8> {
    let pixels = rows.flat_map(|row| row.as_chunks::<N>().0);
    pixels.flat_map(|pixel| at.map(|place| pixel.get(place).copied().unwrap_or(0))).collect()
}
