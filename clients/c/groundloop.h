/* Layouts of groundloop's topics, for C and C++.
 *
 * Made from src/transport/wire.rs by `cargo test --test attach protocol`; docs/protocol.md says what they mean.
 * Text is UTF-8, padded with zero bytes. Reserved fields are zero.
 *
 * A topic but `control` has one writer. Before you create a publisher, clean up dead nodes, open the service and
 * look at its number of publishers (number_of_publishers of its dynamic config): above 0 another process does the
 * same, and two would be mixed. Say so and end: `TOPIC of run "RUN" has a writer already`. */
#ifndef GROUNDLOOP_H
#define GROUNDLOOP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#define GROUNDLOOP_ASSERT(what, why) static_assert(what, why)
#else
#define GROUNDLOOP_ASSERT(what, why) _Static_assert(what, why)
#endif

/* Version of every layout in this file; a reader rejects other versions. */
#define GROUNDLOOP_SCHEMA 4u
/* Longest name in bytes (objects, predicates, actions). */
#define GROUNDLOOP_NAME_BYTES_MAX 48u
/* Most arguments of one fact or step. */
#define GROUNDLOOP_ARGS_MAX 6u
/* Longest free text in a header, in bytes. */
#define GROUNDLOOP_DETAIL_BYTES_MAX 160u
/* Most waypoints of one motion. */
#define GROUNDLOOP_WAYPOINTS_MAX 16u
/* Event id of a wake-up: a message was sent. */
#define GROUNDLOOP_EVENT_SENT 4u
/* Event id of a reader that announces itself. */
#define GROUNDLOOP_EVENT_JOINED 5u

/* Header of `camera/<id>/rgb` and `camera/<id>/depth`; the payload is the pixels, row by row. */
#define GROUNDLOOP_FRAME_HEADER_TYPE_NAME "groundloop.FrameHeader.v1"
typedef struct groundloop_frame_header {
    /* Version of the wire format, `SCHEMA`; other versions are refused. */
    uint32_t schema;
    /* 0 = RGB8, 1 = depth as little-endian f32 metres along the optical axis (0 = none). */
    uint32_t encoding;
    /* Number of the frame; RGB and depth of one capture share it. */
    uint64_t sequence;
    /* Capture stamp in run time, nanoseconds. */
    uint64_t capture_ns;
    /* Monotonic clock at sending, nanoseconds. */
    uint64_t send_ns;
    /* Columns. */
    uint32_t width;
    /* Rows. */
    uint32_t height;
    /* Bytes per row. */
    uint32_t stride;
    /* 1 when `fx`…`cy` are known. */
    uint32_t has_intrinsics;
    /* Focal length along columns, pixels. */
    double fx;
    /* Focal length along rows, pixels. */
    double fy;
    /* Principal point, column. */
    double cx;
    /* Principal point, row. */
    double cy;
    /* 1 when the two pose fields are known. */
    uint32_t has_pose;
    /* Zero. */
    uint32_t reserved;
    /* Camera position in the world frame, metres. */
    double world_from_camera_xyz[3];
    /* Camera orientation in the world frame, unit quaternion (x, y, z, w). */
    double world_from_camera_xyzw[4];
} groundloop_frame_header;
GROUNDLOOP_ASSERT(sizeof(groundloop_frame_header) == 144, "size of frame_header");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, schema) == 0, "frame_header.schema");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, encoding) == 4, "frame_header.encoding");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, sequence) == 8, "frame_header.sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, capture_ns) == 16, "frame_header.capture_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, send_ns) == 24, "frame_header.send_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, width) == 32, "frame_header.width");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, height) == 36, "frame_header.height");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, stride) == 40, "frame_header.stride");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, has_intrinsics) == 44, "frame_header.has_intrinsics");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, fx) == 48, "frame_header.fx");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, fy) == 56, "frame_header.fy");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, cx) == 64, "frame_header.cx");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, cy) == 72, "frame_header.cy");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, has_pose) == 80, "frame_header.has_pose");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, reserved) == 84, "frame_header.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, world_from_camera_xyz) == 88, "frame_header.world_from_camera_xyz");
GROUNDLOOP_ASSERT(offsetof(groundloop_frame_header, world_from_camera_xyzw) == 112, "frame_header.world_from_camera_xyzw");

