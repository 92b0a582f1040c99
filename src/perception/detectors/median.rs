//! Medians: of numbers, and of colours channel by channel.

use std::cmp::Ordering;

use super::lab::Lab;

/// The middle value, of two the greater; `None` of nothing.
pub(super) fn median<T: Copy>(
    mut values: Vec<T>,
    order: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, order).1)
}

/// The channel-wise median; `None` of nothing.
pub(super) fn median_rgb(colours: &[[u8; 3]]) -> Option<[u8; 3]> {
    let channel = |i: usize| median(colours.iter().map(|rgb| rgb[i]).collect(), u8::cmp);
    Some([channel(0)?, channel(1)?, channel(2)?])
}

/// The same in the colour space of distances.
pub(super) fn median_colour(colours: &[[u8; 3]]) -> Option<Lab> {
    median_rgb(colours).map(Lab::of)
}
