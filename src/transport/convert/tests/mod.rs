//! What is written is read back; what does not fit is rejected by the name of its field.

mod rejections;
mod reports;

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::geometry::{Aabb, CameraModel, Intrinsics, PixelBox};
use crate::logic::Truth;
use crate::messages::{
    Command, CommandKind, Dispatch, Effects, Expect, Frame, GoalMessage, GoalUpdate, Motion,
    PlanMessage, PlanSource, PlanVerdict, RobotState, Spent, Status, StatusKind, StepOutcome,
    Waypoint,
};
use crate::pddl::{Atom, Name, SourceText, Step, Typed, parse_goal};
use crate::run::DomainFolder;
use crate::scene::{Anomaly, FrameRef, Origin, Scene, SceneFact, SceneObject, Visibility};
use crate::transport::wire::{
    ARGS_MAX, CommandRecord, DeviceHeader, DispatchRecord, FrameHeader, NameText, OutcomeRecord,
    RobotStateRecord, SceneRecord, StatusRecord, StepRecord, StreamHeader, TaskHeader,
    WAYPOINTS_MAX,
};

const CAUSE: FrameRef =
    FrameRef { cycle: 7, frame_sequence: 70, capture_ns: 700, frame_send_ns: 7000 };

fn context() -> WireContext {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld");
    WireContext::new(11, 0xabc, DomainFolder::read(&path).unwrap().domain)
}

fn names() -> impl Strategy<Value = Name> {
    "[a-z0-9_äßπ-]{1,20}".prop_map(Name::new)
}

fn numbers() -> impl Strategy<Value = f64> {
    prop_oneof![-1e9..1e9, prop::num::f64::NORMAL | prop::num::f64::ZERO]
}

fn triples() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(numbers())
}

prop_compose! {
    fn objects()(
        name in names(),
        type_name in prop::sample::select(vec!["block", "robot", "object"]),
        pixel_box in prop::option::of(prop::array::uniform4(numbers())),
        volume in prop::option::of((triples(), triples())),
        score in 0.0..=1.0_f32,
        visibility in prop::sample::select(vec![
            Visibility::Visible, Visibility::Hidden, Visibility::Held, Visibility::Implied,
        ]),
        seen_ns in any::<u64>(),
    ) -> SceneObject {
        let volume = volume.map(|(c, extent)| Aabb { centre: Point3::from(c), extent });
        let (type_name, pixel_box) = (type_name.into(), pixel_box.map(PixelBox::from));
        SceneObject { name, type_name, pixel_box, volume, score, visibility, seen_ns }
    }
}

prop_compose! {
    fn facts(objects: Vec<SceneObject>)(
        predicate in prop::sample::select(vec![("on", 2), ("clear", 1), ("handempty", 1)]),
        args in prop::array::uniform2(0..objects.len()),
        truths in prop::array::uniform2(truths()),
        origin in prop::sample::select(vec![
            Origin::Observed, Origin::Proprioceptive, Origin::Completed, Origin::Remembered,
            Origin::Predicted, Origin::Constrained,
        ]),
        confidence in 0.0..=1.0_f32,
    ) -> SceneFact {
        let args = args[..predicate.1].iter().map(|i| objects[*i].name.clone()).collect();
        let atom = Atom { predicate: predicate.0.into(), args };
        SceneFact { atom, raw: truths[0], confirmed: truths[1], origin, confidence }
    }
}

prop_compose! {
    fn anomalies(objects: Vec<SceneObject>)(
        objects in prop::collection::vec(prop::sample::select(objects), 1..=ARGS_MAX),
        reason in "[a-z][ a-z]{0,40}",
    ) -> Anomaly {
        Anomaly::about(objects.into_iter().map(|object| object.name).collect(), reason)
    }
}

fn truths() -> impl Strategy<Value = Truth> {
    prop::sample::select(vec![Truth::False, Truth::Unknown, Truth::True])
}

fn scenes() -> impl Strategy<Value = Scene> {
    let facts = |objects: Vec<SceneObject>| {
        let anomalies = prop::collection::vec(anomalies(objects.clone()), 0..3);
        let facts = prop::collection::vec(facts(objects.clone()), 0..8);
        (Just(objects), facts, anomalies, any::<u32>(), any::<[u32; 2]>())
    };
    prop::collection::vec(objects(), 1..6).prop_flat_map(facts).prop_map(
        |(objects, facts, anomalies, unsettled, [detect_us, ground_us])| Scene {
            cause: CAUSE,
            objects,
            facts,
            anomalies,
            unsettled,
            detect_us,
            ground_us,
        },
    )
}