/* Header of messages from and to devices, which know nothing of the task. */
#define GROUNDLOOP_DEVICE_HEADER_TYPE_NAME "groundloop.DeviceHeader.v1"
typedef struct groundloop_device_header {
    /* Version of the wire format, `SCHEMA`; other versions are refused. */
    uint32_t schema;
    /* Zero. */
    uint32_t reserved;
    /* Number of the message in its stream. */
    uint64_t sequence;
    /* Run time that the content belongs to, nanoseconds. */
    uint64_t capture_ns;
    /* Monotonic clock at sending, nanoseconds. */
    uint64_t send_ns;
} groundloop_device_header;
GROUNDLOOP_ASSERT(sizeof(groundloop_device_header) == 32, "size of device_header");
GROUNDLOOP_ASSERT(offsetof(groundloop_device_header, schema) == 0, "device_header.schema");
GROUNDLOOP_ASSERT(offsetof(groundloop_device_header, reserved) == 4, "device_header.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_device_header, sequence) == 8, "device_header.sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_device_header, capture_ns) == 16, "device_header.capture_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_device_header, send_ns) == 24, "device_header.send_ns");

/* Header of messages that rest on a frame: goal, scene, plan, outcome. */
#define GROUNDLOOP_TASK_HEADER_TYPE_NAME "groundloop.TaskHeader.v3"
typedef struct groundloop_task_header {
    /* Version of the wire format, `SCHEMA`; other versions are refused. */
    uint32_t schema;
    /* Message-specific: the plan's verdict, see `convert`. */
    uint32_t verdict;
    /* Which run this belongs to. */
    uint64_t run_id;
    /* Hash of the domain folder the sender uses. */
    uint64_t domain_hash;
    /* The how manieth message of its writer this is. */
    uint64_t sequence;
    /* Number of the cycle. */
    uint64_t cycle;
    /* Frame that it rests on. */
    uint64_t frame_sequence;
    /* That frame's capture stamp, run time in nanoseconds. */
    uint64_t capture_ns;
    /* When that frame was sent, monotonic nanoseconds (latency only). */
    uint64_t frame_send_ns;
    /* Monotonic clock at sending, nanoseconds (latency only). */
    uint64_t send_ns;
    /* How long the stages took, microseconds (latency only): detect, ground or plan, -. */
    uint32_t stage_us[2];
    /* Plan cost, or zero. */
    uint64_t cost;
    /* Scene: facts that are neither confirmed nor refuted yet. Plan: 1 when the goal speaks of all objects of a type. */
    uint32_t unsettled;
    /* Plan: which source of the plan-reuse cascade answered, from 1 in its order; 0 = none. */
    uint32_t source;
    /* Plan: states expanded for it. */
    uint64_t expansions;
    /* Plan: time spent on taking in the facts, nanoseconds (latency only): processor, wall. */
    uint64_t observe_ns[2];
    /* Plan: time spent on the answer, nanoseconds (latency only): processor, wall. */
    uint64_t decide_ns[2];
    /* Message-specific text: a limit, a missing object, a reason. */
    uint8_t detail[160];
} groundloop_task_header;
GROUNDLOOP_ASSERT(sizeof(groundloop_task_header) == 296, "size of task_header");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, schema) == 0, "task_header.schema");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, verdict) == 4, "task_header.verdict");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, run_id) == 8, "task_header.run_id");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, domain_hash) == 16, "task_header.domain_hash");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, sequence) == 24, "task_header.sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, cycle) == 32, "task_header.cycle");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, frame_sequence) == 40, "task_header.frame_sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, capture_ns) == 48, "task_header.capture_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, frame_send_ns) == 56, "task_header.frame_send_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, send_ns) == 64, "task_header.send_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, stage_us) == 72, "task_header.stage_us");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, cost) == 80, "task_header.cost");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, unsettled) == 88, "task_header.unsettled");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, source) == 92, "task_header.source");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, expansions) == 96, "task_header.expansions");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, observe_ns) == 104, "task_header.observe_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, decide_ns) == 120, "task_header.decide_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_task_header, detail) == 136, "task_header.detail");

