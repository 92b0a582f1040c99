"""Layouts of groundloop's topics.

Made from src/transport/wire.rs by `cargo test --test attach protocol`; docs/protocol.md says what they mean.
"""

import ctypes

SCHEMA = 4
"""Version of every layout in this file; a reader rejects other versions."""
NAME_BYTES_MAX = 48
"""Longest name in bytes (objects, predicates, actions)."""
ARGS_MAX = 6
"""Most arguments of one fact or step."""
DETAIL_BYTES_MAX = 160
"""Longest free text in a header, in bytes."""
WAYPOINTS_MAX = 16
"""Most waypoints of one motion."""


class FrameHeader(ctypes.Structure):
    """Header of `camera/<id>/rgb` and `camera/<id>/depth`; the payload is the pixels, row by row."""

    _fields_ = [
        ("schema", ctypes.c_uint32),  # Version of the wire format, `SCHEMA`; other versions are refused.
        ("encoding", ctypes.c_uint32),  # 0 = RGB8, 1 = depth as little-endian f32 metres along the optical axis (0 = none).
        ("sequence", ctypes.c_uint64),  # Number of the frame; RGB and depth of one capture share it.
        ("capture_ns", ctypes.c_uint64),  # Capture stamp in run time, nanoseconds.
        ("send_ns", ctypes.c_uint64),  # Monotonic clock at sending, nanoseconds.
        ("width", ctypes.c_uint32),  # Columns.
        ("height", ctypes.c_uint32),  # Rows.
        ("stride", ctypes.c_uint32),  # Bytes per row.
        ("has_intrinsics", ctypes.c_uint32),  # 1 when `fx`…`cy` are known.
        ("fx", ctypes.c_double),  # Focal length along columns, pixels.
        ("fy", ctypes.c_double),  # Focal length along rows, pixels.
        ("cx", ctypes.c_double),  # Principal point, column.
        ("cy", ctypes.c_double),  # Principal point, row.
        ("has_pose", ctypes.c_uint32),  # 1 when the two pose fields are known.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("world_from_camera_xyz", ctypes.c_double * 3),  # Camera position in the world frame, metres.
        ("world_from_camera_xyzw", ctypes.c_double * 4),  # Camera orientation in the world frame, unit quaternion (x, y, z, w).
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.FrameHeader.v1"


class DeviceHeader(ctypes.Structure):
    """Header of messages from and to devices, which know nothing of the task."""

    _fields_ = [
        ("schema", ctypes.c_uint32),  # Version of the wire format, `SCHEMA`; other versions are refused.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("sequence", ctypes.c_uint64),  # Number of the message in its stream.
        ("capture_ns", ctypes.c_uint64),  # Run time that the content belongs to, nanoseconds.
        ("send_ns", ctypes.c_uint64),  # Monotonic clock at sending, nanoseconds.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.DeviceHeader.v1"


class TaskHeader(ctypes.Structure):
    """Header of messages that rest on a frame: goal, scene, plan, outcome."""

    _fields_ = [
        ("schema", ctypes.c_uint32),  # Version of the wire format, `SCHEMA`; other versions are refused.
        ("verdict", ctypes.c_uint32),  # Message-specific: the plan's verdict, see `convert`.
        ("run_id", ctypes.c_uint64),  # Which run this belongs to.
        ("domain_hash", ctypes.c_uint64),  # Hash of the domain folder the sender uses.
        ("sequence", ctypes.c_uint64),  # The how manieth message of its writer this is.
        ("cycle", ctypes.c_uint64),  # Number of the cycle.
        ("frame_sequence", ctypes.c_uint64),  # Frame that it rests on.
        ("capture_ns", ctypes.c_uint64),  # That frame's capture stamp, run time in nanoseconds.
        ("frame_send_ns", ctypes.c_uint64),  # When that frame was sent, monotonic nanoseconds (latency only).
        ("send_ns", ctypes.c_uint64),  # Monotonic clock at sending, nanoseconds (latency only).
        ("stage_us", ctypes.c_uint32 * 2),  # How long the stages took, microseconds (latency only): detect, ground or plan, -.
        ("cost", ctypes.c_uint64),  # Plan cost, or zero.
        ("unsettled", ctypes.c_uint32),  # Scene: facts that are neither confirmed nor refuted yet. Plan: 1 when the goal speaks of all objects of a type.
        ("source", ctypes.c_uint32),  # Plan: which source of the plan-reuse cascade answered, from 1 in its order; 0 = none.
        ("expansions", ctypes.c_uint64),  # Plan: states expanded for it.
        ("observe_ns", ctypes.c_uint64 * 2),  # Plan: time spent on taking in the facts, nanoseconds (latency only): processor, wall.
        ("decide_ns", ctypes.c_uint64 * 2),  # Plan: time spent on the answer, nanoseconds (latency only): processor, wall.
        ("detail", ctypes.c_uint8 * 160),  # Message-specific text: a limit, a missing object, a reason.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.TaskHeader.v3"


class StreamHeader(ctypes.Structure):
    """Header of messages that have a number of their own beside the frame that they rest on."""

    _fields_ = [
        ("schema", ctypes.c_uint32),  # Version of the wire format, `SCHEMA`; other versions are refused.
        ("kind", ctypes.c_uint32),  # Message-specific, see `convert`.
        ("run_id", ctypes.c_uint64),  # Which run this belongs to.
        ("domain_hash", ctypes.c_uint64),  # Hash of the domain folder the sender uses.
        ("sequence", ctypes.c_uint64),  # Number of the message in its stream.
        ("cycle", ctypes.c_uint64),  # Number of the cycle.
        ("frame_sequence", ctypes.c_uint64),  # Frame that it rests on.
        ("capture_ns", ctypes.c_uint64),  # That frame's capture stamp, run time in nanoseconds.
        ("frame_send_ns", ctypes.c_uint64),  # When that frame was sent, monotonic nanoseconds (latency only).
        ("send_ns", ctypes.c_uint64),  # Monotonic clock at sending, nanoseconds (latency only).
        ("command_id", ctypes.c_uint64),  # The command that it is about, or zero.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.StreamHeader.v1"


class NameText(ctypes.Structure):
    """A zero-padded name; its own type so that records can derive `Default`."""

    _fields_ = [
        ("bytes", ctypes.c_uint8 * 48),  # UTF-8, padded with zero bytes.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.NameText.v1"


class SceneRecord(ctypes.Structure):
    """One object, fact or anomaly of a scene; `tag` says which fields count."""

    _fields_ = [
        ("tag", ctypes.c_uint32),  # 0 = object, 1 = fact, 2 = anomaly.
        ("kind", ctypes.c_uint32),  # Object: index of its type in the domain's sorted types. Fact: index of its predicate.
        ("source", ctypes.c_uint32),  # Object: visibility. Fact: origin.
        ("state", ctypes.c_uint32),  # Object: 1 = box known, 2 = volume known, 3 = both. Fact: raw truth (0, 1, 2). Anomaly: 0 = no place, 1 = place known, 2 = an object may be hidden there.
        ("confirmed", ctypes.c_uint32),  # Fact: confirmed truth (0 false, 1 unknown, 2 true).
        ("n_args", ctypes.c_uint32),  # Fact: number of arguments. Anomaly: number of objects.
        ("args", ctypes.c_uint32 * 6),  # Fact and anomaly: arguments as indices into the objects of this message.
        ("score", ctypes.c_float),  # Detector's score or the fact's confidence, 0..=1.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("seen_ns", ctypes.c_uint64),  # Object: when it was last seen, run time in nanoseconds.
        ("pixel_box", ctypes.c_double * 4),  # Object and place of an anomaly: x1, y1, x2, y2 in pixels.
        ("centre", ctypes.c_double * 3),  # Object: middle of its volume in the world frame, metres.
        ("extent", ctypes.c_double * 3),  # Object: edge lengths of its volume, metres.
        ("name", NameText),  # Object: its name (up to `NAME_BYTES_MAX`). Anomaly: what is wrong, cut to as many bytes.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.SceneRecord.v1"


class StepRecord(ctypes.Structure):
    """One step of a plan."""

    _fields_ = [
        ("action", NameText),  # Name of the action schema.
        ("n_args", ctypes.c_uint32),  # Number of arguments.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("args", NameText * 6),  # The arguments.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.StepRecord.v1"


class DispatchRecord(ctypes.Structure):
    """A dispatched step, or an atom that it is about to change."""

    _fields_ = [
        ("tag", ctypes.c_uint32),  # 0 = the step, first and once; 1 = an atom that becomes true; 2 = one that becomes false.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("call", StepRecord),  # The step, or the atom as a predicate with its arguments.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.DispatchRecord.v1"


class OutcomeRecord(ctypes.Structure):
    """How a dispatched step ended, in the executor's judgement."""

    _fields_ = [
        ("step", StepRecord),  # Ground action that the robot is told to carry out.
        ("failures", ctypes.c_uint32),  # How often this very step has failed so far.
        ("succeeded", ctypes.c_uint32),  # 1 = it did what it was to do.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.OutcomeRecord.v1"


class RobotStateRecord(ctypes.Structure):
    """What a robot knows of itself."""

    _fields_ = [
        ("position", ctypes.c_double * 3),  # Tool centre point in the world frame, metres.
        ("yaw_rad", ctypes.c_double),  # Rotation about the world's z axis, radians.
        ("opening_m", ctypes.c_double),  # Jaw opening, metres.
        ("holding", ctypes.c_uint32),  # 1 = something is in the gripper.
        ("phase", ctypes.c_uint32),  # Index of the waypoint being approached.
        ("command_id", ctypes.c_uint64),  # The running command, 0 = idle.
        ("answered", ctypes.c_uint64),  # The newest frame that has been answered, plus one; 0 = none.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.RobotStateRecord.v1"


class WaypointRecord(ctypes.Structure):
    """One point of a motion."""

    _fields_ = [
        ("position", ctypes.c_double * 3),  # Tool centre point in the world frame, metres.
        ("yaw_rad", ctypes.c_double),  # Rotation about the world's z axis, radians.
        ("opening_m", ctypes.c_double),  # Jaw opening wanted at the end of it, metres.
        ("speed_m_s", ctypes.c_double),  # Speed limit, metres per second.
        ("expect", ctypes.c_uint32),  # What the gripper must feel when it is done: 0 = anything, 1 = empty, 2 = holding.
        ("retractable", ctypes.c_uint32),  # 1 = until this point is reached, the motion may be cancelled by going straight up.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.WaypointRecord.v1"


class CommandRecord(ctypes.Structure):
    """One command to a robot."""

    _fields_ = [
        ("kind", ctypes.c_uint32),  # 0 = continue, 1 = start a motion, 2 = cancel: go straight up, 3 = hold still.
        ("n_waypoints", ctypes.c_uint32),  # Number of waypoints.
        ("command_id", ctypes.c_uint64),  # Identity of the motion; grows.
        ("frame_sequence", ctypes.c_uint64),  # The frame that this answers.
        ("waypoints", WaypointRecord * 16),  # Only the first `n_waypoints` count.
        ("has_step", ctypes.c_uint32),  # 1 = `step` is known.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("step", StepRecord),  # The step that the motion carries out, for logs; a robot need not read it.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.CommandRecord.v2"


class StatusRecord(ctypes.Structure):
    """What a robot says of a command."""

    _fields_ = [
        ("command_id", ctypes.c_uint64),  # Number of the command that the status is about.
        ("kind", ctypes.c_uint32),  # 0 = accepted, 1 = done, 2 = failed, 3 = cancelled as told.
        ("reserved", ctypes.c_uint32),  # Zero.
        ("detail", ctypes.c_uint8 * 160),  # Why, when it failed.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.StatusRecord.v1"


class ControlRecord(ctypes.Structure):
    """A request to the loop; any process may send one."""

    _fields_ = [
        ("request", ctypes.c_uint32),  # 0 = stop, 1 = pause, 2 = resume, 3 = answer one frame.
        ("reason", ctypes.c_uint32),  # Stop: 0 = Ctrl-C, 1 = SIGTERM, 2 = a request on the bus. Otherwise zero.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.ControlRecord.v1"


class DecisionRecord(ctypes.Structure):
    """Which plan one command rests on, and when it was sent; the scene is in the header."""

    _fields_ = [
        ("plan_cycle", ctypes.c_uint64),  # Cycle of the scene that the plan was made for.
        ("answered_ns", ctypes.c_uint64),  # Monotonic clock once the command had been sent, nanoseconds (latency only).
        ("kind", ctypes.c_uint32),  # 0 = continue, 1 = a step was started, 2 = the plan was switched.
        ("is_last", ctypes.c_uint32),  # 1 = the episode ends with it.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.DecisionRecord.v1"


class HealthRecord(ctypes.Structure):
    """How one actor fares."""

    _fields_ = [
        ("actor", NameText),  # Its name.
        ("is_alive", ctypes.c_uint32),  # 1 = it runs now.
        ("n_restarts", ctypes.c_uint32),  # Failures that were followed by a restart.
        ("n_messages", ctypes.c_uint64),  # Messages that it has worked on.
        ("n_missed", ctypes.c_uint64),  # Frames that newer ones have overtaken.
        ("n_rejected", ctypes.c_uint64),  # Frames that could not be used.
        ("n_malformed", ctypes.c_uint64),  # Of them: not laid out as they should be.
        ("n_other_size", ctypes.c_uint64),  # Of them: of a size that cannot be scaled to that of the labelled examples.
        ("n_bad_stamp", ctypes.c_uint64),  # Of them: with a stamp that is 0 or stands still.
        ("n_ahead", ctypes.c_uint64),  # Of them: with a stamp in the future.
        ("n_late", ctypes.c_uint64),  # Of them: captured before a frame that had come already.
        ("n_repeated", ctypes.c_uint64),  # Of them: sent again.
        ("last_rejection", ctypes.c_uint8 * 160),  # Why the last of them could not.
    ]

    @staticmethod
    def type_name() -> str:
        return "groundloop.HealthRecord.v2"
