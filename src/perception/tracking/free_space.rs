//! Whether the place where an object was seen last is empty now, hidden, or not.

use nalgebra::Vector3;

use crate::geometry::{Aabb, CameraModel};
use crate::perception::{DepthView, FrameView};

/// Rays along each side of the part that is looked at.
const N_RAYS: i32 = 7;
/// The part of a volume that is looked at, about its middle: the edges of an estimate may be off, and a turned
/// block does not fill the corners of its volume.
const INNER_SHARE: f64 = 0.5;
/// Nearer than the volume by more than this is something before it, in metres.
const BEFORE_M: f64 = 0.015;
/// Least length by which a ray must go on into the volume to have gone through it, in metres.
const INTO_M: f64 = 0.02;
/// Or this share of its way through the volume, if that is longer.
const INTO_SHARE: f64 = 0.5;
/// Least share of rays that measure anything.
const MEASURED_SHARE_MIN: f64 = 0.5;
/// Least share of all rays that must go through an empty place.
const THROUGH_SHARE_MIN: f64 = 0.4;
/// Least share of the rays that nothing stops before it.
const THROUGH_OF_FREE_MIN: f64 = 0.6;

/// What a camera shows of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sight {
    /// It looks through: what was there is there no more.
    Empty,
    /// Something stands there.
    Taken,
    /// Something else is before it, it is out of the picture, or depth is not measured.
    Hidden,
}

/// What cameras show of a place: none of them may see something there that another looks through.
pub(super) fn sight(place: &Aabb, frames: &[FrameView<'_>]) -> Sight {
    let seen: Vec<Sight> = frames.iter().map(|frame| sight_of(place, frame)).collect();
    let says = |what: Sight| seen.contains(&what);
    match (says(Sight::Taken), says(Sight::Empty)) {
        (true, _) => Sight::Taken,
        (false, true) => Sight::Empty,
        (false, false) => Sight::Hidden,
    }
}

fn sight_of(place: &Aabb, frame: &FrameView<'_>) -> Sight {
    let (Some(depth), Some(camera)) = (&frame.depth, frame.camera) else { return Sight::Hidden };
    let inner = Aabb { extent: place.extent.map(|edge| edge * INNER_SHARE), ..*place };
    let Some(bounds) = camera.bounds(inner.corners()) else { return Sight::Hidden };
    let (columns, rows) = ([bounds.x1, bounds.x2], [bounds.y1, bounds.y2]);
    let at =
        |[low, high]: [f64; 2], n: i32| low + (high - low) * f64::from(n) / f64::from(N_RAYS - 1);
    let mut count = Count::default();
    for (row, column) in (0..N_RAYS).flat_map(|row| (0..N_RAYS).map(move |column| (row, column))) {
        count.ray(place, (depth, camera), [at(columns, column).round(), at(rows, row).round()]);
    }
    count.sight()
}

/// How many rays do what.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    all: u32,
    before: u32,
    on: u32,
    through: u32,
}

