//! Frames, robot states, commands and statuses.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};

use super::plan::{any_step_from_wire, step_to_wire};
use super::text::{text_from_wire, text_to_wire};
use super::{WireError, finite, flag, single};
use crate::geometry::{CameraModel, Intrinsics};
use crate::messages::{
    Command, CommandKind, Expect, Frame, Motion, RobotState, Status, StatusKind, Waypoint,
};
use crate::transport::Received;
use crate::transport::wire::{
    CommandRecord, DeviceHeader, FrameHeader, RobotStateRecord, SCHEMA, StatusRecord,
    WAYPOINTS_MAX, WaypointRecord,
};

/// `FrameHeader::encoding` of packed RGB8.
const ENCODING_RGB8: u32 = 0;
/// `FrameHeader::encoding` of little-endian f32 metres.
const ENCODING_DEPTH_F32: u32 = 1;
/// Largest width and height of a frame, in pixels.
pub const FRAME_SIDE_MAX: u32 = 8192;

/// A checked RGB frame, still in shared memory.
#[derive(Debug, Clone, Copy)]
pub struct RgbView<'a> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Packed RGB8, `width * height * 3` bytes.
    pub rgb: &'a [u8],
    /// Intrinsics and pose, where both are known.
    pub model: Option<CameraModel>,
}

/// The header of a frame; `depth` says which of its two pictures.
pub fn frame_header(frame: &Frame, depth: bool) -> FrameHeader {
    let bytes_per_pixel = if depth { 4 } else { 3 };
    let mut header = FrameHeader {
        schema: SCHEMA,
        encoding: if depth { ENCODING_DEPTH_F32 } else { ENCODING_RGB8 },
        sequence: frame.sequence,
        capture_ns: frame.capture_ns,
        width: frame.width,
        height: frame.height,
        stride: frame.width * bytes_per_pixel,
        ..FrameHeader::default()
    };
    if let Some(model) = &frame.model {
        let Intrinsics { fx, fy, cx, cy } = model.intrinsics;
        let pose = model.world_from_camera;
        let q = pose.rotation.quaternion();
        header.has_intrinsics = 1;
        (header.fx, header.fy, header.cx, header.cy) = (fx, fy, cx, cy);
        header.has_pose = 1;
        header.world_from_camera_xyz = pose.translation.vector.into();
        header.world_from_camera_xyzw = [q.i, q.j, q.k, q.w];
    }
    header
}

/// Checks an RGB frame.
///
/// # Errors
/// [`WireError`] naming the field: a zero or huge side, another encoding or stride, a payload of
/// the wrong length, intrinsics or a pose that are not numbers.
pub fn frame_from_wire<'a>(
    header: &FrameHeader,
    payload: &'a [u8],
) -> Result<RgbView<'a>, WireError> {
    check_size(header, ENCODING_RGB8, 3, payload)?;
    let (width, height) = (header.width, header.height);
    Ok(RgbView { width, height, rgb: payload, model: model_from_wire(header)? })
}

/// An RGB frame that has been checked, once; its pixels stay in shared memory.
#[derive(Debug)]
pub struct RgbFrame {
    message: Received<FrameHeader, u8>,
    header: FrameHeader,
    model: Option<CameraModel>,
}

impl RgbFrame {
    /// Checks a received frame.
    ///
    /// # Errors
    /// As for [`frame_from_wire`].
    pub fn read(message: Received<FrameHeader, u8>) -> Result<Self, WireError> {
        let header = *message.header();
        let model = frame_from_wire(&header, message.records())?.model;
        Ok(Self { message, header, model })
    }

    /// Number, time stamps, size and camera model of the frame.
    pub fn header(&self) -> &FrameHeader {
        &self.header
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.header.width, self.header.height]
    }

    /// Packed RGB8, row by row.
    pub fn rgb(&self) -> &[u8] {
        self.message.records()
    }

    /// Intrinsics and pose, where both are known.
    pub fn model(&self) -> Option<&CameraModel> {
        self.model.as_ref()
    }
}

/// Checks a depth frame and writes it into `depth_m`, `width * height` values; values that are not
/// finite and positive become 0.
///
/// # Errors
/// [`WireError`] as for [`frame_from_wire`].
pub fn depth_from_wire(
    header: &FrameHeader,
    payload: &[u8],
    depth_m: &mut Vec<f32>,
) -> Result<(), WireError> {
    check_size(header, ENCODING_DEPTH_F32, 4, payload)?;
    let values = payload.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    depth_m.clear();
    depth_m.extend(values.map(|z| if z.is_finite() && z > 0.0 { z } else { 0.0 }));
    Ok(())
}

