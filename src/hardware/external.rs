//! A camera and a robot that other processes play, over the topics of the run.

use super::{CameraPort, EXTERNAL, RobotPort};
use crate::parts::{Part, no_options};

/// The entry of the table of cameras.
pub(super) const CAMERA: Part<CameraPort> = Part {
    name: EXTERNAL,
    help: "another process publishes camera/ID/rgb, and camera/ID/depth where it has depth (ID: main, or its name)",
    options: no_options,
    build: |_| Ok(Box::new(CameraPort::default())),
};

/// The entry of the table of robots.
pub(super) const ROBOT: Part<RobotPort> = Part {
    name: EXTERNAL,
    help: "another process reads robot/command, and publishes robot/state and robot/status",
    options: no_options,
    build: |_| Ok(Box::new(RobotPort { acts: true, open: None, faults: None })),
};
