//! Messages that are not what they should be, and the field that gives them away.

use super::*;

/// Two objects, one fact and one anomaly of them.
fn scene() -> Scene {
    let object = |name: &str| SceneObject {
        name: name.into(),
        type_name: "block".into(),
        pixel_box: Some(PixelBox::from([0.0, 0.0, 9.0, 9.0])),
        volume: Some(Aabb { centre: Point3::origin(), extent: [0.05; 3] }),
        score: 0.5,
        visibility: Visibility::Visible,
        seen_ns: 1,
    };
    let fact = SceneFact {
        atom: Atom::new("on", &["a", "b"]),
        raw: Truth::True,
        confirmed: Truth::True,
        origin: Origin::Observed,
        confidence: 0.5,
    };
    let objects = vec![object("a"), object("b")];
    let anomaly = Anomaly::about(vec!["a".into(), "b".into()], "a gap between");
    let (facts, anomalies) = (vec![fact], vec![anomaly]);
    Scene { cause: CAUSE, objects, facts, anomalies, ..Scene::default() }
}

#[track_caller]
fn check<T: std::fmt::Debug>(field: &str, result: Result<T, WireError>) {
    assert_eq!(result.unwrap_err().field, field);
}

#[test]
fn a_scene_of_another_run_or_domain_is_rejected() {
    let (ours, records) = scene_to_wire(&scene(), &context()).unwrap();
    let mut header = ours;
    header.domain_hash = 0xdef;
    let error = scene_from_wire(&header, &records, &context()).unwrap_err();
    let expect = "message rejected: domain_hash: expected 0000000000000abc, got 0000000000000def";
    assert_eq!(error.to_string(), expect);
    let mut header = ours;
    header.run_id = 12;
    check("run_id", scene_from_wire(&header, &records, &context()));
    check("run_id", plan_from_wire(&header, &[], &context()));
    check("run_id", outcome_from_wire(&header, &[OutcomeRecord::default()], &context()));
    check("run_id", goal_from_wire(&header, b"", &context()));
}

#[test]
fn scene_records_out_of_range_are_rejected() {
    type Change = fn(&mut SceneRecord);
    let objects: [(&str, Change); 11] = [
        ("tag", |r| r.tag = 3),
        ("object type", |r| r.kind = 3),
        ("visibility", |r| r.source = 4),
        ("object state", |r| r.state = 4),
        ("pixel_box", |r| r.pixel_box[2] = f64::NAN),
        ("centre", |r| r.centre[0] = f64::INFINITY),
        ("extent", |r| r.extent[1] = f64::NAN),
        ("score", |r| r.score = f32::NAN),
        ("score", |r| r.score = 1.1),
        ("object name", |r| r.name.bytes[0] = 0),
        ("object name", |r| r.name.bytes[0] = 0xff),
    ];
    let facts: [(&str, Change); 9] = [
        ("predicate", |r| r.kind = 6),
        ("n_args", |r| r.n_args = 1),
        ("n_args", |r| r.n_args = 7),
        ("argument", |r| r.args[1] = 2),
        ("argument", |r| r.args[1] = u32::MAX),
        ("origin", |r| r.source = 6),
        ("raw", |r| r.state = 3),
        ("confirmed", |r| r.confirmed = 3),
        ("confidence", |r| r.score = -0.1),
    ];
    let anomalies: [(&str, Change); 7] = [
        ("anomaly state", |r| r.state = 3),
        ("pixel_box", |r| r.pixel_box[1] = f64::NAN),
        ("n_args", |r| r.n_args = 7),
        ("argument", |r| r.args[1] = 2),
        ("reason", |r| r.name.bytes[0] = 0),
        ("reason", |r| r.name.bytes[1] = b'\n'),
        ("reason", |r| r.name.bytes[0] = 0xff),
    ];
    let context = context();
    let (header, records) = scene_to_wire(&scene(), &context).unwrap();
    let objects = objects.iter().map(|change| (0, change));
    let others = facts.iter().map(|change| (2, change));
    let others = others.chain(anomalies.iter().map(|change| (3, change)));
    for (at, (field, change)) in objects.chain(others) {
        let mut records = records.clone();
        change(&mut records[at]);
        check(field, scene_from_wire(&header, &records, &context));
    }
}

