//! Motions on an arm that arrives when the test says so.

use nalgebra::Point3;

use super::*;
use crate::messages::{CommandKind, Expect, Motion, StatusKind, Waypoint};

/// An arm that is where it was told to go, and holds what the test gives it.
struct FakeArm {
    tool: Target,
    targets: Vec<Target>,
    arrived: bool,
    holding: bool,
    /// Refuses to go below this height, metres.
    floor_m: f64,
}

impl FakeArm {
    fn new() -> Self {
        let position = Point3::new(0.0, 0.0, 0.2);
        let tool = Target { position, yaw_rad: 0.0, opening_m: 0.08, speed_m_s: 0.1 };
        Self { tool, targets: Vec::new(), arrived: true, holding: false, floor_m: 0.0 }
    }

    /// Heights that it was told to go to.
    fn heights(&self) -> Vec<f64> {
        self.targets.iter().map(|t| t.position.z).collect()
    }
}

impl Arm for FakeArm {
    fn go(&mut self, target: Target) -> Result<(), String> {
        if target.position.z < self.floor_m {
            return Err("below the floor".to_owned());
        }
        self.targets.push(target);
        self.tool = target;
        Ok(())
    }

    fn has_arrived(&self) -> bool {
        self.arrived
    }

    fn is_holding(&self) -> bool {
        self.holding
    }

    fn tool(&self) -> Target {
        self.tool
    }
}

fn waypoint(z: f64, expect: Expect) -> Waypoint {
    Waypoint {
        position: Point3::new(0.1, 0.0, z),
        yaw_rad: 0.0,
        opening_m: 0.05,
        speed_m_s: 0.3,
        expect,
        retractable: true,
    }
}

fn motion(waypoints: &[(f64, Expect)]) -> CommandKind {
    let waypoints = waypoints.iter().map(|(z, expect)| waypoint(*z, *expect)).collect();
    CommandKind::Start(Motion { waypoints })
}

fn taking() -> CommandKind {
    motion(&[(0.5, Expect::Empty), (0.1, Expect::Empty), (0.1, Expect::Holding)])
}

/// An arm on its way to the second of three waypoints of command 4.
fn going_down() -> (Sequencer, FakeArm) {
    let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
    assert_eq!(sequencer.accept(4, &taking(), &mut arm), Some(StatusKind::Accepted));
    assert_eq!(sequencer.tick(&mut arm), None);
    assert_eq!((sequencer.command_id(), sequencer.phase()), (Some(4), 1));
    (sequencer, arm)
}

#[test]
fn waypoints_are_gone_through_in_order_each_once_the_last_is_reached() {
    let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
    arm.arrived = false;
    let up_and_down = motion(&[(0.5, Expect::Anything), (0.1, Expect::Anything)]);
    assert_eq!(sequencer.accept(4, &up_and_down, &mut arm), Some(StatusKind::Accepted));
    assert_eq!(sequencer.tick(&mut arm), None);
    assert_eq!((arm.heights(), sequencer.phase()), (vec![0.5], 0), "still on its way");
    arm.arrived = true;
    assert_eq!(sequencer.tick(&mut arm), None);
    assert_eq!((arm.heights(), sequencer.phase()), (vec![0.5, 0.1], 1));
    let sent = arm.targets[1];
    assert_eq!((sent.position.x, sent.opening_m, sent.speed_m_s), (0.1, 0.05, 0.3));
    assert_eq!(sequencer.tick(&mut arm), Some((4, StatusKind::Done)));
    assert_eq!((sequencer.command_id(), sequencer.phase()), (None, 0));
    assert_eq!(sequencer.tick(&mut arm), None, "it is over");
}

#[test]
fn a_hand_that_is_not_as_expected_goes_up_before_it_says_so() {
    for (expect, holding, reason) in [
        (Expect::Holding, false, "nothing is in the gripper"),
        (Expect::Empty, true, "something is still in the gripper"),
    ] {
        let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
        sequencer.accept(4, &motion(&[(0.4, Expect::Anything), (0.1, expect)]), &mut arm);
        sequencer.tick(&mut arm);
        arm.holding = holding;
        assert_eq!(sequencer.tick(&mut arm), None, "it has to go up first");
        assert_eq!(arm.heights(), [0.4, 0.1, 0.4], "the highest point of the motion");
        let up = arm.targets[2];
        assert_eq!((up.position.x, up.opening_m), (0.1, if holding { 0.0 } else { 0.05 }));
        arm.arrived = false;
        assert_eq!((sequencer.tick(&mut arm), sequencer.command_id()), (None, Some(4)));
        arm.arrived = true;
        let failed = StatusKind::Failed(reason.to_owned());
        assert_eq!(sequencer.tick(&mut arm), Some((4, failed)));
        assert_eq!(sequencer.command_id(), None);
    }
}

