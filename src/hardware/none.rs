//! No robot: the first confirmed plan is the result.

use super::RobotPort;
use crate::parts::{Part, no_options};

/// The entry of the table of robots.
pub(super) const ROBOT: Part<RobotPort> = Part {
    name: "none",
    help: "nothing acts: the first confirmed plan is the result",
    options: no_options,
    build: |_| Ok(Box::new(RobotPort { acts: false, open: None, faults: None })),
};
