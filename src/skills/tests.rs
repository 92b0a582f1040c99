//! Perceived volumes in, waypoints out; and the books that say which action is which motion.

use std::path::Path;

use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::geometry::Aabb;
use crate::messages::{Expect, RobotState, Waypoint};
use crate::pddl::Step;
use crate::run::DomainFolder;
use crate::scene::{SceneObject, Visibility};
use crate::transport::wire::WAYPOINTS_MAX;

const MOTION: MotionConfig = MotionConfig {
    travel_z_m: 0.5,
    speed_m_s: 1.0,
    approach_speed_m_s: 0.3,
    approach_m: 0.04,
    jaw_clearance_m: 0.02,
    opening_m_max: 0.1,
    grip_depth_m: 0.02,
    release_gap_m: 0.002,
    table_clearance_m: 0.03,
    table_z_m: 0.0,
    place_x_m: [-0.3, 0.3],
    place_y_m: -0.05,
    reach_x_m: [-0.3, 0.3],
    reach_y_m: [-0.2, 0.1],
    view_poses: Vec::new(),
};

const ROBOT: RobotState = RobotState {
    capture_ns: 0,
    position: Point3::new(0.0, 0.05, 0.4),
    yaw_rad: 0.0,
    opening_m: 0.03,
    holding: false,
    command_id: None,
    phase: 0,
    answered: None,
};

fn folder(name: &str) -> DomainFolder {
    DomainFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(name)).unwrap()
}

fn object(name: &str, centre: [f64; 3], extent: [f64; 3]) -> SceneObject {
    SceneObject {
        name: name.into(),
        type_name: "block".into(),
        pixel_box: None,
        volume: Some(Aabb { centre: Point3::from(centre), extent }),
        score: 1.0,
        visibility: Visibility::Visible,
        seen_ns: 0,
    }
}

/// A cube with an edge of 5 cm, `level` cubes above the table.
fn cube(name: &str, x: f64, level: f64) -> SceneObject {
    object(name, [x, 0.0, 0.025 + 0.05 * level], [0.05; 3])
}

fn held(name: &str, centre_above_tool_m: f64, extent: [f64; 3]) -> Held {
    Held { object: name.into(), centre_above_tool_m, extent }
}

fn step(text: &str) -> Step {
    let words: Vec<&str> = text.split(' ').collect();
    Step::new(words[0], &words[1..])
}

fn motion(
    domain: &str,
    text: &str,
    objects: &[SceneObject],
    held: Option<Held>,
) -> Result<(Vec<Waypoint>, Option<Held>), SkillError> {
    let skills = folder(domain).skills.unwrap();
    let (motion, held) = skills.motion(&step(text), objects, &ROBOT, held, &MOTION)?;
    Ok((motion.waypoints, held))
}

#[track_caller]
fn check_path(waypoints: &[Waypoint], expect: &[[f64; 3]]) {
    assert_eq!(waypoints.len(), expect.len());
    for (waypoint, expect) in waypoints.iter().zip(expect) {
        let apart = (waypoint.position - Point3::from(*expect)).norm();
        assert!(apart < 1e-9, "expected {expect:?}, got {:?}", waypoint.position);
    }
}

/// Where the object's middle is when the jaws open.
#[track_caller]
fn check_release(
    (domain, text): (&str, &str),
    objects: &[SceneObject],
    held: &Held,
    expect: [f64; 3],
) {
    let (waypoints, left) = motion(domain, text, objects, Some(held.clone())).unwrap();
    let opens = waypoints.iter().find(|w| w.expect == Expect::Empty).unwrap();
    let middle = opens.position + nalgebra::Vector3::z() * held.centre_above_tool_m;
    let apart = (middle - Point3::from(expect)).norm();
    assert!(apart < 1e-9, "expected {expect:?}, got {middle:?}");
    assert_eq!(left, None);
}

