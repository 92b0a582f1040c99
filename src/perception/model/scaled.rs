//! Labelled examples as the same camera shows them at another resolution.

use crate::geometry::{Mask, MaskRun, PixelBox};
use crate::mismatch::Mismatch;
use crate::perception::model::{Exemplar, ObjectBox};

/// Ratios of width to height that differ by at most this share are one: cameras round their sizes.
pub const RATIO_OFF_MAX: f64 = 0.02;

/// An image has another ratio of width to height than the labelled example, which can then not be
/// scaled to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherRatio {
    /// Width and height of the example's image, in pixels.
    pub example: [u32; 2],
    /// Width and height of the other image, in pixels.
    pub image: [u32; 2],
}

impl OtherRatio {
    /// What was expected, what is there, and what to do; `at` is where the image comes from.
    pub fn mismatch(self, at: &str) -> Mismatch {
        let [width, height] = self.example;
        let expected = format!(
            "{width}x{height} pixels like the labelled example, or another size of its ratio ({:.3})",
            ratio(self.example)
        );
        let [width, height] = self.image;
        let got = format!(
            "{width}x{height} ({:.3}): crop to that ratio, or label an example of this camera",
            ratio(self.image)
        );
        Mismatch::new(at, expected, got)
    }
}

fn ratio([width, height]: [u32; 2]) -> f64 {
    f64::from(width) / f64::from(height)
}

impl Exemplar {
    /// The example as an image of another size shows it: boxes and masks in the pixels of that image;
    /// volumes stay. At its own size it is the same.
    ///
    /// # Errors
    /// [`OtherRatio`] when the ratios of width to height differ by more than [`RATIO_OFF_MAX`].
    pub fn scaled_to(&self, image_size: [u32; 2]) -> Result<Self, OtherRatio> {
        let own = self.image_size;
        let is_one_ratio = (ratio(image_size) / ratio(own) - 1.0).abs() <= RATIO_OFF_MAX;
        if !is_one_ratio {
            return Err(OtherRatio { example: own, image: image_size });
        }
        if image_size == own {
            return Ok(self.clone());
        }
        let scaled = |object: &ObjectBox| ObjectBox {
            pixel_box: scaled_box(&object.pixel_box, own, image_size),
            mask: object.mask.as_ref().map(|mask| scaled_mask(mask, own, image_size)),
            ..object.clone()
        };
        let objects = self.objects.iter().map(scaled).collect();
        Ok(Self { image_size, objects, ..self.clone() })
    }
}

/// Multiplied before it is divided: what lies inside one image lies inside the other.
fn scaled_box(b: &PixelBox, from: [u32; 2], to: [u32; 2]) -> PixelBox {
    let along = |axis: usize, v: f64| v * f64::from(to[axis]) / f64::from(from[axis]);
    PixelBox { x1: along(0, b.x1), y1: along(1, b.y1), x2: along(0, b.x2), y2: along(1, b.y2) }
}

