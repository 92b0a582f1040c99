//! What `groundloop run --json` says of an episode.

use serde_json::Value;

/// The keys of a JSON object in their order.
pub fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

/// What the JSON of an episode holds, in this order.
const REPORT_KEYS: [&str; 20] = [
    "verdict",
    "reason",
    "seed",
    "cycles",
    "frames",
    "replans",
    "skills_done",
    "skills_failed",
    "sim_seconds",
    "wall_seconds",
    "cpu_ms_per_frame",
    "rungs",
    "decision_hash",
    "latency_us",
    "plan",
    "goal",
    "goal_in_simulator",
    "facts",
    "faults",
    "dispatches",
];

/// Fails unless it is the report of one episode.
#[track_caller]
pub fn is_a_report(report: &Value) {
    assert_eq!(keys(report), REPORT_KEYS);
    let latency = &report["latency_us"];
    assert_eq!(keys(latency), ["frame_to_command", "detect", "ground", "plan"]);
    let kinds = &latency["frame_to_command"];
    assert_eq!(keys(kinds), ["continue", "dispatch", "replan"]);
    for kind in ["continue", "dispatch", "replan"] {
        assert_eq!(keys(&kinds[kind]), ["count", "p50", "p99", "max"]);
    }
    assert_eq!(report["decision_hash"].as_str().unwrap().len(), 64);
}