prop_compose! {
    fn waypoints()(
        position in triples(),
        yaw_rad in -4.0..4.0,
        opening_m in 0.0..0.2,
        speed_m_s in 0.001..3.0,
        expect in prop::sample::select(vec![Expect::Anything, Expect::Empty, Expect::Holding]),
        retractable in any::<bool>(),
    ) -> Waypoint {
        let position = Point3::from(position);
        Waypoint { position, yaw_rad, opening_m, speed_m_s, expect, retractable }
    }
}

fn commands() -> impl Strategy<Value = Command> {
    let motion = prop::collection::vec(waypoints(), 0..=WAYPOINTS_MAX);
    let kind = prop_oneof![
        Just(CommandKind::Continue),
        motion.prop_map(|waypoints| CommandKind::Start(Motion { waypoints })),
        Just(CommandKind::Cancel),
        Just(CommandKind::Hold),
    ];
    (any::<[u64; 3]>(), kind, prop::option::of(steps())).prop_map(
        |([id, frame_sequence, capture_ns], kind, step)| Command {
            id,
            frame_sequence,
            capture_ns,
            kind,
            step,
        },
    )
}

fn statuses() -> impl Strategy<Value = Status> {
    let kind = prop_oneof![
        Just(StatusKind::Accepted),
        Just(StatusKind::Done),
        "\\PC{0,40}".prop_map(StatusKind::Failed),
        Just(StatusKind::Cancelled),
    ];
    (any::<[u64; 3]>(), kind).prop_map(|([sequence, capture_ns, command_id], kind)| Status {
        sequence,
        capture_ns,
        command_id,
        kind,
    })
}

fn steps() -> impl Strategy<Value = Step> {
    (names(), names())
        .prop_map(|(a, b)| Step { action: "stack".into(), args: vec![a, b, "arm".into()] })
}

fn verdicts() -> impl Strategy<Value = PlanVerdict> {
    let steps = prop::collection::vec(steps(), 0..9);
    prop_oneof![
        (steps, any::<u64>()).prop_map(|(steps, cost)| PlanVerdict::Plan { steps, cost }),
        ("\\PC{0,40}", any::<bool>())
            .prop_map(|(proof, unknowns)| PlanVerdict::Unsolvable { proof, unknowns }),
        "\\PC{0,40}".prop_map(|limit| PlanVerdict::OutOfBudget { limit }),
        "\\PC{0,40}".prop_map(|feature| PlanVerdict::Unsupported { feature }),
        prop::collection::vec(names(), 0..4).prop_map(|objects| PlanVerdict::Missing { objects }),
        prop::collection::vec((names(), names()), 0..4).prop_map(|pairs| {
            let atom = |(a, b)| Atom { predicate: "on".into(), args: vec![a, b] };
            PlanVerdict::Inconsistent { atoms: pairs.into_iter().map(atom).collect() }
        }),
    ]
}

prop_compose! {
    fn plans()(
        verdict in verdicts(),
        source in prop::option::of(prop::sample::select(PlanSource::ALL.to_vec())),
        (plan_us, expansions, of_all, is_predicted, is_doubted) in any::<(u32, u64, bool, bool, bool)>(),
        [a, b, c, d] in any::<[u64; 4]>(),
    ) -> PlanMessage {
        let observe = Spent { cpu_ns: a, wall_ns: b };
        let decide = Spent { cpu_ns: c, wall_ns: d };
        PlanMessage { cause: CAUSE, verdict, of_all, is_predicted, is_doubted, source, expansions, plan_us, observe, decide }
    }
}

