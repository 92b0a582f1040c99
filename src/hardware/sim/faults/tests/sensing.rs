//! Faults of cameras and detectors: what each does to a frame, and how it is told apart from the others.

use std::f64::consts::PI;

use super::*;
use crate::geometry::PixelBox;
use crate::hardware::Camera as _;
use crate::hardware::sim::SimCamera;
use crate::messages::Frame;
use crate::perception::Detection;

/// A simulated camera with faults.
struct Sight {
    bench: Bench,
    camera: SimCamera,
}

impl Sight {
    fn new(faults_text: &str, seed: u64) -> Self {
        let mut bench = bench(faults_text, seed);
        bench.open();
        let camera = SimCamera::new(bench.hardware.clone(), "main").unwrap();
        Self { bench, camera }
    }

    async fn frame(&mut self) -> Frame {
        self.camera.next().await.unwrap().unwrap().clone()
    }

    /// The next frames, each answered as soon as it is there.
    async fn frames(&mut self, n: usize) -> Vec<Frame> {
        let mut frames = Vec::new();
        while frames.len() < n {
            let frame = self.frame().await;
            self.bench.answer(frame.sequence);
            frames.push(frame);
        }
        frames
    }
}

/// Four frames with an action at the second one.
async fn second_of_four(action: &str) -> Vec<Frame> {
    Sight::new(&fault("frame = 'main'\nnth = 2", action), 1).frames(4).await
}

/// Four frames of a world where nothing goes wrong with the camera.
async fn undisturbed() -> Vec<Frame> {
    Sight::new(&fault("at_s = 99.0", "kind = 'drop'"), 1).frames(4).await
}

/// Share of the pixels that differ by more than a little.
fn changed(one: &Frame, other: &Frame) -> f64 {
    let pairs = one.rgb.chunks_exact(3).zip(other.rgb.chunks_exact(3));
    let differ = pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 24)).count();
    differ as f64 / (one.rgb.len() / 3) as f64
}

fn depth(frame: &Frame) -> &[f32] {
    frame.depth_m.as_deref().unwrap()
}

fn mean(frame: &Frame) -> f64 {
    frame.rgb.iter().map(|value| f64::from(*value)).sum::<f64>() / frame.rgb.len() as f64
}