/* Header of messages that have a number of their own beside the frame that they rest on. */
#define GROUNDLOOP_STREAM_HEADER_TYPE_NAME "groundloop.StreamHeader.v1"
typedef struct groundloop_stream_header {
    /* Version of the wire format, `SCHEMA`; other versions are refused. */
    uint32_t schema;
    /* Message-specific, see `convert`. */
    uint32_t kind;
    /* Which run this belongs to. */
    uint64_t run_id;
    /* Hash of the domain folder the sender uses. */
    uint64_t domain_hash;
    /* Number of the message in its stream. */
    uint64_t sequence;
    /* Number of the cycle. */
    uint64_t cycle;
    /* Frame that it rests on. */
    uint64_t frame_sequence;
    /* That frame's capture stamp, run time in nanoseconds. */
    uint64_t capture_ns;
    /* When that frame was sent, monotonic nanoseconds (latency only). */
    uint64_t frame_send_ns;
    /* Monotonic clock at sending, nanoseconds (latency only). */
    uint64_t send_ns;
    /* The command that it is about, or zero. */
    uint64_t command_id;
} groundloop_stream_header;
GROUNDLOOP_ASSERT(sizeof(groundloop_stream_header) == 80, "size of stream_header");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, schema) == 0, "stream_header.schema");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, kind) == 4, "stream_header.kind");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, run_id) == 8, "stream_header.run_id");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, domain_hash) == 16, "stream_header.domain_hash");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, sequence) == 24, "stream_header.sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, cycle) == 32, "stream_header.cycle");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, frame_sequence) == 40, "stream_header.frame_sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, capture_ns) == 48, "stream_header.capture_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, frame_send_ns) == 56, "stream_header.frame_send_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, send_ns) == 64, "stream_header.send_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_stream_header, command_id) == 72, "stream_header.command_id");

/* A zero-padded name; its own type so that records can derive `Default`. */
#define GROUNDLOOP_NAME_TEXT_TYPE_NAME "groundloop.NameText.v1"
typedef struct groundloop_name_text {
    /* UTF-8, padded with zero bytes. */
    uint8_t bytes[48];
} groundloop_name_text;
GROUNDLOOP_ASSERT(sizeof(groundloop_name_text) == 48, "size of name_text");
GROUNDLOOP_ASSERT(offsetof(groundloop_name_text, bytes) == 0, "name_text.bytes");

/* One object, fact or anomaly of a scene; `tag` says which fields count. */
#define GROUNDLOOP_SCENE_RECORD_TYPE_NAME "groundloop.SceneRecord.v1"
typedef struct groundloop_scene_record {
    /* 0 = object, 1 = fact, 2 = anomaly. */
    uint32_t tag;
    /* Object: index of its type in the domain's sorted types. Fact: index of its predicate. */
    uint32_t kind;
    /* Object: visibility. Fact: origin. */
    uint32_t source;
    /* Object: 1 = box known, 2 = volume known, 3 = both. Fact: raw truth (0, 1, 2). Anomaly: 0 = no place, 1 = place known, 2 = an object may be hidden there. */
    uint32_t state;
    /* Fact: confirmed truth (0 false, 1 unknown, 2 true). */
    uint32_t confirmed;
    /* Fact: number of arguments. Anomaly: number of objects. */
    uint32_t n_args;
    /* Fact and anomaly: arguments as indices into the objects of this message. */
    uint32_t args[6];
    /* Detector's score or the fact's confidence, 0..=1. */
    float score;
    /* Zero. */
    uint32_t reserved;
    /* Object: when it was last seen, run time in nanoseconds. */
    uint64_t seen_ns;
    /* Object and place of an anomaly: x1, y1, x2, y2 in pixels. */
    double pixel_box[4];
    /* Object: middle of its volume in the world frame, metres. */
    double centre[3];
    /* Object: edge lengths of its volume, metres. */
    double extent[3];
    /* Object: its name (up to `NAME_BYTES_MAX`). Anomaly: what is wrong, cut to as many bytes. */
    groundloop_name_text name;
} groundloop_scene_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_scene_record) == 192, "size of scene_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, tag) == 0, "scene_record.tag");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, kind) == 4, "scene_record.kind");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, source) == 8, "scene_record.source");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, state) == 12, "scene_record.state");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, confirmed) == 16, "scene_record.confirmed");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, n_args) == 20, "scene_record.n_args");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, args) == 24, "scene_record.args");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, score) == 48, "scene_record.score");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, reserved) == 52, "scene_record.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, seen_ns) == 56, "scene_record.seen_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, pixel_box) == 64, "scene_record.pixel_box");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, centre) == 96, "scene_record.centre");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, extent) == 120, "scene_record.extent");
GROUNDLOOP_ASSERT(offsetof(groundloop_scene_record, name) == 144, "scene_record.name");

