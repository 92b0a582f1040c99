//! Which pixels of a box are the object's, for detectors that give boxes only: those that are
//! about as far away as its middle.

use super::DepthView;
use crate::geometry::{CameraModel, MaskRun, PixelBox};

/// The pixels of a box that are within the object's reach of the middle's depth: an object is
/// taken to be about as deep as it is wide. In each row the run from the first to the last of them;
/// none without depth in the middle.
pub(super) fn mask_of_box(
    pixel_box: &PixelBox,
    depth: &DepthView<'_>,
    camera: &CameraModel,
) -> Vec<MaskRun> {
    let edge = |v: f64| v.round().max(0.0) as u32;
    let (columns, rows) =
        (edge(pixel_box.x1)..edge(pixel_box.x2), edge(pixel_box.y1)..edge(pixel_box.y2));
    let quarter = |range: &std::ops::Range<u32>| {
        let n = range.len() as u32 / 4;
        range.start + n..range.end.saturating_sub(n)
    };
    // A detector may give a box that is far larger than the image.
    let [n_columns, n_rows] = depth.size();
    let within = |range: &std::ops::Range<u32>, n: u32| range.start..range.end.min(n);
    let middle_columns = within(&quarter(&columns), n_columns);
    let middle_rows = within(&quarter(&rows), n_rows);
    let (columns, rows) = (within(&columns, n_columns), within(&rows, n_rows));
    let mut middle: Vec<f64> = middle_rows
        .flat_map(|y| middle_columns.clone().filter_map(move |x| depth.at(x, y)))
        .collect();
    if middle.is_empty() {
        return Vec::new();
    }
    let n_middle = middle.len();
    let (_, middle_m, _) = middle.select_nth_unstable_by(n_middle / 2, f64::total_cmp);
    let middle_m = *middle_m;
    let reach_m = pixel_box.width() * middle_m / camera.intrinsics.fx;
    let is_own = |x: u32, y: u32| depth.at(x, y).is_some_and(|d| (d - middle_m).abs() <= reach_m);
    let run = |y: u32| {
        let x_start = columns.clone().find(|x| is_own(*x, y))?;
        let x_end = columns.clone().rev().find(|x| is_own(*x, y))? + 1;
        Some(MaskRun { y, x_start, x_end })
    };
    rows.filter_map(run).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::geometry::Intrinsics;

    /// A disc half a metre away before a wall two metres away, with a hole in the depth.
    #[test]
    fn the_wall_behind_is_left_out() {
        let (width, height) = (40, 30);
        let mut depth_m = vec![2.0_f32; width * height];
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let (dx, dy) = (x as f64 - 20.0, y as f64 - 15.0);
            if dx.hypot(dy) <= 8.0 {
                depth_m[y * width + x] = 0.5;
            }
        }
        depth_m[15 * width + 20] = 0.0;
        let depth = DepthView::new(width, height, &depth_m).unwrap();
        let camera = CameraModel {
            intrinsics: Intrinsics { fx: 40.0, fy: 40.0, cx: 20.0, cy: 15.0 },
            world_from_camera: Isometry3::identity(),
        };
        let mask = mask_of_box(&PixelBox::from([11.6, 6.8, 29.2, 24.0]), &depth, &camera);
        assert_eq!(mask.first(), Some(&MaskRun { y: 7, x_start: 20, x_end: 21 }));
        assert_eq!(mask.get(8), Some(&MaskRun { y: 15, x_start: 12, x_end: 29 }));
        assert_eq!(mask.len(), 17);
        assert!(mask_of_box(&PixelBox::from([60.0, 1.0, 70.0, 9.0]), &depth, &camera).is_empty());
    }
}
