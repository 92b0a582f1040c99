//! A robot and whoever commands it: what cannot be read is refused with a status, and a robot that hears nothing
//! more holds by itself.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::external::waypoint;
use crate::common::{TestRun, runtime, small};
use groundloop::actors::Monitor;
use groundloop::messages::{Command, CommandKind, Motion, Status, StatusKind, Waypoint};
use groundloop::run::HardwarePorts;
use groundloop::transport::convert::{command_to_wire, device_header, status_from_wire};
use groundloop::transport::topics::{RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATUS};
use groundloop::transport::wire::{CommandRecord, DeviceHeader, SCHEMA, StatusRecord};
use groundloop::transport::{Bus, Depth, Publisher, Subscriber};
use tokio::task::JoinSet;

/// The simulated gripper in real time, on a bus of its own.
struct Rig {
    commands: Publisher<DeviceHeader, CommandRecord>,
    statuses: Subscriber<DeviceHeader, StatusRecord>,
    _robot: JoinSet<()>,
}

impl Rig {
    fn start(run: &TestRun, sets: &[&str]) -> Self {
        let config = small("blocksworld.toml", &[&["clock=realtime"], sets].concat());
        let ports = HardwarePorts::build(&config, &config.domain_folder().unwrap()).unwrap();
        let bus = Bus::open(&run.bus("test")).unwrap();
        let commands = bus.publisher(&ROBOT_COMMAND).unwrap();
        let statuses = bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH)).unwrap();
        let mut robot = JoinSet::new();
        let actors = ports.actors(&bus, &Monitor::default()).into_iter();
        for actor in actors.filter(|actor| actor.name == "robot") {
            robot.spawn(async move { (actor.serve)().await.unwrap() });
        }
        Self { commands, statuses, _robot: robot }
    }

    fn send(&self, header: DeviceHeader, record: &CommandRecord) {
        self.commands.publish(header, std::slice::from_ref(record)).unwrap();
    }

    async fn next(&mut self) -> Status {
        let status = self.statuses.next().await.unwrap();
        status_from_wire(status.header(), status.records()).unwrap()
    }
}

/// A motion that is not over before something else happens: metres at millimetres a second.
fn start(id: u64) -> CommandRecord {
    let slow = |z| Waypoint { speed_m_s: 0.001, ..waypoint(z) };
    command(id, CommandKind::Start(Motion { waypoints: vec![slow(0.3), slow(0.4)] }))
}

fn command(id: u64, kind: CommandKind) -> CommandRecord {
    let command = Command { id, frame_sequence: 0, capture_ns: 0, kind, step: None };
    command_to_wire(&command).unwrap()
}

/// The executor does not wait for a motion that never began; and whatever else a hold says, it is obeyed.
#[test]
fn a_motion_that_cannot_be_read_has_failed_and_a_hold_is_obeyed() {
    let run = TestRun::new();
    runtime().block_on(async {
        let mut rig = Rig::start(&run, &["robot.command_age_ms_max=600000"]);
        let mut broken = start(1);
        broken.waypoints[1].speed_m_s = f64::NAN;
        rig.send(device_header(0, 0), &broken);
        let status = rig.next().await;
        let StatusKind::Failed(reason) = status.kind else { unreachable!("{status:?}") };
        assert_eq!(status.command_id, 1);
        assert!(
            reason.contains("the command cannot be read: message rejected: waypoint"),
            "{reason}"
        );
        rig.send(device_header(1, 0), &start(2));
        assert_eq!(rig.next().await.kind, StatusKind::Accepted);
        let mut hold = command(2, CommandKind::Hold);
        hold.n_waypoints = 99;
        rig.send(device_header(2, 0), &hold);
        let held = rig.next().await;
        assert_eq!((held.command_id, held.kind), (2, StatusKind::Cancelled));
    });
}

/// Whoever has started the motion says nothing any more: killed, stopped, or cut off.
#[test]
fn a_robot_that_hears_nothing_more_holds_by_itself() {
    let run = TestRun::new();
    runtime().block_on(async {
        let mut rig = Rig::start(&run, &["robot.command_age_ms_max=300"]);
        rig.send(device_header(0, 0), &start(1));
        assert_eq!(rig.next().await.kind, StatusKind::Accepted);
        let held = rig.next().await;
        assert_eq!((held.command_id, held.kind), (1, StatusKind::Cancelled));
    });
}

/// A run of another version is no run for this robot.
#[test]
fn commands_of_another_version_move_nothing() {
    let run = TestRun::new();
    runtime().block_on(async {
        let mut rig = Rig::start(&run, &["robot.command_age_ms_max=600000"]);
        for schema in [SCHEMA + 1, SCHEMA - 1] {
            rig.send(DeviceHeader { schema, ..device_header(0, 0) }, &start(1));
        }
        rig.send(device_header(1, 0), &start(2));
        let first = rig.next().await;
        assert_eq!((first.command_id, first.kind), (2, StatusKind::Accepted));
    });
}