/* One step of a plan. */
#define GROUNDLOOP_STEP_RECORD_TYPE_NAME "groundloop.StepRecord.v1"
typedef struct groundloop_step_record {
    /* Name of the action schema. */
    groundloop_name_text action;
    /* Number of arguments. */
    uint32_t n_args;
    /* Zero. */
    uint32_t reserved;
    /* The arguments. */
    groundloop_name_text args[6];
} groundloop_step_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_step_record) == 344, "size of step_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_step_record, action) == 0, "step_record.action");
GROUNDLOOP_ASSERT(offsetof(groundloop_step_record, n_args) == 48, "step_record.n_args");
GROUNDLOOP_ASSERT(offsetof(groundloop_step_record, reserved) == 52, "step_record.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_step_record, args) == 56, "step_record.args");

/* A dispatched step, or an atom that it is about to change. */
#define GROUNDLOOP_DISPATCH_RECORD_TYPE_NAME "groundloop.DispatchRecord.v1"
typedef struct groundloop_dispatch_record {
    /* 0 = the step, first and once; 1 = an atom that becomes true; 2 = one that becomes false. */
    uint32_t tag;
    /* Zero. */
    uint32_t reserved;
    /* The step, or the atom as a predicate with its arguments. */
    groundloop_step_record call;
} groundloop_dispatch_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_dispatch_record) == 352, "size of dispatch_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_dispatch_record, tag) == 0, "dispatch_record.tag");
GROUNDLOOP_ASSERT(offsetof(groundloop_dispatch_record, reserved) == 4, "dispatch_record.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_dispatch_record, call) == 8, "dispatch_record.call");

/* How a dispatched step ended, in the executor's judgement. */
#define GROUNDLOOP_OUTCOME_RECORD_TYPE_NAME "groundloop.OutcomeRecord.v1"
typedef struct groundloop_outcome_record {
    /* Ground action that the robot is told to carry out. */
    groundloop_step_record step;
    /* How often this very step has failed so far. */
    uint32_t failures;
    /* 1 = it did what it was to do. */
    uint32_t succeeded;
} groundloop_outcome_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_outcome_record) == 352, "size of outcome_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_outcome_record, step) == 0, "outcome_record.step");
GROUNDLOOP_ASSERT(offsetof(groundloop_outcome_record, failures) == 344, "outcome_record.failures");
GROUNDLOOP_ASSERT(offsetof(groundloop_outcome_record, succeeded) == 348, "outcome_record.succeeded");

/* What a robot knows of itself. */
#define GROUNDLOOP_ROBOT_STATE_RECORD_TYPE_NAME "groundloop.RobotStateRecord.v1"
typedef struct groundloop_robot_state_record {
    /* Tool centre point in the world frame, metres. */
    double position[3];
    /* Rotation about the world's z axis, radians. */
    double yaw_rad;
    /* Jaw opening, metres. */
    double opening_m;
    /* 1 = something is in the gripper. */
    uint32_t holding;
    /* Index of the waypoint being approached. */
    uint32_t phase;
    /* The running command, 0 = idle. */
    uint64_t command_id;
    /* The newest frame that has been answered, plus one; 0 = none. */
    uint64_t answered;
} groundloop_robot_state_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_robot_state_record) == 64, "size of robot_state_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, position) == 0, "robot_state_record.position");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, yaw_rad) == 24, "robot_state_record.yaw_rad");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, opening_m) == 32, "robot_state_record.opening_m");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, holding) == 40, "robot_state_record.holding");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, phase) == 44, "robot_state_record.phase");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, command_id) == 48, "robot_state_record.command_id");
GROUNDLOOP_ASSERT(offsetof(groundloop_robot_state_record, answered) == 56, "robot_state_record.answered");

