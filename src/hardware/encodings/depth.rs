//! Distances along the optical axis (REP 118).

const MM_PER_M: f32 = 1000.0;

/// Rows of millimetres; 0 stays 0, which is none.
pub(super) fn of_mm<'a>(
    rows: impl Iterator<Item = &'a [u8]>,
    read: fn([u8; 2]) -> u16,
) -> Vec<f32> {
    let values = rows.flat_map(|row| row.as_chunks::<2>().0);
    values.map(|bytes| f32::from(read(*bytes)) / MM_PER_M).collect()
}

/// Rows of metres; what is not positive and finite is none, 0.
pub(super) fn of_m<'a>(rows: impl Iterator<Item = &'a [u8]>, read: fn([u8; 4]) -> f32) -> Vec<f32> {
    let values = rows.flat_map(|row| row.as_chunks::<4>().0).map(|bytes| read(*bytes));
    values.map(|z| if z.is_finite() && z > 0.0 { z } else { 0.0 }).collect()
}
