//! Picking and placing through the gripper's commands, with the errors perception makes.

mod common;

use common::{centre, error, go, hanoi, pick, pick_body, place, run, shake, stack_of, world};
use groundloop_sim::{Arrangement, FixedStack, World};
use nalgebra::Point3;

const CARRY_Z: f64 = 0.35;

fn four_blocks() -> groundloop_sim::SceneSpec {
    let mut spec = stack_of(4);
    let stacks = spec.bodies.iter().enumerate().map(|(k, body)| FixedStack {
        at_m: [-0.2 + 0.13 * k as f64, 0.01 * k as f64],
        yaw_deg: 2.0 * k as f64,
        bodies: vec![body.name.clone()],
    });
    spec.arrangement = Arrangement::Fixed { stacks: stacks.collect(), towers: vec![] };
    spec
}

/// Builds a tower of four with errors of up to 3 mm at each grasp.
fn build_tower(seed: u64) -> World {
    let mut world = world(&four_blocks(), seed);
    for level in 1..4_u64 {
        let name = format!("block_{level}");
        let start_ns = world.time_ns();
        let grasp_at = centre(&world, &name) + error(seed * 10 + level, 0.003);
        assert!(pick(&mut world, grasp_at, 0.0, 0.05, CARRY_Z), "seed {seed}: {name} not lifted");
        let below = centre(&world, &format!("block_{}", level - 1));
        place(&mut world, Point3::new(below.x, below.y, below.z + 0.051), 0.0, CARRY_Z);
        let took_s = (world.time_ns() - start_ns) as f64 * 1e-9;
        assert!(took_s < 5.0, "pick and place took {took_s} s");
    }
    run(&mut world, 1.0);
    world
}

#[test]
fn towers_of_four_are_built_with_grasp_errors() {
    for seed in 0..16 {
        let truth = build_tower(seed).truth();
        for level in 1..4 {
            let block = truth.body(&format!("block_{level}")).unwrap();
            let below = truth.body(&format!("block_{}", level - 1)).unwrap();
            assert_eq!(block.on.as_ref(), Some(&below.name), "seed {seed}");
            let offset = block.position - below.position;
            assert!((offset.z - 0.05).abs() < 0.001, "seed {seed} level {level}: {offset}");
            assert!(offset.xy().norm() < 0.008, "seed {seed} level {level}: {offset}");
        }
    }
}

#[test]
fn a_disk_goes_from_peg_to_peg_with_errors_of_4_mm() {
    for seed in 0..24 {
        let mut world = world(&hanoi(), seed);
        let size = world.truth().body("red_disk").unwrap().size_m;
        let at = centre(&world, "red_disk") + error(2 * seed, 0.002);
        assert!(pick(&mut world, at, 0.0, size.x, CARRY_Z), "seed {seed}");
        let peg = centre(&world, "middle_peg");
        let target = Point3::new(peg.x, peg.y, 0.012 + 0.009 + 0.002) + error(2 * seed + 1, 0.0028);
        place(&mut world, target, 0.0, CARRY_Z);
        run(&mut world, 1.0);
        let truth = world.truth();
        let disk = truth.body("red_disk").unwrap();
        assert_eq!(disk.on.as_deref(), Some("middle_peg"), "seed {seed}: {disk:?}");
        assert!(disk.upright && disk.still, "seed {seed}: {disk:?}");
        for other in ["purple_disk", "green_disk", "blue_disk"] {
            assert_eq!(truth.body(other).unwrap().peg.as_deref(), Some("left_peg"), "seed {seed}");
        }
    }
}

#[test]
fn a_disk_far_off_its_peg_comes_to_rest_nearby() {
    for seed in 0..40 {
        let mut world = world(&hanoi(), seed);
        assert!(pick_body(&mut world, "red_disk", 0.062, CARRY_Z));
        let peg = centre(&world, "middle_peg");
        let target = Point3::new(peg.x, peg.y, 0.024) + error(seed, 0.02);
        place(&mut world, target, 0.0, CARRY_Z);
        run(&mut world, 3.0);
        let truth = world.truth();
        let disk = truth.body("red_disk").unwrap();
        assert!(disk.still && (disk.position - peg).xy().norm() < 0.25, "seed {seed}: {disk:?}");
    }
}

#[test]
fn a_disk_dropped_above_a_peg_seats() {
    for seed in 0..20 {
        let mut world = world(&hanoi(), seed);
        let size = world.truth().body("red_disk").unwrap().size_m;
        assert!(pick_body(&mut world, "red_disk", size.x, CARRY_Z));
        let target = Point3::new(0.135, 0.0, 0.142 + 0.015) + error(seed, 0.0021);
        place(&mut world, target, 0.0, CARRY_Z);
        run(&mut world, 1.5);
        let truth = world.truth();
        let disk = truth.body("red_disk").unwrap();
        assert_eq!(disk.on.as_deref(), Some("right_peg"), "seed {seed}: {disk:?}");
    }
}

