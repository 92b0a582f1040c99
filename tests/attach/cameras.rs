//! Runs with several cameras, and with one that moves.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{TestRun, episode, external, n_panics, panic_of, project, small, unique_run};
use groundloop::actors::Monitor;
use groundloop::messages::Event;
use groundloop::run::{HardwarePorts, RunConfig, load_run};
use groundloop::transport::{Bus, BusConfig, EventReader};
use rustix::process::Signal;
use tokio::task::JoinSet;

/// Both cameras are small, and use the small labelled examples.
const SMALL_BACK: &str = "cameras.back.exemplar.folder=sim_320x240";

fn two_views(sets: &[&str]) -> RunConfig {
    small("blocksworld_two_views.toml", &[&[SMALL_BACK], sets].concat())
}

/// What hides from the first camera is found by the second, whatever the seed.
#[test]
fn a_second_view_resolves_what_the_first_hides() {
    for seed in [1, 2] {
        let config = RunConfig { seed, ..two_views(&[]) };
        let both = TestRun::new();
        let report = both.run(config).unwrap().report;
        assert_eq!(report.verdict, "reached", "seed {seed}: {}", both.told());
        assert_eq!(report.goal_in_simulator, Some(true), "seed {seed}");
        let alone = RunConfig { seed, ..two_views(&["cameras.back.kind=none"]) };
        let report = episode(alone).report;
        assert_eq!(report.verdict, "gave-up", "seed {seed}");
        assert!(report.reason.contains("limits.unseen_s_max"), "{}", report.reason);
    }
}

/// One frame of each camera makes a moment, whoever is scheduled first and whoever restarts.
#[test]
fn a_panic_of_one_of_two_cameras_changes_nothing() {
    let config =
        two_views(&["sim.scene=scenes/three_blocks.toml", "goal.text=red over blue over green"]);
    let calm = episode(config.clone()).report;
    assert_eq!(calm.verdict, "reached");
    let mut shaken = config;
    for (actor, at_message) in [("camera", 20), ("camera/back", 31), ("scene_parser", 45)] {
        shaken.fault.push(panic_of(actor, at_message));
    }
    let shaken = episode(shaken);
    assert_eq!(n_panics(&shaken), 3);
    assert_eq!(shaken.report.decision_hash, calm.decision_hash);
}

/// What every camera shows is drawn, or comes from another process: the run is the same.
#[test]
fn cameras_in_another_process_are_looked_through_as_one() {
    let sets = [
        "sim.scene=scenes/three_blocks.toml",
        "goal.text=red over blue over green",
        "perception.exemplar.folder=sim_320x240",
        SMALL_BACK,
    ];
    let one = episode(two_views(&sets)).report;
    let name = unique_run("two-cameras");
    let played = [&sets[..], &["sim.camera.width=320", "sim.camera.height=240"]].concat();
    let hardware = external::hardware_of("configs/blocksworld_two_views.toml", &name, &played);
    let (run, _folder) = external::run(&name, &[&sets[1..], &["robot.wait_s=120"]].concat());
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let two = ended.json();
    assert_eq!(two["decision_hash"], one.decision_hash.as_str(), "{two}");
    hardware.signal(Signal::TERM);
    assert_eq!(hardware.end().status.code(), Some(0));
}

/// A run whose cameras are played by the test, which loses the second one once it has started.
fn lost(clock: &str) {
    let name = unique_run(&format!("lost-camera-{clock}"));
    let clock = format!("clock={clock}");
    let config = two_views(&[&clock]);
    let ports = HardwarePorts::build(&config, &config.domain_folder().unwrap()).unwrap();
    let examples = ["perception.exemplar.folder=sim_320x240", SMALL_BACK];
    let sets = [&[clock.as_str(), "camera.wait_s=2", "robot.wait_s=120"], &examples[..]].concat();
    let (run, _folder) = external::run(&name, &sets);
    crate::common::runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let mut events = EventReader::open(&bus).unwrap();
        let [mut back, mut others] = [JoinSet::new(), JoinSet::new()];
        for actor in ports.actors(&bus, &Monitor::default()) {
            let playing = if actor.name == "camera/back" { &mut back } else { &mut others };
            playing.spawn((actor.serve)());
        }
        while !matches!(events.next().await.unwrap().event, Event::Started { .. }) {}
        back.shutdown().await;
        let ended = tokio::task::spawn_blocking(|| run.end()).await.unwrap();
        assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
        let said = ended.stderr.lines().last().unwrap();
        let expected = format!(
            "error: a frame on camera/back/rgb for 2 s (camera.wait_s) is missing: start a camera, \
             such as `groundloop camera images DIR --fps 5 --run {name} --camera back`; nobody writes \
             camera/back/rgb of run \"{name}\" in /"
        );
        assert!(said.starts_with(&expected), "{said}");
    });
}

