//! Cleaned colour masks to regions of the outline that a type declares.

use crate::geometry::PixelBox;
use crate::perception::detectors::bitmask::BitMask;
use crate::perception::detectors::regions::{Axis, Region, regions};
use crate::perception::model::{Appearance, Shape};

/// Labelled objects bound the sizes to look for: down to this share of the smallest.
const SIZE_SHARE_MIN: f64 = 0.3;
/// And up to this multiple of the largest.
const SIZE_MULTIPLE_MAX: f64 = 3.0;

/// A patch this much higher than the highest labelled object may be two that touch.
const DOUBLE_HEIGHT: f64 = 1.2;

/// An outline draws in by at least this many pixels between two bodies (see [`enlargement`]).
const WAIST_PIXELS_MIN: f64 = 2.0;

/// The least share of its box that a convex body fills: a square that stands on a corner half of it,
/// and some of that goes with its blurred edge.
const TURNED_FILL_MIN: f64 = 0.4;
/// A convex body fills this share of its convex hull, noise at its edge allowed for.
const SOLIDITY_MIN: f64 = 0.85;

/// Of a body that others hide, at least this share of its box must be seen.
const SEEN_SHARE_MIN: f64 = 0.25;

/// Of an object behind another, so much of its width and height must show,
const REST_MIN: f64 = 0.1;
/// and so much of the longer of them;
const REST_LENGTH_MIN: f64 = 0.5;
/// it fills this share of its box,
const REST_FILL_MIN: f64 = 0.5;
/// and what hides it lies along this share of a side,
const REST_HIDDEN_MIN: f64 = 0.75;
/// at most so many pixels away (see [`enlargement`]).
const REST_GAP: f64 = 4.0;

/// A post of which less than this is to be seen, as a multiple of its width, may be anything.
const STUB_HEIGHT_MIN: f64 = 0.5;

/// What is left of a base's blurred edge, in pixels (see [`enlargement`]).
const BASE_MARGIN: f64 = 2.0;

/// Limits in pixels hold for pictures of up to so many rows.
const ROWS_MAX: f64 = 512.0;

/// How many times larger limits in pixels are in a picture of so many rows: with the picture grow its
/// blurred edges and the steps of its outlines, while no limit may sink below a pixel or two.
pub(super) fn enlargement(image_height: usize) -> f64 {
    (image_height as f64 / ROWS_MAX).max(1.0)
}

/// Sizes of objects of one type, in some unit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sizes {
    /// Least and greatest width.
    pub(super) width: [f64; 2],
    /// Least and greatest height.
    pub(super) height: [f64; 2],
}

impl Sizes {
    /// Multiplied by a factor.
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { width: self.width.map(|v| v * factor), height: self.height.map(|v| v * factor) }
    }

    fn along(&self, axis: Axis) -> [f64; 2] {
        match axis {
            Axis::Rows => self.height,
            Axis::Columns => self.width,
        }
    }

    /// The smallest range that contains both.
    pub(super) fn widened(self, other: Self) -> Self {
        let hull = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self { width: hull(self.width, other.width), height: hull(self.height, other.height) }
    }
}

/// How large the visible part of an object of one type may be, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SizeLimits {
    accepted: Sizes,
    /// Sizes of labelled objects.
    labelled: Option<Sizes>,
    /// Whether bodies are neither round nor posts.
    is_angular: bool,
    /// What limits in pixels are multiplied by.
    enlargement: f64,
}

impl SizeLimits {
    /// The declared limits for an image of `image_height` rows, narrowed to sizes like those of
    /// labelled objects (shares of the image height).
    ///
    /// A post's height is not narrowed from below: what stands in front of it can hide almost
    /// all of it.
    pub(super) fn new(spec: &Appearance, labelled: Option<Sizes>, image_height: usize) -> Self {
        let is_angular = matches!(spec.shape, Shape::Patch { split_waists: false });
        let enlargement = enlargement(image_height);
        let declared = Sizes { width: spec.width, height: spec.height };
        let declared = declared.scaled(image_height as f64);
        let Some(labelled) = labelled.map(|l| l.scaled(image_height as f64)) else {
            return Self { accepted: declared, labelled: None, is_angular, enlargement };
        };
        let meet = |declared: [f64; 2], [least, greatest]: [f64; 2]| {
            let low = declared[0].max(least * SIZE_SHARE_MIN);
            let high = declared[1].min(greatest * SIZE_MULTIPLE_MAX);
            if low <= high { [low, high] } else { declared }
        };
        let width = meet(declared.width, labelled.width);
        let least_height = match spec.shape {
            Shape::Patch { .. } | Shape::Plate {} => labelled.height[0],
            Shape::Post { .. } => 0.0,
        };
        let height = meet(declared.height, [least_height, labelled.height[1]]);
        let accepted = Sizes { width, height };
        Self { accepted, labelled: Some(labelled), is_angular, enlargement }
    }