#[test]
fn names_that_are_no_names_are_rejected() {
    let context = context();
    let (header, records) = scene_to_wire(&scene(), &context).unwrap();
    for name in ["a b", "(a", "a)", "?x", "a;b", "a\u{7}"] {
        let mut records = records.clone();
        records[0].name.bytes[..name.len()].copy_from_slice(name.as_bytes());
        check("object name", scene_from_wire(&header, &records, &context));
    }
}

#[test]
fn what_does_not_fit_into_a_message_is_not_sent() {
    let context = context();
    let mut scene = scene();
    scene.objects[0].name = Name::new("x".repeat(48));
    scene.facts.clear();
    scene.anomalies.clear();
    assert!(scene_to_wire(&scene, &context).is_ok());
    scene.objects[0].name = Name::new("x".repeat(49));
    check("name", scene_to_wire(&scene, &context));
    scene.objects[0].name = "a".into();
    scene.objects[0].type_name = "cup".into();
    check("object type", scene_to_wire(&scene, &context));
    scene.objects[0].type_name = "block".into();
    let stray = |atom: Atom| SceneFact { atom, ..self::scene().facts[0].clone() };
    scene.facts = vec![stray(Atom::new("on", &["a", "ghost"]))];
    check("argument", scene_to_wire(&scene, &context));
    scene.facts = vec![stray(Atom::new("under", &["a", "b"]))];
    check("predicate", scene_to_wire(&scene, &context));
    scene.facts.clear();
    let anomaly = |objects: &[&str]| {
        Anomaly::about(objects.iter().map(|&name| name.into()).collect(), "nothing under")
    };
    scene.anomalies = vec![anomaly(&["ghost"])];
    check("argument", scene_to_wire(&scene, &context));
    scene.facts = vec![stray(Atom::new("on", &["a"; 7]))];
    check("n_args", scene_to_wire(&scene, &context));
    scene.facts.clear();
    // A thing in front of everything is next to more objects than a record has room for.
    scene.anomalies = vec![anomaly(&["a"; 13])];
    let (header, records) = scene_to_wire(&scene, &context).unwrap();
    let told = scene_from_wire(&header, &records, &context).unwrap().anomalies;
    let n_objects: Vec<usize> = told.iter().map(|anomaly| anomaly.objects.len()).collect();
    assert_eq!(n_objects, [6, 6, 1]);
    assert!(told.iter().all(|anomaly| anomaly.reason == "nothing under"));
}

#[test]
fn a_text_that_is_too_long_is_cut_between_two_characters() {
    let limit = "ä".repeat(100); // of two bytes each; a header has room for 160
    let verdict = PlanVerdict::OutOfBudget { limit };
    let plan = PlanMessage::new(CAUSE, verdict);
    let (header, records) = plan_to_wire(&plan, &context()).unwrap();
    let read = plan_from_wire(&header, &records, &context()).unwrap().verdict;
    assert_eq!(read, PlanVerdict::OutOfBudget { limit: "ä".repeat(80) });
    let reason = format!("a{}", "ä".repeat(100));
    let kind = StatusKind::Failed(reason);
    let status = Status { sequence: 0, capture_ns: 0, command_id: 1, kind };
    let read = status_from_wire(&device_header(0, 0), &[status_to_wire(&status)]).unwrap();
    assert_eq!(read.kind, StatusKind::Failed(format!("a{}", "ä".repeat(79))));
}

