//! Which pixels of an image are an object's.

use std::ops::Deref;
use std::sync::Arc;

/// Pixels `x_start..x_end` of row `y`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MaskRun {
    /// The row.
    pub y: u32,
    /// First column.
    pub x_start: u32,
    /// One past the last column.
    pub x_end: u32,
}

/// The pixels of one object, from top to bottom and from left to right, with what is asked of them
/// for every pair of objects. A clone shares them.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask(Arc<Measured>);

#[derive(Debug, PartialEq)]
struct Measured {
    runs: Vec<MaskRun>,
    centroid: [f64; 2],
    area: f64,
    columns: [u32; 2],
    /// How many runs lie above each row, from the first row to the last.
    n_above: Vec<usize>,
}

impl Mask {
    /// The middle of the pixels: column and row.
    pub fn centroid(&self) -> [f64; 2] {
        self.0.centroid
    }

    /// The number of pixels.
    pub fn area(&self) -> f64 {
        self.0.area
    }

    /// How many runs lie above a row.
    fn n_above(&self, y: u32) -> usize {
        let Some(row) = self.first().and_then(|first| y.checked_sub(first.y)) else { return 0 };
        self.0.n_above.get(row as usize).copied().unwrap_or(self.len())
    }

    /// The smallest distance between the pixels of two masks, in pixels; 0 when they touch or
    /// overlap, infinite when one has none.
    pub fn gap(&self, other: &Self) -> f64 {
        let (Some(first), Some(last)) = (other.first(), other.last()) else { return f64::INFINITY };
        let Measured { runs: others, columns: [left, right], .. } = &*other.0;
        let mut nearest = u64::MAX;
        // The side that faces the other mask comes first; of what lies wholly above or below it, the
        // rest is farther off.
        let mut look_from = |run: &MaskRun| {
            let aside = apart(run.x_end, *left).max(apart(*right, run.x_start));
            let beyond = apart(run.y + 1, first.y).max(apart(last.y + 1, run.y));
            if beyond * beyond >= nearest && beyond > 0 {
                return false;
            }
            // No other run is nearer in columns and in rows than these.
            if aside * aside + beyond * beyond >= nearest {
                return true;
            }
            let mut offer = |near: &MaskRun| {
                let dy = apart(run.y.min(near.y) + 1, run.y.max(near.y));
                let dx = apart(run.x_end, near.x_start).max(apart(near.x_end, run.x_start));
                nearest = nearest.min(dx * dx + dy * dy);
                // Later ones are farther in rows.
                aside * aside + dy * dy >= nearest
            };
            let (above, below) = others.split_at(other.n_above(run.y));
            let _last_below = below.iter().find(|near| offer(near));
            let _last_above = above.iter().rfind(|near| offer(near));
            nearest > 0
        };
        if self.first().is_some_and(|run| run.y < first.y) {
            let (above, below) = self.split_at(self.n_above(last.y + 1));
            let _last = above.iter().rev().all(&mut look_from);
            let _last = below.iter().all(&mut look_from);
        } else {
            let _last = self.iter().all(look_from);
        }
        if nearest == u64::MAX { f64::INFINITY } else { (nearest as f64).sqrt() }
    }
}

/// How many pixels lie between the end of one run and the start of another one; 0 where they overlap.
fn apart(end: u32, start: u32) -> u64 {
    u64::from(start.saturating_sub(end))
}

impl Deref for Mask {
    type Target = [MaskRun];

    fn deref(&self) -> &[MaskRun] {
        &self.0.runs
    }
}

