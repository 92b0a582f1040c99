//! Runs whose camera and robot are played by another process.

use groundloop::messages::{Expect, Waypoint};
use nalgebra::Point3;

use super::Process;

/// The run file of the task.
pub const CONFIG: &str = "configs/blocksworld.toml";

/// A run file for the same task, whose camera and robot are played elsewhere. How a robot of one's own
/// moves, and what it hides, is one's own to say.
const EXTERNAL: &str = r#"
extends = "blocksworld"

[camera]
kind = "external"
wait_s = 120.0

[robot]
kind = "external"

[robot.motion]
travel_z_m = 0.55
speed_m_s = 1.2
approach_speed_m_s = 0.3
approach_m = 0.04
jaw_clearance_m = 0.03
opening_m_max = 0.13
grip_depth_m = 0.025
release_gap_m = 0.002
table_clearance_m = 0.03
table_z_m = 0.0
place_x_m = [-0.30, 0.30]
place_y_m = -0.02
reach_x_m = [-0.45, 0.45]
reach_y_m = [-0.30, 0.25]
view_poses = []

[robot.self_filter]
beyond_jaws_m = 0.03
half_depth_m = 0.03
below_m = 0.02
above_m = 0.60
"#;

/// A run whose camera and robot are played elsewhere, with overrides.
pub fn run(name: &str, sets: &[&str]) -> (Process, tempfile::TempDir) {
    start("run", name, sets)
}

/// The same by another verb.
pub fn start(verb: &str, name: &str, sets: &[&str]) -> (Process, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("external.toml");
    std::fs::write(&path, EXTERNAL).unwrap();
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let args = [verb, path.to_str().unwrap(), "--json", "--run", name];
    let process = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    (process, folder)
}

/// A process that plays the simulated camera and gripper of the run file, with overrides.
pub fn hardware(name: &str, sets: &[&str]) -> Process {
    hardware_of(CONFIG, name, sets)
}

/// The same for another run file.
pub fn hardware_of(config: &str, name: &str, sets: &[&str]) -> Process {
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let args = ["hardware", config, "--run", name];
    let mut hardware = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    hardware.wait_for_line("playing camera and ");
    hardware
}

/// A point at a height above the table, with nothing in the gripper.
pub fn waypoint(z: f64) -> Waypoint {
    Waypoint {
        position: Point3::new(0.1, 0.0, z),
        yaw_rad: 0.0,
        opening_m: 0.05,
        speed_m_s: 5.0,
        expect: Expect::Empty,
        retractable: true,
    }
}
