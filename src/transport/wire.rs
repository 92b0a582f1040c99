//! What travels in shared memory: fixed-size `#[repr(C)]` records with versioned names.
//!
//! No pointer, `usize`, `bool` or `String`: another process, in another language, reads the same
//! bytes. Everything read from here is untrusted until `convert` has checked it.

use iceoryx2::prelude::ZeroCopySend;

/// Version of every layout in this file; a reader rejects other versions.
pub const SCHEMA: u32 = 4;

/// Longest name in bytes (objects, predicates, actions).
pub const NAME_BYTES_MAX: usize = 48;

/// Most arguments of one fact or step.
pub const ARGS_MAX: usize = 6;

/// Longest free text in a header, in bytes.
pub const DETAIL_BYTES_MAX: usize = 160;

/// Most waypoints of one motion.
pub const WAYPOINTS_MAX: usize = 16;

/// A name: UTF-8, padded with zero bytes.
pub type NameBytes = [u8; NAME_BYTES_MAX];

/// Every header tells its schema, a number that grows by one per message, and when it was sent.
pub trait WireHeader:
    Copy + Default + std::fmt::Debug + ZeroCopySend + Send + Sync + 'static
{
    /// Layout version.
    fn schema(&self) -> u32;
    /// Number of the message in its stream.
    fn sequence(&self) -> u64;
    /// Run time that the content belongs to, nanoseconds; 0 where it belongs to none.
    fn capture_ns(&self) -> u64;
    /// When it was sent, monotonic nanoseconds.
    fn send_ns(&self) -> u64;
    /// Notes when it is sent (monotonic clock, nanoseconds; for latency figures only), and the how
    /// manieth message of its writer it is, where the header has no number of its own.
    fn stamp(&mut self, send_ns: u64, n_sent: u64);
}

macro_rules! header {
    ($type:ty) => {
        header!($type, |_header: &mut $type, _n_sent: u64| {});
    };
    ($type:ty, $number:expr) => {
        impl WireHeader for $type {
            fn schema(&self) -> u32 {
                self.schema
            }
            fn sequence(&self) -> u64 {
                self.sequence
            }
            fn capture_ns(&self) -> u64 {
                self.capture_ns
            }
            fn send_ns(&self) -> u64 {
                self.send_ns
            }
            fn stamp(&mut self, send_ns: u64, n_sent: u64) {
                self.send_ns = send_ns;
                let number: fn(&mut $type, u64) = $number;
                number(self, n_sent);
            }
        }
    };
}

/// Header of `camera/<id>/rgb` and `camera/<id>/depth`; the payload is the pixels, row by row.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.FrameHeader.v1")]
#[repr(C)]
pub struct FrameHeader {
    /// Version of the wire format, [`SCHEMA`]; other versions are refused.
    pub schema: u32,
    /// 0 = RGB8, 1 = depth as little-endian f32 metres along the optical axis (0 = none).
    pub encoding: u32,
    /// Number of the frame; RGB and depth of one capture share it.
    pub sequence: u64,
    /// Capture stamp in run time, nanoseconds.
    pub capture_ns: u64,
    /// Monotonic clock at sending, nanoseconds.
    pub send_ns: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes per row.
    pub stride: u32,
    /// 1 when `fx`…`cy` are known.
    pub has_intrinsics: u32,
    /// Focal length along columns, pixels.
    pub fx: f64,
    /// Focal length along rows, pixels.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
    /// 1 when the two pose fields are known.
    pub has_pose: u32,
    /// Zero.
    pub reserved: u32,
    /// Camera position in the world frame, metres.
    pub world_from_camera_xyz: [f64; 3],
    /// Camera orientation in the world frame, unit quaternion (x, y, z, w).
    pub world_from_camera_xyzw: [f64; 4],
}
header!(FrameHeader);

/// Header of messages from and to devices, which know nothing of the task.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.DeviceHeader.v1")]
#[repr(C)]
pub struct DeviceHeader {
    /// Version of the wire format, [`SCHEMA`]; other versions are refused.
    pub schema: u32,
    /// Zero.
    pub reserved: u32,
    /// Number of the message in its stream.
    pub sequence: u64,
    /// Run time that the content belongs to, nanoseconds.
    pub capture_ns: u64,
    /// Monotonic clock at sending, nanoseconds.
    pub send_ns: u64,
}
header!(DeviceHeader);

