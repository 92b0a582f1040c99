//! Masks of models of the YOLO family: weighted sums of prototypes.

use super::description::InputSpec;
use super::input::Fit;
use super::tensor::Tensor;
use crate::geometry::{MaskRun, PixelBox};
use crate::mismatch::listed;

/// What masks are made of: `K` maps of h x w values over the model's input. An object is where the sum
/// of its weights times the maps is positive.
#[derive(Debug, PartialEq)]
pub(super) struct Prototypes<'a> {
    maps: Vec<&'a [f32]>,
    h: usize,
    w: usize,
}

impl<'a> Prototypes<'a> {
    /// # Errors
    /// The tensor is not of that shape.
    pub(super) fn new(tensor: &'a Tensor) -> Result<Self, String> {
        match *tensor.shape.as_slice() {
            [1, k, h, w] if k * h * w == tensor.values.len() && k * h * w > 0 => {
                Ok(Self { maps: tensor.values.chunks_exact(h * w).collect(), h, w })
            }
            _ => {
                let got = listed(&tensor.shape);
                Err(format!("masks: expected shape [1, K, h, w], got {got}"))
            }
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.maps.len()
    }

    /// The pixels of an object in the frame, within its box.
    pub(super) fn mask(
        &self,
        weights: &[f32],
        pixel_box: &PixelBox,
        (fit, input): (Fit, &InputSpec),
    ) -> Vec<MaskRun> {
        let PixelBox { x1, y1, x2, y2 } = *pixel_box;
        // Middles of pixels and of cells lie at halves.
        let factors = [self.w as f64 / input.width as f64, self.h as f64 / input.height as f64];
        let at = |x: f64, y: f64| {
            let [x, y] = fit.to_input([x + 0.5, y + 0.5]);
            [x * factors[0] - 0.5, y * factors[1] - 0.5]
        };
        let sums = self.sums(weights, at(x1 - 0.5, y1 - 0.5), at(x2 - 0.5, y2 - 0.5));
        let columns = || pixels(x1, x2);
        let mut runs: Vec<MaskRun> = Vec::new();
        for y in pixels(y1, y2) {
            let mut run: Option<MaskRun> = None;
            for x in columns() {
                if sums.between(at(f64::from(x), f64::from(y))) > 0.0 {
                    run.get_or_insert(MaskRun { y, x_start: x, x_end: x }).x_end = x + 1;
                } else {
                    runs.extend(run.take());
                }
            }
            runs.extend(run);
        }
        runs
    }

    /// The weighted sums of the cells around a part of the maps.
    fn sums(&self, weights: &[f32], from: [f64; 2], to: [f64; 2]) -> Sums {
        let cell = |value: f64, n: usize| (value.max(0.0) as usize).min(n - 1);
        let (x0, y0) = (cell(from[0].floor(), self.w), cell(from[1].floor(), self.h));
        let (x1, y1) = (cell(to[0].ceil(), self.w), cell(to[1].ceil(), self.h));
        let cells = (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (x, y)));
        let sum = |(x, y): (usize, usize)| {
            let terms = self.maps.iter().zip(weights);
            terms.map(|(map, weight)| map[y * self.w + x] * weight).sum::<f32>()
        };
        Sums { corner: [x0, y0], w: x1 + 1 - x0, h: y1 + 1 - y0, values: cells.map(sum).collect() }
    }
}

/// The pixels whose middles are between two edges.
fn pixels(from: f64, to: f64) -> std::ops::Range<u32> {
    (from - 0.5).ceil().max(0.0) as u32..(to - 0.5).ceil().max(0.0) as u32
}

/// Weighted sums of prototypes in a part of the maps.
struct Sums {
    /// Column and row of the first.
    corner: [usize; 2],
    w: usize,
    h: usize,
    values: Vec<f32>,
}

impl Sums {
    /// The value between the cells around a place; beyond the last cells it is theirs.
    fn between(&self, [x, y]: [f64; 2]) -> f32 {
        let x = (x - self.corner[0] as f64).clamp(0.0, (self.w - 1) as f64);
        let y = (y - self.corner[1] as f64).clamp(0.0, (self.h - 1) as f64);
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.w - 1), (y0 + 1).min(self.h - 1));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let at = |x: usize, y: usize| self.values.get(y * self.w + x).copied().unwrap_or(f32::NAN);
        let above = at(x0, y0) + (at(x1, y0) - at(x0, y0)) * fx;
        let below = at(x0, y1) + (at(x1, y1) - at(x0, y1)) * fx;
        above + (below - above) * fy
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::pddl::Name;
    use crate::perception::ImageView;
    use crate::perception::detectors::onnx::description::Description;
    use crate::perception::detectors::onnx::description::tests::SMALL;

    /// Three maps of 4 x 4: one that falls from left to right, one that is 1 everywhere, one that
    /// falls from top to bottom.
    fn maps() -> Tensor {
        let falling = [3.0, 1.0, -1.0, -3.0];
        let down = falling.map(|value| [value; 4]).concat();
        let values = [falling.repeat(4), vec![1.0; 16], down].concat();
        Tensor { shape: vec![1, 3, 4, 4], values }
    }

    #[track_caller]
    fn check(weights: [f32; 3], edges: [f64; 4], expect: &[(u32, u32, u32)]) {
        // A frame of 16 x 8 in the middle of an input of 8 x 8.
        let description = Description::parse(SMALL, &BTreeSet::from([Name::new("block")])).unwrap();
        let rgb = vec![0; 3 * 16 * 8];
        let fit = Fit::new(&description.input, &ImageView::new(16, 8, &rgb).unwrap());
        let maps = maps();
        let prototypes = Prototypes::new(&maps).unwrap();
        let mask = prototypes.mask(&weights, &PixelBox::from(edges), (fit, &description.input));
        let runs: Vec<_> = mask.iter().map(|run| (run.y, run.x_start, run.x_end)).collect();
        assert_eq!(runs, expect, "{weights:?} {edges:?}");
    }

    #[test]
    fn an_object_is_where_the_weighted_sum_is_positive_within_its_box() {
        // Four columns of the frame are a cell; the falling map changes its sign in the middle.
        check([1.0, 0.0, 0.0], [2.0, 1.0, 12.0, 3.0], &[(1, 2, 8), (2, 2, 8)]);
        check([-1.0, 0.0, 0.0], [2.0, 1.0, 12.0, 3.0], &[(1, 8, 12), (2, 8, 12)]);
        check([0.0, 0.0, 1.0], [0.0, 2.0, 4.0, 7.0], &[(2, 0, 4), (3, 0, 4)]);
        check([0.0, 0.0, -1.0], [0.0, 2.0, 4.0, 5.0], &[(4, 0, 4)]);
        // Two more for everything: the sign changes a cell further to the right.
        check([1.0, 2.0, 0.0], [0.0, 7.0, 16.0, 8.0], &[(7, 0, 12)]);
        check([0.0, -1.0, 0.0], [0.0, 0.0, 16.0, 8.0], &[]);
        check([f32::NAN, 1.0, 0.0], [0.0, 0.0, 16.0, 8.0], &[]);
        // Pixels whose middles are in the box.
        check([0.0, 1.0, 0.0], [2.4, 3.6, 4.6, 5.0], &[(4, 2, 5)]);
        check([0.0, 1.0, 0.0], [3.6, 3.6, 4.4, 4.4], &[]);
    }
}
