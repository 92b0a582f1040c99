//! Every topic: its name, depth and overflow rule.

/// How a reader treats what piles up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Only the newest message counts; what it overtakes is counted, not queued.
    Newest,
    /// Every message counts; a gap is an error that the reader reports.
    Reliable,
}

/// One topic. The service name is `groundloop/<run>/<name>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// Name below the run.
    pub name: &'static str,
    /// Messages a reader can have waiting.
    pub depth: usize,
    /// Messages that a late joiner gets.
    pub history: usize,
    /// How a reader treats what piles up.
    pub delivery: Delivery,
    /// Elements of the first allocation; a longer message grows it.
    pub initial_len: usize,
}

const fn newest(name: &'static str, initial_len: usize) -> Topic {
    Topic { name, depth: 2, history: 1, delivery: Delivery::Newest, initial_len }
}

const fn reliable(name: &'static str) -> Topic {
    Topic { name, depth: 64, history: 16, delivery: Delivery::Reliable, initial_len: 1 }
}

/// Bytes of a 640×480 RGB frame: the first allocation of a camera topic.
const FRAME_BYTES: usize = 640 * 480 * 3;

/// Pixels: camera → scene parser.
pub const CAMERA_RGB: Topic = newest("camera/main/rgb", FRAME_BYTES);
/// Depth: camera → scene parser.
pub const CAMERA_DEPTH: Topic = newest("camera/main/depth", FRAME_BYTES / 3 * 4);
/// What the robot knows of itself: robot → scene parser, executor.
pub const ROBOT_STATE: Topic = newest("robot/state", 1);
/// Motions and answers to frames: executor → robot, scene parser.
pub const ROBOT_COMMAND: Topic = reliable("robot/command");
/// How motions fare: robot → executor, scene parser.
pub const ROBOT_STATUS: Topic = reliable("robot/status");
/// The constant goal: goal parser → all.
pub const GOAL: Topic =
    Topic { name: "goal", depth: 1, history: 1, delivery: Delivery::Newest, initial_len: 4096 };
/// The scene graph: scene parser → planner, executor, goal parser.
pub const SCENE: Topic = newest("scene", 256);
/// The plan: planner → executor.
pub const PLAN: Topic = newest("plan", 64);
/// How dispatched steps ended: executor → planner.
pub const OUTCOME: Topic = reliable("outcome");

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
