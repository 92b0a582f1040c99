//! From the pixels of a detection and a depth image to a volume in the world.

use nalgebra::{Point2, Point3};

use super::box_estimate::Heading;
use super::edge_depth::{End, depths_at};
use super::model::DepthRule;
use super::silhouette::mask_of_box;
use super::{BoxEstimate, DepthView, Detection, TruncatedSides};
use crate::geometry::{Aabb, CameraModel, MaskRun};

/// A volume rests on at least this many pixels with depth.
const PIXELS_MIN: usize = 12;

/// About so many pixels make a median.
const PIXELS_MEDIAN: usize = 256;

/// How far beyond an edge of the mask its surroundings are looked at, in pixels.
const BEYOND_PX: i64 = 3;
/// An edge is told by this share of its rows or columns, or it counts as cut.
const WHOLE_SHARE_MIN: f64 = 0.25;

/// Of an object that is as deep as it is seen to be, the back is where this share of the upper ends of
/// its columns is at most: others end at something that stands before the back.
const BACK_QUANTILE: f64 = 0.75;
/// Such an object is at least so deep, in metres: a level camera sees no back.
const DEPTH_MIN_M: f64 = 0.01;

/// The world volume of a detected object; `None` with too few depth pixels.
///
/// The camera stands upright and looks level or from above, in any direction. What it sees of an
/// object is its front and top: left and right are taken from the ends of the mask's rows, bottom
/// and top from the ends of its columns, the front from the lower ends of the middle columns; how
/// deep the object is follows from `rule`. Quantiles stand in for extremes, against noise and stray
/// pixels. A detection without a mask has that of its box at the depth of its middle. Ends beyond
/// which something nearer lies are left out as long as others tell the edge; otherwise the side is
/// reported as cut. The centre is in the world frame; the extents are those
/// across and along the camera's direction, which is what x and y are for a camera that looks
/// along y.
pub fn volume_of(
    detection: &Detection,
    depth: &DepthView<'_>,
    camera: &CameraModel,
    rule: DepthRule,
) -> Option<BoxEstimate> {
    let heading = Heading::of(camera);
    let lift = |column: f64, row: f64, depth_m: f64| -> Option<Point3<f64>> {
        let point = camera.lift(Point2::new(column, row), depth_m).ok()?;
        Some(heading.view_from_world(point))
    };
    let pixel = |x: u32, y: u32, dx: f64, dy: f64| {
        lift(f64::from(x) + dx, f64::from(y) + dy, depth.at(x, y)?)
    };
    let filled;
    let mask = if detection.mask.is_empty() {
        filled = mask_of_box(&detection.pixel_box, depth, camera);
        &filled
    } else {
        &detection.mask
    };
    let reach_m = reach_of(mask, depth, camera)?;
    let (rows, columns) = (row_ends(mask), column_ends(mask));
    // Half a pixel outwards: to the edge of the last pixel, not to its middle.
    let edge = |ends: Vec<End>, axis: usize, [dx, dy]: [f64; 2]| -> Vec<(f64, bool)> {
        let told = depths_at(&ends, depth, reach_m).into_iter();
        let told = told.filter_map(|(end, depth_m)| {
            let (x, y) = end.pixel;
            let hidden = depth.is_covered((x, y), end.outwards(BEYOND_PX), depth_m);
            Some((lift(f64::from(x) + dx, f64::from(y) + dy, depth_m)?[axis], hidden))
        });
        told.collect()
    };
    let left = Edge::of(&edge(rows.iter().map(left_end).collect(), 0, [-0.5, 0.0]));
    let right = Edge::of(&edge(rows.iter().map(right_end).collect(), 0, [0.5, 0.0]));
    let bottom = Edge::of(&edge(columns.iter().map(ColumnEnds::bottom).collect(), 2, [0.0, 0.5]));
    let top = edge(columns.iter().map(ColumnEnds::top).collect(), 2, [0.0, 0.0]);
    let top = top.into_iter().map(|(z, _)| z);
    let cut = TruncatedSides { left: left.is_cut, right: right.is_cut, bottom: bottom.is_cut };
    let (left, right) = (quantile(left.ends, 0.1)?, quantile(right.ends, 0.9)?);
    let (bottom, top) = (quantile(bottom.ends, 0.5)?, quantile(top.collect(), 0.75)?);
    let front = columns
        .iter()
        .flat_map(|c| c.lowest_quarter().filter_map(|y| pixel(c.x, y, 0.0, 0.0)))
        .filter(|p| (p.x - f64::midpoint(left, right)).abs() <= (right - left) / 6.0);
    let front = quantile(front.map(|p| p.y).collect(), 0.35)?;
    let extent_y = match rule {
        DepthRule::AsWide => right - left,
        DepthRule::AsSeen => {
            let back = edge(columns.iter().map(ColumnEnds::top).collect(), 1, [0.0, -0.5]);
            let back = quantile(back.into_iter().map(|(y, _)| y).collect(), BACK_QUANTILE)?;
            (back - front).max(DEPTH_MIN_M)
        }
    };
    let centre =
        Point3::new(f64::midpoint(left, right), front + extent_y / 2.0, f64::midpoint(bottom, top));
    let centre = heading.world_from_view(centre);
    let volume = Aabb { centre, extent: [right - left, extent_y, top - bottom] };
    Some(BoxEstimate { volume, cut, heading })
}