#[test]
fn a_whole_tower_of_hanoi_is_moved() {
    fn moves(n: usize, from: usize, to: usize, list: &mut Vec<(usize, usize)>) {
        if n > 0 {
            let via = 3 - from - to;
            moves(n - 1, from, via, list);
            list.push((from, to));
            moves(n - 1, via, to, list);
        }
    }
    let pegs = ["left_peg", "middle_peg", "right_peg"];
    let mut list = Vec::new();
    moves(4, 0, 2, &mut list);
    let mut world = world(&hanoi(), 3);
    for (k, (from, to)) in list.into_iter().enumerate() {
        let truth = world.truth();
        let on_peg = |peg: usize| {
            let disks = truth.bodies.iter().filter(|b| b.peg.as_deref() == Some(pegs[peg]));
            disks.max_by(|a, b| a.position.z.total_cmp(&b.position.z))
        };
        let disk = on_peg(from).unwrap();
        let height = on_peg(to).map_or(0.012, |top| top.position.z + 0.009);
        let peg = truth.body(pegs[to]).unwrap().position;
        let step = k as u64;
        assert!(pick(&mut world, disk.position + error(step, 0.002), 0.0, disk.size_m.x, CARRY_Z));
        let target = Point3::new(peg.x, peg.y, height + 0.01) + error(step + 99, 0.002);
        place(&mut world, target, 0.0, CARRY_Z);
        run(&mut world, 0.5);
        assert_eq!(world.truth().body(&disk.name).unwrap().peg.as_deref(), Some(pegs[to]));
    }
    let truth = world.truth();
    assert!(
        truth
            .bodies
            .iter()
            .filter(|b| b.kind == "disk")
            .all(|b| b.peg.as_deref() == Some("right_peg"))
    );
}

#[test]
fn a_held_block_neither_swings_nor_falls_in_fast_motion() {
    let mut world = world(&four_blocks(), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    let moved_m = shake(&mut world, "block_0");
    assert!(moved_m < 0.002, "moved by {moved_m} m");
}

#[test]
fn a_released_block_stays_where_it_was_placed_also_when_pressed_down_or_dropped_a_little() {
    for too_high_mm in [-4, -2, -1, 0, 1, 3, 6] {
        let mut world = world(&four_blocks(), 1);
        assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
        let below = centre(&world, "block_1");
        let z = below.z + 0.05 + 0.001 * f64::from(too_high_mm);
        place(&mut world, Point3::new(below.x, below.y, z), 0.0, CARRY_Z);
        let placed = centre(&world, "block_0");
        assert!((placed - below).xy().norm() < 0.002, "{too_high_mm} mm: {placed} on {below}");
        run(&mut world, 2.0);
        assert!((centre(&world, "block_0") - placed).norm() < 0.0005, "{too_high_mm} mm");
        assert_eq!(world.truth().body("block_0").unwrap().on.as_deref(), Some("block_1"));
    }
}

#[test]
fn an_object_pushed_hard_against_another_slips_out_of_the_grip() {
    let mut world = world(&four_blocks(), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    go(&mut world, Point3::new(0.0, -0.2, 0.03), 0.0, 0.0, 0.5);
    go(&mut world, Point3::new(0.0, -0.2, 0.005), 0.0, 0.0, 0.5);
    let truth = world.truth();
    let block = truth.body("block_0").unwrap();
    assert!(!block.held && !world.gripper().holding, "{block:?}");
    assert!(block.on_table && block.upright, "{block:?}");
}

#[test]
fn closing_on_nothing_holds_nothing_and_closes() {
    let mut world = world(&four_blocks(), 1);
    go(&mut world, Point3::new(-0.13, 0.0, 0.03), 0.0, 0.0, 1.2);
    let state = world.gripper();
    assert!(!state.holding && state.at_target && state.opening_m < 1e-3);
}

#[test]
fn a_dropped_block_falls() {
    let mut world = world(&four_blocks(), 1);
    assert!(pick_body(&mut world, "block_0", 0.05, CARRY_Z));
    let up = world.gripper().position;
    go(&mut world, up, 0.0, 0.08, 1.0);
    run(&mut world, 2.0);
    let truth = world.truth();
    let block = truth.body("block_0").unwrap();
    assert!(!block.held && block.still && block.position.z < 0.06, "{block:?}");
}