impl Count {
    fn ray(
        &mut self,
        place: &Aabb,
        (depth, camera): (&DepthView<'_>, &CameraModel),
        [column, row]: [f64; 2],
    ) {
        let k = &camera.intrinsics;
        // As long as it takes to go one metre along the optical axis.
        let ray = Vector3::new((column - k.cx) / k.fx, (row - k.cy) / k.fy, 1.0);
        let (origin, ray) =
            (camera.world_from_camera.translation.vector, camera.world_from_camera * ray);
        let Some([into_m, out_m]) = place.along_ray(origin.into(), ray) else { return };
        self.all += 1;
        let is_inside = column >= 0.0 && row >= 0.0;
        let measured = is_inside.then(|| depth.at(column as u32, row as u32)).flatten();
        let Some(measured_m) = measured else { return };
        if measured_m < into_m - BEFORE_M {
            self.before += 1;
        } else if measured_m - into_m > INTO_M.max(INTO_SHARE * (out_m - into_m)) {
            self.through += 1;
        } else {
            self.on += 1;
        }
    }

    fn sight(self) -> Sight {
        let Self { all, before, on, through } = self;
        let is_share =
            |n: u32, of: u32, share: f64| of > 0 && f64::from(n) >= share * f64::from(of);
        if !is_share(before + on + through, all, MEASURED_SHARE_MIN) {
            return Sight::Hidden;
        }
        if is_share(through, all, THROUGH_SHARE_MIN)
            && is_share(through, through + on, THROUGH_OF_FREE_MIN)
        {
            return Sight::Empty;
        }
        if on > before { Sight::Taken } else { Sight::Hidden }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

    use super::*;
    use crate::geometry::Intrinsics;

    const SIZE: [usize; 2] = [64, 48];

    /// Half a metre above a table at z = 0, half a metre before its middle, looking down at it.
    fn camera() -> CameraModel {
        let position = Translation3::new(0.0, -0.6, 0.4);
        let forward = Vector3::new(0.0, 0.6, -0.4);
        let right = Vector3::x();
        let down = forward.normalize().cross(&right);
        let axes = nalgebra::Matrix3::from_columns(&[right, down, forward.normalize()]);
        let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
        CameraModel {
            intrinsics: Intrinsics { fx: 80.0, fy: 80.0, cx: 32.0, cy: 24.0 },
            world_from_camera: Isometry3::from_parts(
                position,
                UnitQuaternion::from_rotation_matrix(&rotation),
            ),
        }
    }

    fn block(x: f64, y: f64) -> Aabb {
        Aabb { centre: Point3::new(x, y, 0.025), extent: [0.05; 3] }
    }

    /// The depth image of blocks on the table.
    fn depth(blocks: &[Aabb]) -> Vec<f32> {
        let (camera, table) =
            (camera(), Aabb { centre: Point3::new(0.0, 0.0, -0.5), extent: [9.0, 9.0, 1.0] });
        let k = camera.intrinsics;
        let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x as f64, y as f64)));
        let measured = pixels.map(|(x, y)| {
            let ray = Vector3::new((x - k.cx) / k.fx, (y - k.cy) / k.fy, 1.0);
            let origin = Point3::from(camera.world_from_camera.translation.vector);
            let ray = camera.world_from_camera * ray;
            let hits = blocks.iter().chain([&table]).filter_map(|b| b.along_ray(origin, ray));
            hits.map(|[into, _]| into).fold(f64::INFINITY, f64::min) as f32
        });
        measured.map(|m| if m.is_finite() { m } else { 0.0 }).collect()
    }

    fn seen(place: &Aabb, depth_m: &[f32]) -> Sight {
        let camera = camera();
        let depth = DepthView::new(SIZE[0], SIZE[1], depth_m).unwrap();
        let frame = FrameView { image: None, depth: Some(depth), camera: Some(&camera) };
        sight(place, &[frame])
    }

    #[test]
    fn a_place_is_taken_empty_or_hidden() {
        let here = block(0.0, 0.0);
        assert_eq!(seen(&here, &depth(&[here])), Sight::Taken);
        assert_eq!(seen(&here, &depth(&[])), Sight::Empty);
        assert_eq!(seen(&here, &depth(&[block(0.1, 0.0)])), Sight::Empty);
        let before = Aabb { centre: Point3::new(0.0, -0.1, 0.1), extent: [0.1, 0.02, 0.2] };
        assert_eq!(seen(&here, &depth(&[before])), Sight::Hidden);
        assert_eq!(seen(&here, &depth(&[before, here])), Sight::Hidden);
    }

    /// On top of a block nothing stands: what is behind is far away, and the block below is not looked at.
    #[test]
    fn the_place_on_top_of_a_block_is_empty() {
        let [below, mut above] = [block(0.0, 0.0); 2];
        above.centre.z += 0.05;
        assert_eq!(seen(&above, &depth(&[below])), Sight::Empty);
        assert_eq!(seen(&above, &depth(&[below, above])), Sight::Taken);
        assert_eq!(seen(&below, &depth(&[below, above])), Sight::Taken);
    }

    #[test]
    fn without_depth_nothing_is_said() {
        let here = block(0.0, 0.0);
        assert_eq!(seen(&here, &vec![0.0; SIZE[0] * SIZE[1]]), Sight::Hidden);
        assert_eq!(sight(&here, &[FrameView::default()]), Sight::Hidden);
        assert_eq!(seen(&block(2.0, 0.0), &depth(&[])), Sight::Hidden);
    }

    /// One camera that sees it counts more than one that looks past.
    #[test]
    fn what_one_camera_sees_is_there() {
        let (here, camera) = (block(0.0, 0.0), camera());
        let [with, without] = [depth(&[here]), depth(&[])];
        let frame = |depth_m| FrameView {
            image: None,
            depth: Some(DepthView::new(SIZE[0], SIZE[1], depth_m).unwrap()),
            camera: Some(&camera),
        };
        let (with, without) = (frame(&with), frame(&without));
        assert_eq!(sight(&here, &[with, without]), Sight::Taken);
        assert_eq!(sight(&here, &[FrameView::default(), without]), Sight::Empty);
    }
}
