//! Every topic: its name and its limits. How much a reader lets pile up is the reader's own affair
//! ([`super::Depth`]).

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use crate::messages::MAIN_CAMERA;

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

/// Most messages waiting for one reader of a topic, camera frames excepted: two seconds at 30 frames
/// per second. iceoryx2 keeps 256 bytes per connection for each message that may wait for each reader
/// there may be, used or not: with 16 readers about 280 kB.
const DEPTH_MAX: usize = 64;
/// Most frames waiting for one reader: a quarter of a second at 30 frames per second.
const FRAMES_DEPTH_MAX: usize = 8;
/// Messages of a topic without losses that a late joiner gets.
const HISTORY: usize = 16;
/// The one writer of a topic, and a second one while the first is being replaced.
const ONE_WRITER: usize = 2;

/// Events that a late joiner gets.
const EVENTS_HISTORY: usize = 64;
/// Processes that may send requests at a time.
const CONTROL_WRITERS_MAX: usize = 16;
/// What has become of goals, that a late joiner gets.
const TASK_STATUS_HISTORY: usize = 64;
/// Bytes of the first allocation of a topic whose messages are text.
const TEXT_BYTES: usize = 4096;

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

/// A topic of JSON texts.
const fn text(name: &'static str, history: usize) -> Topic {
    Topic { history, ..state(name, TEXT_BYTES) }
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
/// Motions and answers to frames: executor → robot.
pub const ROBOT_COMMAND: Topic = stream("robot/command");
/// How motions fare: robot → executor, scene parser.
pub const ROBOT_STATUS: Topic = stream("robot/status");
/// The constant goal: goal parser → all.
pub const GOAL: Topic = state("goal", TEXT_BYTES);
/// The scene graph: scene parser → planner, executor, goal parser.
pub const SCENE: Topic = state("scene", 256);
/// The plan: planner → executor.
pub const PLAN: Topic = state("plan", 64);
/// Steps that the robot is told to carry out, with what they change: executor → scene parser.
pub const DISPATCH: Topic = stream("dispatch");
/// How dispatched steps ended: executor → planner.
pub const OUTCOME: Topic = stream("outcome");

/// Which scene and plan each command rests on: executor → whoever measures or records.
pub const DECISION: Topic = stream("decision");
/// What has happened, as JSON with a line for people: executor → narration, recorder,
/// viewers, scene parser (pauses).
pub const EVENT: Topic = text("event", EVENTS_HISTORY);
/// How the episode has ended, as JSON: executor → whoever waits for it.
pub const VERDICT: Topic = text("verdict", 1);
/// Requests to stop, pause, resume or step: any process → executor. Who asks stays until an event
/// answers: a message that the executor has not read yet is lost with its writer.
pub const CONTROL: Topic = Topic { writers_max: CONTROL_WRITERS_MAX, ..stream("control") };
/// How the actors fare: supervisor → viewers.
pub const HEALTH: Topic = state("health", 8);
/// What a process must know to take part, as JSON: run → every process that joins.
pub const RUN: Topic = text("run", 1);
/// Goals for a long-lived run, and that they are cancelled, as JSON: any process → run. Nothing is kept: who asks,
/// asks again until `task/status` answers.
pub const TASK: Topic = Topic { writers_max: CONTROL_WRITERS_MAX, ..text("task", 0) };
/// What becomes of each of them, as JSON: run → whoever asked, viewers.
pub const TASK_STATUS: Topic = text("task/status", TASK_STATUS_HISTORY);

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
    DISPATCH,
    OUTCOME,
    DECISION,
    EVENT,
    VERDICT,
    CONTROL,
    HEALTH,
    RUN,
    TASK,
    TASK_STATUS,
];

/// The topics of one camera: `camera/<id>/rgb` and `camera/<id>/depth`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CameraTopics {
    /// What the camera is called among actors: `camera/<id>`, and `camera` for `main`.
    pub camera: &'static str,
    /// Its pixels.
    pub rgb: Topic,
    /// Its depth.
    pub depth: Topic,
}

impl CameraTopics {
    /// Those of a camera by its id, such as `main`.
    pub fn of(id: &str) -> Self {
        if id == MAIN_CAMERA {
            return Self { camera: "camera", rgb: CAMERA_RGB, depth: CAMERA_DEPTH };
        }
        let topic = |what: &str, like: Topic| Topic {
            name: for_good(format!("camera/{id}/{what}")),
            ..like
        };
        Self {
            camera: for_good(format!("camera/{id}")),
            rgb: topic("rgb", CAMERA_RGB),
            depth: topic("depth", CAMERA_DEPTH),
        }
    }
}

/// A name that lasts as long as the process, kept once: there are as many as a run file has cameras.
fn for_good(name: String) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name.as_str()) {
        return known;
    }
    let kept: &'static str = Box::leak(name.into_boxed_str());
    names.insert(kept);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_has_topics_of_its_own_name() {
        let left = CameraTopics::of("left");
        assert_eq!([left.camera, left.rgb.name], ["camera/left", "camera/left/rgb"]);
        assert_eq!(left.depth.name, "camera/left/depth");
        assert_eq!(left.rgb.depth_max, CAMERA_RGB.depth_max);
        assert_eq!(CameraTopics::of("left"), left);
        assert!(std::ptr::eq(CameraTopics::of("left").rgb.name, left.rgb.name), "kept once");
        assert_eq!(CameraTopics::of("main").rgb, CAMERA_RGB);
    }
}
