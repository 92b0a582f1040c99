//! Files as ROS and `OpenCV` write them, lenses as `OpenCV` bends them, and files that are none.

use proptest::prelude::*;

use super::*;

/// As `cv::FileStorage` of `OpenCV` 4.14 writes it.
const OPENCV: &str = "%YAML:1.0
---
calibration_time: Mon
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 612., 0., 325.5, 0., 608., 236., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.12, 0.050000000000000003, 0.001, -0.00050000000000000001,
       0. ]
image_points: !!opencv-matrix
   rows: 2
   cols: 3
   dt: \"2f\"
   data: [ 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0. ]
";

/// As `camera_calibration` of ROS writes it.
const ROS: &str = "image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [612.0, 0.0, 325.5, 0.0, 608.0, 236.0, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.12, 0.05, 0.001, -0.0005, 0.0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [600, 0, 320, 0, 0, 600, 240, 0, 0, 0, 1, 0]
";

/// As `ros2 topic echo --once` prints a message.
const ECHO: &str = "header:
  stamp:
    sec: 1700000000
    nanosec: 0
  frame_id: camera
height: 480
width: 640
distortion_model: plumb_bob
d:
- -0.12
- 0.05
- 0.001
- -0.0005
- 0.0
k:
- 612.0
- 0.0
- 325.5
- 0.0
- 608.0
- 236.0
- 0.0
- 0.0
- 1.0
binning_x: 0
---
";

fn known() -> Calibration {
    let matrix = [612.0, 0.0, 325.5, 0.0, 608.0, 236.0, 0.0, 0.0, 1.0];
    let lens = Distortion::of_model("", &[-0.12, 0.05, 0.001, -0.0005, 0.0]).unwrap();
    Calibration::of_matrix(Some([640, 480]), &matrix, lens).unwrap()
}

#[test]
fn the_files_of_ros_and_opencv_say_the_same() {
    for text in [OPENCV, ROS, ECHO] {
        assert_eq!(parse_calibration(text), Ok(known()), "{text}");
    }
}

/// `cv2.projectPoints` and `cv2.fisheye.distortPoints` of the same rays.
#[test]
fn lenses_bend_as_those_of_opencv() {
    let displaced = |model: &str, coefficients: &[f64]| {
        let distortion = Distortion::of_model(model, coefficients).unwrap();
        Calibration { distortion, ..known() }.displacement_px([640, 480]).unwrap().unwrap()
    };
    let close = |got: f64, wanted: f64| assert!((got - wanted).abs() < 1e-6, "{got}, {wanted}");
    close(displaced("plumb_bob", &[-0.12, 0.05, 0.001, -0.0005, 0.0]), 17.286_474_38);
    close(displaced("equidistant", &[0.02, -0.01, 0.003, -0.001]), 45.687_656_063_9);
    let rational = [0.1, -0.05, 0.001, 0.002, 0.01, 0.2, -0.1, 0.05, 0.001, 0.002, -0.001, 0.0005];
    close(displaced("rational_polynomial", &rational), 15.999_343_537_9);
    close(displaced("plumb_bob", &[]), 0.0);
    let odd =
        Calibration { distortion: Distortion::of_model("ftheta", &[1.0]).unwrap(), ..known() };
    assert_eq!(odd.displacement_px([640, 480]), Ok(None));
}

/// The middle of the picture stays the middle, and its corners the corners.
#[test]
fn intrinsics_follow_the_size_of_the_frames() {
    let half = known().at([320, 240]).unwrap();
    assert_eq!((half.fx, half.fy), (306.0, 304.0));
    assert_eq!((half.cx, half.cy), (162.5, 117.75));
    assert_eq!(known().at([640, 480]), Ok(known().intrinsics));
    let said = known().at([640, 360]).unwrap_err();
    assert!(said.contains("640x480 pixels, the frames are 640x360"), "{said}");
    assert!(known().at([0, 0]).is_err());
}

#[test]
fn what_is_no_calibration_is_told_by_its_key() {
    for (from, to, expect) in [
        ("camera_matrix", "matrix", "expected a camera matrix"),
        ("612.0, 0.0", "612.0", "camera_matrix: expected 9 numbers"),
        ("612.0", "-612.0", "camera_matrix: expected positive focal lengths"),
        ("612.0, 0.0", "612.0, 0.5", "without skew"),
        ("612.0", "many", "camera_matrix: expected a number, got \"many\""),
        ("image_width: 640", "image_width: -1", "image_width: expected a number of pixels"),
        ("image_width: 640", "", "image_height: expected width and height, or neither"),
        ("-0.12, ", "", ""),
        ("-0.12, 0.05, ", "", "distortion_coefficients: expected 0, 4, 5, 8, 12 or 14"),
        ("camera_matrix:", "camera_matrix: {", "line"),
    ] {
        let read = parse_calibration(&ROS.replacen(from, to, 1));
        match read {
            Ok(_) => assert_eq!(expect, "", "{from} -> {to}"),
            Err(said) => assert!(!expect.is_empty() && said.contains(expect), "{to}: {said}"),
        }
    }
}

proptest! {
    /// Bytes changed here and there are a calibration or an error.
    #[test]
    fn foreign_files_are_no_panic(
        changes in proptest::collection::vec((0..900_usize, any::<char>()), 1..8),
        which in 0..3_usize,
    ) {
        let mut text: Vec<char> = [OPENCV, ROS, ECHO][which].chars().collect();
        for (at, new) in changes {
            if let Some(old) = text.get_mut(at) {
                *old = new;
            }
        }
        let text: String = text.into_iter().collect();
        if let Ok(calibration) = parse_calibration(&text) {
            let size = calibration.image_size.unwrap_or([640, 480]);
            prop_assert!(calibration.at(size).is_ok());
        }
    }

    #[test]
    fn deep_files_are_no_panic(depth in 1..200_000_usize) {
        prop_assert!(parse_calibration(&"[".repeat(depth)).is_err());
    }
}
