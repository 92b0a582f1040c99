//! Wire ↔ core. Whatever comes from shared memory is checked here, once, and never trusted before.

mod context;
mod device;
mod dispatch;
mod loop_state;
mod plan;
mod report;
mod request;
mod task;
mod text;
#[cfg(test)]
mod tests;

use crate::mismatch::listed;
use std::fmt::Display;

use thiserror::Error;

pub use context::WireContext;
pub use device::{
    FRAME_SIDE_MAX, RgbFrame, RgbView, command_from_wire, command_to_wire, depth_from_wire,
    depth_to_bytes, device_header, frame_from_wire, frame_header, robot_state_from_wire,
    robot_state_to_wire, status_from_wire, status_to_wire,
};
pub use dispatch::{dispatch_from_wire, dispatch_to_wire};
pub use loop_state::{
    control_from_wire, control_to_wire, decision_from_wire, decision_to_wire, health_from_wire,
    health_to_wire,
};
pub use plan::{plan_from_wire, plan_to_wire};
pub use report::{
    end_from_wire, end_to_wire, event_from_wire, event_to_wire, run_from_wire, run_to_wire,
};
pub use request::{
    TASK_ID_BYTES_MAX, TASK_TEXT_BYTES_MAX, task_request_from_wire, task_request_to_wire,
    task_status_from_wire, task_status_to_wire,
};
pub use task::{
    goal_from_wire, goal_to_wire, outcome_from_wire, outcome_to_wire, scene_from_wire,
    scene_to_wire,
};

/// A message from shared memory does not say what it should. It is dropped, and the run goes on.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("message rejected: {field}: expected {expected}, got {got}")]
pub struct WireError {
    /// Name of the field in the wire record.
    pub field: &'static str,
    /// What it may be.
    pub expected: String,
    /// What it is.
    pub got: String,
}

impl WireError {
    fn new(field: &'static str, expected: impl Display, got: impl Display) -> Self {
        Self { field, expected: expected.to_string(), got: got.to_string() }
    }
}

/// The only record of a message that has exactly one.
fn single<'a, R>(field: &'static str, records: &'a [R]) -> Result<&'a R, WireError> {
    match records {
        [record] => Ok(record),
        _ => Err(WireError::new(field, "one record", records.len())),
    }
}

fn finite<const N: usize>(field: &'static str, values: [f64; N]) -> Result<[f64; N], WireError> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(values)
    } else {
        Err(WireError::new(field, "finite numbers", listed(values)))
    }
}

fn flag(field: &'static str, value: u32) -> Result<bool, WireError> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(WireError::new(field, "0 or 1", value)),
    }
}