/// Header of messages that rest on a frame: goal, scene, plan, outcome.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("groundloop.TaskHeader.v3")]
#[repr(C)]
pub struct TaskHeader {
    /// Version of the wire format, [`SCHEMA`]; other versions are refused.
    pub schema: u32,
    /// Message-specific: the plan's verdict, see `convert`.
    pub verdict: u32,
    /// Which run this belongs to.
    pub run_id: u64,
    /// Hash of the domain folder the sender uses.
    pub domain_hash: u64,
    /// The how manieth message of its writer this is.
    pub sequence: u64,
    /// Number of the cycle.
    pub cycle: u64,
    /// Frame that it rests on.
    pub frame_sequence: u64,
    /// That frame's capture stamp, run time in nanoseconds.
    pub capture_ns: u64,
    /// When that frame was sent, monotonic nanoseconds (latency only).
    pub frame_send_ns: u64,
    /// Monotonic clock at sending, nanoseconds (latency only).
    pub send_ns: u64,
    /// How long the stages took, microseconds (latency only): detect, ground or plan, -.
    pub stage_us: [u32; 2],
    /// Plan cost, or zero.
    pub cost: u64,
    /// Scene: facts that are neither confirmed nor refuted yet. Plan: 1 when the goal speaks of all
    /// objects of a type.
    pub unsettled: u32,
    /// Plan: which source of the plan-reuse cascade answered, from 1 in its order; 0 = none.
    pub source: u32,
    /// Plan: states expanded for it.
    pub expansions: u64,
    /// Plan: time spent on taking in the facts, nanoseconds (latency only): processor, wall.
    pub observe_ns: [u64; 2],
    /// Plan: time spent on the answer, nanoseconds (latency only): processor, wall.
    pub decide_ns: [u64; 2],
    /// Message-specific text: a limit, a missing object, a reason.
    pub detail: [u8; DETAIL_BYTES_MAX],
}
header!(TaskHeader, |header, n_sent| header.sequence = n_sent);

impl Default for TaskHeader {
    fn default() -> Self {
        Self {
            schema: SCHEMA,
            verdict: 0,
            run_id: 0,
            domain_hash: 0,
            sequence: 0,
            cycle: 0,
            frame_sequence: 0,
            capture_ns: 0,
            frame_send_ns: 0,
            send_ns: 0,
            stage_us: [0; 2],
            cost: 0,
            unsettled: 0,
            source: 0,
            expansions: 0,
            observe_ns: [0; 2],
            decide_ns: [0; 2],
            detail: [0; DETAIL_BYTES_MAX],
        }
    }
}

/// Header of messages that have a number of their own beside the frame that they rest on.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.StreamHeader.v1")]
#[repr(C)]
pub struct StreamHeader {
    /// Version of the wire format, [`SCHEMA`]; other versions are refused.
    pub schema: u32,
    /// Message-specific, see `convert`.
    pub kind: u32,
    /// Which run this belongs to.
    pub run_id: u64,
    /// Hash of the domain folder the sender uses.
    pub domain_hash: u64,
    /// Number of the message in its stream.
    pub sequence: u64,
    /// Number of the cycle.
    pub cycle: u64,
    /// Frame that it rests on.
    pub frame_sequence: u64,
    /// That frame's capture stamp, run time in nanoseconds.
    pub capture_ns: u64,
    /// When that frame was sent, monotonic nanoseconds (latency only).
    pub frame_send_ns: u64,
    /// Monotonic clock at sending, nanoseconds (latency only).
    pub send_ns: u64,
    /// The command that it is about, or zero.
    pub command_id: u64,
}
header!(StreamHeader);

