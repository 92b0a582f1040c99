//! Recordings that other libraries have written (`tests/attach/recordings/make.py`), and files that are none.

use std::path::PathBuf;

use proptest::prelude::*;

use super::source::RecordedFrame;
use super::*;
use crate::geometry::Intrinsics;
use crate::hardware::calibration::{Calibration, Distortion};

const ROS2: &str = "ros2.mcap";
const SIZE: [u32; 2] = [16, 8];

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/attach/recordings").join(name)
}

fn topics(colour: &str, depth: Option<&str>) -> Topics {
    Topics {
        colour: colour.to_owned(),
        depth: depth.map(str::to_owned),
        calibration: info_topic(colour),
        yuv: YuvColours::Bt601,
    }
}

fn frames(name: &str, topics: &Topics) -> Vec<RecordedFrame> {
    let mut recording = Recording::open(&file(name), topics).unwrap();
    let frames = std::iter::from_fn(|| recording.next().unwrap()).collect();
    assert_eq!(recording.n_broken, 0);
    frames
}

/// The picture that the recordings show as frame `n`.
fn picture(n: u8) -> Vec<u8> {
    let fields = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 100, 50]];
    let colours = fields.map(|colour: [u8; 3]| colour.repeat(4)).concat().repeat(4);
    [colours, vec![40 * n; 16 * 4 * 3]].concat()
}

#[track_caller]
fn close(got: &[u8], wanted: &[u8], off: u8) {
    assert_eq!(got.len(), wanted.len());
    let far = got.iter().zip(wanted).position(|(a, b)| a.abs_diff(*b) > off);
    assert_eq!(far, None, "{got:?}");
}

#[test]
fn every_frame_of_a_topic_comes_in_order_at_its_time() {
    let all = frames(ROS2, &topics("/camera/image_raw", None));
    assert_eq!(all.len(), 4);
    for (n, frame) in (0..).zip(&all) {
        assert_eq!((&frame.rgb, frame.size), (&picture(n), SIZE), "{n}: rows have a step");
        assert_eq!(frame.log_ns, 1_700_000_000_000_000_000 + u64::from(n) * 50_000_000);
        assert_eq!(frame.depth_m, None);
    }
}

#[test]
fn every_encoding_has_the_same_colours() {
    for (topic, off) in [
        ("/camera/bgr8/image_raw", 0),
        ("/camera/rgba8/image_raw", 0),
        ("/camera/bgra8/image_raw", 0),
        ("/camera/yuv422_yuy2/image_raw", 2),
        ("/camera/yuv422/image_raw", 2),
        ("/camera/nv12/image_raw", 2),
        ("/png/compressed", 0),
    ] {
        let all = frames(ROS2, &topics(topic, None));
        assert_eq!(all.len(), 1, "{topic}");
        close(&all[0].rgb, &picture(0), off);
    }
    let grey = &frames(ROS2, &topics("/camera/mono8/image_raw", None))[0];
    assert_eq!(grey.rgb[..3], [255; 3]);
    assert_eq!(grey.rgb[12..15], [0; 3]);
    // JPEG shares colours between pixels: the middle of a field is its colour.
    let jpeg = &frames(ROS2, &topics("/jpeg/compressed", None))[0];
    close(&jpeg.rgb[3..6], &[255, 0, 0], 30);
    assert_eq!(jpeg.size, SIZE);
}

#[test]
fn depth_goes_with_the_colours_of_its_moment() {
    for depth in ["/depth/image_raw", "/depth/big", "/depth/metres"] {
        let all = frames(ROS2, &topics("/camera/image_raw", Some(depth)));
        assert_eq!(all.len(), 4, "{depth}");
        for (n, frame) in (0_u16..).zip(&all) {
            let depth_m = frame.depth_m.as_ref().unwrap();
            assert_eq!(depth_m[0], 0.0, "{depth}");
            let wanted = f32::from(1000 + n) / 1000.0;
            assert!((depth_m[1] - wanted).abs() < 1e-6, "{depth} {n}: {}", depth_m[1]);
        }
    }
    let packed = frames(ROS2, &topics("/camera/image_raw", Some("/depth/compressedDepth")));
    let has_depth: Vec<bool> = packed.iter().map(|frame| frame.depth_m.is_some()).collect();
    assert_eq!(has_depth, [true, false, false, false], "colours go on without depth");
}

