//! How far away an object is at the edges of its mask, where pixels may show what lies behind it.
//!
//! Smooth edges, noise, and a depth camera that stands beside the colour camera give the outermost
//! pixels of a mask the depth of something else, or none at all. There the object's own depth is
//! extrapolated from its inside.

use super::DepthView;

/// How far inwards the border between the object and something else is looked for, in pixels.
const BORDER_PX: u32 = 4;
/// From one pixel to the next one depth goes on smoothly when it differs by less, in metres.
const STEP_M: f64 = 0.01;
/// A pixel between two depths is neither of them: what is left of a step at the next pixel, as a
/// share of that step.
const REST_SHARE: f64 = 0.3;
/// Over so many pixels the slope of a surface is measured.
const SLOPE_PX: u32 = 3;
/// An edge with more ends than this share of which depth is not the object's is looked at closely.
const FOREIGN_SHARE_MAX: f64 = 0.05;

/// One end of a row or column of a mask.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// Its outermost pixel: column and row.
    pub(super) pixel: (u32, u32),
    /// The step to the next pixel inwards.
    pub(super) inwards: (i64, i64),
    /// Pixels from this end to the other one, both counted.
    pub(super) length: u32,
}

impl End {
    /// So many pixels away from the object.
    pub(super) fn outwards(&self, pixels: i64) -> (i64, i64) {
        (-pixels * self.inwards.0, -pixels * self.inwards.1)
    }
}

/// The ends that make one edge of a mask, each with the object's depth there.
///
/// `reach_m` is how much the object's own depth may differ between the middle and the end of a row
/// or column. Ends of which the object's depth is nowhere known are left out.
pub(super) fn depths_at(ends: &[End], depth: &DepthView<'_>, reach_m: f64) -> Vec<(End, f64)> {
    let ends: Vec<Sampled<'_>> =
        ends.iter().map(|end| Sampled::new(*end, depth, reach_m)).collect();
    let n_foreign = ends.iter().filter(|end| end.measured().is_none()).count();
    let is_clean = n_foreign as f64 <= FOREIGN_SHARE_MAX * ends.len() as f64;
    let own = |end: &Sampled<'_>| {
        let measured = end.measured().filter(|_| is_clean);
        Some((end.end, measured.or_else(|| end.extrapolated())?))
    };
    ends.iter().filter_map(own).collect()
}

/// An end with the depth image that it is looked up in.
struct Sampled<'a> {
    end: End,
    depth: &'a DepthView<'a>,
    reach_m: f64,
    /// Depth in the middle of its row or column.
    middle_m: Option<f64>,
}

impl<'a> Sampled<'a> {
    fn new(end: End, depth: &'a DepthView<'a>, reach_m: f64) -> Self {
        let mut sampled = Self { end, depth, reach_m, middle_m: None };
        let middle = end.length / 2;
        let around = middle.saturating_sub(2)..(middle + 3).min(end.length);
        let mut values: Vec<f64> = around.filter_map(|k| sampled.at(k)).collect();
        values.sort_unstable_by(f64::total_cmp);
        sampled.middle_m = values.get(values.len() / 2).copied();
        sampled
    }

    /// Depth `k` pixels inwards.
    fn at(&self, k: u32) -> Option<f64> {
        let End { pixel, inwards, length } = self.end;
        let along = |start: u32, step: i64| start.checked_add_signed((step * i64::from(k)) as i32);
        let (x, y) = (along(pixel.0, inwards.0)?, along(pixel.1, inwards.1)?);
        self.depth.at(x, y).filter(|_| k < length)
    }

    /// Whether the object may be that far away here.
    fn is_own(&self, depth_m: f64) -> bool {
        self.middle_m.is_none_or(|middle_m| (depth_m - middle_m).abs() <= self.reach_m)
    }

    /// What was measured at the end itself, if it may be the object's.
    fn measured(&self) -> Option<f64> {
        self.at(0).filter(|depth_m| self.is_own(*depth_m))
    }