    /// Width of the widest labelled object.
    pub(super) fn widest(&self) -> Option<f64> {
        self.labelled.map(|labelled| labelled.width[1])
    }

    /// Sizes of labelled objects of a type of angular bodies, such as blocks: what others leave to be
    /// seen of one is told from a whole one.
    pub(super) fn angular(&self) -> Option<Sizes> {
        self.labelled.filter(|_| self.is_angular)
    }

    /// Height of the lowest labelled object.
    pub(super) fn lowest(&self) -> Option<f64> {
        self.labelled.map(|labelled| labelled.height[0])
    }

    /// Height of the highest labelled object.
    pub(super) fn highest(&self) -> Option<f64> {
        self.labelled.map(|labelled| labelled.height[1])
    }

    /// Least and greatest size of labelled objects across the cuts of an axis.
    pub(super) fn labelled_along(&self, axis: Axis) -> Option<[f64; 2]> {
        self.labelled.map(|sizes| sizes.along(axis))
    }

    /// The least size that is accepted across the cuts of an axis.
    pub(super) fn least_along(&self, axis: Axis) -> f64 {
        self.accepted.along(axis)[0]
    }

    /// How many times as large as the largest labelled object a piece is, by the side in which it is
    /// less so: two that touch are not larger in both.
    pub(super) fn scale_of(&self, b: &PixelBox) -> Option<f64> {
        let ratio = |l: Sizes| (b.width() / l.width[1]).min(b.height() / l.height[1]);
        self.labelled.map(ratio)
    }

    /// Whether a piece is as high as an object may be, or as what shows of one.
    pub(super) fn may_contain_height(&self, b: &PixelBox) -> bool {
        let [low, high] = self.accepted.height;
        let low = self.angular().map_or(low, |labelled| low.min(REST_MIN * labelled.height[1]));
        (low..=high).contains(&b.height())
    }

    /// Whether a piece is as large as an object may be.
    pub(super) fn contain(&self, b: &PixelBox) -> bool {
        let within = |v: f64, [low, high]: [f64; 2]| low <= v && v <= high;
        within(b.width(), self.accepted.width) && within(b.height(), self.accepted.height)
    }
}

/// Finds the regions of one colour that may be objects of one type, or pieces of them.
pub(super) fn find(mask: &BitMask, spec: &Appearance, limits: &SizeLimits) -> Vec<Region> {
    let pixels = |share: f64| (share * mask.height() as f64).round().max(1.0) as usize;
    let [open_x, open_y] = spec.open.map(pixels);
    let [close_x, close_y] = spec.close.map(pixels);
    let mask = mask.open(open_x, open_y).close(close_x, close_y);
    match spec.shape {
        Shape::Patch { split_waists: false } | Shape::Plate {} => regions(&mask),
        Shape::Patch { split_waists: true } => {
            regions(&mask).into_iter().flat_map(|r| split_at_waists(r, limits)).collect()
        }
        Shape::Post { base_width_min } => {
            let (pieces, _) = standing(&mask, pixels(base_width_min), [open_x, open_y], limits);
            join_columns(pieces)
        }
    }
}

/// Whether a region has the outline and the size of an object of its type. `is_body` says of a pixel
/// whether it belongs to a body of another colour, which may hide the rest of this one.
pub(super) fn fits(
    region: &Region,
    spec: &Appearance,
    limits: &SizeLimits,
    is_body: &dyn Fn(u32, u32) -> bool,
) -> bool {
    let b = region.pixel_box();
    let aspect = b.width() / b.height();
    let is_whole = limits.contain(&b)
        && spec.aspect[0] <= aspect
        && aspect <= spec.aspect[1]
        && (is_filled(region, spec.fill_min)
            || is_filled_where_seen(region, spec.fill_min, is_body));
    is_whole || is_rest(region, spec, limits, is_body)
}