#[test]
fn a_camera_that_is_lost_in_lockstep_ends_the_run_by_its_name() {
    lost("lockstep");
}

#[test]
fn a_camera_that_is_lost_in_real_time_ends_the_run_by_its_name() {
    lost("realtime");
}

/// With several cameras each has to say where it is: a photograph says nothing of it.
#[test]
fn a_camera_without_a_pose_is_refused_by_its_name() {
    let name = unique_run("no-pose");
    let image = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles.png";
    let args = ["camera", "images", image, "--fps", "20", "--run", &name, "--camera", "back"];
    let mut camera = crate::common::Process::start(&args);
    camera.wait_for_line("publishing images as camera back");
    let sets = ["perception.exemplar.folder=sim_320x240", SMALL_BACK, "clock=realtime"];
    let (run, _folder) = external::run(&name, &[&sets[..], &["camera.wait_s=1"]].concat());
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("camera back: the frame has no intrinsics"), "{}", ended.stderr);
}

#[track_caller]
fn refused(sets: &[&str], expect: &str) {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let read = load_run(&project("configs/blocksworld_two_views.toml"), &sets)
        .and_then(|config| groundloop::run::PreparedRun::read(config, None).map(drop));
    let said = read.unwrap_err().to_string();
    assert!(said.contains(expect), "{sets:?}: {said}");
}

#[test]
fn wrong_settings_of_cameras_are_told_with_their_keys() {
    for (set, expect) in [
        ("cameras.back.kin=sim", "cameras.back.kin: unknown key; did you mean kind?"),
        ("cameras.back.kind=simm", "cameras.back.kind"),
        ("cameras.main.kind=sim", "cameras.main: expected a name of letters, digits, _ and -"),
        (
            "cameras.side.kind=sim",
            "sim.cameras.side: expected a table with position_m and look_at_m",
        ),
        ("cameras.back.kind=external", "cameras.back.kind: expected the kind of camera and robot"),
        ("cameras.back.exemplar.image=x.png", "cameras.back.exemplar: expected either folder"),
        ("sim.cameras.back.height=300", "sim.cameras.back: expected 640x480 pixels"),
        ("sim.cameras.back.position=[0, 0, 1]", "position: unknown key; did you mean position_m?"),
        ("sim.cameras.back.mount=carrige", "did you mean \"carriage\"?"),
        ("camera.skew_ms_max=-1", "camera.skew_ms_max"),
    ] {
        refused(&[set], expect);
    }
    let side = ["sim.cameras.bac.position_m=[0, 1, 1]", "sim.cameras.bac.look_at_m=[0, 0, 0]"];
    refused(&side, "expected a table [cameras.bac] beside it, got none; did you mean \"back\"?");
}

fn movable(sets: &[&str]) -> TestRun {
    let run = TestRun::new();
    let report = run.run(small("blocksworld_movable_camera.toml", sets)).unwrap().report;
    let told = run.told();
    let can_look = sets != [NO_VIEWS];
    assert_eq!(report.verdict, if can_look { "reached" } else { "gave-up" }, "{told}");
    assert_eq!(report.goal_in_simulator, Some(can_look), "{told}");
    run
}

const NO_VIEWS: &str = "robot.motion.view_poses=[]";

/// A block that seems to hang is looked at from the side before the goal counts as reached: the
/// blocks that hold it up are found there, and the goal, which seemed to hold, is worked for.
#[test]
fn a_doubt_that_matters_moves_the_camera() {
    let told = movable(&[]).told();
    let why = "the goal seems to hold, but there is nothing under red_block";
    assert!(told.contains(&format!("look from view 1: {why}")), "{told}");
    assert!(told.contains("unstack"), "{told}");
    let told = movable(&[NO_VIEWS]).told();
    assert!(told.contains(why), "{told}");
}

/// Objects of the goal that nobody has seen are looked for from the view poses, too.
#[test]
fn a_hidden_object_of_the_goal_is_found_by_moving_the_camera() {
    let goal = "goal.text=Put the red block on the pink block and the blue block on the table.";
    let told = movable(&[goal]).told();
    assert!(told.contains("look from view 1: objects of the goal: blue_block"), "{told}");
    let report = episode(small("blocksworld_movable_camera.toml", &[goal, NO_VIEWS])).report;
    assert_eq!(report.verdict, "gave-up");
    assert!(report.reason.contains("blue_block"), "{}", report.reason);
}