/// Depth values as they travel: the same bytes.
#[cfg(target_endian = "little")]
pub fn depth_to_bytes(depth_m: &[f32]) -> &[u8] {
    bytemuck::cast_slice(depth_m)
}

fn check_size(
    header: &FrameHeader,
    encoding: u32,
    bytes_per_pixel: u32,
    payload: &[u8],
) -> Result<(), WireError> {
    if header.encoding != encoding {
        return Err(WireError::new("encoding", encoding, header.encoding));
    }
    let sides = 1..=FRAME_SIDE_MAX;
    if !sides.contains(&header.width) || !sides.contains(&header.height) {
        let got = format!("{}x{}", header.width, header.height);
        return Err(WireError::new("width x height", format!("1..={FRAME_SIDE_MAX} each"), got));
    }
    let stride = header.width * bytes_per_pixel;
    if header.stride != stride {
        return Err(WireError::new("stride", stride, header.stride));
    }
    let bytes = stride as usize * header.height as usize;
    if payload.len() != bytes {
        return Err(WireError::new("payload", format!("{bytes} bytes"), payload.len()));
    }
    Ok(())
}

fn model_from_wire(header: &FrameHeader) -> Result<Option<CameraModel>, WireError> {
    let known = flag("has_intrinsics", header.has_intrinsics)?;
    if !(flag("has_pose", header.has_pose)? && known) {
        return Ok(None);
    }
    let [fx, fy, cx, cy] = finite("fx, fy, cx, cy", [header.fx, header.fy, header.cx, header.cy])?;
    if fx <= 0.0 || fy <= 0.0 {
        return Err(WireError::new("fx, fy", "positive focal lengths", format!("{fx}, {fy}")));
    }
    let [x, y, z] = finite("world_from_camera_xyz", header.world_from_camera_xyz)?;
    let [i, j, k, w] = finite("world_from_camera_xyzw", header.world_from_camera_xyzw)?;
    let quaternion = Quaternion::new(w, i, j, k);
    if (quaternion.norm() - 1.0).abs() > 1e-3 {
        let got = quaternion.norm();
        return Err(WireError::new("world_from_camera_xyzw", "a unit quaternion", got));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    let world_from_camera = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    Ok(Some(CameraModel { intrinsics: Intrinsics { fx, fy, cx, cy }, world_from_camera }))
}

/// The header of a device's message.
pub fn device_header(sequence: u64, capture_ns: u64) -> DeviceHeader {
    DeviceHeader { schema: SCHEMA, sequence, capture_ns, ..DeviceHeader::default() }
}

/// Writes a robot state.
pub fn robot_state_to_wire(state: &RobotState) -> RobotStateRecord {
    RobotStateRecord {
        position: state.position.coords.into(),
        yaw_rad: state.yaw_rad,
        opening_m: state.opening_m,
        holding: u32::from(state.holding),
        phase: u32::try_from(state.phase).unwrap_or(u32::MAX),
        command_id: state.command_id.unwrap_or(0),
        answered: state.answered.map_or(0, |sequence| sequence.saturating_add(1)),
    }
}

/// Checks a robot state.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn robot_state_from_wire(
    header: &DeviceHeader,
    records: &[RobotStateRecord],
) -> Result<RobotState, WireError> {
    let record = single("robot state", records)?;
    let position = Point3::from(finite("position", record.position)?);
    let [yaw_rad, opening_m] = finite("yaw_rad, opening_m", [record.yaw_rad, record.opening_m])?;
    Ok(RobotState {
        capture_ns: header.capture_ns,
        position,
        yaw_rad,
        opening_m,
        holding: flag("holding", record.holding)?,
        command_id: (record.command_id != 0).then_some(record.command_id),
        phase: record.phase as usize,
        answered: record.answered.checked_sub(1),
    })
}