#[test]
fn plans_and_outcomes_out_of_range_are_rejected() {
    let context = context();
    let step = Step::new("stack", &["a", "b", "arm"]);
    let verdict = PlanVerdict::Plan { steps: vec![step.clone()], cost: 1 };
    let plan = PlanMessage::new(CAUSE, verdict);
    let (header, records) = plan_to_wire(&plan, &context).unwrap();
    type Change = fn(&mut TaskHeader, &mut StepRecord);
    let cases: [(&str, Change); 10] = [
        ("plan verdict", |h, _| h.verdict = 7),
        ("source", |h, _| h.source = 9),
        ("predicate", |h, _| h.verdict = 6),
        ("predicate", |h, r| (h.verdict, r.action.bytes[0]) = (6, 0xff)),
        ("fact arguments", |h, r| {
            h.verdict = 6;
            r.action = NameText::default();
            r.action.bytes[..5].copy_from_slice(b"clear");
        }),
        ("detail", |h, _| h.detail[0] = 0xff),
        ("action", |_, r| r.action.bytes[0] = 0x13),
        ("action", |_, r| r.action.bytes = r.args[0].bytes),
        ("step arguments", |_, r| r.n_args = 2),
        ("argument", |_, r| r.args[1].bytes[0] = 0xff),
    ];
    for (field, change) in cases {
        let (mut header, mut record) = (header, records[0]);
        change(&mut header, &mut record);
        check(field, plan_from_wire(&header, &[record], &context));
    }
    let too_many = Step { args: vec!["a".into(); 7], ..step.clone() };
    let outcome = StepOutcome { sequence: 0, step, succeeded: true, failures: 0 };
    let (header, record) = outcome_to_wire(&outcome, &context).unwrap();
    check("outcome", outcome_from_wire(&header, &[], &context));
    let twice = OutcomeRecord { succeeded: 2, ..record };
    check("succeeded", outcome_from_wire(&header, &[twice], &context));
    let outcome = StepOutcome { step: too_many, ..outcome };
    check("step arguments", outcome_to_wire(&outcome, &context));
}

#[test]
fn a_goal_that_is_no_goal_is_rejected_with_the_reason() {
    let context = context();
    let header = TaskHeader { run_id: 11, domain_hash: 0xabc, ..TaskHeader::default() };
    check("goal", goal_from_wire(&header, &[0xff], &context));
    let text = "(define (problem goal) (:domain blocksworld) (:goal (under a b)))";
    let error = goal_from_wire(&header, text.as_bytes(), &context).unwrap_err();
    assert_eq!(error.field, "goal");
    assert!(error.got.contains("under"), "{error}");
}

#[test]
fn frames_of_the_wrong_size_or_form_are_rejected() {
    type Change = fn(&mut FrameHeader);
    let cases: [(&str, Change); 14] = [
        ("encoding", |h| h.encoding = 1),
        ("width x height", |h| h.width = 0),
        ("width x height", |h| h.height = 0),
        ("width x height", |h| h.width = 8193),
        ("width x height", |h| h.height = u32::MAX),
        ("stride", |h| h.stride = 10),
        ("payload", |h| h.height = 3),
        ("has_intrinsics", |h| h.has_intrinsics = 2),
        ("has_pose", |h| h.has_pose = 7),
        ("fx, fy, cx, cy", |h| h.cx = f64::NAN),
        ("fx, fy", |h| h.fy = 0.0),
        ("world_from_camera_xyz", |h| h.world_from_camera_xyz[1] = f64::INFINITY),
        ("world_from_camera_xyzw", |h| h.world_from_camera_xyzw = [0.0, 0.0, 0.0, 2.0]),
        ("world_from_camera_xyzw", |h| h.world_from_camera_xyzw[0] = f64::NAN),
    ];
    let frame = frame();
    for (field, change) in cases {
        let mut header = frame_header(&frame, false);
        change(&mut header);
        check(field, frame_from_wire(&header, &frame.rgb));
    }
    let header = frame_header(&frame, false);
    check("payload", frame_from_wire(&header, &frame.rgb[1..]));
    check("encoding", depth_from_wire(&header, &frame.rgb, &mut Vec::new()));
    check("payload", depth_from_wire(&frame_header(&frame, true), &[0; 23], &mut Vec::new()));
}