/// How much depth may differ within an object: as much as it is wide or high, in metres. `None` with
/// too few depth pixels.
fn reach_of(mask: &[MaskRun], depth: &DepthView<'_>, camera: &CameraModel) -> Option<f64> {
    let n_pixels: usize = mask.iter().map(|r| (r.x_end - r.x_start) as usize).sum();
    let pixels = mask.iter().flat_map(|r| (r.x_start..r.x_end).map(|x| (x, r.y)));
    let depths = |step: usize| pixels.clone().step_by(step).filter_map(|(x, y)| depth.at(x, y));
    if depths(1).take(PIXELS_MIN).count() < PIXELS_MIN {
        return None;
    }
    let middle_m = quantile(depths(n_pixels / PIXELS_MEDIAN + 1).collect(), 0.5)?;
    let (first, last) = (mask.first()?, mask.last()?);
    let left = mask.iter().map(|r| r.x_start).min()?;
    let right = mask.iter().map(|r| r.x_end).max()?;
    let longest = (right - left).max(last.y + 1 - first.y);
    Some(f64::from(longest) * middle_m / camera.intrinsics.fx)
}

/// Where an edge is, told by the ends of rows or columns.
struct Edge {
    ends: Vec<f64>,
    is_cut: bool,
}

impl Edge {
    /// From each end's coordinate and whether something nearer lies beyond it.
    fn of(ends: &[(f64, bool)]) -> Self {
        let n_whole = ends.iter().filter(|(_, hidden)| !hidden).count();
        let is_cut = (n_whole as f64) < WHOLE_SHARE_MIN * ends.len() as f64;
        let used = ends.iter().filter(|(_, hidden)| is_cut || !hidden);
        Self { ends: used.map(|(end, _)| *end).collect(), is_cut }
    }
}

fn left_end(row: &MaskRun) -> End {
    End { pixel: (row.x_start, row.y), inwards: (1, 0), length: row.x_end - row.x_start }
}

fn right_end(row: &MaskRun) -> End {
    End { pixel: (row.x_end - 1, row.y), inwards: (-1, 0), length: row.x_end - row.x_start }
}

/// First and last column of each row.
fn row_ends(mask: &[MaskRun]) -> Vec<MaskRun> {
    let mut rows: Vec<MaskRun> = Vec::new();
    for run in mask.iter().filter(|r| r.x_start < r.x_end) {
        match rows.last_mut() {
            Some(last) if last.y == run.y => {
                last.x_start = last.x_start.min(run.x_start);
                last.x_end = last.x_end.max(run.x_end);
            }
            _ => rows.push(*run),
        }
    }
    rows
}