/// The pixels whose middles lie in a pixel of the mask; of a mask that is too thin for that, the one
/// in its middle.
fn scaled_mask(mask: &Mask, from: [u32; 2], to: [u32; 2]) -> Mask {
    // The first pixel whose middle is at or beyond an edge of the other image.
    let first = |axis: usize, edge: u32| {
        let [from, to] = [from[axis], to[axis]].map(u64::from);
        let at = (2 * u64::from(edge) * to).saturating_sub(from).div_ceil(2 * from);
        u32::try_from(at.min(to)).unwrap_or(u32::MAX)
    };
    let mut runs: Vec<MaskRun> = Vec::new();
    for of_row in mask.chunk_by(|a, b| a.y == b.y) {
        let Some(y) = of_row.first().map(|run| run.y) else { continue };
        let columns = of_row.iter().map(|run| (first(0, run.x_start), first(0, run.x_end)));
        let columns: Vec<(u32, u32)> = columns.filter(|(start, end)| start < end).collect();
        for y in first(1, y)..first(1, y + 1) {
            runs.extend(columns.iter().map(|&(x_start, x_end)| MaskRun { y, x_start, x_end }));
        }
    }
    if runs.is_empty() {
        let middle = mask.centroid();
        let [x, y] = [0, 1].map(|axis| {
            let at = middle[axis] * f64::from(to[axis]) / f64::from(from[axis]);
            (at as u32).min(to[axis].saturating_sub(1))
        });
        runs.push(MaskRun { y, x_start: x, x_end: x + 1 });
    }
    runs.into()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Aabb;

    fn filled([x1, y1, x2, y2]: [u32; 4]) -> Mask {
        (y1..y2).map(|y| MaskRun { y, x_start: x1, x_end: x2 }).collect()
    }

    fn example() -> Exemplar {
        let mut a =
            ObjectBox::new("a".into(), "block".into(), PixelBox::from([4.0, 6.0, 20.0, 48.0]));
        a.mask = Some(filled([4, 6, 20, 48]));
        a.volume =
            serde_json::from_str::<Aabb>(r#"{"centre": [0, 0, 1], "extent": [1, 1, 2]}"#).ok();
        let name = "example".to_owned();
        Exemplar { name, image_size: [64, 48], objects: vec![a], init: BTreeSet::new() }
    }

    #[test]
    fn boxes_and_masks_are_scaled_and_volumes_stay() {
        let own = example();
        assert!(own.objects[0].volume.is_some());
        for (size, edges) in [
            ([32, 24], [2.0, 3.0, 10.0, 24.0]),
            ([96, 72], [6.0, 9.0, 30.0, 72.0]),
            ([192, 144], [12.0, 18.0, 60.0, 144.0]),
        ] {
            let scaled = own.scaled_to(size).unwrap();
            let object = &scaled.objects[0];
            assert_eq!(<[f64; 4]>::from(object.pixel_box), edges);
            assert_eq!(object.mask, Some(filled(edges.map(|v| v as u32))), "{size:?}");
            assert_eq!((scaled.image_size, object.volume), (size, own.objects[0].volume));
        }
        assert_eq!(own.scaled_to([64, 48]), Ok(own));
    }

    #[test]
    fn a_ratio_that_is_off_by_a_little_is_rounding_and_by_more_another_camera() {
        let own = example();
        let scaled = own.scaled_to([97, 72]).unwrap(); // 1 % wider
        assert_eq!(<[f64; 4]>::from(scaled.objects[0].pixel_box), [6.0625, 9.0, 30.3125, 72.0]);
        for size in [[98, 72], [64, 36], [48, 64], [0, 48], [64, 0], [0, 0]] {
            let other = own.scaled_to(size).unwrap_err();
            assert_eq!(other, OtherRatio { example: [64, 48], image: size });
        }
        let said = own.scaled_to([64, 36]).unwrap_err().mismatch("x.png").to_string();
        let expected = "x.png: expected 64x48 pixels like the labelled example, or another size of its \
                        ratio (1.333), got 64x36 (1.778): crop to that ratio, or label an example of \
                        this camera";
        assert_eq!(said, expected);
    }

    #[test]
    fn a_mask_that_is_too_thin_keeps_a_pixel() {
        let thin = filled([40, 10, 41, 11]);
        assert_eq!(scaled_mask(&thin, [64, 48], [16, 12]), filled([10, 2, 11, 3]));
        let corner = filled([63, 47, 64, 48]);
        assert_eq!(scaled_mask(&corner, [64, 48], [16, 12]), filled([15, 11, 16, 12]));
    }

    proptest! {
        /// What lies inside the image does so at every size, and masks keep their order.
        #[test]
        fn nothing_leaves_the_image(
            (width, height) in (1..2000_u32, 1..2000_u32),
            scale in 0.05..8.0_f64,
            (left, top) in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let size = [width, height].map(|v| ((f64::from(v) * scale).round() as u32).max(1));
            let full = PixelBox::from([0.0, 0.0, f64::from(width), f64::from(height)]);
            let [w, h] = size.map(f64::from);
            prop_assert_eq!(<[f64; 4]>::from(scaled_box(&full, [width, height], size)), [0.0, 0.0, w, h]);
            let x = ((left * f64::from(width)) as u32).min(width - 1);
            let y = ((top * f64::from(height)) as u32).min(height - 1);
            let runs = [(x, width), (0, x)].map(|(x_start, x_end)| MaskRun { y, x_start, x_end });
            let runs: Vec<MaskRun> = runs.into_iter().rev().filter(|r| r.x_start < r.x_end).collect();
            let scaled = scaled_mask(&runs.into(), [width, height], size);
            prop_assert!(!scaled.is_empty());
            prop_assert!(scaled.iter().all(|r| r.x_start < r.x_end && r.x_end <= size[0] && r.y < size[1]));
            prop_assert!(scaled.is_sorted_by(|a, b| (a.y, a.x_end) <= (b.y, b.x_start)));
        }
    }
}