/// Whether a region is what shows of an object behind another body: too narrow or too low, with the
/// body along it, and open to the ground somewhere.
fn is_rest(
    region: &Region,
    spec: &Appearance,
    limits: &SizeLimits,
    is_body: &dyn Fn(u32, u32) -> bool,
) -> bool {
    let Some(labelled) = limits.angular() else { return false };
    let (b, accepted) = (region.pixel_box(), limits.accepted);
    let aspect = b.width() / b.height();
    let is_narrow = b.width() < accepted.width[0] || aspect < spec.aspect[0];
    let is_low = b.height() < accepted.height[0] || aspect > spec.aspect[1];
    let (width, height) = (labelled.width[1], labelled.height[1]);
    let shows = b.width() >= REST_MIN * width
        && b.height() >= REST_MIN * height
        && b.width().max(b.height()) >= REST_LENGTH_MIN * width.min(height)
        && b.width() <= accepted.width[1]
        && b.height() <= accepted.height[1];
    if is_narrow == is_low || !shows || (region.area() as f64) < REST_FILL_MIN * b.area() {
        return false;
    }
    let [x1, y1, x2, y2] = <[f64; 4]>::from(b).map(|v| v as u32);
    let beside = |columns: std::ops::Range<u32>| {
        let bodies = (y1..y2).filter(|y| columns.clone().any(|x| is_body(x, *y))).count();
        bodies as f64 / b.height()
    };
    let along = |rows: std::ops::Range<u32>| {
        let bodies = (x1..x2).filter(|x| rows.clone().any(|y| is_body(*x, y))).count();
        bodies as f64 / b.width()
    };
    let gap = (REST_GAP * limits.enlargement).round() as u32;
    let across = [beside(x1.saturating_sub(gap)..x1), beside(x2..x2 + gap)];
    let upright = [along(y1.saturating_sub(gap)..y1), along(y2..y2 + gap)];
    let hiding = if is_narrow { across } else { upright };
    let least = |sides: [f64; 2]| sides[0].min(sides[1]);
    hiding.iter().any(|share| *share >= REST_HIDDEN_MIN)
        && least(across).min(least(upright)) <= 1.0 - REST_HIDDEN_MIN
}

/// Whether a region fills what of its box other bodies leave to be seen.
fn is_filled_where_seen(
    region: &Region,
    fill_min: f64,
    is_body: &dyn Fn(u32, u32) -> bool,
) -> bool {
    let b = region.pixel_box();
    let [x1, y1, x2, y2] = <[f64; 4]>::from(b).map(|v| v as u32);
    let pixels = (y1..y2).flat_map(|y| (x1..x2).map(move |x| (x, y)));
    let hidden = pixels.filter(|(x, y)| is_body(*x, *y)).count() as f64;
    let seen = region.area() as f64;
    seen >= SEEN_SHARE_MIN * b.area() && seen >= fill_min * (b.area() - hidden)
}

/// Finds the tops of posts that what stands in front of them hides almost whole: as wide as a post,
/// and not higher than that. `known` are the posts that have been found.
pub(super) fn find_stubs(
    mask: &BitMask,
    spec: &Appearance,
    limits: &SizeLimits,
    known: &[PixelBox],
) -> Vec<Region> {
    let Shape::Post { base_width_min } = spec.shape else { return Vec::new() };
    let pixels = |share: f64| (share * mask.height() as f64).round().max(1.0) as usize;
    let open = [pixels(spec.open[0]), pixels(spec.open[0])];
    let (_, low) = standing(mask, pixels(base_width_min), open, limits);
    let [least, most] = limits.accepted.width;
    let is_stub = |b: PixelBox| {
        (least..=most).contains(&b.width())
            && b.height() >= STUB_HEIGHT_MIN * b.width()
            && known.iter().all(|k| k.x2 <= b.x1 || b.x2 <= k.x1)
    };
    low.into_iter().filter(|region| is_stub(region.pixel_box())).collect()
}

