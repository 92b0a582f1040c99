//! Connected regions of a binary image, as row runs.

use super::bitmask::BitMask;
use crate::geometry::{MaskRun, PixelBox};

/// The two ways to cut a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    /// Between rows.
    Rows,
    /// Between columns.
    Columns,
}

/// A connected set of pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Region {
    /// Its pixels, top to bottom and left to right; never empty.
    pub(super) runs: Vec<MaskRun>,
}

impl Region {
    /// The number of pixels.
    pub(super) fn area(&self) -> usize {
        self.runs.iter().map(|r| (r.x_end - r.x_start) as usize).sum()
    }

    /// The tight box around the pixels.
    pub(super) fn pixel_box(&self) -> PixelBox {
        let x1 = self.runs.iter().map(|r| r.x_start).min().unwrap_or(0);
        let x2 = self.runs.iter().map(|r| r.x_end).max().unwrap_or(0);
        let y1 = self.runs.first().map_or(0, |r| r.y);
        let y2 = self.runs.last().map_or(0, |r| r.y + 1);
        PixelBox::from([x1, y1, x2, y2].map(f64::from))
    }

    /// Both regions as one.
    pub(super) fn joined(mut self, other: Self) -> Self {
        self.runs.extend(other.runs);
        self.runs.sort_unstable();
        self
    }

    /// Leftmost column and one past the rightmost column of each row from the first to the last;
    /// an empty row has `None`.
    pub(super) fn row_extents(&self) -> Vec<Option<[u32; 2]>> {
        let (Some(first), Some(last)) = (self.runs.first(), self.runs.last()) else {
            return Vec::new();
        };
        let mut rows: Vec<Option<[u32; 2]>> = vec![None; (last.y - first.y + 1) as usize];
        for run in &self.runs {
            let row = &mut rows[(run.y - first.y) as usize];
            let [x1, x2] = row.unwrap_or([run.x_start, run.x_end]);
            *row = Some([x1.min(run.x_start), x2.max(run.x_end)]);
        }
        rows
    }

    /// Cuts the region before rows (or columns) counted from its first one; empty parts are left out.
    pub(super) fn cut(self, before: &[usize], between: Axis) -> Vec<Self> {
        if before.is_empty() {
            return vec![self];
        }
        let b = self.pixel_box();
        let origin = if between == Axis::Rows { b.y1 } else { b.x1 } as u32;
        let limits: Vec<u32> = before.iter().map(|at| origin + *at as u32).collect();
        let mut parts: Vec<Vec<MaskRun>> = vec![Vec::new(); limits.len() + 1];
        for run in self.runs {
            if between == Axis::Rows {
                parts[limits.partition_point(|limit| *limit <= run.y)].push(run);
                continue;
            }
            let mut x_start = run.x_start;
            while x_start < run.x_end {
                let part = limits.partition_point(|limit| *limit <= x_start);
                let x_end = limits.get(part).map_or(run.x_end, |limit| run.x_end.min(*limit));
                parts[part].push(MaskRun { x_start, x_end, ..run });
                x_start = x_end;
            }
        }
        parts.into_iter().filter(|runs| !runs.is_empty()).map(|runs| Self { runs }).collect()
    }

    /// Cuts the region above a row; an empty part is left out.
    pub(super) fn cut_above(self, row: u32) -> Vec<Self> {
        let (above, below) = self.runs.into_iter().partition(|run| run.y < row);
        [above, below]
            .into_iter()
            .filter(|p: &Vec<_>| !p.is_empty())
            .map(|runs| Self { runs })
            .collect()
    }
}

/// The regions of pixels that touch, also by a corner, in the order of their first pixel.
pub(super) fn regions(mask: &BitMask) -> Vec<Region> {
    let mut runs: Vec<MaskRun> = Vec::new();
    let mut parents: Vec<usize> = Vec::new();
    let mut above = 0..0;
    for y in 0..mask.height() {
        let start = runs.len();
        row_runs(mask.row(y), y as u32, &mut runs);
        parents.extend(start..runs.len());
        let mut next = above.start;
        for i in start..runs.len() {
            // Runs above that end before this one starts cannot touch later ones either.
            while next < above.end && runs[next].x_end < runs[i].x_start {
                next += 1;
            }
            let mut j = next;
            while j < above.end && runs[j].x_start <= runs[i].x_end {
                union(&mut parents, i, j);
                j += 1;
            }
        }
        above = start..runs.len();
    }
    let mut found: Vec<Region> = Vec::new();
    let mut region_of_root = vec![usize::MAX; runs.len()];
    for (i, run) in runs.iter().enumerate() {
        let root = root(&mut parents, i);
        if region_of_root[root] == usize::MAX {
            region_of_root[root] = found.len();
            found.push(Region { runs: Vec::new() });
        }
        found[region_of_root[root]].runs.push(*run);
    }
    found
}