/* One point of a motion. */
#define GROUNDLOOP_WAYPOINT_RECORD_TYPE_NAME "groundloop.WaypointRecord.v1"
typedef struct groundloop_waypoint_record {
    /* Tool centre point in the world frame, metres. */
    double position[3];
    /* Rotation about the world's z axis, radians. */
    double yaw_rad;
    /* Jaw opening wanted at the end of it, metres. */
    double opening_m;
    /* Speed limit, metres per second. */
    double speed_m_s;
    /* What the gripper must feel when it is done: 0 = anything, 1 = empty, 2 = holding. */
    uint32_t expect;
    /* 1 = until this point is reached, the motion may be cancelled by going straight up. */
    uint32_t retractable;
} groundloop_waypoint_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_waypoint_record) == 56, "size of waypoint_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, position) == 0, "waypoint_record.position");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, yaw_rad) == 24, "waypoint_record.yaw_rad");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, opening_m) == 32, "waypoint_record.opening_m");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, speed_m_s) == 40, "waypoint_record.speed_m_s");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, expect) == 48, "waypoint_record.expect");
GROUNDLOOP_ASSERT(offsetof(groundloop_waypoint_record, retractable) == 52, "waypoint_record.retractable");

/* One command to a robot. */
#define GROUNDLOOP_COMMAND_RECORD_TYPE_NAME "groundloop.CommandRecord.v2"
typedef struct groundloop_command_record {
    /* 0 = continue, 1 = start a motion, 2 = cancel: go straight up, 3 = hold still. */
    uint32_t kind;
    /* Number of waypoints. */
    uint32_t n_waypoints;
    /* Identity of the motion; grows. */
    uint64_t command_id;
    /* The frame that this answers. */
    uint64_t frame_sequence;
    /* Only the first `n_waypoints` count. */
    groundloop_waypoint_record waypoints[16];
    /* 1 = `step` is known. */
    uint32_t has_step;
    /* Zero. */
    uint32_t reserved;
    /* The step that the motion carries out, for logs; a robot need not read it. */
    groundloop_step_record step;
} groundloop_command_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_command_record) == 1272, "size of command_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, kind) == 0, "command_record.kind");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, n_waypoints) == 4, "command_record.n_waypoints");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, command_id) == 8, "command_record.command_id");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, frame_sequence) == 16, "command_record.frame_sequence");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, waypoints) == 24, "command_record.waypoints");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, has_step) == 920, "command_record.has_step");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, reserved) == 924, "command_record.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_command_record, step) == 928, "command_record.step");

/* What a robot says of a command. */
#define GROUNDLOOP_STATUS_RECORD_TYPE_NAME "groundloop.StatusRecord.v1"
typedef struct groundloop_status_record {
    /* Number of the command that the status is about. */
    uint64_t command_id;
    /* 0 = accepted, 1 = done, 2 = failed, 3 = cancelled as told. */
    uint32_t kind;
    /* Zero. */
    uint32_t reserved;
    /* Why, when it failed. */
    uint8_t detail[160];
} groundloop_status_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_status_record) == 176, "size of status_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_status_record, command_id) == 0, "status_record.command_id");
GROUNDLOOP_ASSERT(offsetof(groundloop_status_record, kind) == 8, "status_record.kind");
GROUNDLOOP_ASSERT(offsetof(groundloop_status_record, reserved) == 12, "status_record.reserved");
GROUNDLOOP_ASSERT(offsetof(groundloop_status_record, detail) == 16, "status_record.detail");

/* A request to the loop; any process may send one. */
#define GROUNDLOOP_CONTROL_RECORD_TYPE_NAME "groundloop.ControlRecord.v1"
typedef struct groundloop_control_record {
    /* 0 = stop, 1 = pause, 2 = resume, 3 = answer one frame. */
    uint32_t request;
    /* Stop: 0 = Ctrl-C, 1 = SIGTERM, 2 = a request on the bus. Otherwise zero. */
    uint32_t reason;
} groundloop_control_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_control_record) == 8, "size of control_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_control_record, request) == 0, "control_record.request");
GROUNDLOOP_ASSERT(offsetof(groundloop_control_record, reason) == 4, "control_record.reason");