/// One object, fact or anomaly of a scene; `tag` says which fields count.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.SceneRecord.v1")]
#[repr(C)]
pub struct SceneRecord {
    /// 0 = object, 1 = fact, 2 = anomaly.
    pub tag: u32,
    /// Object: index of its type in the domain's sorted types. Fact: index of its predicate.
    pub kind: u32,
    /// Object: visibility. Fact: origin.
    pub source: u32,
    /// Object: 1 = box known, 2 = volume known, 3 = both. Fact: raw truth (0, 1, 2). Anomaly: 0 = no
    /// place, 1 = place known, 2 = an object may be hidden there.
    pub state: u32,
    /// Fact: confirmed truth (0 false, 1 unknown, 2 true).
    pub confirmed: u32,
    /// Fact: number of arguments. Anomaly: number of objects.
    pub n_args: u32,
    /// Fact and anomaly: arguments as indices into the objects of this message.
    pub args: [u32; ARGS_MAX],
    /// Detector's score or the fact's confidence, 0..=1.
    pub score: f32,
    /// Zero.
    pub reserved: u32,
    /// Object: when it was last seen, run time in nanoseconds.
    pub seen_ns: u64,
    /// Object and place of an anomaly: x1, y1, x2, y2 in pixels.
    pub pixel_box: [f64; 4],
    /// Object: middle of its volume in the world frame, metres.
    pub centre: [f64; 3],
    /// Object: edge lengths of its volume, metres.
    pub extent: [f64; 3],
    /// Object: its name (up to [`NAME_BYTES_MAX`]). Anomaly: what is wrong, cut to as many bytes.
    pub name: NameText,
}

/// A zero-padded name; its own type so that records can derive `Default`.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("groundloop.NameText.v1")]
#[repr(C)]
pub struct NameText {
    /// UTF-8, padded with zero bytes.
    pub bytes: NameBytes,
}

impl Default for NameText {
    fn default() -> Self {
        Self { bytes: [0; NAME_BYTES_MAX] }
    }
}

/// One step of a plan.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.StepRecord.v1")]
#[repr(C)]
pub struct StepRecord {
    /// Name of the action schema.
    pub action: NameText,
    /// Number of arguments.
    pub n_args: u32,
    /// Zero.
    pub reserved: u32,
    /// The arguments.
    pub args: [NameText; ARGS_MAX],
}

/// A dispatched step, or an atom that it is about to change.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.DispatchRecord.v1")]
#[repr(C)]
pub struct DispatchRecord {
    /// 0 = the step, first and once; 1 = an atom that becomes true; 2 = one that becomes false.
    pub tag: u32,
    /// Zero.
    pub reserved: u32,
    /// The step, or the atom as a predicate with its arguments.
    pub call: StepRecord,
}

/// How a dispatched step ended, in the executor's judgement.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.OutcomeRecord.v1")]
#[repr(C)]
pub struct OutcomeRecord {
    /// Ground action that the robot is told to carry out.
    pub step: StepRecord,
    /// How often this very step has failed so far.
    pub failures: u32,
    /// 1 = it did what it was to do.
    pub succeeded: u32,
}

/// What a robot knows of itself.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.RobotStateRecord.v1")]
#[repr(C)]
pub struct RobotStateRecord {
    /// Tool centre point in the world frame, metres.
    pub position: [f64; 3],
    /// Rotation about the world's z axis, radians.
    pub yaw_rad: f64,
    /// Jaw opening, metres.
    pub opening_m: f64,
    /// 1 = something is in the gripper.
    pub holding: u32,
    /// Index of the waypoint being approached.
    pub phase: u32,
    /// The running command, 0 = idle.
    pub command_id: u64,
    /// The newest frame that has been answered, plus one; 0 = none.
    pub answered: u64,
}

/// One point of a motion.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.WaypointRecord.v1")]
#[repr(C)]
pub struct WaypointRecord {
    /// Tool centre point in the world frame, metres.
    pub position: [f64; 3],
    /// Rotation about the world's z axis, radians.
    pub yaw_rad: f64,
    /// Jaw opening wanted at the end of it, metres.
    pub opening_m: f64,
    /// Speed limit, metres per second.
    pub speed_m_s: f64,
    /// What the gripper must feel when it is done: 0 = anything, 1 = empty, 2 = holding.
    pub expect: u32,
    /// 1 = until this point is reached, the motion may be cancelled by going straight up.
    pub retractable: u32,
}

