//! Touching bodies of one colour name: cut where the shade steps inside a region, or where a region
//! is as large as several objects of a type that has one size.
//!
//! How much the shade steps inside one body (a lit top above a front in shade) the labelled objects
//! say; without them nothing is cut.

use super::outline::SizeLimits;
use crate::geometry::PixelBox;
use crate::perception::ImageView;
use crate::perception::detectors::lab::Lab;
use crate::perception::detectors::median::{median, median_colour};
use crate::perception::detectors::regions::{Axis, Region};

/// A step of the shade must be at least this to be a border (in Lab units),
const STEP_MIN: f32 = 33.0;
/// and so many times the greatest one inside labelled objects.
const STEP_MULTIPLE_MIN: f32 = 1.3;
/// About how many pixels of a line are looked at.
const SAMPLES: f64 = 16.0;
/// Lines on either side of a step that are compared, as a share of the least part.
const REACH_SHARE: f64 = 0.25;
/// The rim of a labelled box that may show something else, as a share of its side.
const RIM_SHARE: f64 = 0.15;
/// The middle of a line, as a share: its ends are blurred and shaded.
const MIDDLE_SHARE: f64 = 0.6;
/// A type whose labelled objects differ by at most this factor has one size.
const ONE_SIZE_RATIO_MAX: f64 = 1.4;
/// An object that is so much as long as the largest labelled one shows that whole side.
const WHOLE_SHARE_MIN: f64 = 0.6;
/// Shapes that differ by at most this share are one,
const SAME_RATIO_MAX: f64 = 0.2;
/// and this share of the labelled objects must have one for others to be taken to have it.
const AGREEING_MIN: f64 = 0.7;
/// So many times the usual size may be two objects.
const SEVERAL_MIN: f64 = 1.6;
/// A cut by size goes to the seam this near, as a share of a part,
const SNAP_SHARE: f64 = 0.2;
/// if there is one that differs by so much (in Lab units).
const SEAM_MIN: f32 = 4.0;

/// The greatest steps of the shade inside labelled objects: between rows, between columns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct InnerSteps([f32; 2]);

impl InnerSteps {
    /// Adds what one more labelled box shows.
    pub(super) fn widened(self, image: &ImageView<'_>, b: &PixelBox) -> Self {
        let greatest = |axis: Axis| {
            let lines = lines(image, b, axis);
            let rim = (RIM_SHARE * lines.len() as f64).ceil() as usize;
            let inner = lines.get(rim..lines.len().saturating_sub(rim)).unwrap_or_default();
            let reach = reach(inner.len() as f64 / 2.0);
            (0..inner.len()).map(|at| step(inner, at, reach)).fold(0.0, f32::max)
        };
        let Self([rows, columns]) = self;
        Self([rows.max(greatest(Axis::Rows)), columns.max(greatest(Axis::Columns))])
    }

    fn border_min(self, axis: Axis) -> f32 {
        let Self([rows, columns]) = self;
        let inside = if axis == Axis::Rows { rows } else { columns };
        STEP_MIN.max(STEP_MULTIPLE_MIN * inside)
    }
}

/// How large an object of a type with one shape is.
#[derive(Debug, Clone, Copy)]
pub(super) struct BySize {
    /// So many times as large in this picture as the largest labelled one.
    pub(super) scale: f64,
    /// So many times as high as wide, where labelled objects agree about it: that holds at any
    /// distance from the camera.
    pub(super) ratio: Option<f64>,
}

impl BySize {
    /// How long an object is across the cuts of an axis, if it is as long as this body the other way.
    fn length(self, axis: Axis, body: &PixelBox, limits: &SizeLimits) -> Option<f64> {
        let (other, across) = match axis {
            Axis::Rows => (Axis::Columns, body.width()),
            Axis::Columns => (Axis::Rows, body.height()),
        };
        let [least, greatest] = limits.labelled_along(axis)?;
        let is_whole = across >= WHOLE_SHARE_MIN * limits.labelled_along(other)?[1];
        let by_shape = self.ratio.filter(|_| is_whole).map(|ratio| match axis {
            Axis::Rows => ratio * across,
            Axis::Columns => across / ratio,
        });
        let largest = self.scale * greatest;
        let by_labels = (greatest <= ONE_SIZE_RATIO_MAX * least).then_some(largest);
        by_shape.map(|length| length.min(largest)).or(by_labels)
    }
}

/// The height of labelled objects as a share of their width, where most agree about it.
pub(super) fn usual_ratio(ratios: &[f64]) -> Option<f64> {
    let middle = median(ratios.to_vec(), f64::total_cmp)?;
    let is_near = |ratio: &&f64| (*ratio - middle).abs() <= SAME_RATIO_MAX * middle;
    let n_near = ratios.iter().filter(is_near).count();
    (n_near as f64 >= AGREEING_MIN * ratios.len() as f64).then_some(middle)
}

/// Cuts a region into bodies. Without `by_size`, sizes cut nothing.
pub(super) fn split(
    region: Region,
    image: &ImageView<'_>,
    limits: &SizeLimits,
    (inside, by_size): (InnerSteps, Option<BySize>),
) -> Vec<Region> {
    let mut bodies = vec![region];
    for axis in [Axis::Rows, Axis::Columns] {
        let part_min = limits.least_along(axis).max(2.0);
        let cut = |body: Region| {
            let b = body.pixel_box();
            let lines = lines(image, &b, axis);
            let mut cuts = borders(&lines, part_min, inside.border_min(axis));
            if cuts.is_empty() {
                let size = by_size.and_then(|by_size| by_size.length(axis, &b, limits));
                cuts = size.map_or_else(Vec::new, |size| cuts_by_size(&lines, size));
            }
            body.cut(&cuts, axis)
        };
        bodies = bodies.into_iter().flat_map(cut).collect();
    }
    bodies
}

