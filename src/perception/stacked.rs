//! Bodies of one look and one size that stand on one another: their detection is as high as several.
//!
//! In the image a stack is told from a near or large body by its shape only (`detectors/colour`);
//! depth tells how high it is in the world.

use nalgebra::Point3;

use super::{BoxEstimate, Detection};
use crate::geometry::{CameraModel, MaskRun, PixelBox};

/// How far a height may be from that of so many bodies, as a share of one.
const OFF_MAX: f64 = 0.3;
/// Widths of a stack of bodies that do not stand quite above one another, as a share of one's.
const WIDTH_SHARE: [f64; 2] = [0.7, 1.6];
/// Most bodies that a detection is parted into.
const BODIES_MAX: f64 = 16.0;

/// Parts detections that are as high as several objects of their type, and as wide as one; what is
/// new is not measured yet. Those without a mask, or whose lower end is hidden, stay as they are.
pub(super) fn part_stacks(camera: &CameraModel, detections: &mut Vec<Detection>) {
    let parted = std::mem::take(detections).into_iter().flat_map(|detection| {
        let parts = rows_between(&detection, camera).map(|rows| parted(&detection, &rows));
        parts.filter(|parts| parts.len() > 1).unwrap_or_else(|| vec![detection])
    });
    *detections = parted.collect();
}

/// The first rows of the bodies below the uppermost one, from the top; `None` for a single one.
fn rows_between(detection: &Detection, camera: &CameraModel) -> Option<Vec<f64>> {
    let BoxEstimate { volume, cut, heading } = detection.measured?;
    let usual = detection.usual_extent?;
    let height = volume.extent[2] / usual[2];
    let n = height.round();
    let is_one_wide = |axis: usize| {
        let share = volume.extent[axis] / usual[axis];
        (WIDTH_SHARE[0]..=WIDTH_SHARE[1]).contains(&share)
    };
    let is_stack = (2.0..=BODIES_MAX).contains(&n) && (height - n).abs() <= OFF_MAX;
    if cut.bottom || !is_stack || !(is_one_wide(0) && is_one_wide(1)) {
        return None;
    }
    let middle = heading.view_from_world(volume.centre);
    let front = middle.y - volume.extent[1] / 2.0;
    let row = |i: u32| {
        let z = volume.top_z() - f64::from(i) * volume.extent[2] / n;
        Some(camera.project(heading.world_from_view(Point3::new(middle.x, front, z)))?.y)
    };
    (1..n as u32).map(row).collect()
}

/// The parts of a detection between rows; those without a pixel are none.
fn parted(detection: &Detection, rows: &[f64]) -> Vec<Detection> {
    let part = |i: usize| {
        let from = i.checked_sub(1).and_then(|before| rows.get(before)).copied();
        let (from, to) = (from.unwrap_or(0.0), rows.get(i).copied().unwrap_or(f64::INFINITY));
        let is_within = |run: &&MaskRun| (from..to).contains(&f64::from(run.y));
        let mask: Vec<MaskRun> = detection.mask.iter().filter(is_within).copied().collect();
        let pixel_box = bounds(&mask)?;
        Some(Detection { pixel_box, mask, measured: None, ..detection.clone() })
    };
    (0..=rows.len()).filter_map(part).collect()
}

/// The box around pixels that are in order from the top.
fn bounds(mask: &[MaskRun]) -> Option<PixelBox> {
    let (first, last) = (mask.first()?, mask.last()?);
    let left = mask.iter().map(|run| run.x_start).min()?;
    let right = mask.iter().map(|run| run.x_end).max()?;
    Some(PixelBox::from([left, first.y, right, last.y + 1].map(f64::from)))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Rotation3, Vector3};

    use super::*;
    use crate::geometry::{Aabb, Intrinsics};
    use crate::perception::TruncatedSides;
    use crate::perception::box_estimate::Heading;

    /// A level camera that looks along y, a metre away: a metre is 500 pixels, z = 0 lies above row 240.
    fn camera() -> CameraModel {
        let axes = Rotation3::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        CameraModel {
            intrinsics: Intrinsics { fx: 500.0, fy: 500.0, cx: 319.5, cy: 239.5 },
            world_from_camera: Isometry3::from_parts(
                Vector3::new(0.0, -1.0, 0.0).into(),
                nalgebra::UnitQuaternion::from_rotation_matrix(&axes),
            ),
        }
    }

    /// Something red that stands on z = 0, its front a metre away, among blocks of 5 cm.
    fn detection(width_m: f64, height_m: f64) -> Detection {
        let row = |y: u32| MaskRun { y, x_start: 300, x_end: 300 + (500.0 * width_m) as u32 };
        let mask: Vec<MaskRun> = (240 - (500.0 * height_m) as u32..240).map(row).collect();
        let volume = Aabb {
            centre: Point3::new(0.0, width_m / 2.0, height_m / 2.0),
            extent: [width_m, width_m, height_m],
        };
        let measured =
            BoxEstimate { volume, cut: TruncatedSides::default(), heading: Heading([0.0, 1.0]) };
        Detection {
            pixel_box: bounds(&mask).unwrap(),
            mask,
            measured: Some(measured),
            usual_extent: Some([0.05; 3]),
            ..Detection::new("block".into(), "red".into(), PixelBox::from([0.0; 4]))
        }
    }

    fn rows(detection: Detection) -> Vec<[f64; 2]> {
        let mut detections = vec![detection];
        part_stacks(&camera(), &mut detections);
        detections.iter().map(|part| [part.pixel_box.y1, part.pixel_box.y2]).collect()
    }

    #[test]
    fn what_is_as_high_as_several_is_so_many() {
        assert_eq!(rows(detection(0.05, 0.10)), [[190.0, 215.0], [215.0, 240.0]]);
        assert_eq!(rows(detection(0.06, 0.152)).len(), 3, "they stand a little apart");
    }

    #[test]
    fn one_that_is_wide_or_a_little_high_stays_one() {
        for (width_m, height_m) in [(0.05, 0.05), (0.05, 0.062), (0.05, 0.08), (0.1, 0.1)] {
            assert_eq!(rows(detection(width_m, height_m)).len(), 1, "{width_m} by {height_m}");
        }
    }

    #[test]
    fn without_a_size_or_a_lower_end_nothing_is_parted() {
        let of_any_size = Detection { usual_extent: None, ..detection(0.05, 0.1) };
        assert_eq!(rows(of_any_size).len(), 1);
        let mut cut = detection(0.05, 0.1);
        if let Some(measured) = &mut cut.measured {
            measured.cut.bottom = true;
        }
        assert_eq!(rows(cut).len(), 1);
    }
}