/* Which plan one command rests on, and when it was sent; the scene is in the header. */
#define GROUNDLOOP_DECISION_RECORD_TYPE_NAME "groundloop.DecisionRecord.v1"
typedef struct groundloop_decision_record {
    /* Cycle of the scene that the plan was made for. */
    uint64_t plan_cycle;
    /* Monotonic clock once the command had been sent, nanoseconds (latency only). */
    uint64_t answered_ns;
    /* 0 = continue, 1 = a step was started, 2 = the plan was switched. */
    uint32_t kind;
    /* 1 = the episode ends with it. */
    uint32_t is_last;
} groundloop_decision_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_decision_record) == 24, "size of decision_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_decision_record, plan_cycle) == 0, "decision_record.plan_cycle");
GROUNDLOOP_ASSERT(offsetof(groundloop_decision_record, answered_ns) == 8, "decision_record.answered_ns");
GROUNDLOOP_ASSERT(offsetof(groundloop_decision_record, kind) == 16, "decision_record.kind");
GROUNDLOOP_ASSERT(offsetof(groundloop_decision_record, is_last) == 20, "decision_record.is_last");

/* How one actor fares. */
#define GROUNDLOOP_HEALTH_RECORD_TYPE_NAME "groundloop.HealthRecord.v2"
typedef struct groundloop_health_record {
    /* Its name. */
    groundloop_name_text actor;
    /* 1 = it runs now. */
    uint32_t is_alive;
    /* Failures that were followed by a restart. */
    uint32_t n_restarts;
    /* Messages that it has worked on. */
    uint64_t n_messages;
    /* Frames that newer ones have overtaken. */
    uint64_t n_missed;
    /* Frames that could not be used. */
    uint64_t n_rejected;
    /* Of them: not laid out as they should be. */
    uint64_t n_malformed;
    /* Of them: of a size that cannot be scaled to that of the labelled examples. */
    uint64_t n_other_size;
    /* Of them: with a stamp that is 0 or stands still. */
    uint64_t n_bad_stamp;
    /* Of them: with a stamp in the future. */
    uint64_t n_ahead;
    /* Of them: captured before a frame that had come already. */
    uint64_t n_late;
    /* Of them: sent again. */
    uint64_t n_repeated;
    /* Why the last of them could not. */
    uint8_t last_rejection[160];
} groundloop_health_record;
GROUNDLOOP_ASSERT(sizeof(groundloop_health_record) == 288, "size of health_record");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, actor) == 0, "health_record.actor");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, is_alive) == 48, "health_record.is_alive");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_restarts) == 52, "health_record.n_restarts");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_messages) == 56, "health_record.n_messages");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_missed) == 64, "health_record.n_missed");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_rejected) == 72, "health_record.n_rejected");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_malformed) == 80, "health_record.n_malformed");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_other_size) == 88, "health_record.n_other_size");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_bad_stamp) == 96, "health_record.n_bad_stamp");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_ahead) == 104, "health_record.n_ahead");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_late) == 112, "health_record.n_late");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, n_repeated) == 120, "health_record.n_repeated");
GROUNDLOOP_ASSERT(offsetof(groundloop_health_record, last_rejection) == 128, "health_record.last_rejection");

/* camera/main/rgb: groundloop_frame_header, payload bytes: packed RGB8, row by row */
/* camera/main/depth: groundloop_frame_header, payload bytes: little-endian f32 metres, row by row */
/* robot/state: groundloop_device_header, payload one RobotStateRecord */
/* robot/command: groundloop_device_header, payload one CommandRecord */
/* robot/status: groundloop_device_header, payload one StatusRecord */
/* goal: groundloop_task_header, payload bytes: a PDDL problem without facts, or nothing yet */
/* scene: groundloop_task_header, payload SceneRecords: objects, facts, anomalies */
/* plan: groundloop_task_header, payload StepRecords */
/* dispatch: groundloop_stream_header, payload DispatchRecords */
/* outcome: groundloop_task_header, payload one OutcomeRecord */
/* decision: groundloop_stream_header, payload one DecisionRecord */
/* event: groundloop_stream_header, payload bytes: JSON */
/* verdict: groundloop_stream_header, payload bytes: JSON */
/* control: groundloop_device_header, payload one ControlRecord */
/* health: groundloop_stream_header, payload HealthRecords */
/* run: groundloop_device_header, payload bytes: JSON */
/* task: groundloop_device_header, payload bytes: JSON */
/* task/status: groundloop_device_header, payload bytes: JSON */

#ifdef __cplusplus
}
#endif

#endif
