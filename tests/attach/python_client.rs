//! The Python package in `clients/python`, where its libraries are installed: a camera, a robot, a viewer.
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::external::waypoint;
use crate::common::{Killed, Process, SMALL_CAMERA, project, unique_run};
use groundloop::messages::{
    Command as RobotCommand, CommandKind, Expect, Motion, StatusKind, Waypoint,
};
use groundloop::transport::convert::{
    command_to_wire, depth_from_wire, device_header, frame_from_wire, robot_state_from_wire,
    status_from_wire,
};
use groundloop::transport::topics::{
    CAMERA_DEPTH, CAMERA_RGB, RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS,
};
use groundloop::transport::wire::{
    CommandRecord, DeviceHeader, FrameHeader, RobotStateRecord, StatusRecord,
};
use groundloop::transport::{
    Bus, BusConfig, Depth, Publisher, Received, Subscriber, TransportError,
};
use nalgebra::Point3;

/// Whether the package can be used; prints what is skipped where it cannot.
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
pub(crate) fn is_there() -> bool {
    let import = Command::new("python3")
        .args(["-c", "import groundloop"])
        .env("PYTHONPATH", project("clients/python"))
        .output();
    let is_there = import.is_ok_and(|output| output.status.success());
    if !is_there {
        println!("skipped: the Python package: pip install ./clients/python");
    }
    is_there
}

fn python(args: &[&str]) -> Killed {
    let mut command = Command::new("python3");
    command.args(args).env("PYTHONPATH", project("clients/python")).stdin(Stdio::null());
    Killed(command.current_dir(project("")).spawn().unwrap())
}

/// Two by three pixels, with depth as whole millimetres, a camera model, and a pose that is a quarter turn.
const CAMERA: &str = "
import sys, time, numpy as np
from groundloop import Camera, Intrinsics

def main():
    pose = np.array([[0.0, -1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3], [0.0, 0.0, 0.0, 1.0]])
    camera = Camera(sys.argv[1], intrinsics=Intrinsics(500.0, 501.0, 1.0, 0.5), world_from_camera=pose)
    rgb = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    depth = np.array([[1000, 0, 2000], [1, 2, 3]], np.uint16)
    while True:
        camera.publish(rgb, depth)
        time.sleep(0.02)

main()
";

#[test]
fn a_camera_in_python_is_seen_as_it_is() {
    if !is_there() {
        return;
    }
    let name = unique_run("python-camera");
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    crate::common::runtime().block_on(async {
        let mut frames: Subscriber<FrameHeader, u8> =
            bus.subscriber(&CAMERA_RGB, Depth::newest()).unwrap();
        let mut depths: Subscriber<FrameHeader, u8> =
            bus.subscriber(&CAMERA_DEPTH, Depth::newest()).unwrap();
        let _camera = python(&["-c", CAMERA, &name]);
        let frame = frames.newest().await.unwrap();
        let view = frame_from_wire(frame.header(), frame.records()).unwrap();
        assert_eq!((view.width, view.height), (3, 2));
        assert_eq!(view.rgb, (0..18).collect::<Vec<u8>>());
        let model = view.model.unwrap();
        assert_eq!((model.intrinsics.fx, model.intrinsics.fy), (500.0, 501.0));
        let ahead = model.world_from_camera * Point3::new(1.0, 0.0, 0.0);
        assert!((ahead - Point3::new(0.1, 1.2, 0.3)).norm() < 1e-9, "{ahead}");
        let depth = depths.newest().await.unwrap();
        let mut depth_m = Vec::new();
        depth_from_wire(depth.header(), depth.records(), &mut depth_m).unwrap();
        assert_eq!(depth_m, [1.0, 0.0, 2.0, 0.001, 0.002, 0.003]);
    });
}

