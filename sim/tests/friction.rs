//! Holding by friction alone, with fingers that collide.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod common;

use common::{
    centre, error, go, hanoi, pick, pick_body, place, run, shake, stack_of, world_config,
};
use groundloop_sim::{Arrangement, FixedStack, Grasp, SceneSpec, World, WorldConfig};
use nalgebra::Point3;

const CARRY_Z: f64 = 0.35;

fn world(spec: &SceneSpec, seed: u64) -> World {
    let config = WorldConfig { grasp: Grasp::Friction, ..world_config() };
    World::new(spec, &config, seed).unwrap()
}

/// Four blocks in a row with so much between their middles, each turned by `yaw_deg`.
fn row(apart_m: f64, yaw_deg: f64) -> SceneSpec {
    let mut spec = stack_of(4);
    let stacks = spec.bodies.iter().enumerate().map(|(k, body)| FixedStack {
        at_m: [-0.2 + apart_m * k as f64, 0.01 * k as f64],
        yaw_deg,
        bodies: vec![body.name.clone()],
    });
    spec.arrangement = Arrangement::Fixed { stacks: stacks.collect(), towers: vec![] };
    spec
}

/// Whether the four blocks are a tower: each at most 15 mm beside the one below it and at most 4 mm
/// from where it should be in height.
fn is_tower(world: &World) -> bool {
    let at = |k: usize| centre(world, &format!("block_{k}"));
    (1..4).map(|k| at(k) - at(k - 1)).all(|d| d.xy().norm() < 0.015 && (d.z - 0.05).abs() < 0.004)
}

/// Builds a tower of four with errors of up to 3 mm at each grasp, the jaws turned by `yaw_rad`.
fn build_tower(seed: u64, yaw_rad: f64) -> World {
    let mut world = world(&row(0.13, yaw_rad.to_degrees()), seed);
    for k in 1..4_u64 {
        let grasp_at = centre(&world, &format!("block_{k}")) + error(seed * 10 + k, 0.003);
        assert!(pick(&mut world, grasp_at, yaw_rad, 0.05, CARRY_Z), "seed {seed}: block_{k}");
        let below = centre(&world, &format!("block_{}", k - 1));
        place(&mut world, Point3::new(below.x, below.y, below.z + 0.051), yaw_rad, CARRY_Z);
    }
    run(&mut world, 1.0);
    world
}

#[test]
fn towers_of_four_are_built() {
    let n_towers = (0..100).filter(|&seed| is_tower(&build_tower(seed, 0.0))).count();
    assert!(n_towers >= 95, "{n_towers} of 100");
}

#[test]
fn towers_are_built_along_any_yaw() {
    for k in 0..12_u64 {
        let yaw_rad = 0.26 * k as f64 - 1.5;
        assert!(is_tower(&build_tower(k, yaw_rad)), "{yaw_rad} rad");
    }
}

/// Rubber pads hold a block that stands askew as it is.
#[test]
fn a_block_that_stands_askew_is_held() {
    for yaw_deg in [4.0, 8.0, 12.0] {
        let mut world = world(&row(0.13, yaw_deg), 1);
        assert!(pick_body(&mut world, "block_0", 0.062, CARRY_Z), "{yaw_deg}");
        run(&mut world, 2.0);
        assert!(world.gripper().holding && centre(&world, "block_0").z > 0.34, "{yaw_deg}");
    }
}

#[test]
fn a_held_block_stays_between_the_pads_in_fast_motion() {
    let mut world = world(&row(0.13, 0.0), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    let moved_m = shake(&mut world, "block_0");
    assert!(moved_m < 0.004, "moved by {moved_m} m");
}

#[test]
fn a_disk_goes_from_peg_to_peg() {
    for seed in 0..8 {
        let mut world = world(&hanoi(), seed);
        let size = world.truth().body("red_disk").unwrap().size_m;
        let at = centre(&world, "red_disk") + error(2 * seed, 0.002);
        assert!(pick(&mut world, at, 0.0, size.x, CARRY_Z), "seed {seed}");
        let peg = centre(&world, "middle_peg");
        let target = Point3::new(peg.x, peg.y, 0.012 + 0.009 + 0.002) + error(2 * seed + 1, 0.002);
        place(&mut world, target, 0.0, CARRY_Z);
        run(&mut world, 1.0);
        let truth = world.truth();
        let disk = truth.body("red_disk").unwrap();
        assert_eq!(disk.on.as_deref(), Some("middle_peg"), "seed {seed}: {disk:?}");
    }
}

/// Fingers that go down where there is no room for them push the neighbour aside.
#[test]
fn fingers_push_what_stands_in_their_way() {
    let mut world = world(&row(0.058, 0.0), 1);
    let before = centre(&world, "block_2");
    assert!(pick_body(&mut world, "block_1", 0.05, CARRY_Z));
    run(&mut world, 1.0);
    let moved = (centre(&world, "block_2") - before).xy().norm();
    assert!(moved > 0.002, "moved by {moved} m");
}

#[test]
fn opening_lets_go_and_closing_on_nothing_holds_nothing() {
    let mut world = world(&row(0.13, 0.0), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    let up = world.gripper().position;
    go(&mut world, up, 0.0, 0.08, 1.0);
    run(&mut world, 2.0);
    let truth = world.truth();
    let block = truth.body("block_0").unwrap();
    assert!(!block.held && block.still && block.position.z < 0.06, "{block:?}");
    go(&mut world, Point3::new(0.25, 0.15, 0.03), 0.0, 0.0, 1.2);
    let state = world.gripper();
    assert!(!state.holding && state.at_target && state.opening_m < 1e-3, "{state:?}");
}

/// What a missed grasp, a drop and a slip are made of.
#[test]
fn slippery_pads_hold_nothing_until_they_open() {
    let mut world = world(&row(0.13, 0.0), 1);
    world.make_slippery();
    assert!(!pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z), "they have opened");

    let before = centre(&world, "block_0") - world.gripper().position;
    world.slide_held(0.005);
    run(&mut world, 0.5);
    let down_m = before.z - (centre(&world, "block_0") - world.gripper().position).z;
    assert!(world.gripper().holding && (down_m - 0.005).abs() < 0.001, "{down_m} m");

    assert_eq!(world.let_fall().as_deref(), Some("block_0"));
    run(&mut world, 2.0);
    assert!(!world.gripper().holding);
    assert!(centre(&world, "block_0").z < 0.06);
}

#[test]
fn a_clone_has_the_same_future() {
    let mut world = world(&row(0.13, 0.0), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    let mut copy = world.clone();
    for world in [&mut world, &mut copy] {
        place(world, Point3::new(0.1, 0.12, 0.026), 0.4, CARRY_Z);
    }
    assert_eq!(world.fingerprint(), copy.fingerprint());
}