/// Writes a command.
///
/// # Errors
/// [`WireError`] when the motion has too many waypoints, or the step a name that is too long.
pub fn command_to_wire(command: &Command) -> Result<CommandRecord, WireError> {
    let (kind, motion) = match &command.kind {
        CommandKind::Continue => (0, None),
        CommandKind::Start(motion) => (1, Some(motion)),
        CommandKind::Cancel => (2, None),
        CommandKind::Hold => (3, None),
    };
    let waypoints = motion.map_or(&[][..], |m| &m.waypoints);
    if waypoints.len() > WAYPOINTS_MAX {
        let expected = format!("at most {WAYPOINTS_MAX}");
        return Err(WireError::new("waypoints", expected, waypoints.len()));
    }
    let mut record = CommandRecord {
        kind,
        n_waypoints: u32::try_from(waypoints.len()).unwrap_or(u32::MAX),
        command_id: command.id,
        frame_sequence: command.frame_sequence,
        has_step: u32::from(command.step.is_some()),
        step: command.step.as_ref().map(step_to_wire).transpose()?.unwrap_or_default(),
        ..CommandRecord::default()
    };
    for (to, from) in record.waypoints.iter_mut().zip(waypoints) {
        *to = WaypointRecord {
            position: from.position.coords.into(),
            yaw_rad: from.yaw_rad,
            opening_m: from.opening_m,
            speed_m_s: from.speed_m_s,
            expect: match from.expect {
                Expect::Anything => 0,
                Expect::Empty => 1,
                Expect::Holding => 2,
            },
            retractable: u32::from(from.retractable),
        };
    }
    Ok(record)
}

/// Checks a command.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn command_from_wire(
    header: &DeviceHeader,
    records: &[CommandRecord],
) -> Result<Command, WireError> {
    let record = single("command", records)?;
    let kind = match record.kind {
        0 => CommandKind::Continue,
        1 => CommandKind::Start(motion_from_wire(record)?),
        2 => CommandKind::Cancel,
        3 => CommandKind::Hold,
        other => return Err(WireError::new("command kind", "0 to 3", other)),
    };
    let has_step = flag("has_step", record.has_step)?;
    Ok(Command {
        id: record.command_id,
        frame_sequence: record.frame_sequence,
        capture_ns: header.capture_ns,
        kind,
        step: has_step.then(|| any_step_from_wire(&record.step)).transpose()?,
    })
}

/// Only a start has waypoints that count: a hold is obeyed whatever stands there.
fn motion_from_wire(record: &CommandRecord) -> Result<Motion, WireError> {
    let n_waypoints = record.n_waypoints as usize;
    let waypoints = record
        .waypoints
        .get(..n_waypoints)
        .ok_or_else(|| WireError::new("n_waypoints", WAYPOINTS_MAX, n_waypoints))?;
    let waypoints = waypoints.iter().map(waypoint_from_wire).collect::<Result<_, _>>()?;
    Ok(Motion { waypoints })
}

fn waypoint_from_wire(record: &WaypointRecord) -> Result<Waypoint, WireError> {
    let position = Point3::from(finite("waypoint position", record.position)?);
    let values = [record.yaw_rad, record.opening_m, record.speed_m_s];
    let [yaw_rad, opening_m, speed_m_s] = finite("waypoint yaw, opening, speed", values)?;
    if speed_m_s <= 0.0 {
        return Err(WireError::new("waypoint speed_m_s", "a positive speed", speed_m_s));
    }
    let expect = match record.expect {
        0 => Expect::Anything,
        1 => Expect::Empty,
        2 => Expect::Holding,
        other => return Err(WireError::new("waypoint expect", "0 to 2", other)),
    };
    let retractable = flag("waypoint retractable", record.retractable)?;
    Ok(Waypoint { position, yaw_rad, opening_m, speed_m_s, expect, retractable })
}

/// Writes a status.
pub fn status_to_wire(status: &Status) -> StatusRecord {
    let (kind, detail) = match &status.kind {
        StatusKind::Accepted => (0, ""),
        StatusKind::Done => (1, ""),
        StatusKind::Failed(reason) => (2, reason.as_str()),
        StatusKind::Cancelled => (3, ""),
    };
    let command_id = status.command_id;
    StatusRecord { command_id, kind, reserved: 0, detail: text_to_wire(detail) }
}

/// Checks a status.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn status_from_wire(
    header: &DeviceHeader,
    records: &[StatusRecord],
) -> Result<Status, WireError> {
    let record = single("status", records)?;
    let kind = match record.kind {
        0 => StatusKind::Accepted,
        1 => StatusKind::Done,
        2 => StatusKind::Failed(text_from_wire("detail", &record.detail)?.to_owned()),
        3 => StatusKind::Cancelled,
        other => return Err(WireError::new("status kind", "0 to 3", other)),
    };
    Ok(Status {
        sequence: header.sequence,
        capture_ns: header.capture_ns,
        command_id: record.command_id,
        kind,
    })
}
