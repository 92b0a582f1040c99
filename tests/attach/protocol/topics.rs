//! Who says what on which topic.

/// One topic with its layouts.
pub(crate) struct Spoken {
    pub(crate) name: &'static str,
    pub(crate) header: &'static str,
    /// A record, or what the bytes are.
    pub(crate) payload: &'static str,
    pub(crate) from: &'static str,
    pub(crate) to: &'static str,
}

const fn spoken(name: &'static str, layouts: [&'static str; 2], ends: [&'static str; 2]) -> Spoken {
    let ([header, payload], [from, to]) = (layouts, ends);
    Spoken { name, header, payload, from, to }
}

/// All topics, in the order of `transport/topics.rs`.
pub(crate) const TOPICS: [Spoken; 18] = [
    spoken(
        "camera/main/rgb",
        ["FrameHeader", "bytes: packed RGB8, row by row"],
        ["camera", "scene parser"],
    ),
    spoken(
        "camera/main/depth",
        ["FrameHeader", "bytes: little-endian f32 metres, row by row"],
        ["camera", "scene parser"],
    ),
    spoken(
        "robot/state",
        ["DeviceHeader", "one RobotStateRecord"],
        ["robot", "scene parser, executor"],
    ),
    spoken("robot/command", ["DeviceHeader", "one CommandRecord"], ["executor", "robot"]),
    spoken(
        "robot/status",
        ["DeviceHeader", "one StatusRecord"],
        ["robot", "scene parser, executor"],
    ),
    spoken(
        "goal",
        ["TaskHeader", "bytes: a PDDL problem without facts, or nothing yet"],
        ["goal parser", "planner, scene parser"],
    ),
    spoken(
        "scene",
        ["TaskHeader", "SceneRecords: objects, facts, anomalies"],
        ["scene parser", "planner, executor, goal parser"],
    ),
    spoken("plan", ["TaskHeader", "StepRecords"], ["planner", "executor"]),
    spoken("dispatch", ["StreamHeader", "DispatchRecords"], ["executor", "scene parser"]),
    spoken("outcome", ["TaskHeader", "one OutcomeRecord"], ["executor", "planner"]),
    spoken(
        "decision",
        ["StreamHeader", "one DecisionRecord"],
        ["executor", "who measures or records"],
    ),
    spoken("event", ["StreamHeader", "bytes: JSON"], ["executor", "viewers, scene parser"]),
    spoken("verdict", ["StreamHeader", "bytes: JSON"], ["executor", "who waits for the end"]),
    spoken("control", ["DeviceHeader", "one ControlRecord"], ["any process", "executor"]),
    spoken("health", ["StreamHeader", "HealthRecords"], ["supervisor", "viewers"]),
    spoken("run", ["DeviceHeader", "bytes: JSON"], ["run", "who joins"]),
    spoken("task", ["DeviceHeader", "bytes: JSON"], ["any process", "run that serves"]),
    spoken(
        "task/status",
        ["DeviceHeader", "bytes: JSON"],
        ["run that serves", "who asked, viewers"],
    ),
];
