//! Pixel masks: how two of them lie to each other, and how they are written beside labelled boxes.

use serde::Deserialize as _;

use super::exemplar::{entries, fault};
use crate::geometry::MaskRun;
use crate::pddl::SourceText;
use crate::perception::model::{Exemplar, ExemplarError};

/// The smallest distance between the pixels of two masks, in pixels; 0 when they touch or overlap.
pub(super) fn gap(a: &[MaskRun], b: &[MaskRun]) -> f64 {
    let (Some(first), Some(last)) = (b.first(), b.last()) else { return f64::INFINITY };
    let left = b.iter().map(|other| other.x_start).min().unwrap_or(0);
    let right = b.iter().map(|other| other.x_end).max().unwrap_or(0);
    let apart = |low: u32, high: u32| f64::from(high.saturating_sub(low));
    let mut nearest = f64::INFINITY;
    let mut look_from = |run: &MaskRun| {
        // No other run is nearer in columns and in rows than these.
        let aside = apart(run.x_end, left).max(apart(right, run.x_start));
        let beyond = apart(run.y + 1, first.y).max(apart(last.y + 1, run.y));
        if aside * aside + beyond * beyond >= nearest {
            return;
        }
        let mut offer = |other: &MaskRun| {
            let dy = apart(run.y.min(other.y) + 1, run.y.max(other.y));
            let dx = apart(run.x_end, other.x_start).max(apart(other.x_end, run.x_start));
            nearest = nearest.min(dx * dx + dy * dy);
            // Later ones are farther in rows.
            aside * aside + dy * dy >= nearest
        };
        let (above, below) = b.split_at(b.partition_point(|other| other.y < run.y));
        let _last_below = below.iter().find(|other| offer(other));
        let _last_above = above.iter().rfind(|other| offer(other));
    };
    // The side that faces the other mask comes first, and most of the rest is too far off then.
    if a.first().is_some_and(|run| run.y < first.y) {
        a.iter().rev().for_each(&mut look_from);
    } else {
        a.iter().for_each(&mut look_from);
    }
    nearest.sqrt()
}

/// The middle of a mask's pixels.
pub(super) fn centroid(mask: &[MaskRun]) -> [f64; 2] {
    let (mut n, mut x, mut y) = (0.0, 0.0, 0.0);
    for run in mask {
        let length = f64::from(run.x_end - run.x_start);
        n += length;
        x += length * f64::midpoint(f64::from(run.x_start), f64::from(run.x_end));
        y += length * (f64::from(run.y) + 0.5);
    }
    [x / n, y / n]
}

/// The number of pixels.
pub(super) fn area(mask: &[MaskRun]) -> f64 {
    mask.iter().map(|run| f64::from(run.x_end - run.x_start)).sum()
}