#[test]
fn a_hand_that_is_as_expected_goes_on() {
    for (expect, holding) in
        [(Expect::Holding, true), (Expect::Empty, false), (Expect::Anything, true)]
    {
        let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
        arm.holding = holding;
        sequencer.accept(4, &motion(&[(0.1, expect)]), &mut arm);
        assert_eq!(sequencer.tick(&mut arm), Some((4, StatusKind::Done)), "{expect:?}");
    }
}

#[test]
fn a_broken_off_motion_goes_up_with_what_is_held_and_then_says_so() {
    for holding in [false, true] {
        let (mut sequencer, mut arm) = going_down();
        arm.holding = holding;
        assert_eq!(sequencer.accept(4, &CommandKind::Cancel, &mut arm), None);
        assert_eq!(arm.heights(), [0.5, 0.1, 0.5]);
        assert_eq!(arm.tool.opening_m, if holding { 0.0 } else { 0.05 }, "what is held stays held");
        assert_eq!(sequencer.accept(4, &CommandKind::Cancel, &mut arm), None);
        assert_eq!(arm.targets.len(), 3, "told twice, done once");
        arm.arrived = false;
        assert_eq!(sequencer.tick(&mut arm), None);
        arm.arrived = true;
        assert_eq!(sequencer.tick(&mut arm), Some((4, StatusKind::Cancelled)));
    }
}

#[test]
fn breaking_off_or_going_on_without_a_motion_moves_nothing() {
    let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
    for kind in [CommandKind::Cancel, CommandKind::Continue] {
        assert_eq!(sequencer.accept(1, &kind, &mut arm), None);
        assert_eq!(sequencer.tick(&mut arm), None);
    }
    assert!(arm.targets.is_empty());
}

#[test]
fn a_motion_that_cannot_begin_is_refused() {
    let (mut sequencer, mut arm) = going_down();
    let failed = |reason: &str| Some(StatusKind::Failed(reason.to_owned()));
    let refused = sequencer.accept(5, &taking(), &mut arm);
    assert_eq!(refused, failed("another motion is running"));
    assert_eq!((sequencer.command_id(), arm.targets.len()), (Some(4), 2), "the first goes on");

    let mut sequencer = Sequencer::default();
    let refused = sequencer.accept(5, &motion(&[]), &mut arm);
    assert_eq!(refused, failed("the motion has no waypoints"));
    let refused = sequencer.accept(6, &motion(&[(-0.1, Expect::Anything)]), &mut arm);
    assert_eq!(refused, failed("below the floor"));
    assert_eq!(sequencer.command_id(), None);
}

#[test]
fn a_waypoint_that_the_arm_refuses_fails_the_motion() {
    let (mut sequencer, mut arm) = (Sequencer::default(), FakeArm::new());
    sequencer.accept(4, &motion(&[(0.5, Expect::Anything), (-0.1, Expect::Anything)]), &mut arm);
    assert_eq!(sequencer.tick(&mut arm), None);
    let failed = StatusKind::Failed("below the floor".to_owned());
    assert_eq!(sequencer.tick(&mut arm), Some((4, failed)));
}

#[test]
fn hold_stands_still_where_the_tool_is() {
    let (mut sequencer, mut arm) = going_down();
    arm.tool.position.z = 0.3;
    assert_eq!(sequencer.accept(4, &CommandKind::Hold, &mut arm), None);
    assert_eq!(arm.heights(), [0.5, 0.1, 0.3]);
    let ended = sequencer.tick(&mut arm);
    assert_eq!(ended, Some((4, StatusKind::Cancelled)), "the jaws keep what they hold");
    assert_eq!((sequencer.tick(&mut arm), arm.targets.len()), (None, 3), "it stays there");
    arm.floor_m = 1.0;
    let refused = sequencer.accept(4, &CommandKind::Hold, &mut arm);
    assert_eq!(refused, Some(StatusKind::Failed("below the floor".to_owned())));
}