/// The pieces of a mask that stand above its base: those that are higher than wide, and the others.
fn standing(
    mask: &BitMask,
    base_width: usize,
    [open_x, open_y]: [usize; 2],
    limits: &SizeLimits,
) -> (Vec<Region>, Vec<Region>) {
    let base = mask.open(base_width, 1);
    let margin = (BASE_MARGIN * limits.enlargement).round() as usize;
    let standing = mask.without(&base.grow(margin, margin)).open(open_x, open_y);
    // Pieces of a base that something in front cuts up hardly rise above it.
    let base_top = regions(&base).first().map_or(f64::INFINITY, |r| r.pixel_box().y1);
    let least = limits.accepted.height[0];
    let above = regions(&standing).into_iter().filter(|r| r.pixel_box().y1 + least <= base_top);
    above.partition(|region| region.pixel_box().height() > region.pixel_box().width())
}

/// Whether a region fills its box, or at least its own convex outline: turned by 45 degrees, a
/// square fills half of its box.
fn is_filled(region: &Region, fill_min: f64) -> bool {
    let (area, of_box) = (region.area() as f64, region.pixel_box().area());
    area >= fill_min * of_box
        || (area >= TURNED_FILL_MIN.min(fill_min) * of_box
            && area >= SOLIDITY_MIN * hull_area(&region.row_extents()))
}

/// Area of the convex hull of rows, given as first and one past the last column.
fn hull_area(rows: &[Option<[u32; 2]>]) -> f64 {
    let side = |of: fn([u32; 2]) -> f64| -> f64 {
        let reach: Vec<f64> = rows.iter().map(|r| r.map_or(f64::NEG_INFINITY, of)).collect();
        let hull = below_hull(&reach).into_iter().zip(&reach).zip(rows);
        hull.map(|((depth, reach), row)| if row.is_some() { depth + reach } else { 0.0 }).sum()
    };
    side(|[_, x2]| f64::from(x2)) + side(|[x1, _]| -f64::from(x1))
}

/// Joins pieces that stand in one column: a bar with something in front of its middle.
fn join_columns(pieces: Vec<Region>) -> Vec<Region> {
    let mut joined: Vec<Region> = Vec::new();
    for piece in pieces {
        let b = piece.pixel_box();
        let same_column = |other: &Region| {
            let o = other.pixel_box();
            let common = o.x2.min(b.x2) - o.x1.max(b.x1);
            common > 0.5 * o.width().min(b.width())
        };
        match joined.iter().position(same_column) {
            Some(i) => {
                let other = joined.remove(i);
                joined.push(other.joined(piece));
            }
            None => joined.push(piece),
        }
    }
    joined
}

/// Cuts a region that is higher than any labelled object where both sides of its outline draw in:
/// two round bodies of one colour, one upon the other. Without labelled objects nothing is cut.
fn split_at_waists(region: Region, limits: &SizeLimits) -> Vec<Region> {
    let too_high =
        |r: &Region| limits.highest().is_some_and(|h| r.pixel_box().height() > DOUBLE_HEIGHT * h);
    let part_min = limits.accepted.height[0].ceil().max(1.0) as usize;
    let depth_min = WAIST_PIXELS_MIN * limits.enlargement;
    let mut parts = Vec::new();
    let mut rest = vec![region];
    while let Some(region) = rest.pop() {
        let waist = if too_high(&region) {
            waist(&region.row_extents(), part_min, depth_min)
        } else {
            None
        };
        match waist {
            Some(row) => {
                let first = region.runs.first().map_or(0, |r| r.y);
                rest.extend(region.cut_above(first + row as u32));
            }
            None => parts.push(region),
        }
    }
    parts
}

/// The row in which both sides of the outline lie farthest inside their convex hulls, counting the
/// shallower side; `None` when that is less than `depth_min`. Both parts have at least `part_min` rows.
fn waist(rows: &[Option<[u32; 2]>], part_min: usize, depth_min: f64) -> Option<usize> {
    let side = |of: fn([u32; 2]) -> f64| -> Vec<f64> {
        let reach: Vec<f64> = rows.iter().map(|r| r.map_or(f64::NEG_INFINITY, of)).collect();
        below_hull(&reach)
    };
    let left = side(|[x1, _]| -f64::from(x1));
    let right = side(|[_, x2]| f64::from(x2));
    let depths = left.iter().zip(&right).map(|(l, r)| l.min(*r)).enumerate();
    let inner =
        depths.filter(|(i, _)| (part_min..=rows.len().saturating_sub(part_min)).contains(i));
    let deepest = inner.max_by(|a, b| a.1.total_cmp(&b.1));
    deepest.filter(|(_, depth)| *depth >= depth_min).map(|(i, _)| i)
}