#[test]
fn a_block_is_taken_from_above_by_its_width() {
    let objects = [cube("a", 0.1, 1.0), cube("b", 0.1, 0.0)];
    let (waypoints, held) = motion("blocksworld", "unstack a b arm", &objects, None).unwrap();
    let (grip, up) = ([0.1, 0.0, 0.08], [0.1, 0.0, 0.5]);
    check_path(&waypoints, &[[0.0, 0.05, 0.5], up, [0.1, 0.0, 0.12], grip, grip, up]);
    let openings: Vec<f64> = waypoints.iter().map(|w| w.opening_m).collect();
    assert_eq!(openings, [0.07, 0.07, 0.07, 0.07, 0.0, 0.0]);
    let speeds: Vec<f64> = waypoints.iter().map(|w| w.speed_m_s).collect();
    assert_eq!(speeds, [1.0, 1.0, 1.0, 0.3, 0.3, 1.0]);
    let expects: Vec<Expect> = waypoints.iter().map(|w| w.expect).collect();
    let (empty, holding) = (Expect::Empty, Expect::Holding);
    assert_eq!(expects, [empty, empty, empty, empty, holding, holding]);
    assert!(waypoints[..5].iter().all(|w| w.retractable) && !waypoints[5].retractable);
    let held = held.unwrap();
    assert_eq!((held.object.as_str(), held.extent), ("a", [0.05; 3]));
    assert!((held.centre_above_tool_m + 0.005).abs() < 1e-9, "gripped above its middle");
}

#[test]
fn something_low_is_gripped_at_its_middle_and_something_wide_with_open_jaws() {
    let objects = [object("a", [0.1, 0.0, 0.01], [0.09, 0.09, 0.02])];
    let (waypoints, held) = motion("blocksworld", "pick_up a arm", &objects, None).unwrap();
    assert_eq!((waypoints[3].position.z, waypoints[3].opening_m), (0.01, MOTION.opening_m_max));
    assert_eq!(held.unwrap().centre_above_tool_m, 0.0);
}

#[test]
fn a_block_is_let_go_just_above_what_it_is_put_on() {
    let objects = [cube("b", -0.1, 1.0), cube("c", -0.1, 0.0)];
    let a = held("a", -0.005, [0.05; 3]);
    let task = ("blocksworld", "stack a b arm");
    check_release(task, &objects, &a, [-0.1, 0.0, 0.127]);
    let (waypoints, _) = motion(task.0, task.1, &objects, Some(a)).unwrap();
    let (goal, up) = ([-0.1, 0.0, 0.132], [-0.1, 0.0, 0.5]);
    check_path(&waypoints, &[[0.0, 0.05, 0.5], up, [-0.1, 0.0, 0.172], goal, goal, up]);
    let retractable: Vec<bool> = waypoints.iter().map(|w| w.retractable).collect();
    assert_eq!(retractable, [true, true, true, true, false, false], "no way back once it is open");
    let openings: Vec<f64> = waypoints.iter().map(|w| w.opening_m).collect();
    assert_eq!(openings, [0.03, 0.03, 0.03, 0.03, 0.07, 0.07], "as they are, then open");
}

#[test]
fn a_disk_goes_onto_the_highest_disk_around_the_peg_or_to_its_foot() {
    let disk = |name, x, z| object(name, [x, 0.0, z], [0.08, 0.08, 0.02]);
    let peg = |name, x| object(name, [x, 0.0, 0.08], [0.01, 0.01, 0.16]);
    let objects = [
        peg("p", 0.2),
        peg("q", -0.2),
        disk("low", 0.2, 0.01),
        disk("high", 0.205, 0.03),
        disk("elsewhere", 0.1, 0.05),
        disk("d", -0.2, 0.01),
    ];
    // The disk itself is still in the scene, at its old place: it does not count.
    let (waypoints, left) = motion("hanoi", "move d q p", &objects, None).unwrap();
    assert!(waypoints.len() <= WAYPOINTS_MAX);
    assert_eq!((waypoints[3].position.x, waypoints[9].position.x), (-0.2, 0.2));
    assert_eq!(left, None);
    let disk_held = held("d", 0.0, [0.06, 0.06, 0.02]);
    let place = |target: &str, expect: f64| {
        let entry = |action: &str| {
            format!(
                "[[action]]\nname = \"{action}\"\npreempt = \"retract\"\n\
                 sequence = [{{ skill = \"place\", object = \"?d\", around = \"?to\" }}]\n"
            )
        };
        let book = entry("move") + &entry("recover");
        let book = SkillMap::parse("skills.toml", &book, &folder("hanoi").domain).unwrap();
        let step = step(&format!("move d q {target}"));
        let held = Some(disk_held.clone());
        let (motion, _) = book.motion(&step, &objects, &ROBOT, held, &MOTION).unwrap();
        let z = motion.waypoints[4].position.z;
        assert!((z - expect).abs() < 1e-9, "around {target}: expected {expect}, got {z}");
    };
    place("p", 0.04 + 0.002 + 0.01);
    place("q", 0.002 + 0.01);
}