fn row_runs(words: &[u64], y: u32, runs: &mut Vec<MaskRun>) {
    let mut open: Option<u32> = None;
    for (i, &word) in words.iter().enumerate() {
        if word == 0 && open.is_none() {
            continue;
        }
        let base = 64 * i as u32;
        let mut at = 0;
        while at < 64 {
            let rest = word >> at;
            if let Some(x_start) = open {
                let n = rest.trailing_ones().min(64 - at);
                at += n;
                if at < 64 {
                    runs.push(MaskRun { y, x_start, x_end: base + at });
                    open = None;
                }
            } else if rest == 0 {
                break;
            } else {
                at += rest.trailing_zeros();
                open = Some(base + at);
            }
        }
    }
    if let Some(x_start) = open {
        runs.push(MaskRun { y, x_start, x_end: 64 * words.len() as u32 });
    }
}

fn root(parents: &mut [usize], mut i: usize) -> usize {
    while parents[i] != i {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    i
}

fn union(parents: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(parents, a), root(parents, b));
    // The earlier run stays the root, so that regions come in the order of their first pixel.
    parents[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn mask_of(width: usize, bits: &[bool]) -> BitMask {
        let mut mask = BitMask::new(width, bits.len() / width);
        for (i, _) in bits.iter().enumerate().filter(|(_, b)| **b) {
            mask.set(i % width, i / width);
        }
        mask
    }

    #[test]
    fn a_ring_is_one_region_and_its_inside_another() {
        let rows = ["#######", "#.....#", "#..#..#", "#.....#", "#######"];
        let bits: Vec<bool> = rows.concat().bytes().map(|b| b == b'#').collect();
        let found = regions(&mask_of(7, &bits));
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].area(), 20);
        assert_eq!(found[1].pixel_box(), PixelBox::from([3.0, 2.0, 4.0, 3.0]));
    }

    #[test]
    fn cutting_keeps_every_pixel() {
        let found = regions(&mask_of(3, &[true; 15]));
        let parts = found[0].clone().cut_above(2);
        let heights: Vec<f64> = parts.iter().map(|p| p.pixel_box().height()).collect();
        assert_eq!(heights, [2.0, 3.0]);
        let widths = |parts: Vec<Region>| -> Vec<f64> {
            parts.iter().map(|p| p.pixel_box().width()).collect()
        };
        assert_eq!(widths(found[0].clone().cut(&[1], Axis::Columns)), [1.0, 2.0]);
        assert_eq!(
            found[0].clone().cut(&[1, 4], Axis::Rows).iter().map(Region::area).sum::<usize>(),
            15
        );
    }

    proptest! {
        /// Every pixel is in exactly one region, and pixels that touch are in the same one.
        #[test]
        fn regions_partition_the_pixels(bits in proptest::collection::vec(any::<bool>(), 130 * 6)) {
            let mask = mask_of(130, &bits);
            let mut owner = vec![usize::MAX; bits.len()];
            let found = regions(&mask);
            for (i, region) in found.iter().enumerate() {
                for run in &region.runs {
                    for x in run.x_start..run.x_end {
                        let pixel = run.y as usize * 130 + x as usize;
                        prop_assert!(bits[pixel] && owner[pixel] == usize::MAX);
                        owner[pixel] = i;
                    }
                }
            }
            prop_assert_eq!(found.iter().map(Region::area).sum::<usize>(), mask.count());
            for (y, x) in (0..5).flat_map(|y| (0..129).map(move |x| (y, x))) {
                for (a, b) in [((y, x), (y, x + 1)), ((y, x), (y + 1, x)),
                               ((y, x), (y + 1, x + 1)), ((y, x + 1), (y + 1, x))] {
                    let (a, b) = (a.0 * 130 + a.1, b.0 * 130 + b.1);
                    prop_assert!(!(bits[a] && bits[b]) || owner[a] == owner[b]);
                }
            }
        }
    }
}