proptest! {
    #[test]
    fn a_scene_arrives_as_it_was_sent(scene in scenes()) {
        let context = context();
        let (header, records) = scene_to_wire(&scene, &context).unwrap();
        prop_assert_eq!(scene_from_wire(&header, &records, &context), Ok(scene));
    }

    #[test]
    fn a_plan_arrives_as_it_was_sent(plan in plans()) {
        let context = context();
        let (header, records) = plan_to_wire(&plan, &context).unwrap();
        prop_assert_eq!(plan_from_wire(&header, &records, &context), Ok(plan));
    }

    #[test]
    fn a_command_and_a_status_arrive_as_they_were_sent(
        command in commands(),
        status in statuses(),
    ) {
        let record = command_to_wire(&command).unwrap();
        let header = device_header(1, command.capture_ns);
        prop_assert_eq!(command_from_wire(&header, &[record]), Ok(command));
        let header = device_header(status.sequence, status.capture_ns);
        prop_assert_eq!(status_from_wire(&header, &[status_to_wire(&status)]), Ok(status));
    }

    #[test]
    fn a_robot_state_arrives_as_it_was_sent(
        position in triples(),
        [yaw_rad, opening_m] in prop::array::uniform2(numbers()),
        holding in any::<bool>(),
        command_id in prop::option::of(1..u64::MAX),
        phase in 0..99_usize,
        answered in prop::option::of(0..u64::MAX),
    ) {
        let position = Point3::from(position);
        let capture_ns = 5;
        let state = RobotState {
            capture_ns, position, yaw_rad, opening_m, holding, command_id, phase, answered,
        };
        let read = robot_state_from_wire(&device_header(1, 5), &[robot_state_to_wire(&state)]);
        prop_assert_eq!(read, Ok(state));
    }

    #[test]
    fn a_dispatch_arrives_as_it_was_sent(
        step in steps(),
        (sequence, command_id) in any::<(u64, u64)>(),
        [add, delete] in prop::array::uniform2(prop::collection::btree_set(names(), 0..4)),
    ) {
        let atom = |name: Name| Atom { predicate: "clear".into(), args: vec![name] };
        let (add, delete) = (add.into_iter().map(atom), delete.into_iter().map(atom));
        let effects = Effects { add: add.collect(), delete: delete.collect() };
        let dispatch = Dispatch { sequence, cause: CAUSE, command_id, step, effects };
        let context = context();
        let (header, records) = dispatch_to_wire(&dispatch, &context).unwrap();
        prop_assert_eq!(dispatch_from_wire(&header, &records, &context), Ok(dispatch));
    }

    #[test]
    fn an_outcome_arrives_as_it_was_sent(
        (a, b) in (names(), names()),
        (sequence, failures, succeeded) in any::<(u64, u32, bool)>(),
    ) {
        let context = context();
        let step = Step { action: "unstack".into(), args: vec![a, b, "arm".into()] };
        let outcome = StepOutcome { sequence, step, succeeded, failures };
        let (header, record) = outcome_to_wire(&outcome, &context).unwrap();
        prop_assert_eq!(outcome_from_wire(&header, &[record], &context), Ok(outcome));
    }

    #[test]
    fn garbage_is_rejected_or_read_but_never_panics(
        words in prop::collection::vec(prop_oneof![0..6_u32, any::<u32>()], 16),
        numbers in prop::array::uniform10(any::<f64>()),
        score in any::<f32>(),
        bytes in prop::collection::vec(any::<u8>(), 48),
    ) {
        let context = context();
        let mut scene = SceneRecord { score, ..SceneRecord::default() };
        [scene.tag, scene.kind, scene.source, scene.state, scene.confirmed, scene.n_args] =
            [words[0], words[1], words[2], words[3], words[4], words[5]];
        scene.args.copy_from_slice(&words[6..12]);
        scene.pixel_box.copy_from_slice(&numbers[..4]);
        scene.centre.copy_from_slice(&numbers[4..7]);
        scene.extent.copy_from_slice(&numbers[7..]);
        scene.name.bytes.copy_from_slice(&bytes);
        let header = TaskHeader { run_id: 11, domain_hash: 0xabc, ..TaskHeader::default() };
        if let Ok(scene) = scene_from_wire(&header, &[scene], &context) {
            prop_assert!(scene.objects.iter().all(|o| (0.0..=1.0).contains(&o.score)));
        }
        let mut command = CommandRecord { kind: words[0], n_waypoints: words[1], ..CommandRecord::default() };
        command.step.action.bytes.copy_from_slice(&bytes);
        (command.has_step, command.step.n_args) = (words[3], words[4]);
        command.waypoints[0].position.copy_from_slice(&numbers[..3]);
        command.waypoints[0].speed_m_s = numbers[3];
        command.waypoints[0].expect = words[2];
        if let Ok(command) = command_from_wire(&device_header(0, 0), &[command])
            && let CommandKind::Start(motion) = command.kind
        {
            prop_assert!(motion.waypoints.iter().all(|w| w.speed_m_s > 0.0));
        }
        let mut plan = StepRecord { n_args: words[0], ..StepRecord::default() };
        plan.action.bytes.copy_from_slice(&bytes);
        let header = TaskHeader { verdict: words[1], ..header };
        let plan = plan_from_wire(&header, &[plan], &context);
        prop_assert!(plan.is_err() || words[1] != 0, "no action is called like that");
        let goal = goal_from_wire(&header, &bytes, &context);
        prop_assert!(goal.is_err() || words[1] == 1, "nobody can want that");
    }
}

