//! Every topic: its name and its limits. How much a reader lets pile up is the reader's own affair
//! ([`super::Depth`]).

/// One topic. The service name is `groundloop/<run>/<name>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// Name below the run.
    pub name: &'static str,
    /// Most messages that a reader may ask to have waiting.
    pub depth_max: usize,
    /// Messages that a late joiner gets.
    pub history: usize,
    /// Writers at a time.
    pub writers_max: usize,
    /// Elements of the first allocation; a longer message grows it.
    pub initial_len: usize,
}

/// Most messages waiting for one reader of a topic, camera frames excepted.
const DEPTH_MAX: usize = 256;
/// Most frames waiting for one reader: half a second at 30 frames per second.
const FRAMES_DEPTH_MAX: usize = 16;
/// Messages of a topic without losses that a late joiner gets.
const HISTORY: usize = 16;
/// The one writer of a topic, and a second one while the first is being replaced.
const ONE_WRITER: usize = 2;

/// What the loop's own readers of a topic without losses have waiting at most.
pub const RELIABLE_DEPTH: usize = 64;

/// A topic of which the last message counts.
const fn state(name: &'static str, initial_len: usize) -> Topic {
    Topic { name, depth_max: DEPTH_MAX, history: 1, writers_max: ONE_WRITER, initial_len }
}

/// A topic of which every message counts.
const fn stream(name: &'static str) -> Topic {
    let (depth_max, writers_max) = (DEPTH_MAX, ONE_WRITER);
    Topic { name, depth_max, history: HISTORY, writers_max, initial_len: 1 }
}

const fn frames(name: &'static str, initial_len: usize) -> Topic {
    Topic { depth_max: FRAMES_DEPTH_MAX, ..state(name, initial_len) }
}

/// Bytes of a 640×480 RGB frame: the first allocation of a camera topic.
const FRAME_BYTES: usize = 640 * 480 * 3;

/// Pixels: camera → scene parser.
pub const CAMERA_RGB: Topic = frames("camera/main/rgb", FRAME_BYTES);
/// Depth: camera → scene parser.
pub const CAMERA_DEPTH: Topic = frames("camera/main/depth", FRAME_BYTES / 3 * 4);
/// What the robot knows of itself: robot → scene parser, executor.
pub const ROBOT_STATE: Topic = state("robot/state", 1);
/// Motions and answers to frames: executor → robot, scene parser.
pub const ROBOT_COMMAND: Topic = stream("robot/command");
/// How motions fare: robot → executor, scene parser.
pub const ROBOT_STATUS: Topic = stream("robot/status");
/// The constant goal: goal parser → all.
pub const GOAL: Topic = state("goal", 4096);
/// The scene graph: scene parser → planner, executor, goal parser.
pub const SCENE: Topic = state("scene", 256);
/// The plan: planner → executor.
pub const PLAN: Topic = state("plan", 64);
/// How dispatched steps ended: executor → planner.
pub const OUTCOME: Topic = stream("outcome");

/// All topics, for tools and tests.
pub const TOPICS: &[Topic] = &[
    CAMERA_RGB,
    CAMERA_DEPTH,
    ROBOT_STATE,
    ROBOT_COMMAND,
    ROBOT_STATUS,
    GOAL,
    SCENE,
    PLAN,
    OUTCOME,
];