/// One command to a robot.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("groundloop.CommandRecord.v2")]
#[repr(C)]
pub struct CommandRecord {
    /// 0 = continue, 1 = start a motion, 2 = cancel: go straight up, 3 = hold still.
    pub kind: u32,
    /// Number of waypoints.
    pub n_waypoints: u32,
    /// Identity of the motion; grows.
    pub command_id: u64,
    /// The frame that this answers.
    pub frame_sequence: u64,
    /// Only the first `n_waypoints` count.
    pub waypoints: [WaypointRecord; WAYPOINTS_MAX],
    /// 1 = `step` is known.
    pub has_step: u32,
    /// Zero.
    pub reserved: u32,
    /// The step that the motion carries out, for logs; a robot need not read it.
    pub step: StepRecord,
}

impl Default for CommandRecord {
    fn default() -> Self {
        Self {
            kind: 0,
            n_waypoints: 0,
            command_id: 0,
            frame_sequence: 0,
            waypoints: [WaypointRecord::default(); WAYPOINTS_MAX],
            has_step: 0,
            reserved: 0,
            step: StepRecord::default(),
        }
    }
}

/// What a robot says of a command.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("groundloop.StatusRecord.v1")]
#[repr(C)]
pub struct StatusRecord {
    /// Number of the command that the status is about.
    pub command_id: u64,
    /// 0 = accepted, 1 = done, 2 = failed, 3 = cancelled as told.
    pub kind: u32,
    /// Zero.
    pub reserved: u32,
    /// Why, when it failed.
    pub detail: [u8; DETAIL_BYTES_MAX],
}

impl Default for StatusRecord {
    fn default() -> Self {
        Self { command_id: 0, kind: 0, reserved: 0, detail: [0; DETAIL_BYTES_MAX] }
    }
}

/// A request to the loop; any process may send one.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.ControlRecord.v1")]
#[repr(C)]
pub struct ControlRecord {
    /// 0 = stop, 1 = pause, 2 = resume, 3 = answer one frame.
    pub request: u32,
    /// Stop: 0 = Ctrl-C, 1 = SIGTERM, 2 = a request on the bus. Otherwise zero.
    pub reason: u32,
}

/// Which plan one command rests on, and when it was sent; the scene is in the header.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.DecisionRecord.v1")]
#[repr(C)]
pub struct DecisionRecord {
    /// Cycle of the scene that the plan was made for.
    pub plan_cycle: u64,
    /// Monotonic clock once the command had been sent, nanoseconds (latency only).
    pub answered_ns: u64,
    /// 0 = continue, 1 = a step was started, 2 = the plan was switched.
    pub kind: u32,
    /// 1 = the episode ends with it.
    pub is_last: u32,
}

/// How one actor fares.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("groundloop.HealthRecord.v2")]
#[repr(C)]
pub struct HealthRecord {
    /// Its name.
    pub actor: NameText,
    /// 1 = it runs now.
    pub is_alive: u32,
    /// Failures that were followed by a restart.
    pub n_restarts: u32,
    /// Messages that it has worked on.
    pub n_messages: u64,
    /// Frames that newer ones have overtaken.
    pub n_missed: u64,
    /// Frames that could not be used.
    pub n_rejected: u64,
    /// Of them: not laid out as they should be.
    pub n_malformed: u64,
    /// Of them: of a size that cannot be scaled to that of the labelled examples.
    pub n_other_size: u64,
    /// Of them: with a stamp that is 0 or stands still.
    pub n_bad_stamp: u64,
    /// Of them: with a stamp in the future.
    pub n_ahead: u64,
    /// Of them: captured before a frame that had come already.
    pub n_late: u64,
    /// Of them: sent again.
    pub n_repeated: u64,
    /// Why the last of them could not.
    pub last_rejection: [u8; DETAIL_BYTES_MAX],
}

impl Default for HealthRecord {
    fn default() -> Self {
        Self {
            actor: NameText::default(),
            is_alive: 0,
            n_restarts: 0,
            n_messages: 0,
            n_missed: 0,
            n_rejected: 0,
            n_malformed: 0,
            n_other_size: 0,
            n_bad_stamp: 0,
            n_ahead: 0,
            n_late: 0,
            n_repeated: 0,
            last_rejection: [0; DETAIL_BYTES_MAX],
        }
    }
}