struct ColumnEnds {
    x: u32,
    y_first: u32,
    y_last: u32,
}

impl ColumnEnds {
    fn top(&self) -> End {
        let length = self.y_last + 1 - self.y_first;
        End { pixel: (self.x, self.y_first), inwards: (0, 1), length }
    }

    fn bottom(&self) -> End {
        End { pixel: (self.x, self.y_last), inwards: (0, -1), ..self.top() }
    }

    /// Rows of the lowest quarter.
    fn lowest_quarter(&self) -> impl Iterator<Item = u32> {
        self.y_last - (self.y_last - self.y_first) / 4..=self.y_last
    }
}

/// First and last row of each column.
fn column_ends(mask: &[MaskRun]) -> Vec<ColumnEnds> {
    let first = mask.iter().map(|r| r.x_start).min().unwrap_or(0);
    let end = mask.iter().map(|r| r.x_end).max().unwrap_or(0);
    let mut columns: Vec<Option<ColumnEnds>> = (first..end).map(|_| None).collect();
    for run in mask {
        for x in run.x_start..run.x_end {
            let column = &mut columns[(x - first) as usize];
            let y_first = column.as_ref().map_or(run.y, |c| c.y_first.min(run.y));
            *column = Some(ColumnEnds { x, y_first, y_last: run.y });
        }
    }
    columns.into_iter().flatten().collect()
}