#[test]
fn the_calibration_beside_the_pictures_is_found() {
    let glance = |name: &str, topics: &Topics| {
        Recording::open(&file(name), topics).unwrap().glance().unwrap()
    };
    let raw = Intrinsics { fx: 20.0, fy: 21.0, cx: 7.5, cy: 3.5 };
    let lens = Distortion::of_model("plumb_bob", &[0.01, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let wanted = Calibration { image_size: Some(SIZE), intrinsics: raw, distortion: lens };
    let found = glance(ROS2, &topics("/camera/image_raw", None));
    assert_eq!((found.size, found.calibration.as_ref()), (SIZE, Some(&wanted)));
    assert_eq!(glance(ROS2, &topics("/png/compressed", None)).calibration, None);
    let found = glance("foxglove_json.mcap", &topics("/raw", None));
    assert_eq!(found.calibration.as_ref(), Some(&wanted));
    let rectified = pictures_of_a_rectified_topic();
    assert_eq!(rectified.intrinsics, Intrinsics { fx: 19.0, fy: 19.5, cx: 7.0, cy: 3.0 });
    assert_eq!(rectified.distortion, Distortion::NONE);
}

/// The calibration of the recording, as it holds for rectified pictures.
fn pictures_of_a_rectified_topic() -> Calibration {
    let bytes = std::fs::read(file(ROS2)).unwrap();
    let mut messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let info = messages.find(|m| m.channel.topic.ends_with("camera_info")).unwrap();
    let schema = "sensor_msgs/msg/CameraInfo";
    let recorded = pictures::Recorded { schema, encoding: "cdr", data: &info.data };
    pictures::calibration(recorded, true).unwrap()
}

#[test]
fn messages_of_foxglove_are_read_as_protobuf_and_json() {
    let raw = &frames("foxglove.mcap", &topics("/camera/raw", Some("/camera/depth")))[0];
    assert_eq!(raw.rgb, picture(1));
    assert!((raw.depth_m.as_ref().unwrap()[1] - 1.001).abs() < 1e-6);
    assert_eq!(frames("foxglove.mcap", &topics("/camera/png", None))[0].rgb, picture(1));
    assert_eq!(frames("foxglove_json.mcap", &topics("/raw", None))[0].rgb, picture(2));
}

#[tokio::test]
async fn frames_are_due_as_they_were_recorded_or_at_a_rate() {
    let playing = Playing {
        path: file(ROS2),
        topics: topics("/camera/image_raw", None),
        size: SIZE,
        model: None,
        is_again: false,
    };
    let mut camera = RecordedCamera::open(playing.clone(), None).unwrap();
    let first = camera.due(7_000);
    assert_eq!(camera.due(7_000 + 50_000_000) - first, Duration::from_millis(50));
    assert_eq!(camera.due(0), first, "a clock that went back");
    let pace = Duration::from_millis(20);
    let mut camera = RecordedCamera::open(playing, Some(pace)).unwrap();
    let first = camera.due(7_000);
    camera.due = Some(first);
    assert!(camera.due(7_001) >= first + pace);
}

#[test]
fn what_is_not_there_is_told_with_what_is() {
    let told = |name: &str, colour: &str| {
        let glance = Recording::open(&file(name), &topics(colour, None));
        glance.and_then(Recording::glance).unwrap_err().to_string()
    };
    let said = told(ROS2, "/camera/image");
    assert!(said.contains("ros2.mcap: no picture on the topic \"/camera/image\""), "{said}");
    assert!(said.contains("\"/camera/image_raw\", ") && !said.contains("camera_info"), "{said}");
    let said = told(ROS2, "/depth/image_raw");
    assert!(said.contains("say it as camera.options.depth_topic"), "{said}");
    let said = told("make.py", "/camera/image_raw");
    assert!(said.contains("make.py: "), "{said}");
    assert!(told("none.mcap", "/camera/image_raw").contains("No such file"));
}

/// Plays what there is of a recording; whatever comes of it, it comes to an end.
fn played(bytes: &[u8]) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changed.mcap");
    std::fs::write(&path, bytes).unwrap();
    let topics = topics("/camera/image_raw", Some("/depth/image_raw"));
    let mut recording = Recording::open(&path, &topics).unwrap();
    let mut n = 0;
    while let Ok(Some(_)) = recording.next() {
        n += 1;
    }
    n
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn changed_recordings_are_no_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        length in any::<prop::sample::Index>(),
        is_cut: bool,
    ) {
        let mut bytes = std::fs::read(file(ROS2)).unwrap();
        for (at, new) in changes {
            let n = bytes.len();
            bytes[at.index(n)] = new;
        }
        if is_cut {
            bytes.truncate(length.index(bytes.len()));
        }
        prop_assert!(played(&bytes) <= 4);
    }

    /// Messages that are not what their schema says.
    #[test]
    fn foreign_messages_are_no_panic(
        data in proptest::collection::vec(any::<u8>(), 0..400),
        is_little: bool,
        schema in 0..pictures::PICTURES.len(),
        encoding in 0..3_usize,
    ) {
        let data = [&[0, u8::from(is_little), 0, 0][..], &data].concat();
        let encoding = ["cdr", "protobuf", "json"][encoding];
        let schema = pictures::PICTURES[schema];
        let recorded = pictures::Recorded { schema, encoding, data: &data };
        let _said = pictures::picture(recorded, YuvColours::Bt601);
        for schema in ["sensor_msgs/msg/CameraInfo", "foxglove.CameraCalibration"] {
            let recorded = pictures::Recorded { schema, ..recorded };
            let _said = pictures::calibration(recorded, false);
        }
    }
}