/// How much neighbours in a row differ.
fn sharpness(frame: &Frame) -> f64 {
    let pairs = frame.rgb.iter().zip(&frame.rgb[3..]);
    pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / frame.rgb.len() as f64
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_frame_is_shown_by_no_camera_and_time_goes_on() {
    let frames = second_of_four("kind = 'drop_frame'").await;
    let numbers: Vec<u64> = frames.iter().map(|frame| frame.sequence).collect();
    assert_eq!(numbers, [0, 2, 3, 4]);
    let plain = undisturbed().await;
    assert_eq!((&frames[1], &frames[2]), (&plain[2], &plain[3]));
    let mut lost = Sight::new(&fault("frame = 'main'", "kind = 'drop_frame', for_s = 1.0"), 1);
    let first = lost.frame().await;
    assert!((30..=31).contains(&first.sequence), "{}", first.sequence);
    assert_eq!(lost.bench.hardware.faults().len(), 1);
}

/// The loop is told by `camera.wait_s`; the simulator does not go on for ever.
#[test]
fn a_camera_that_loses_every_frame_shows_none() {
    let text = fault("frame = 'main'\nevery = true", "kind = 'drop_frame'");
    let mut bench = bench(&text, 1);
    let released = bench.hardware.released();
    bench.open();
    assert_eq!(*released.borrow(), 0);
    assert!(bench.hardware.look(|_| ()).0 >= 60_000_000_000);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_late_frame_is_an_earlier_one_with_its_stamp() {
    let text = fault("frame = 'main'\nnth = 4", "kind = 'late_frame', by_s = 0.06");
    let frames = Sight::new(&text, 1).frames(5).await;
    assert_eq!(frames[3].sequence, 3);
    let shown = Frame { sequence: 3, ..frames[1].clone() };
    assert_eq!(frames[3], shown);
    assert!(frames[4].capture_ns > frames[2].capture_ns);
    // There is none before the first.
    let mut first = Sight::new(&fault("at_s = 0", "kind = 'late_frame', by_s = 0.1"), 1);
    let plain = undisturbed().await;
    assert_eq!(first.frame().await, plain[0]);
    assert!(!first.bench.hardware.faults()[0].happened);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_frame_comes_twice_as_it_is() {
    let text = fault("frame = 'main'\nnth = 2", "kind = 'repeat_frame'");
    let mut sight = Sight::new(&text, 1);
    sight.frames(1).await;
    let (one, two) = (sight.frame().await, sight.frame().await);
    assert_eq!((one.sequence, &one), (1, &two));
    sight.bench.answer(1);
    assert_eq!(sight.frame().await, undisturbed().await[2]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frozen_picture_stays_while_stamps_go_on() {
    let text = fault("frame = 'main'\nnth = 2", "kind = 'freeze', for_s = 0.1");
    let mut sight = Sight::new(&text, 1);
    let frames = sight.frames(6).await;
    let plain = Sight::new(&fault("at_s = 99.0", "kind = 'drop'"), 1).frames(6).await;
    for (idx, (frame, plain)) in frames.iter().zip(&plain).enumerate() {
        let is_frozen = (1..=3).contains(&idx);
        assert_eq!((frame.sequence, frame.capture_ns), (plain.sequence, plain.capture_ns));
        assert_eq!(frame.rgb == frames[1].rgb, is_frozen, "{idx}");
        assert_eq!(frame.rgb == plain.rgb, !(2..=3).contains(&idx), "{idx}");
    }
    assert_eq!(sight.bench.hardware.faults().len(), 1, "one record of all frames");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_done_to_pixels_is_done_to_one_frame_and_told_apart() {
    let plain = undisturbed().await;
    for (action, pixels) in [
        ("kind = 'corrupt', share = 0.2", 0.15..0.35),
        ("kind = 'blur', px = 6", 0.01..0.5),
        ("kind = 'exposure', factor = 0.3", 0.5..1.01),
        ("kind = 'exposure', factor = 3.0", 0.5..1.01),
        ("kind = 'occluder', width = 0.15, for_s = 0.01", 0.01..0.4),
        ("kind = 'depth_holes', share = 0.1", -0.1..1e-9),
        ("kind = 'bump_camera', by_m = [0.05, 0.0, 0.0], for_s = 0.01", 0.05..1.0),
    ] {
        let frames = second_of_four(action).await;
        assert_eq!(
            (&frames[0], &frames[2], &frames[3]),
            (&plain[0], &plain[2], &plain[3]),
            "{action}"
        );
        let share = changed(&frames[1], &plain[1]);
        assert!(pixels.contains(&share), "{action}: {share}");
        assert_eq!(frames[1].model, plain[1].model, "{action}");
        assert_ne!(frames[1], plain[1]);
        assert_eq!(frames, second_of_four(action).await, "the same seed does the same");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn each_disturbance_of_a_picture_has_its_mark() {
    let plain = &undisturbed().await[1];
    let at = async |action: &str| second_of_four(action).await.swap_remove(1);
    let no_depth = |frame: &Frame| depth(frame).iter().filter(|metres| **metres == 0.0).count();

    let blurred = at("kind = 'blur', px = 6").await;
    assert!(sharpness(&blurred) < 0.5 * sharpness(plain) && blurred.depth_m == plain.depth_m);
    assert!((mean(&blurred) - mean(plain)).abs() < 2.0);

    let dark = at("kind = 'exposure', factor = 0.3").await;
    let bright = at("kind = 'exposure', factor = 12.0").await;
    assert!(mean(&dark) < 0.7 * mean(plain) && mean(&bright) > 1.2 * mean(plain));
    let n_white = bright.rgb.chunks_exact(3).filter(|pixel| *pixel == [255; 3]).count();
    assert!(n_white > bright.rgb.len() / 100, "{n_white}");
    assert_eq!(dark.depth_m, plain.depth_m);

    let torn = at("kind = 'corrupt', share = 0.2").await;
    assert!(sharpness(&torn) > 1.5 * sharpness(plain) && torn.depth_m != plain.depth_m);

    let holes = at("kind = 'depth_holes', share = 0.1").await;
    let n_holes = no_depth(&holes) - no_depth(plain);
    let share = n_holes as f64 / depth(plain).len() as f64;
    assert!((0.1..0.15).contains(&share) && holes.rgb == plain.rgb, "{share}");

    let covered = at("kind = 'occluder', width = 0.15, for_s = 0.01").await;
    let nearest = depth(plain).iter().copied().filter(|metres| *metres > 0.0).fold(9.0, f32::min);
    let hand: Vec<usize> =
        (0..depth(plain).len()).filter(|idx| depth(&covered)[*idx] < 0.9 * nearest).collect();
    assert!(hand.len() > depth(plain).len() / 100);
    assert!(hand.iter().all(|idx| covered.rgb[3 * idx] > covered.rgb[3 * idx + 2]), "skin");

    // What stands still is where it was, seen from 5 cm to the right: everything moves to the left.
    let bumped = at("kind = 'bump_camera', by_m = [0.05, 0.0, 0.0], for_s = 0.01").await;
    assert_ne!(bumped.depth_m, plain.depth_m);
    let turn = format!("kind = 'bump_camera', by_m = [0.0, 0.0, 0.0], by_rad = {}", PI / 30.0);
    assert_ne!(at(&turn).await.rgb, bumped.rgb);
}

/// A bump without an end stays; every frame says the place where the camera should be.
#[tokio::test(flavor = "multi_thread")]
async fn a_bumped_camera_stays_where_it_is() {
    let frames = second_of_four("kind = 'bump_camera', by_m = [0.03, 0.0, 0.0]").await;
    let plain = undisturbed().await;
    for idx in 1..4 {
        assert!(changed(&frames[idx], &plain[idx]) > 0.02, "{idx}");
        assert_eq!(frames[idx].model, plain[idx].model);
    }
}

/// The hand is at another place with another seed.
#[tokio::test(flavor = "multi_thread")]
async fn places_are_drawn_from_the_seed() {
    let text = fault("at_s = 0", "kind = 'occluder', width = 0.1, for_s = 0.01");
    let mut places = Vec::new();
    for seed in 1..=3 {
        let frame = Sight::new(&text, seed).frame().await;
        let nearest = depth(&frame).iter().copied().filter(|m| *m > 0.0).fold(9.0, f32::min);
        places.push(depth(&frame).iter().position(|metres| *metres == nearest));
    }
    assert!(places[0] != places[1] && places[1] != places[2], "{places:?}");
}

/// A camera that is restarted shows the frame that waits for an answer as it was.
#[tokio::test(flavor = "multi_thread")]
async fn a_restarted_camera_shows_the_same_again() {
    for action in [
        "kind = 'corrupt', share = 0.2",
        "kind = 'freeze', for_s = 0.2",
        "kind = 'late_frame', by_s = 0.05",
        "kind = 'occluder', width = 0.1, for_s = 0.1",
    ] {
        let mut sight = Sight::new(&fault("frame = 'main'\nnth = 3", action), 1);
        sight.frames(2).await;
        let before = sight.frame().await;
        sight.camera = SimCamera::new(sight.bench.hardware.clone(), "main").unwrap();
        assert_eq!(sight.frame().await, before, "{action}");
        assert_eq!(sight.bench.hardware.faults().len(), 1, "{action}");
    }
}

/// What a detector would say that sees two blocks where they are.
fn detected(sight: &Sight, names: &[&str]) -> Vec<Detection> {
    let camera = sight.bench.hardware.camera("main").unwrap();
    let model = crate::hardware::sim::model_of(camera);
    let detection = |name: &&str| {
        let at = sight.bench.hardware.oracle().0.body(name).unwrap().position;
        let seen = model.world_from_camera.inverse() * at;
        let k = model.intrinsics;
        let (x, y) = (k.fx * seen.x / seen.z + k.cx, k.fy * seen.y / seen.z + k.cy);
        let half = 0.025 * k.fx / seen.z;
        let pixel_box = PixelBox::from([x - half, y - half, x + half, y + half]);
        Detection::new("block".into(), name.split('_').next().unwrap().into(), pixel_box)
    };
    names.iter().map(detection).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn detectors_miss_invent_and_misplace() {
    let names = ["green_block", "yellow_block"];
    let labels =
        |found: &[Detection]| found.iter().map(|d| d.label.to_string()).collect::<Vec<String>>();
    for (action, expected) in [
        ("kind = 'miss_detection', object = 'green_block'", vec!["yellow"]),
        ("kind = 'false_detection', label = 'pink'", vec!["green", "yellow", "pink"]),
        (
            "kind = 'misplace_detection', object = 'yellow_block', by_px = [40, 0]",
            vec!["green", "yellow"],
        ),
    ] {
        let mut sight = Sight::new(&fault("frame = 'main'\nnth = 2", action), 1);
        let plain = detected(&sight, &names);
        for number in 0..3 {
            sight.frames(1).await;
            let mut found = plain.clone();
            sight.bench.hardware.disturb_detections("main", number, &mut found);
            let mut again = plain.clone();
            sight.bench.hardware.disturb_detections("main", number, &mut again);
            assert_eq!(found, again, "a restarted actor sees the same");
            if number != 1 {
                assert_eq!(found, plain, "{action}");
                continue;
            }
            assert_eq!(labels(&found), expected, "{action}");
            let moved_px = found[found.len() - 1].pixel_box.x1 - plain[1].pixel_box.x1;
            assert_eq!(moved_px == 40.0, action.contains("misplace"), "{action}: {moved_px}");
        }
        let [record] = &sight.bench.hardware.faults()[..] else { panic!("one fault") };
        assert!(record.happened, "{}", record.said);
    }
}

/// An object that the detector does not see anyhow cannot be missed.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_seen_cannot_be_missed() {
    let text = fault("at_s = 0", "kind = 'miss_detection', object = 'red_block'");
    let mut sight = Sight::new(&text, 1);
    let mut found = detected(&sight, &["green_block"]);
    sight.frames(1).await;
    sight.bench.hardware.disturb_detections("main", 0, &mut found);
    assert_eq!(found.len(), 1);
    let [record] = &sight.bench.hardware.faults()[..] else { panic!("one fault") };
    assert!(!record.happened && record.said.contains("does not see red_block"));
}

/// Frames are occasions for every kind of fault, and other occasions for those of frames.
#[tokio::test(flavor = "multi_thread")]
async fn frames_are_occasions_like_others() {
    let times = async |keys: &str, action: &str| {
        let mut sight = Sight::new(&fault(keys, action), 1);
        sight.frames(6).await;
        let records = sight.bench.hardware.faults();
        records.iter().map(|record| (record.at_ns as f64 * RATE_HZ / 1e9).round() as u64).collect()
    };
    let blur = "kind = 'blur', px = 2";
    let at: Vec<u64> = times("frame = 'any'\nnth = 2", blur).await;
    assert_eq!(at, [1]);
    assert_eq!(times("frame = 'main'\nevery = true", blur).await, [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(times("frame = 'main'\nafter_s = 0.06", blur).await, [2]);
    assert_eq!(times("at_s = 0.1", blur).await, [3]);
    assert_eq!(times("frame = 'back'\nevery = true", blur).await, [0; 0]);
    let world = "kind = 'remove', object = 'green_block'";
    assert_eq!(times("frame = 'main'\nnth = 3", world).await, [2]);
    let mut sight = Sight::new(&fault("holding = 'any'", blur), 1);
    sight.bench.pick();
    assert_eq!(sight.bench.hardware.faults().len(), 1);
}

#[test]
fn every_kind_of_the_cameras_belongs_to_their_group() {
    let schema = serde_json::to_value(schemars::schema_for!(Disturbance)).unwrap();
    let kinds = schema["oneOf"].as_array().unwrap().iter();
    let kinds: Vec<&str> =
        kinds.map(|kind| kind["properties"]["kind"]["const"].as_str().unwrap()).collect();
    assert_eq!(kinds, SensingFault::KINDS);
}
