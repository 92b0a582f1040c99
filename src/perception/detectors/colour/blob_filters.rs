//! Whether a patch of one colour looks like a body: set off from what is around it, and not a seam
//! between two others.

use crate::perception::ImageView;
use crate::perception::detectors::lab::{Hue, Lab};
use crate::perception::detectors::median::median_colour;
use crate::perception::detectors::regions::Region;

/// About how many pixels of a patch are looked at.
const SAMPLES: usize = 128;

/// Colours closer than this are alike (in Lab units).
const CONTRAST_MIN: f32 = 6.0;

/// A patch with more than this share of its surroundings like itself is a part of a larger, slowly
/// changing surface: tinted cloth, a vignette.
const ALIKE_MAX: f64 = 0.5;

/// A seam is lower than this share of an object's usual height.
const SEAM_HEIGHT_SHARE: f64 = 0.7;

/// And at least this share of its surroundings has other object colours.
const SEAM_ENCLOSED_MIN: f64 = 0.85;

/// Its hue is at most so far outside of those that it runs between, in degrees.
const SEAM_HUE_MARGIN: f32 = 25.0;

/// Whether most of the pixels beside and above the patch differ from it.
pub(super) fn stands_out(image: &ImageView<'_>, region: &Region) -> bool {
    let pixel =
        |(x, y): (i64, i64)| image.pixel(usize::try_from(x).ok()?, usize::try_from(y).ok()?);
    let Some(colour) = middle_colour(image, region) else { return false };
    let [left, right, above, _] = surroundings(region);
    let around = [left, right, above].into_iter().flatten().filter_map(pixel);
    share(around, |rgb| Lab::of(rgb).distance(colour) < CONTRAST_MIN) <= ALIKE_MAX
}

/// Whether the patch is a seam: the shadow between two bodies that touch, where the colour of the
/// one runs into that of the other and can look like a thin third one in between.
///
/// `usual_height` is that of objects of the type, in pixels; `other_colour` says whether a pixel
/// (column, row) has one of the objects' colours, but not the patch's.
pub(super) fn is_seam(
    image: &ImageView<'_>,
    region: &Region,
    usual_height: f64,
    other_colour: impl Fn((i64, i64)) -> bool,
) -> bool {
    let around = surroundings(region);
    region.pixel_box().height() < SEAM_HEIGHT_SHARE * usual_height
        && share(around.iter().flatten().copied(), other_colour) >= SEAM_ENCLOSED_MIN
        && is_of_hues_between(image, region, &around)
}

/// Whether the patch has a hue of the body above it, of the one below, or one between the two.
fn is_of_hues_between(
    image: &ImageView<'_>,
    region: &Region,
    [_, _, above, below]: &[Vec<(i64, i64)>; 4],
) -> bool {
    let side = |places: &[(i64, i64)]| {
        let pixel =
            |(x, y): (i64, i64)| image.pixel(usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        let colours: Vec<[u8; 3]> = places.iter().filter_map(|at| pixel(*at)).collect();
        median_colour(&colours).map(Hue::of)
    };
    let own = middle_colour(image, region).map(Hue::of);
    let Some(((own, above), below)) = own.zip(side(above)).zip(side(below)) else { return true };
    let (arc, at) = (above.turn_to(below), above.turn_to(own));
    let (low, high) = (arc.min(0.0) - SEAM_HUE_MARGIN, arc.max(0.0) + SEAM_HUE_MARGIN);
    (low..=high).contains(&at)
}

/// Pixels (column, row) a little left of, right of, above and below the patch's box; some may lie
/// outside the image.
fn surroundings(region: &Region) -> [Vec<(i64, i64)>; 4] {
    let b = region.pixel_box();
    // Far enough to be clear of blurred edges, near enough to be the patch's own surroundings.
    let margin = (0.15 * b.width().min(b.height())).round().max(3.0) as i64;
    let [x1, y1, x2, y2] = <[f64; 4]>::from(b).map(|v| v as i64);
    let column = |x: i64| (y1..y2).step_by(2).map(|y| (x, y)).collect();
    let row = |y: i64| (x1..x2).step_by(2).map(|x| (x, y)).collect();
    [column(x1 - margin), column(x2 - 1 + margin), row(y1 - margin), row(y2 - 1 + margin)]
}

/// The share of items that fulfil a condition; 0 of nothing.
fn share<T>(items: impl Iterator<Item = T>, fulfils: impl Fn(T) -> bool) -> f64 {
    let (mut yes, mut all) = (0_u32, 0_u32);
    for item in items {
        all += 1;
        yes += u32::from(fulfils(item));
    }
    f64::from(yes) / f64::from(all.max(1))
}

/// The channel-wise median over the patch; `None` when it lies outside the image.
pub(super) fn middle_colour(image: &ImageView<'_>, region: &Region) -> Option<Lab> {
    let step = (region.area() / SAMPLES).max(1);
    let pixels = region.runs.iter().flat_map(|r| (r.x_start..r.x_end).map(|x| (x, r.y)));
    let colours: Vec<[u8; 3]> =
        pixels.step_by(step).filter_map(|(x, y)| image.pixel(x as usize, y as usize)).collect();
    median_colour(&colours)
}