/// The value below which a share of the values lies; `None` without values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let index = ((values.len().checked_sub(1)?) as f64 * share).round() as usize;
    let (_, value, _) = values.select_nth_unstable_by(index, f64::total_cmp);
    Some(*value)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::geometry::{Intrinsics, PixelBox};

    /// A camera about a metre in front of the table, looking down a little.
    fn camera(width: usize, height: usize) -> CameraModel {
        camera_at(Point3::new(0.0, -0.95, 0.42), width, height)
    }

    fn camera_at(from: Point3<f64>, width: usize, height: usize) -> CameraModel {
        let to = Point3::new(0.0, 0.0, 0.09);
        let forward = (to - from).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let down = forward.cross(&right);
        let axes = Rotation3::from_basis_unchecked(&[right, down, forward]);
        let focal = height as f64 / (2.0 * 17.0_f64.to_radians().tan());
        CameraModel {
            intrinsics: Intrinsics {
                fx: focal,
                fy: focal,
                cx: (width as f64 - 1.0) / 2.0,
                cy: (height as f64 - 1.0) / 2.0,
            },
            world_from_camera: Isometry3::from_parts(
                from.coords.into(),
                UnitQuaternion::from_rotation_matrix(&axes),
            ),
        }
    }

    /// Where a ray first meets an axis-aligned box, as a multiple of its direction.
    fn hit(from: Point3<f64>, along: Vector3<f64>, volume: &Aabb) -> Option<f64> {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let half = volume.extent[axis] / 2.0;
            let ends = [-half, half].map(|h| (volume.centre[axis] + h - from[axis]) / along[axis]);
            near = near.max(ends[0].min(ends[1]));
            far = far.min(ends[0].max(ends[1]));
        }
        (near < far).then_some(near)
    }

    /// Ray-casts one box and lifts it back.
    #[track_caller]
    fn check(width: usize, height: usize, volume: Aabb, tolerance_m: f64) {
        check_from(&camera(width, height), [width, height], volume, tolerance_m);
    }

    #[track_caller]
    fn check_from(camera: &CameraModel, size: [usize; 2], volume: Aabb, tolerance_m: f64) {
        let lifted = lifted_by(DepthRule::AsWide, camera, size, volume);
        let off = (lifted.centre - volume.centre).abs().max();
        assert!(off < tolerance_m, "{lifted:?} for {volume:?}");
    }

    /// What is lifted of a box that is ray-cast, with depth noise of about a millimetre.
    #[track_caller]
    fn lifted_by(rule: DepthRule, camera: &CameraModel, size: [usize; 2], volume: Aabb) -> Aabb {
        let [width, height] = size;
        let k = camera.intrinsics;
        let from = Point3::from(camera.world_from_camera.translation.vector);
        let mut depth_m = vec![0.0_f32; width * height];
        let mut mask = Vec::new();
        let mut state = 1_u32;
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            // Scaled so that the parameter of the ray is the depth along the optical axis.
            let ray = Vector3::new((x as f64 - k.cx) / k.fx, (y as f64 - k.cy) / k.fy, 1.0);
            let Some(depth) = hit(from, camera.world_from_camera * ray, &volume) else { continue };
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = f64::from(state >> 16) / 65_536.0 - 0.5; // uniform: sigma is 0.29
            depth_m[y * width + x] = (depth + 0.001 / 0.29 * noise) as f32;
            mask.push(MaskRun { y: y as u32, x_start: x as u32, x_end: x as u32 + 1 });
        }
        let detection = Detection {
            mask,
            ..Detection::new("block".into(), "red".into(), PixelBox::from([0.0; 4]))
        };
        let depth = DepthView::new(width, height, &depth_m).unwrap();
        let measured = volume_of(&detection, &depth, camera, rule).unwrap();
        assert_eq!(measured.cut, TruncatedSides::default());
        measured.volume
    }

    /// Something flat whose whole top is seen is as deep as it looks, whatever its width.
    #[test]
    fn a_plate_is_as_deep_as_it_is_seen_to_be() {
        for (width_m, depth_m) in [(0.2, 0.12), (0.1, 0.2)] {
            let extent = [width_m, depth_m, 0.016];
            let volume = Aabb { centre: Point3::new(0.15, 0.02, 0.008), extent };
            let lifted = lifted_by(DepthRule::AsSeen, &camera(640, 480), [640, 480], volume);
            assert!((lifted.centre - volume.centre).abs().max() < 0.004, "{lifted:?}");
            assert!(lifted.extent.iter().zip(extent).all(|(a, b)| (a - b).abs() < 0.006));
        }
    }

    #[test]
    fn a_cut_side_is_put_where_the_known_size_says() {
        let whole = Aabb { centre: Point3::new(0.1, 0.2, 0.025), extent: [0.05; 3] };
        let visible = Aabb { centre: Point3::new(0.115, 0.185, 0.035), extent: [0.02, 0.02, 0.03] };
        let cut = TruncatedSides { left: true, right: false, bottom: true };
        let heading = Heading([0.0, 1.0]);
        let completed = BoxEstimate { volume: visible, cut, heading }.completed(&whole).unwrap();
        assert!((completed.centre - whole.centre).norm() < 1e-9, "{completed:?}");
        assert!(completed.extent.iter().all(|e| (e - 0.05).abs() < 1e-9), "{completed:?}");
        let both = TruncatedSides { left: true, right: true, bottom: false };
        assert_eq!(BoxEstimate { volume: visible, cut: both, heading }.completed(&whole), None);
        let measured = BoxEstimate { volume: visible, cut: TruncatedSides::default(), heading };
        let as_seen = measured.completed(&whole).unwrap();
        assert!((as_seen.centre - visible.centre).norm() < 1e-9, "{as_seen:?}");
    }

    #[test]
    fn cubes_are_lifted_to_where_they_are() {
        for (x, y, z) in [(0.0, 0.0, 0.025), (0.28, 0.05, 0.025), (-0.2, -0.1, 0.125)] {
            let volume = Aabb { centre: Point3::new(x, y, z), extent: [0.05; 3] };
            check(640, 480, volume, 0.002);
            check(320, 240, volume, 0.004);
        }
    }

    /// A detector that gives boxes only: the table around the cube is in the box too, and to one side
    /// of the middle its flank as well, so the volume is rougher than one from a mask (12 mm off and
    /// 25 mm too wide at the edge of the picture), but a gripper still finds it.
    #[test]
    fn a_cube_on_a_table_is_lifted_from_its_box() {
        for x in [0.0, 0.15, -0.28] {
            let (width, height, camera) = (640, 480, camera(640, 480));
            let volume = Aabb { centre: Point3::new(x, 0.0, 0.025), extent: [0.05; 3] };
            let table = Aabb { centre: Point3::new(0.0, 0.0, -0.05), extent: [4.0, 4.0, 0.1] };
            let k = camera.intrinsics;
            let from = Point3::from(camera.world_from_camera.translation.vector);
            let mut depth_m = vec![0.0_f32; width * height];
            let [mut x1, mut y1, mut x2, mut y2] = [width, height, 0, 0];
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                let ray = Vector3::new((x as f64 - k.cx) / k.fx, (y as f64 - k.cy) / k.fy, 1.0);
                let ray = camera.world_from_camera * ray;
                let (cube, table) = (hit(from, ray, &volume), hit(from, ray, &table));
                depth_m[y * width + x] = cube.or(table).unwrap_or(0.0) as f32;
                if cube.is_some() {
                    (x1, y1, x2, y2) = (x1.min(x), y1.min(y), x2.max(x + 1), y2.max(y + 1));
                }
            }
            let detection = Detection::new(
                "block".into(),
                "red".into(),
                PixelBox::from([x1, y1, x2, y2].map(|v| v as f64)),
            );
            let depth = DepthView::new(width, height, &depth_m).unwrap();
            let lifted = volume_of(&detection, &depth, &camera, DepthRule::AsWide).unwrap().volume;
            let off = (lifted.centre - volume.centre).abs().max();
            assert!(off < 0.015, "{lifted:?} for {volume:?}");
            let wide = lifted.extent.iter().map(|e| (e - 0.05).abs()).fold(0.0, f64::max);
            assert!(wide < 0.03, "{lifted:?} for {volume:?}");
        }
    }

    /// From the right, an object's left side is its front one.
    #[test]
    fn a_camera_may_look_in_any_direction() {
        let volume = Aabb { centre: Point3::new(0.05, 0.1, 0.025), extent: [0.05; 3] };
        for from in [[0.95, 0.0, 0.42], [-0.95, 0.0, 0.42], [0.0, 0.95, 0.42], [0.0, -0.4, 1.1]] {
            check_from(&camera_at(from.into(), 640, 480), [640, 480], volume, 0.002);
        }
        let cut = TruncatedSides { left: true, right: false, bottom: false };
        let heading = Heading::of(&camera_at(Point3::new(0.95, 0.0, 0.42), 640, 480));
        let visible = Aabb { centre: Point3::new(0.05, 0.115, 0.025), extent: [0.02, 0.02, 0.05] };
        let visible = Aabb { centre: visible.centre + Vector3::new(0.015, 0.0, 0.0), ..visible };
        let completed = BoxEstimate { volume: visible, cut, heading }.completed(&volume).unwrap();
        assert!((completed.centre - volume.centre).norm() < 1e-9, "{completed:?}");
    }

    #[test]
    fn without_depth_there_is_no_volume() {
        let mask = vec![MaskRun { y: 1, x_start: 0, x_end: 40 }];
        let detection = Detection {
            mask,
            ..Detection::new("block".into(), "red".into(), PixelBox::from([0.0, 1.0, 40.0, 2.0]))
        };
        let nowhere = [0.0, f32::NAN, f32::INFINITY, -1.0].repeat(40);
        let depth = DepthView::new(40, 4, &nowhere).unwrap();
        let model = camera(40, 4);
        assert_eq!(volume_of(&detection, &depth, &model, DepthRule::AsWide), None);
    }

    #[test]
    fn a_wrong_length_is_named() {
        let error = DepthView::new(2, 2, &[0.0; 3]).unwrap_err();
        assert_eq!(error.to_string(), "depth_m: expected 4 values, got 3");
    }
}