impl Exemplar {
    /// Gives each object its mask.
    pub(super) fn add_masks(&mut self, text: &SourceText) -> Result<(), ExemplarError> {
        let [width, height] = self.image_size;
        for (name, value) in entries(text)? {
            let fail = fault(&text.name, &name);
            let written = Vec::<[u32; 3]>::deserialize(&value)
                .map_err(|e| fail("a list of [y, x1, x2]", e.to_string()))?;
            let run = |&[y, x_start, x_end]: &[u32; 3]| MaskRun { y, x_start, x_end };
            let runs: Vec<MaskRun> = written.iter().map(run).collect();
            let is_run = |r: &&MaskRun| r.x_start < r.x_end && r.x_end <= width && r.y < height;
            if let Some(bad) = runs.iter().find(|run| !is_run(run)) {
                let expected = format!("[y, x1, x2] with x1 < x2 inside {width} x {height}");
                let got = format!("[{}, {}, {}]", bad.y, bad.x_start, bad.x_end);
                return Err(fail(&expected, got));
            }
            let in_order = |a: &MaskRun, b: &MaskRun| (a.y, a.x_end) <= (b.y, b.x_start);
            if runs.is_empty() || !runs.is_sorted_by(in_order) {
                return Err(fail("runs from top to bottom and left to right", "others".to_owned()));
            }
            let Some(object) = self.objects.iter_mut().find(|object| object.name == name) else {
                return Err(fail("an object that has a box", "none".to_owned()));
            };
            if object.mask.replace(runs.into()).is_some() {
                return Err(fail("one mask per object", "two".to_owned()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::geometry::PixelBox;
    use crate::pddl::Typed;

    fn filled([x1, y1, x2, y2]: [u32; 4]) -> Vec<MaskRun> {
        (y1..y2).map(|y| MaskRun { y, x_start: x1, x_end: x2 }).collect()
    }

    #[test]
    fn the_gap_is_that_of_the_pixels() {
        let a = filled([0, 0, 10, 10]);
        assert_eq!(gap(&a, &filled([13, 14, 20, 20])), 5.0);
        assert_eq!(gap(&a, &filled([10, 3, 20, 5])), 0.0);
        assert_eq!(gap(&a, &filled([2, 2, 3, 3])), 0.0);
        // Two diagonals of which the boxes overlap and the pixels do not: 3 rows and 4 columns apart.
        let diagonal =
            |x: u32| (0..20).map(move |y| MaskRun { y, x_start: x + y, x_end: x + y + 1 });
        let (a, b) = (diagonal(0).collect::<Vec<_>>(), diagonal(9).collect::<Vec<_>>());
        assert_eq!([gap(&a, &b), gap(&b, &a)], [5.0, 5.0]);
    }

    #[test]
    fn middle_and_area_are_those_of_the_pixels() {
        let l_shape = [filled([0, 0, 2, 2]), filled([0, 2, 6, 4])].concat();
        assert_eq!(area(&l_shape), 16.0);
        assert_eq!(centroid(&l_shape), [(4.0 + 36.0) / 16.0, (4.0 + 36.0) / 16.0]);
    }

    proptest! {
        #[test]
        fn the_gap_agrees_with_its_definition(
            a in proptest::collection::vec((0..30_u32, 0..40_u32, 1..6_u32), 1..12),
            b in proptest::collection::vec((0..30_u32, 0..40_u32, 1..6_u32), 1..12),
        ) {
            let runs = |list: Vec<(u32, u32, u32)>| {
                let run = |(y, x, n)| MaskRun { y, x_start: x, x_end: x + n };
                let mut runs: Vec<MaskRun> = list.into_iter().map(run).collect();
                runs.sort_unstable();
                runs
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
            prop_assert!((gap(&a, &b) - expect).abs() < 1e-9);
        }
    }

    #[test]
    fn bad_masks_name_file_and_object() {
        let boxes = [("a".into(), PixelBox::from([1.0, 1.0, 5.0, 5.0]))];
        let declared = [Typed::new("a", "block")];
        let made = Exemplar::new("b.json", [8, 6], &boxes, (&declared, BTreeSet::new())).unwrap();
        let read = |text: &str| made.clone().add_masks(&SourceText::new("m.json", text));
        read(r#"{"a": [[1, 1, 3], [1, 4, 5], [2, 1, 5]]}"#).unwrap();
        for (text, expect) in [
            (r#"{"a": [[1, 1, 9]]}"#, "m.json: a: expected [y, x1, x2] with x1 < x2 inside 8 x 6"),
            (r#"{"a": [[6, 1, 2]]}"#, "got [6, 1, 2]"),
            (r#"{"a": [[2, 1, 2], [1, 1, 2]]}"#, "from top to bottom"),
            (r#"{"a": []}"#, "from top to bottom"),
            (r#"{"b": [[1, 1, 2]]}"#, "m.json: b: expected an object that has a box"),
            (r#"{"a": [[1, -1, 2]]}"#, "m.json: a: expected a list of [y, x1, x2]"),
            (r#"{"a": [[1, 1, 2]], "a": [[1, 1, 2]]}"#, "m.json: a: expected one mask per object"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expect), "{error}");
        }
    }
}
