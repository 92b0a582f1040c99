//! Ground truth says what stands on what.

mod common;

use common::{hanoi, pick, pick_body, place, run, stack_of, world};
use groundloop_sim::{Arrangement, FixedStack, FixedTower, Shape, WorldFault};
use nalgebra::Point3;

#[test]
fn a_stack_is_read_from_the_bottom_up() {
    let truth = world(&stack_of(3), 0).truth();
    let of = |name: &str| truth.body(name).unwrap();
    assert!(of("block_0").on_table && of("block_0").on.is_none() && !of("block_0").clear);
    assert_eq!(of("block_1").on.as_deref(), Some("block_0"));
    assert_eq!(of("block_2").on.as_deref(), Some("block_1"));
    assert!(of("block_2").clear && !of("block_2").on_table && of("block_2").upright);
}

#[test]
fn touching_neighbours_do_not_carry_each_other() {
    let mut spec = stack_of(2);
    let at = |x: f64, name: &str| FixedStack {
        at_m: [x, 0.0],
        yaw_deg: 0.0,
        bodies: vec![name.to_owned()],
    };
    let stacks = vec![at(0.0, "block_0"), at(0.0501, "block_1")];
    spec.arrangement = Arrangement::Fixed { stacks, towers: vec![] };
    let truth = world(&spec, 0).truth();
    assert!(truth.bodies.iter().all(|body| body.on_table && body.clear && body.on.is_none()));
}

#[test]
fn what_is_held_stands_on_nothing_and_leaves_the_rest_clear() {
    let mut world = world(&stack_of(2), 0);
    assert!(pick_body(&mut world, "block_1", 0.05, 0.3));
    let truth = world.truth();
    let held = truth.body("block_1").unwrap();
    assert!(held.held && held.on.is_none() && !held.on_table);
    assert!(truth.body("block_0").unwrap().clear);
}

#[test]
fn disks_know_their_peg_and_what_is_below_them() {
    let mut spec = hanoi();
    let named = |name: &str| name.to_owned();
    spec.arrangement = Arrangement::Fixed {
        stacks: vec![FixedStack {
            at_m: [0.2, -0.17],
            yaw_deg: 0.0,
            bodies: vec![named("red_disk")],
        }],
        towers: vec![
            FixedTower {
                peg: named("left_peg"),
                disks: vec![named("green_disk"), named("blue_disk")],
            },
            FixedTower { peg: named("right_peg"), disks: vec![named("purple_disk")] },
        ],
    };
    let mut world = world(&spec, 0);
    let truth = world.truth();
    let of = |name: &str| {
        let body = truth.body(name).unwrap();
        (body.on.as_deref(), body.peg.as_deref(), body.on_table)
    };
    assert_eq!(of("green_disk"), (Some("left_peg"), Some("left_peg"), false));
    assert_eq!(of("blue_disk"), (Some("green_disk"), Some("left_peg"), false));
    assert_eq!(of("purple_disk"), (Some("right_peg"), Some("right_peg"), false));
    assert_eq!(of("red_disk"), (None, None, true));
    assert!(!truth.body("left_peg").unwrap().clear && truth.body("middle_peg").unwrap().clear);

    // A disk laid between two pegs is on the board, on no peg.
    let at = truth.body("red_disk").unwrap().position;
    assert!(pick(&mut world, at, 0.0, 0.062, 0.35));
    place(&mut world, Point3::new(0.067, 0.0, 0.022), 0.0, 0.35);
    run(&mut world, 0.5);
    let truth = world.truth();
    let red = truth.body("red_disk").unwrap();
    assert_eq!((red.on.as_deref(), red.peg.as_deref()), (Some("board"), None), "{red:?}");
}

#[test]
fn a_displaced_lower_block_lets_the_upper_one_fall_straight_down() {
    let mut world = world(&stack_of(2), 0);
    let fault = WorldFault::Displace { object: "block_0".to_owned(), to: Some([0.2, 0.0]) };
    world.apply_fault(&fault).unwrap();
    assert!(!world.truth().body("block_1").unwrap().on_table);
    run(&mut world, 1.0);
    assert!(world.truth().body("block_1").unwrap().on_table);
}

#[test]
fn bodies_that_differ_in_name_and_place_alone_look_alike() {
    let mut spec = stack_of(4);
    let colour = spec.bodies[0].colour;
    spec.bodies[2].colour = colour;
    assert_eq!(world(&spec, 0).look_alikes(), [["block_0", "block_2"]]);
    spec.bodies[2].shape = Shape::Block { size_m: 0.04 };
    assert!(world(&spec, 0).look_alikes().is_empty());
    assert!(world(&hanoi(), 0).look_alikes().is_empty(), "pegs are told by their places");
}