#[test]
fn a_goal_arrives_as_it_was_sent() {
    let context = context();
    let objects = ["a", "b"].map(|name| Typed::new(name, "block"));
    for text in [
        "(and (on a b) (not (clear b)))",
        "(or (on a b) (on b a))",
        "(exists (?x - block) (and (on ?x b) (not (= ?x a))))",
        "(forall (?x - block) (ontable ?x))",
        "(and)",
    ] {
        let source = SourceText::new("goal", text);
        let goal = parse_goal(&source, &context.domain, &objects).unwrap();
        let goal = GoalMessage::new(goal, Vec::new(), &objects);
        let goal = GoalUpdate::Known(goal);
        let (header, payload) = goal_to_wire(&goal, &context);
        assert_eq!(goal_from_wire(&header, &payload, &context), Ok(goal), "{text}");
    }
}

#[test]
fn a_goal_that_is_not_known_yet_arrives_as_such() {
    let (context, pending) = (context(), GoalUpdate::Pending { cycle: 5 });
    let (header, payload) = goal_to_wire(&pending, &context);
    assert_eq!(goal_from_wire(&header, &payload, &context), Ok(pending));
    let strange = TaskHeader { verdict: 2, ..header };
    assert_eq!(goal_from_wire(&strange, &payload, &context).unwrap_err().field, "goal verdict");
}

fn frame() -> Frame {
    let intrinsics = Intrinsics { fx: 500.0, fy: 510.0, cx: 1.0, cy: 0.5 };
    let pose = Isometry3::new(Vector3::new(0.1, -0.9, 0.4), Vector3::new(-1.8, 0.2, 0.1));
    Frame {
        sequence: 3,
        capture_ns: 30,
        width: 3,
        height: 2,
        rgb: (0..18).collect(),
        depth_m: Some(vec![0.5, 0.0, 1.5, 2.0, 2.5, 3.0]),
        model: Some(CameraModel { intrinsics, world_from_camera: pose }),
    }
}

#[test]
fn a_frame_arrives_as_it_was_sent() {
    let frame = frame();
    let header = frame_header(&frame, false);
    let view = frame_from_wire(&header, &frame.rgb).unwrap();
    assert_eq!((view.width, view.height, view.rgb), (3, 2, frame.rgb.as_slice()));
    let (sent, read) = (frame.model.unwrap(), view.model.unwrap());
    assert_eq!(read.intrinsics, sent.intrinsics);
    let point = Point3::new(0.3, 0.2, 0.1);
    let apart = read.world_from_camera * point - sent.world_from_camera * point;
    assert!(apart.norm() < 1e-12);
    let bytes = depth_to_bytes(frame.depth_m.as_ref().unwrap());
    let mut depth_m = vec![7.0; 99];
    depth_from_wire(&frame_header(&frame, true), bytes, &mut depth_m).unwrap();
    assert_eq!(Some(depth_m), frame.depth_m);
    let bare = Frame { model: None, ..frame };
    assert_eq!(frame_from_wire(&frame_header(&bare, false), &bare.rgb).unwrap().model, None);
}

#[test]
fn depth_that_is_no_distance_is_none() {
    let bytes = depth_to_bytes(&[f32::NAN, -1.0, f32::INFINITY, 0.0, 0.25, f32::MIN]);
    let mut depth_m = Vec::new();
    depth_from_wire(&frame_header(&frame(), true), bytes, &mut depth_m).unwrap();
    assert_eq!(depth_m, [0.0, 0.0, 0.0, 0.0, 0.25, 0.0]);
}