/// How far each value lies below the upper convex hull of all, the index being the abscissa.
fn below_hull(values: &[f64]) -> Vec<f64> {
    let mut hull: Vec<usize> = Vec::new();
    let slope = |i: usize, j: usize| (values[j] - values[i]) / (j - i) as f64;
    for (i, value) in values.iter().enumerate() {
        if !value.is_finite() {
            continue;
        }
        while let [.., a, b] = hull.as_slice() {
            if slope(*a, *b) > slope(*b, i) {
                break;
            }
            hull.pop();
        }
        hull.push(i);
    }
    let mut depths = vec![f64::INFINITY; values.len()]; // an empty row is as deep as can be
    for pair in hull.windows(2) {
        for i in pair[0]..=pair[1] {
            let on_hull = values[pair[0]] + slope(pair[0], pair[1]) * (i - pair[0]) as f64;
            depths[i] = on_hull - values[i];
        }
    }
    depths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::model::Perception;

    fn rows_of(widths: &[u32]) -> Vec<Option<[u32; 2]>> {
        widths.iter().map(|w| Some([50 - w, 50 + w])).collect()
    }

    #[test]
    fn two_bulges_have_a_waist_and_one_has_none() {
        let one = [12, 18, 20, 21, 21, 20, 18];
        let two = [12, 18, 20, 20, 18, 17, 26, 30, 31, 31, 28];
        assert_eq!(waist(&rows_of(&one), 2, 2.0), None);
        assert_eq!(waist(&rows_of(&two), 2, 2.0), Some(5));
    }

    #[test]
    fn a_notch_on_one_side_is_no_waist() {
        let mut rows = rows_of(&[20; 9]);
        rows[4] = Some([40, 70]);
        assert_eq!(waist(&rows, 2, 2.0), None);
    }

    #[test]
    fn a_hull_has_the_area_of_what_it_is_around() {
        assert_eq!(hull_area(&rows_of(&[20; 9])), 9.0 * 40.0);
        let diamond: Vec<u32> = (1..=20).chain((1..20).rev()).collect();
        assert_eq!(hull_area(&rows_of(&diamond)), 800.0);
        let notched = hull_area(&rows_of(&[20, 20, 5, 20, 20]));
        assert_eq!(notched, 200.0);
    }

    #[test]
    fn what_is_a_waist_grows_with_the_picture() {
        let text = include_str!("../../../../domains/hanoi/perception.toml");
        let perception = Perception::parse("perception.toml", text).unwrap();
        let disk = perception.type_spec(&"disk".into()).unwrap().appearance.clone().unwrap();
        // Two disks, the picture's rows / 20 high each, drawn in by so many pixels where they meet.
        let n_parts = |image_height: usize, depth: usize| {
            let labelled = Sizes { width: [0.1; 2], height: [0.05; 2] };
            let limits = SizeLimits::new(&disk, Some(labelled), image_height);
            let height = image_height / 10;
            let mut mask = BitMask::new(2 * height, height);
            for y in 0..height {
                let inset = if y.abs_diff(height / 2) < 3 { depth } else { 0 };
                (inset..2 * height - inset).for_each(|x| mask.row_mut(y)[x / 64] |= 1 << (x % 64));
            }
            regions(&mask).into_iter().flat_map(|r| split_at_waists(r, &limits)).count()
        };
        assert_eq!([n_parts(512, 3), n_parts(512, 1)], [2, 1]);
        assert_eq!([n_parts(1024, 5), n_parts(1024, 3)], [2, 1]);
        assert_eq!(n_parts(256, 2), 2, "and sinks no further");
    }

    #[test]
    fn an_empty_row_is_a_waist() {
        let mut rows = rows_of(&[20; 9]);
        rows[4] = None;
        assert_eq!(waist(&rows, 2, 2.0), Some(4));
    }
}