/// `clients/python/examples/robot.py` carries out a motion, refuses another, and says so.
#[test]
fn a_robot_in_python_follows_waypoints() {
    if !is_there() {
        return;
    }
    let name = unique_run("python-robot");
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let script = project("clients/python/examples/robot.py");
    crate::common::runtime().block_on(async {
        let commands: Publisher<DeviceHeader, CommandRecord> =
            bus.publisher(&ROBOT_COMMAND).unwrap();
        let mut states: Subscriber<DeviceHeader, RobotStateRecord> =
            bus.subscriber(&ROBOT_STATE, Depth::newest()).unwrap();
        let mut statuses: Subscriber<DeviceHeader, StatusRecord> =
            bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH)).unwrap();
        let _robot = python(&[script.to_str().unwrap(), &name]);
        let read = |m: Received<_, _>| robot_state_from_wire(m.header(), m.records());
        let first = states.newest_of(read).await.unwrap();
        assert!(first.position.z > 0.4 && !first.holding);
        let send = |id: u64, waypoints: Vec<Waypoint>| {
            let kind = CommandKind::Start(Motion { waypoints });
            let command = RobotCommand { id, frame_sequence: 0, capture_ns: 0, kind, step: None };
            let record = command_to_wire(&command).unwrap();
            commands.publish(device_header(id, 0), &[record]).unwrap();
        };
        let mut said = Vec::new();
        send(1, vec![waypoint(0.3), waypoint(0.1)]);
        while said.len() < 2 {
            let message = statuses.next().await.unwrap();
            said.push(status_from_wire(message.header(), message.records()).unwrap().kind);
        }
        send(2, vec![waypoint(-0.1)]);
        let mut next = async || {
            let message = statuses.next().await.unwrap();
            status_from_wire(message.header(), message.records()).unwrap().kind
        };
        said.push(next().await);
        let refused = StatusKind::Failed("that is below the table".to_owned());
        assert_eq!(said, [StatusKind::Accepted, StatusKind::Done, refused]);

        // What is held stays gripped, though the jaws are told to be as wide as it is.
        let gripped = Waypoint { opening_m: 0.0, expect: Expect::Anything, ..waypoint(0.1) };
        let carried = Waypoint { expect: Expect::Holding, ..waypoint(0.2) };
        send(3, vec![gripped, carried, waypoint(0.2)]);
        assert_eq!([next().await, next().await], [StatusKind::Accepted, StatusKind::Done]);

        // Nobody says anything while it is on a long way: it stands, and says so.
        send(4, vec![Waypoint { speed_m_s: 0.001, ..waypoint(0.4) }]);
        assert_eq!(next().await, StatusKind::Accepted);
        let StatusKind::Failed(reason) = next().await else { panic!("it goes on unheard") };
        assert!(reason.contains("nothing was heard"), "{reason}");
    });
}

/// What a Python process says that ends by itself with an error.
fn refused(script: &str, name: &str) -> String {
    let ended = Command::new("python3")
        .args(["-c", script, name])
        .env("PYTHONPATH", project("clients/python"))
        .output()
        .unwrap();
    assert_eq!(ended.status.code(), Some(1));
    String::from_utf8(ended.stderr).unwrap()
}

/// Two cameras of a name, or two robots, would be mixed: the second is refused as `groundloop camera` is.
#[test]
fn a_second_of_a_kind_is_refused_in_python_too() {
    if !is_there() {
        return;
    }
    let name = unique_run("python-second");
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let taken = |topic| TransportError::Taken { topic, run: name.clone() }.to_string();
    let robot = "import sys\nfrom groundloop import Robot\n\
                 def main(): Robot(sys.argv[1], None)\nmain()";
    crate::common::runtime().block_on(async {
        let _commands: Publisher<DeviceHeader, CommandRecord> =
            bus.publisher(&ROBOT_COMMAND).unwrap();
        let mut frames: Subscriber<FrameHeader, u8> =
            bus.subscriber(&CAMERA_RGB, Depth::newest()).unwrap();
        let _depths: Subscriber<FrameHeader, u8> =
            bus.subscriber(&CAMERA_DEPTH, Depth::newest()).unwrap();
        let _statuses: Subscriber<DeviceHeader, StatusRecord> =
            bus.subscriber(&ROBOT_STATUS, Depth::newest()).unwrap();
        let states: Publisher<DeviceHeader, RobotStateRecord> =
            bus.publisher(&ROBOT_STATE).unwrap();
        let said = refused(robot, &name);
        assert!(said.contains(&taken(ROBOT_STATE.name)), "{said}");
        drop(states);

        let camera = python(&["-c", CAMERA, &name]);
        frames.newest().await.unwrap();
        let said = refused(CAMERA, &name);
        assert!(said.contains(&taken(CAMERA_RGB.name)), "{said}");
        // One that was killed is no camera any more.
        drop(camera);
        while frames.poll_next().unwrap().is_some() {}
        let _next = python(&["-c", CAMERA, &name]);
        frames.newest().await.unwrap();
    });
}

/// What happens in a run, told in another process until it has ended.
#[test]
fn a_viewer_in_python_hears_a_run_to_its_end() {
    if !is_there() {
        return;
    }
    let name = unique_run("python-viewer");
    let script = "import sys\nfrom groundloop import watch\n\
                  def main():\n for event in watch(sys.argv[1]): print(event['text'])\nmain()";
    let viewer = Command::new("python3")
        .args(["-c", script, &name])
        .env("PYTHONPATH", project("clients/python"))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let sets = SMALL_CAMERA.iter().flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/blocksworld.toml", "--json", "--run", &name];
    let run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    assert_eq!(run.end().status.code(), Some(0));
    let told = String::from_utf8(viewer.wait_with_output().unwrap().stdout).unwrap();
    assert!(told.contains("started ("), "{told}");
    assert!(
        told.trim_end().ends_with("end: reached: the goal holds in a confirmed state"),
        "{told}"
    );
}

/// A complete camera has 25 lines at most, a robot 60.
#[test]
fn examples_are_short() {
    for (name, lines_max) in [("camera.py", 25), ("robot.py", 60)] {
        let path = Path::new("clients/python/examples").join(name);
        let lines = std::fs::read_to_string(project(path.to_str().unwrap())).unwrap();
        assert!(lines.lines().count() <= lines_max, "{name}");
    }
}