#[test]
fn device_messages_out_of_range_are_rejected() {
    let header = device_header(0, 0);
    let state = RobotStateRecord::default();
    check("robot state", robot_state_from_wire(&header, &[]));
    check("robot state", robot_state_from_wire(&header, &[state, state]));
    let holding = RobotStateRecord { holding: 2, ..state };
    check("holding", robot_state_from_wire(&header, &[holding]));
    let position = RobotStateRecord { position: [0.0, f64::NAN, 0.0], ..state };
    check("position", robot_state_from_wire(&header, &[position]));
    let opening = RobotStateRecord { opening_m: f64::INFINITY, ..state };
    check("yaw_rad, opening_m", robot_state_from_wire(&header, &[opening]));
    let status = StatusRecord { kind: 4, ..StatusRecord::default() };
    check("status kind", status_from_wire(&header, &[status]));
    let mut status = StatusRecord { kind: 2, ..StatusRecord::default() };
    status.detail[0] = 0xff;
    check("detail", status_from_wire(&header, &[status]));
    check("status", status_from_wire(&header, &[]));
}

#[test]
fn commands_out_of_range_are_rejected() {
    let waypoint = Waypoint {
        position: Point3::origin(),
        yaw_rad: 0.0,
        opening_m: 0.0,
        speed_m_s: 1.0,
        expect: Expect::Anything,
        retractable: false,
    };
    let start = |n| Command {
        id: 1,
        frame_sequence: 1,
        capture_ns: 0,
        kind: CommandKind::Start(Motion { waypoints: vec![waypoint; n] }),
        step: Some(Step { action: "pick".into(), args: vec!["a".into()] }),
    };
    assert!(command_to_wire(&start(WAYPOINTS_MAX)).is_ok());
    check("waypoints", command_to_wire(&start(WAYPOINTS_MAX + 1)));
    type Change = fn(&mut CommandRecord);
    let cases: [(&str, Change); 10] = [
        ("command kind", |r| r.kind = 4),
        ("n_waypoints", |r| r.n_waypoints = 17),
        ("waypoint position", |r| r.waypoints[0].position[2] = f64::NAN),
        ("waypoint yaw, opening, speed", |r| r.waypoints[0].yaw_rad = f64::NAN),
        ("waypoint speed_m_s", |r| r.waypoints[0].speed_m_s = 0.0),
        ("waypoint expect", |r| r.waypoints[0].expect = 3),
        ("waypoint retractable", |r| r.waypoints[0].retractable = 2),
        ("has_step", |r| r.has_step = 2),
        ("action", |r| r.step.action.bytes[0] = 0xff),
        ("step arguments", |r| r.step.n_args = 7),
    ];
    for (field, change) in cases {
        let mut record = command_to_wire(&start(2)).unwrap();
        change(&mut record);
        check(field, command_from_wire(&DeviceHeader::default(), &[record]));
    }
}

#[test]
fn dispatches_out_of_range_are_rejected() {
    let step = Step { action: "stack".into(), args: ["a", "b", "arm"].map(Name::new).to_vec() };
    let effects = Effects { add: [Atom::new("on", &["a", "b"])].into(), ..Effects::default() };
    let dispatch = Dispatch { sequence: 1, cause: CAUSE, command_id: 2, step, effects };
    let (header, records) = dispatch_to_wire(&dispatch, &context()).unwrap();
    let foreign = StreamHeader { domain_hash: 0xdef, ..header };
    check("domain_hash", dispatch_from_wire(&foreign, &records, &context()));
    check("dispatch", dispatch_from_wire(&header, &[], &context()));
    check("dispatch", dispatch_from_wire(&header, &records[1..], &context()));
    let twice = [records[0]; 2];
    check("effect tag", dispatch_from_wire(&header, &twice, &context()));
    let huge = [&records[..1], &vec![records[1]; 4_097][..]].concat();
    check("effects", dispatch_from_wire(&header, &huge, &context()));
    type Change = fn(&mut [DispatchRecord]);
    let cases: [(&str, Change); 4] = [
        ("action", |r| r[0].call.action.bytes[0] = b'x'),
        ("step arguments", |r| r[0].call.n_args = 2),
        ("predicate", |r| r[1].call.action.bytes[0] = b'x'),
        ("fact arguments", |r| r[1].call.n_args = 9),
    ];
    for (field, change) in cases {
        let mut records = records.clone();
        change(&mut records);
        check(field, dispatch_from_wire(&header, &records, &context()));
    }
}