#[test]
fn a_free_place_is_the_nearest_to_the_tool_that_is_free() {
    let a = held("a", 0.0, [0.05; 3]);
    let task = ("blocksworld", "put_down a arm");
    check_release(task, &[], &a, [0.0, -0.05, 0.027]);
    // What is in the gripper is in nobody's way, wherever it was seen last.
    let mut ghost = cube("a", 0.0, 0.0);
    check_release(task, std::slice::from_ref(&ghost), &a, [0.0, -0.05, 0.027]);
    (ghost.name, ghost.visibility) = ("b".into(), Visibility::Held);
    check_release(task, &[ghost], &a, [0.0, -0.05, 0.027]);
    // 5 cm of blocks and 3 cm between them; places are a centimetre apart.
    check_release(task, &[cube("b", -0.001, 0.0)], &a, [0.08, -0.05, 0.027]);
    // Rather beside what stands far behind than before it; before a wall there is no choice.
    let behind = |width| object("b", [-0.001, 0.5, 0.025], [width, 0.05, 0.05]);
    check_release(task, &[behind(0.05)], &a, [0.08, -0.05, 0.027]);
    check_release(task, &[behind(9.0)], &a, [0.0, -0.05, 0.027]);
}

/// A tray of 20 by 18 cm takes things of 4 cm one beside the other: 2 cm for the fingers between them
/// along x, 1 cm along y, in steps of 5 mm.
#[test]
fn a_target_takes_several_things_side_by_side_and_then_says_that_it_is_full() {
    let a = held("a", 0.0, [0.04, 0.04, 0.05]);
    let task = ("blocksworld", "stack a tray arm");
    let tray = || object("tray", [0.1, -0.05, 0.008], [0.2, 0.18, 0.016]);
    let inside = |name: &str, x: f64, y: f64| object(name, [x, y, 0.031], [0.038, 0.038, 0.05]);
    let z = 0.016 + 0.002 + 0.025;
    check_release(task, &[tray()], &a, [0.1, -0.05, z]);
    // Beside the middle, rather than before or behind it.
    let one = [tray(), inside("b", 0.1, -0.05)];
    check_release(task, &one, &a, [0.04, -0.05, z]);
    let row = [tray(), inside("b", 0.1, -0.05), inside("c", 0.04, -0.05), inside("d", 0.16, -0.05)];
    check_release(task, &row, &a, [0.1, -0.1, z]);
    // What stands beside the tray, or carries it, is in nobody's way.
    let beside = object("e", [0.1, -0.15, 0.025], [0.04, 0.04, 0.05]);
    let below = object("board", [0.1, -0.05, -0.006], [0.2, 0.18, 0.012]);
    check_release(task, &[tray(), beside, below], &a, [0.1, -0.05, z]);
    let full = [tray(), object("b", [0.1, -0.05, 0.031], [0.12, 0.12, 0.05])];
    let error = motion(task.0, task.1, &full, Some(a)).unwrap_err();
    assert_eq!(error.to_string(), "no free place of 0.040 m on tray, with room for the fingers");
}