    /// The object's depth at the end, as its inside says.
    fn extrapolated(&self) -> Option<f64> {
        let first = self.first_own();
        let inside = (first..=self.end.length / 2).find_map(|k| Some((k, self.at(k)?)));
        let (from, near_m) = inside.filter(|(_, depth_m)| self.is_own(*depth_m)).or_else(|| {
            Some((0, self.middle_m?)) // nothing near the end is the object's
        })?;
        // On a plane the inverse of depth is linear in pixels.
        let far = self
            .at(from + SLOPE_PX)
            .filter(|far_m| from > 0 && (far_m - near_m).abs() < f64::from(SLOPE_PX) * STEP_M);
        let slope = far.map_or(0.0, |far_m| (1.0 / near_m - 1.0 / far_m) / f64::from(SLOPE_PX));
        let inverse = 1.0 / near_m + slope * f64::from(from);
        Some(1.0 / inverse)
            .filter(|depth_m| *depth_m > 0.0 && self.is_own(*depth_m))
            .or(Some(near_m))
    }

    /// How far inwards the first pixel is that shows the object: behind the largest step.
    fn first_own(&self) -> u32 {
        let last = BORDER_PX.min(self.end.length / 4);
        let step = |k: u32| match (self.at(k - 1), self.at(k)) {
            (Some(a), Some(b)) => (a - b).abs(),
            _ => f64::INFINITY,
        };
        let steps = (1..=last).map(|k| (k, step(k))).filter(|(_, step)| *step > STEP_M);
        let largest = steps.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((mut first, largest)) = largest else { return 0 };
        while first < last && step(first + 1) > (REST_SHARE * largest).max(STEP_M) {
            first += 1;
        }
        first
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The depths of one row from its left end, and how far the end itself is taken to be, in
    /// millimetres.
    #[track_caller]
    fn check(row_mm: &[u32], expect_mm: u32) {
        let row: Vec<f32> = row_mm.iter().map(|mm| *mm as f32 / 1e3).collect();
        let depth = DepthView::new(row.len(), 1, &row).unwrap();
        let end = End { pixel: (0, 0), inwards: (1, 0), length: row.len() as u32 };
        let told = depths_at(&[end], &depth, 0.06);
        let [(_, depth_m)] = told.as_slice() else { panic!("{} ends", told.len()) };
        assert!((1e3 * depth_m - f64::from(expect_mm)).abs() < 0.5, "{row_mm:?}: {depth_m}");
    }

    /// A row that goes on as it begins.
    fn row(start_mm: &[u32], then_mm: u32) -> Vec<u32> {
        let mut row = start_mm.to_vec();
        row.resize(24, then_mm);
        row
    }

    #[test]
    fn an_end_that_may_be_the_objects_is_as_measured() {
        check(&row(&[1040, 1025, 1010], 1000), 1040);
    }

    #[test]
    fn what_lies_behind_or_in_front_is_not_the_objects() {
        check(&row(&[1400], 1000), 1000);
        check(&row(&[1400, 1400, 1400], 1000), 1000);
        check(&row(&[800, 800], 1000), 1000);
        check(&row(&[1400, 1150], 1000), 1000); // between the two
    }

    #[test]
    fn a_slope_goes_on_to_the_end() {
        check(&row(&[1400, 1400, 1016, 1012, 1008, 1004], 1000), 1024);
    }

    #[test]
    fn a_hole_is_filled_from_the_inside() {
        check(&row(&[0, 0, 0, 0, 0, 0], 1000), 1000);
        check(&row(&[1400, 0], 1000), 1000);
        let nothing = DepthView::new(24, 1, &[0.0; 24]).unwrap();
        let end = End { pixel: (0, 0), inwards: (1, 0), length: 24 };
        assert!(depths_at(&[end], &nothing, 0.06).is_empty());
    }
}