impl From<Vec<MaskRun>> for Mask {
    fn from(runs: Vec<MaskRun>) -> Self {
        let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
        for run in &runs {
            let length = f64::from(run.x_end - run.x_start);
            area += length;
            x += length * f64::midpoint(f64::from(run.x_start), f64::from(run.x_end));
            y += length * (f64::from(run.y) + 0.5);
        }
        let left = runs.iter().map(|run| run.x_start).min().unwrap_or(0);
        let right = runs.iter().map(|run| run.x_end).max().unwrap_or(0);
        let mut n_above = Vec::new();
        for (i, run) in runs.iter().enumerate() {
            let rows = runs.first().map_or(0, |first| run.y.saturating_sub(first.y) as usize + 1);
            n_above.resize(rows.max(n_above.len()), i);
        }
        let measured = Measured {
            runs,
            n_above,
            centroid: [x / area, y / area],
            area,
            columns: [left, right],
        };
        Self(Arc::new(measured))
    }
}

impl FromIterator<MaskRun> for Mask {
    fn from_iter<T: IntoIterator<Item = MaskRun>>(runs: T) -> Self {
        Self::from(runs.into_iter().collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn filled([x1, y1, x2, y2]: [u32; 4]) -> Mask {
        (y1..y2).map(|y| MaskRun { y, x_start: x1, x_end: x2 }).collect()
    }

    #[test]
    fn the_gap_is_that_of_the_pixels() {
        let a = filled([0, 0, 10, 10]);
        assert_eq!(a.gap(&filled([13, 14, 20, 20])), 5.0);
        assert_eq!(a.gap(&filled([10, 3, 20, 5])), 0.0);
        assert_eq!(a.gap(&filled([2, 2, 3, 3])), 0.0);
        // Two diagonals of which the boxes overlap and the pixels do not: 3 rows and 4 columns apart.
        let diagonal =
            |x: u32| (0..20).map(move |y| MaskRun { y, x_start: x + y, x_end: x + y + 1 });
        let (a, b) = (diagonal(0).collect::<Mask>(), diagonal(9).collect::<Mask>());
        assert_eq!([a.gap(&b), b.gap(&a)], [5.0, 5.0]);
    }

    #[test]
    fn middle_and_area_are_those_of_the_pixels() {
        let l_shape = Mask::from([&*filled([0, 0, 2, 2]), &*filled([0, 2, 6, 4])].concat());
        assert_eq!(l_shape.area(), 16.0);
        assert_eq!(l_shape.centroid(), [(4.0 + 36.0) / 16.0, (4.0 + 36.0) / 16.0]);
    }

    proptest! {
        #[test]
        fn the_gap_agrees_with_its_definition(
            a in proptest::collection::vec((0..30_u32, 0..40_u32, 1..6_u32), 1..12),
            b in proptest::collection::vec((0..30_u32, 0..40_u32, 1..6_u32), 1..12),
        ) {
            let runs = |list: Vec<(u32, u32, u32)>| -> Mask {
                let run = |(y, x, n)| MaskRun { y, x_start: x, x_end: x + n };
                let mut runs: Vec<MaskRun> = list.into_iter().map(run).collect();
                runs.sort_unstable();
                Mask::from(runs)
            };
            let (a, b) = (runs(a), runs(b));
            let pixels = |runs: &[MaskRun]| -> Vec<(u32, u32)> {
                runs.iter().flat_map(|r| (r.x_start..r.x_end).map(|x| (x, r.y))).collect()
            };
            let apart = |p: u32, q: u32| f64::from(p.abs_diff(q).saturating_sub(1));
            let all = pixels(&a);
            let all = all.iter().flat_map(|p| pixels(&b).into_iter().map(move |q| (*p, q)));
            let expect = all.map(|(p, q)| apart(p.0, q.0).hypot(apart(p.1, q.1)));
            let expect = expect.fold(f64::INFINITY, f64::min);
            prop_assert!((a.gap(&b) - expect).abs() < 1e-9);
        }
    }

    #[test]
    fn a_mask_without_pixels_is_infinitely_far_away() {
        let nothing = Mask::from(Vec::new());
        assert_eq!(nothing.gap(&filled([0, 0, 1, 1])), f64::INFINITY);
        assert_eq!(filled([0, 0, 1, 1]).gap(&nothing), f64::INFINITY);
    }
}