/// A row that is full is no table that is full.
#[test]
fn a_place_beside_a_full_row_is_free() {
    let cubes = (0..8).map(|i| cube(&format!("b{i}"), -0.28 + 0.08 * f64::from(i), 0.0));
    let row: Vec<SceneObject> = cubes.collect();
    let skills = folder("blocksworld").skills.unwrap();
    let held = || Some(held("a", 0.0, [0.05; 3]));
    let placed = |reach_y_m| {
        let config = MotionConfig { reach_y_m, place_y_m: -0.02, ..MOTION };
        skills.motion(&step("put_down a arm"), &row, &ROBOT, held(), &config)
    };
    assert!(matches!(placed([-0.05, 0.05]), Err(SkillError::NoFreePlace { .. })));
    let at = placed([-0.2, 0.2]).unwrap().0.waypoints[4].position;
    assert!((at.y - -0.08).abs() < 1e-9, "on the side of the row that is nearer to it: {at}");
}

proptest! {
    #[test]
    fn a_free_place_keeps_clear_of_everything_and_within_reach(
        others in prop::collection::vec((-0.3..0.3, -0.2..0.1, 0.02..0.12), 0..6),
        width in 0.02..0.1,
    ) {
        let objects: Vec<SceneObject> = others
            .iter()
            .enumerate()
            .map(|(i, (x, y, w))| object(&format!("o{i}"), [*x, *y, 0.025], [*w, *w, 0.05]))
            .collect();
        let held = Some(held("a", 0.0, [width, width, 0.05]));
        match motion("blocksworld", "put_down a arm", &objects, held) {
            Ok((waypoints, _)) => {
                let at = waypoints[4].position;
                prop_assert!((-0.3..=0.3).contains(&at.x) && (-0.2..=0.1).contains(&at.y));
                for (x, y, w) in others {
                    let apart = (at.x - x).abs().max((at.y - y).abs()) - f64::midpoint(w, width);
                    prop_assert!(apart >= MOTION.table_clearance_m - 1e-9, "{apart} m apart");
                }
            }
            Err(error) => prop_assert_eq!(error, SkillError::NoFreePlace { width_m: width }),
        }
    }
}

#[test]
fn what_was_perceived_may_not_allow_a_motion() {
    let unplaced = SceneObject { volume: None, ..cube("unplaced", 0.0, 0.0) };
    let objects = [
        cube("a", 0.0, 0.0),
        unplaced,
        object("wide", [0.0, 0.0, 0.05], [0.11, 0.05, 0.1]),
        cube("far", 0.31, 0.0),
        object("near", [0.0, 0.11, 0.025], [0.05; 3]),
        object("everywhere", [0.0, 0.0, 0.01], [9.0, 9.0, 0.02]),
    ];
    let a = || Some(held("a", 0.0, [0.05; 3]));
    let cases = [
        ("pick_up ghost arm", None, "ghost is not in the scene"),
        ("stack a ghost arm", a(), "ghost is not in the scene"),
        (
            "pick_up unplaced arm",
            None,
            "the place of unplaced in the world is not known: no depth or no camera pose",
        ),
        ("pick_up wide arm", None, "wide is 0.110 m wide; the jaws open to 0.100 m"),
        (
            "pick_up far arm",
            None,
            "far at (0.31, 0.00) m is outside the workspace: robot.motion.reach_x_m = [-0.3, 0.3]",
        ),
        (
            "stack a near arm",
            a(),
            "near at (0.00, 0.11) m is outside the workspace: robot.motion.reach_y_m = [-0.2, 0.1]",
        ),
        ("put_down a arm", None, "a should be placed but is not in the gripper"),
        ("put_down b arm", a(), "b should be placed but is not in the gripper"),
        ("pick_up a arm", a(), "a should be picked but the gripper holds something"),
        (
            "put_down a arm",
            a(),
            "no free place of 0.050 m on the table within robot.motion.place_x_m and reach_y_m",
        ),
        ("dance a arm", None, "no skill for action dance in skills.toml"),
    ];
    for (text, held, expect) in cases {
        let error = motion("blocksworld", text, &objects, held).unwrap_err();
        assert_eq!(error.to_string(), expect);
    }
}

#[test]
fn shipped_books_cover_every_action() {
    for name in ["blocksworld", "hanoi"] {
        let folder = folder(name);
        let book = folder.skills.unwrap();
        for action in &folder.domain.actions {
            let skills = book.action(&action.name);
            assert!(skills.is_some_and(|s| !s.sequence.is_empty()), "{name}: {}", action.name);
        }
    }
}

