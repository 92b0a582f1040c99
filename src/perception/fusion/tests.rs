//! Blocks on a table, ray-cast for several small cameras.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::geometry::{Aabb, CameraModel, Intrinsics, MaskRun, PixelBox};
use crate::perception::model::DepthRule;
use crate::perception::{DepthView, Detection, FrameView, volume_of};

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
/// Edge of a block, metres.
const EDGE_M: f64 = 0.05;

/// A block: label, middle.
type Block = (&'static str, [f64; 3]);

/// One camera's picture of blocks.
struct Picture {
    camera: &'static str,
    model: CameraModel,
    depth_m: Vec<f32>,
    detections: Vec<Detection>,
}

impl Picture {
    /// What a camera at a place sees that looks at the middle of the table.
    fn of(camera: &'static str, from: [f64; 3], blocks: &[Block]) -> Self {
        let model = model(Point3::from(from));
        let from = Point3::from(from);
        let k = model.intrinsics;
        let mut depth_m = vec![0.0_f32; WIDTH * HEIGHT];
        let mut masks: Vec<Vec<MaskRun>> = vec![Vec::new(); blocks.len()];
        for (y, x) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (y, x))) {
            let ray = Vector3::new((x as f64 - k.cx) / k.fx, (y as f64 - k.cy) / k.fy, 1.0);
            let ray = model.world_from_camera * ray;
            let table = Aabb { centre: Point3::new(0.0, 0.0, -0.05), extent: [3.0, 3.0, 0.1] };
            let hits = blocks.iter().enumerate();
            let hits = hits.filter_map(|(i, block)| Some((hit(from, ray, &volume(block))?, i)));
            let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
            let depth = nearest.map(|n| n.0).or_else(|| hit(from, ray, &table));
            depth_m[y * WIDTH + x] = depth.unwrap_or(0.0) as f32;
            let (x, y) = (x as u32, y as u32);
            let Some((_, i)) = nearest else { continue };
            match masks[i].last_mut() {
                Some(run) if run.y == y && run.x_end == x => run.x_end += 1,
                _ => masks[i].push(MaskRun { y, x_start: x, x_end: x + 1 }),
            }
        }
        let mut picture = Self { camera, model, depth_m, detections: Vec::new() };
        for (mask, (label, _)) in masks.into_iter().zip(blocks) {
            let boxes = mask.iter().map(|r| {
                let [x1, y1, x2, y2] = [r.x_start, r.y, r.x_end, r.y + 1].map(f64::from);
                PixelBox { x1, y1, x2, y2 }
            });
            let Some(pixel_box) = boxes.reduce(|a, b| a.hull(&b)) else { continue };
            let mut detection =
                Detection { mask, ..Detection::new("block".into(), (*label).into(), pixel_box) };
            let depth = DepthView::new(WIDTH, HEIGHT, &picture.depth_m).unwrap();
            detection.measured = volume_of(&detection, &depth, &model, DepthRule::AsWide);
            // A detector sees no slivers.
            if detection.mask_area() >= 24 {
                picture.detections.push(detection);
            }
        }
        picture
    }

    fn view(&self) -> CameraView<'_> {
        CameraView {
            camera: self.camera,
            frame: FrameView {
                image: None,
                depth: DepthView::new(WIDTH, HEIGHT, &self.depth_m).ok(),
                camera: Some(&self.model),
            },
            detections: self.detections.clone(),
            occluders: Vec::new(),
        }
    }
}

fn volume((_, centre): &Block) -> Aabb {
    Aabb { centre: Point3::from(*centre), extent: [EDGE_M; 3] }
}

fn model(from: Point3<f64>) -> CameraModel {
    let forward = (Point3::new(0.0, 0.0, 0.05) - from).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    let focal = HEIGHT as f64 / (2.0 * 17.0_f64.to_radians().tan());
    let (cx, cy) = ((WIDTH as f64 - 1.0) / 2.0, (HEIGHT as f64 - 1.0) / 2.0);
    CameraModel {
        intrinsics: Intrinsics { fx: focal, fy: focal, cx, cy },
        world_from_camera: Isometry3::from_parts(
            from.coords.into(),
            UnitQuaternion::from_rotation_matrix(&axes),
        ),
    }
}

/// Where a ray first meets a box, as a multiple of its direction.
fn hit(from: Point3<f64>, along: Vector3<f64>, volume: &Aabb) -> Option<f64> {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let [low, high] = volume.span(axis).map(|edge| (edge - from[axis]) / along[axis]);
        near = near.max(low.min(high));
        far = far.min(low.max(high));
    }
    (near < far).then_some(near)
}