/// Where the shade steps by `border_min` at least, every part being `part_min` lines or more.
fn borders(lines: &[Lab], part_min: f64, border_min: f32) -> Vec<usize> {
    let (part, reach) = (part_min.ceil() as usize, reach(part_min));
    let (mut cuts, mut first) = (Vec::new(), 0);
    while first + 2 * part <= lines.len() {
        // The first place of a step, and then the greatest of that step.
        let mut inner = first + part..lines.len() - part + 1;
        let Some(begin) = inner.find(|at| step(lines, *at, reach) >= border_min) else { break };
        let end = (begin + reach).min(lines.len() - part);
        let rated = (begin..=end).map(|at| (step(lines, at, reach), at));
        let best = rated.reduce(|best, next| if next.0 > best.0 { next } else { best });
        first = best.map_or(begin, |(_, at)| at);
        cuts.push(first);
    }
    cuts
}

/// Cuts into as many parts of one size as there is room for.
fn cuts_by_size(lines: &[Lab], size: f64) -> Vec<usize> {
    let n_lines = lines.len() as f64;
    if n_lines < SEVERAL_MIN * size {
        return Vec::new();
    }
    let n = (n_lines / size).round().max(2.0);
    let part = n_lines / n;
    let near = (SNAP_SHARE * part) as usize;
    let cut = |i: u32| {
        let middle = (f64::from(i) * part).round() as usize;
        let places = middle.saturating_sub(near).max(1)..(middle + near).min(lines.len());
        let rated = places.map(|at| (seam(lines, at, reach(part)), at));
        let best = rated.reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.filter(|(seam, _)| *seam >= SEAM_MIN).map_or(middle, |(_, at)| at)
    };
    (1..n as u32).map(cut).collect()
}

/// How much like a border between two bodies a line is: the shade steps there, or the line differs
/// from those on both sides.
fn seam(lines: &[Lab], at: usize, reach: usize) -> f32 {
    let around = lines.get(at.saturating_sub(reach)..(at + reach).min(lines.len())).and_then(mean);
    let off = around.zip(lines.get(at)).map_or(0.0, |(around, line)| around.distance(*line));
    off.max(step(lines, at, reach))
}

/// How many lines on either side of a step are compared.
fn reach(part: f64) -> usize {
    ((REACH_SHARE * part) as usize).max(2)
}

/// How far the shade differs between the lines before `at` and those from it on.
fn step(lines: &[Lab], at: usize, reach: usize) -> f32 {
    let before = lines.get(at.saturating_sub(reach)..at).and_then(mean);
    let after = lines.get(at..(at + reach).min(lines.len())).and_then(mean);
    before.zip(after).map_or(0.0, |(a, b)| a.distance(b))
}

fn mean(lines: &[Lab]) -> Option<Lab> {
    let n = lines.len() as f32;
    let of = |value: fn(&Lab) -> f32| lines.iter().map(value).sum::<f32>() / n;
    (!lines.is_empty()).then(|| Lab { l: of(|c| c.l), a: of(|c| c.a), b: of(|c| c.b) })
}

/// The middle colour of each row or column of a box.
fn lines(image: &ImageView<'_>, b: &PixelBox, axis: Axis) -> Vec<Lab> {
    let across = match axis {
        Axis::Rows => [b.x1, b.x2],
        Axis::Columns => [b.y1, b.y2],
    };
    let length = across[1] - across[0];
    let first = across[0] + (1.0 - MIDDLE_SHARE) / 2.0 * length;
    let step = (MIDDLE_SHARE * length / SAMPLES).max(1.0);
    let n = (MIDDLE_SHARE * length / step).ceil().max(1.0) as u32;
    let line = |at: usize| {
        let sample = |i: u32| {
            let other = (first + step * f64::from(i)) as usize;
            match axis {
                Axis::Rows => image.pixel(other, at),
                Axis::Columns => image.pixel(at, other),
            }
        };
        let colours: Vec<[u8; 3]> = (0..n).filter_map(sample).collect();
        median_colour(&colours).unwrap_or(Lab::of([0; 3]))
    };
    let along = match axis {
        Axis::Rows => b.y1 as usize..b.y2 as usize,
        Axis::Columns => b.x1 as usize..b.x2 as usize,
    };
    along.map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shades(runs: &[(usize, f32)]) -> Vec<Lab> {
        let line = |l: f32| Lab { l, a: 30.0, b: 0.0 };
        runs.iter().flat_map(|(n, l)| vec![line(*l); *n]).collect()
    }

    #[test]
    fn a_step_is_cut_and_a_slope_is_not() {
        assert_eq!(borders(&shades(&[(15, 78.0), (15, 34.0)]), 6.0, 22.0), [15]);
        assert_eq!(borders(&shades(&[(9, 78.0), (9, 34.0), (9, 70.0)]), 6.0, 22.0), [9, 18]);
        let slope: Vec<(usize, f32)> = (0..30).map(|i| (1, 30.0 + 1.5 * i as f32)).collect();
        assert_eq!(borders(&shades(&slope), 6.0, 22.0), Vec::<usize>::new());
    }

    #[test]
    fn twice_the_size_is_two() {
        let seam = shades(&[(31, 50.0), (2, 40.0), (29, 50.0)]);
        let cuts = cuts_by_size(&seam, 30.0);
        assert_eq!(cuts, [31]);
        assert_eq!(cuts_by_size(&shades(&[(40, 50.0)]), 30.0), Vec::<usize>::new());
        assert_eq!(cuts_by_size(&shades(&[(90, 50.0)]), 30.0), [30, 60]);
    }
}