#[test]
fn a_book_tells_what_a_step_carries_and_touches() {
    let blocks = folder("blocksworld").skills.unwrap();
    assert_eq!(blocks.carried(&step("stack a b arm")), Some("a".into()));
    assert_eq!(blocks.target_objects(&step("stack a b arm")), ["a", "b"]);
    assert_eq!(blocks.target_objects(&step("unstack a b arm")), ["a"], "what it lies on may move");
    let hanoi = folder("hanoi").skills.unwrap();
    assert_eq!(hanoi.target_objects(&step("move d p q")), ["d", "q"]);
    assert_eq!(hanoi.carried(&step("dance d")), None);
}

/// The error of the blocksworld book with one text replaced by another.
#[track_caller]
fn check_book(from: &str, to: &str, expect: &str) {
    let text = include_str!("../../domains/blocksworld/skills.toml");
    assert!(text.contains(from), "{from}");
    let domain = folder("blocksworld").domain;
    let error = SkillMap::parse("skills.toml", &text.replacen(from, to, 1), &domain).unwrap_err();
    let message = error.to_string();
    assert!(message.contains(expect), "{message}");
}

#[test]
fn errors_of_a_book_name_file_action_and_key() {
    let stack = "{ skill = \"place\", object = \"?x\", onto = \"?y\" }";
    let skills: Vec<&str> = SKILLS.names().collect();
    check_book(
        "\"pick_up\"",
        "\"lift\"",
        "skills.toml:10:8: error: action[0].name: expected an action of the domain (pick_up, ",
    );
    let expected = format!("expected {}, got throw", skills.join(" or "));
    check_book(
        stack,
        "{ skill = \"throw\", object = \"?x\" }",
        &format!("skills.toml:22:23: error: action[2].sequence[0].skill: {expected}"),
    );
    check_book(
        stack,
        "{ skill = \"place\", onto = \"?y\" }",
        "skills.toml:22:13: error: action[2].sequence[0]: expected a value for object of place, got none",
    );
    check_book(
        stack,
        "{ skill = \"place\", objekt = \"?x\", onto = \"?y\" }",
        "skills.toml:22:41: error: action[2].sequence[0].objekt: expected a parameter of place \
         (object, onto, around), got objekt; did you mean \"object\"?",
    );
    check_book(
        stack,
        "{ skill = \"place\", object = \"?x\", onto = \"?z\" }",
        "skills.toml:22:54: error: action[2].sequence[0].onto: expected a parameter of the action \
         (?x, ?y, ?r), got ?z",
    );
    check_book(
        "preempt = \"retract\"",
        "preempt = \"drop\"",
        "skills.toml:11:11: error: action[0].preempt: expected \"retract\" or \"retract_empty\", got \"drop\"",
    );
    check_book(
        "preempt = \"retract\"",
        "preemt = \"retract\"",
        "skills.toml:11:1: error: action[0].preemt: unknown key; did you mean preempt?",
    );
}

#[test]
fn every_action_has_exactly_one_entry() {
    let domain = folder("hanoi").domain;
    let entry = |action: &str| {
        format!("[[action]]\nname = \"{action}\"\npreempt = \"retract\"\nsequence = []\n")
    };
    let message = |book: &str| SkillMap::parse("f", book, &domain).unwrap_err().to_string();
    assert_eq!(
        message(&entry("move")),
        "f:1:1: error: action: expected an entry for every action of the domain, got none for recover"
    );
    assert_eq!(
        message(&(entry("move") + &entry("recover") + &entry("move"))),
        "f:10:8: error: action[2].name: expected one entry per action, got a second one of move"
    );
}

#[test]
fn what_is_held_at_the_start_is_gripped_as_this_robot_grips() {
    let mut objects = [cube("a", 0.0, 3.0), cube("b", 0.1, 0.0)];
    assert_eq!(Held::found(&objects, &MOTION), None);
    objects[0].visibility = Visibility::Held;
    let found = Held::found(&objects, &MOTION).unwrap();
    assert_eq!((found.object.as_str(), found.extent), ("a", [0.05; 3]));
    assert!((found.centre_above_tool_m - (0.02 - 0.025)).abs() < 1e-9);
}