const FRONT: [f64; 3] = [0.0, -0.95, 0.2];
const BACK: [f64; 3] = [0.0, 0.95, 0.2];
const LEFT: [f64; 3] = [-0.9, -0.2, 0.35];

/// A pair of blocks that hides a third one from the front.
const HIDING: [Block; 3] =
    [("red", [0.0, -0.05, 0.025]), ("blue", [0.0, -0.05, 0.075]), ("green", [0.0, 0.06, 0.025])];

fn find<'a>(fused: &'a [Detection], label: &str) -> Vec<&'a Detection> {
    fused.iter().filter(|d| d.label == label).collect()
}

fn off_m(detection: &Detection, block: &Block) -> f64 {
    (detection.measured.unwrap().volume.centre - Point3::from(block.1)).norm()
}

#[test]
fn what_one_view_hides_is_seen_in_another_and_has_a_box_in_the_first() {
    let (front, back) = (Picture::of("main", FRONT, &HIDING), Picture::of("back", BACK, &HIDING));
    assert!(find(&front.detections, "green").is_empty(), "the test hides it");
    let fused = fuse(front.view(), vec![back.view()]);
    let labels: Vec<&str> = fused.iter().map(|d| d.label.as_str()).collect();
    assert_eq!(labels, ["red", "blue", "green"]);
    for (detection, block) in fused.iter().zip(&HIDING) {
        assert!(off_m(detection, block) < 0.01, "{detection:?}");
        assert_eq!(detection.contradiction, None);
    }
    let pixel = front.model.project(Point3::from(HIDING[2].1)).unwrap();
    let (column, row) = fused[2].pixel_box.centre();
    assert!((column - pixel.x).hypot(row - pixel.y) < 2.0, "{:?}", fused[2].pixel_box);
    assert!(fused[2].mask.is_empty() && fused[2].is_whole_elsewhere);
}

#[test]
fn an_object_that_one_camera_sees_is_kept_whichever_it_is() {
    let red = [("red", [0.05, 0.0, 0.025])];
    let (front, blind) = (Picture::of("main", FRONT, &red), Picture::of("back", BACK, &[]));
    let only_main =
        fuse(front.view(), vec![CameraView { frame: FrameView::default(), ..blind.view() }]);
    assert_eq!(only_main, front.detections);
    let (blind, back) = (Picture::of("main", FRONT, &[]), Picture::of("back", BACK, &red));
    let blind =
        CameraView { frame: FrameView { depth: None, ..blind.view().frame }, ..blind.view() };
    let only_back = fuse(blind, vec![back.view()]);
    assert_eq!(only_back.len(), 1);
    assert_eq!(only_back[0].contradiction, None);
}

/// Of a block that each camera sees a part of, the better estimate counts.
#[test]
fn a_cut_estimate_gives_way_to_a_whole_one() {
    // The lower half of the green one is hidden from the front.
    let blocks = [("red", [0.0, -0.06, 0.025]), ("green", [0.0, 0.02, 0.045])];
    let (front, back) = (Picture::of("main", FRONT, &blocks), Picture::of("back", BACK, &blocks));
    let cut = find(&front.detections, "green")[0];
    assert!(cut.measured.unwrap().cut.bottom, "{cut:?}");
    let fused = fuse(front.view(), vec![back.view()]);
    let green = find(&fused, "green");
    assert_eq!(green.len(), 1);
    assert!(off_m(green[0], &blocks[1]) < 0.01, "{:?}", green[0]);
    assert_eq!(green[0].pixel_box, cut.pixel_box, "its box stays main's");
}

#[test]
fn what_the_robot_hides_from_one_camera_is_taken_from_another() {
    let red = [("red", [0.0, 0.0, 0.025])];
    let (front, back) = (Picture::of("main", FRONT, &red), Picture::of("back", BACK, &red));
    fn hand(picture: &Picture) -> CameraView<'_> {
        CameraView { occluders: vec![picture.detections[0].pixel_box], ..picture.view() }
    }
    let [own] = &fuse(hand(&front), vec![back.view()])[..] else { panic!("one object") };
    assert!(own.is_whole_elsewhere && own.mask.is_empty());
    // Hidden in the other view only, it is main's alone; hidden in both, the tracker is to tell.
    assert_eq!(fuse(front.view(), vec![hand(&back)]), front.detections);
    let [neither] = &fuse(hand(&front), vec![hand(&back)])[..] else { panic!("one object") };
    assert!(!neither.is_whole_elsewhere);
}

