//! `examples/ros2_bridge.py`: what converts messages, with messages that look like those of ROS.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::process::{Command, Output};

use crate::common::project;

fn python(args: &[&str]) -> Output {
    let mut command = Command::new("python3");
    command.args(args).env("PYTHONPATH", project("examples")).current_dir(project(""));
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    command.output().unwrap()
}

/// Whether Python has a module.
fn has(module: &str) -> bool {
    let import = Command::new("python3").args(["-c", &format!("import {module}")]).output();
    import.is_ok_and(|output| output.status.success())
}

/// Each line is true of the module.
const CONVERSIONS: &str = r#"
import math, numpy as np
from types import SimpleNamespace as M
import ros2_bridge as b

def image(encoding, rows, step, big=0):
    return M(encoding=encoding, width=2, height=len(rows), step=step, is_bigendian=big, data=b"".join(rows))

def raises(text, call, *args):
    try:
        call(*args)
    except ValueError as error:
        assert text in str(error), error
    else:
        raise AssertionError(text)

# Pictures, with two bytes behind each row.
pad = b"\xff\xff"
assert b.rgb_of(image("rgb8", [bytes([1, 2, 3, 4, 5, 6]) + pad], 8)).tolist() == [[[1, 2, 3], [4, 5, 6]]]
assert b.rgb_of(image("bgr8", [bytes([1, 2, 3, 4, 5, 6]) + pad] * 2, 8)).tolist() == [[[3, 2, 1], [6, 5, 4]]] * 2
assert b.rgb_of(image("bgra8", [bytes([1, 2, 3, 9, 4, 5, 6, 9])], 8)).tolist() == [[[3, 2, 1], [6, 5, 4]]]
assert b.rgb_of(image("mono8", [bytes([7, 8])], 2)).tolist() == [[[7, 7, 7], [8, 8, 8]]]
assert b.rgb_of(image("rgba8", [bytes(8)], 8)).flags["C_CONTIGUOUS"]
raises('got "bayer_rggb8"', b.rgb_of, image("bayer_rggb8", [bytes(2)], 2))
raises("got step 5 and", b.rgb_of, image("rgb8", [bytes(5)], 5))
raises("and 8 bytes", b.rgb_of, M(encoding="rgb8", width=2, height=2, step=8, is_bigendian=0, data=bytes(8)))

# Depth: millimetres in either order of bytes, metres with gaps.
assert np.allclose(b.depth_of(image("16UC1", [bytes([0xE8, 3, 0, 0]) + pad], 6)), [[1.0, 0.0]])
assert np.allclose(b.depth_of(image("16UC1", [bytes([3, 0xE8, 0, 1])], 4, 1)), [[1.0, 0.001]])
gaps = np.array([[1.5, np.nan], [np.inf, -1.0]], "<f4")
assert b.depth_of(image("32FC1", [gaps.tobytes()[:8], gaps.tobytes()[8:]], 8)).tolist() == [[1.5, 0.0], [0.0, 0.0]]
raises("depth encoding", b.depth_of, image("rgb8", [bytes(6)], 6))

# Intrinsics.
info = M(width=640, height=480, k=[600.0, 0, 320.0, 0, 601.0, 240.0, 0, 0, 1])
assert b.intrinsics_of(info, (640, 480)) == (600.0, 601.0, 320.0, 240.0)
raises("got 640x480", b.intrinsics_of, info, (320, 240))
raises("not calibrated", b.intrinsics_of, M(width=2, height=2, k=[0.0] * 9), (2, 2))

# Poses: a quarter turn about z takes x to y.
s = math.sqrt(0.5)
turned = b.matrix_of(M(x=1.0, y=2.0, z=3.0), M(x=0.0, y=0.0, z=s, w=s))
assert np.allclose(turned @ [1, 0, 0, 1], [1, 3, 3, 1])
assert np.allclose(b.matrix_of(M(x=0, y=0, z=0), M(x=0, y=0, z=2 * s, w=2 * s))[:3, :3], turned[:3, :3])
raises("unit quaternion", b.matrix_of, M(x=0, y=0, z=0), M(x=0, y=0, z=0, w=0))

# What is told to an arm is what is read of it, fingers down.
for yaw in (-3.0, -1.0, 0.0, 0.5, 3.1):
    x, y, z, w = b.down_with(yaw)
    matrix = b.matrix_of(M(x=0, y=0, z=0), M(x=x, y=y, z=z, w=w))
    assert np.allclose(matrix[:3, 2], [0, 0, -1]), matrix
    assert math.isclose(b.yaw_of(matrix), yaw), (yaw, b.yaw_of(matrix))
assert math.isclose(b.apart_rad(3.1, -0.01), math.pi - 3.11) and b.apart_rad(0.2, 0.1) < 0.11

# The gripper.
joints = M(name=["a", "left", "right"], position=[1.0, 0.02, 0.021])
assert math.isclose(b.opening_of(joints, ["left", "right"]), 0.041)
raises("expected middle among", b.opening_of, joints, ["middle"])
jaws = b.Jaws()
jaws.hear(0.08, 0.0)
jaws.want(0.0, 1.0)
assert not jaws.is_at_rest(1.1) and not jaws.is_holding(1.1), "it has just been told to close"
jaws.hear(0.05, 1.2)
assert not jaws.is_holding(1.3)
jaws.hear(0.05, 1.7)
assert jaws.is_holding(1.7) and jaws.is_at_rest(1.7), "it has closed on something"
jaws.hear(0.0, 2.0)
assert not jaws.is_holding(9.0) and jaws.is_at_rest(9.0), "closed on nothing"
jaws.want(0.08, 9.0)
assert not jaws.is_at_rest(99.0), "it should open and does not"

# Stamps.
assert b.monotonic_of(900, 1000, 50_000) == 49_900
assert b.monotonic_of(0, 1000, 50_000) == 50_000 and b.monotonic_of(2000, 1000, 50_000) == 50_000
assert b.nanoseconds(M(sec=2, nanosec=5)) == 2_000_000_005
"#;

#[test]
fn messages_of_ros_are_converted() {
    if !has("numpy") {
        println!("skipped: the ROS 2 bridge: pip install numpy");
        return;
    }
    let ended = python(&["-c", CONVERSIONS]);
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
fn without_ros_it_says_what_is_missing() {
    if !has("numpy") || has("rclpy") {
        println!("skipped: a Python with numpy and without rclpy");
        return;
    }
    let ended = python(&["examples/ros2_bridge.py", "run"]);
    assert_eq!(ended.status.code(), Some(5));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(said.contains("rclpy is missing"), "{said}");
}
