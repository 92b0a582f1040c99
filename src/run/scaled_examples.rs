//! Labelled examples and their pictures, scaled to the size of a camera's frames.

use std::sync::Arc;

use image::RgbImage;
use image::imageops::{FilterType, resize};

use crate::perception::model::{Exemplar, OtherRatio};

/// Averages where a picture shrinks and interpolates where it grows; unlike steeper filters it makes
/// no colours at edges that neither side has.
const FILTER: FilterType = FilterType::Triangle;

/// Labelled examples with their pictures.
pub(super) type Examples = Arc<Vec<(RgbImage, Exemplar)>>;

/// The examples as images of `size` show them. They stay the same when they have that size.
///
/// # Errors
/// [`OtherRatio`] of the first whose ratio of width to height is another one.
pub(super) fn scaled_examples(examples: &Examples, size: [u32; 2]) -> Result<Examples, OtherRatio> {
    if examples.iter().all(|(_, exemplar)| exemplar.image_size == size) {
        return Ok(Arc::clone(examples));
    }
    let scaled = examples.iter().map(|(picture, exemplar)| scaled_example(picture, exemplar, size));
    Ok(Arc::new(scaled.collect::<Result<_, OtherRatio>>()?))
}

/// One of them.
pub(super) fn scaled_example(
    picture: &RgbImage,
    exemplar: &Exemplar,
    size: [u32; 2],
) -> Result<(RgbImage, Exemplar), OtherRatio> {
    let exemplar = exemplar.scaled_to(size)?;
    let [width, height] = size;
    let is_own = picture.dimensions() == (width, height);
    let picture = if is_own { picture.clone() } else { resize(picture, width, height, FILTER) };
    Ok((picture, exemplar))
}

/// Width and height of examples that have one size.
pub(super) fn size_of(examples: &[(RgbImage, Exemplar)]) -> [u32; 2] {
    examples.first().map_or([0, 0], |(_, exemplar)| exemplar.image_size)
}