#[test]
fn two_blocks_of_one_colour_are_two() {
    let blocks =
        [("red", [0.0, 0.0, 0.025]), ("red", [0.0, 0.0, 0.075]), ("red", [0.07, 0.0, 0.025])];
    let (front, back) = (Picture::of("main", FRONT, &blocks), Picture::of("back", BACK, &blocks));
    assert_eq!(fuse(front.view(), vec![back.view()]).len(), 3);
    // Each camera sees another one of two that stand on each other.
    fn half(picture: &Picture, idx: usize) -> CameraView<'_> {
        CameraView { detections: vec![picture.detections[idx].clone()], ..picture.view() }
    }
    assert_eq!(fuse(half(&front, 0), vec![half(&back, 1)]).len(), 2);
}

#[test]
fn a_camera_that_looks_through_an_object_denies_it() {
    let red = [("red", [0.0, 0.0, 0.025])];
    let (front, back) = (Picture::of("main", FRONT, &red), Picture::of("back", BACK, &[]));
    let fused = fuse(front.view(), vec![back.view()]);
    let said = fused[0].contradiction.as_deref();
    assert_eq!(said, Some("back sees through the place of"));
    // What stands before it is no contradiction.
    let (front, back) = (Picture::of("main", BACK, &HIDING), Picture::of("back", FRONT, &HIDING));
    let fused = fuse(front.view(), vec![back.view()]);
    assert!(fused.iter().all(|d| d.contradiction.is_none()), "{fused:?}");
}

#[test]
fn two_labels_of_one_body_are_one_object_and_a_contradiction() {
    let (red, pink) = ([("red", [0.0, 0.0, 0.025])], [("pink", [0.0, 0.0, 0.025])]);
    let (front, back) = (Picture::of("main", FRONT, &red), Picture::of("back", BACK, &pink));
    let [fused] = &fuse(front.view(), vec![back.view()])[..] else { panic!("one object") };
    assert_eq!(fused.label, "red");
    let said = fused.contradiction.as_deref();
    assert_eq!(said, Some("seen as red by main and as pink by back:"));
    // Different bodies that touch are no contradiction.
    let side_by_side = [("red", [0.0, 0.0, 0.025]), ("pink", [0.05, 0.0, 0.025])];
    let (front, back) =
        (Picture::of("main", FRONT, &side_by_side), Picture::of("back", BACK, &side_by_side));
    let fused = fuse(front.view(), vec![back.view()]);
    assert!(fused.len() == 2 && fused.iter().all(|d| d.contradiction.is_none()), "{fused:?}");
}

/// Blocks of different places on a grid, two of each label, some on others.
fn layouts() -> impl Strategy<Value = Vec<Block>> {
    let slots: Vec<[f64; 3]> = (0..12)
        .map(|i| {
            let (column, row, level) = (i % 3, i / 3 % 2, i / 6);
            let at = |n: i32, step: f64| f64::from(n) * step;
            [at(column - 1, 0.11), at(row, 0.1) - 0.05, 0.025 + at(level, EDGE_M)]
        })
        .collect();
    let labels = ["red", "blue", "green", "pink", "red", "blue"];
    proptest::sample::subsequence(slots, 1..=6)
        .prop_map(move |slots| labels.into_iter().zip(slots).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_view_fused_with_itself_says_the_same(blocks in layouts()) {
        let front = Picture::of("main", FRONT, &blocks);
        let fused = fuse(front.view(), vec![CameraView { camera: "twin", ..front.view() }]);
        prop_assert_eq!(fused.len(), front.detections.len());
        for (fused, own) in fused.into_iter().zip(&front.detections) {
            prop_assert_eq!(&Detection { is_whole_elsewhere: false, ..fused }, own);
        }
    }

    #[test]
    fn the_order_of_the_cameras_does_not_matter(blocks in layouts()) {
        let front = Picture::of("main", FRONT, &blocks);
        let (back, left) = (Picture::of("back", BACK, &blocks), Picture::of("left", LEFT, &blocks));
        let fused = fuse(front.view(), vec![back.view(), left.view()]);
        prop_assert_eq!(&fused, &fuse(front.view(), vec![left.view(), back.view()]));
        // Every block that some camera sees is there once, near its place.
        for block in &blocks {
            let is_near = |d: &&Detection| {
                d.label == block.0 && d.measured.is_some() && off_m(d, block) < 0.02
            };
            let views = [&front, &back, &left];
            let seen = views.iter().any(|view| view.detections.iter().any(|d| is_near(&d)));
            let n_near = fused.iter().filter(is_near).count();
            prop_assert!(n_near == usize::from(seen) || n_near == 1, "{:?} in {:?}", block, fused);
        }
        prop_assert!(fused.iter().all(|d| d.contradiction.is_none()), "{:?}", fused);
    }
}
