//! How many and how large: blocks of mixed sizes, disks on three to five pegs. Every scene starts
//! without overlap, which `World::new` refuses, and stands for a minute.

mod common;

use common::{blocks, hanoi, run, stack_of, world};
use groundloop_sim::{Arrangement, BodySpec, Colour, SceneSpec, Shape, World};

/// Farthest that a resting body may move in a minute, in metres.
const CREEP_MAX_M: f64 = 0.001;

/// `n` blocks from 30 to 60 mm in random stacks of up to four.
fn mixed_blocks(n: usize) -> SceneSpec {
    let mut spec = blocks();
    spec.bodies = (0..n)
        .map(|k| {
            let shape = Shape::Block { size_m: 0.03 + 0.01 * (k % 4) as f64 };
            BodySpec::new(format!("block_{k}"), shape, Colour([200, 40, 20 * k as u8]))
        })
        .collect();
    if let Arrangement::RandomStacks { stack_height_max, .. } = &mut spec.arrangement {
        *stack_height_max = 4;
    }
    spec
}

/// `n` disks on the first of `n_pegs` pegs, 130 mm apart on one board; the pegs stick out of them.
fn disks_on_pegs(n: usize, n_pegs: usize) -> SceneSpec {
    let mut spec = hanoi();
    let board_m = 0.17 + 0.13 * (n_pegs - 1) as f64;
    spec.bodies.retain(|body| body.shape.kind() == "board");
    spec.bodies[0].shape = Shape::Board { size_m: [board_m, 0.13, 0.012] };
    spec.bodies.extend((0..n_pegs).map(|k| {
        let x = 0.13 * (k as f64 - 0.5 * (n_pegs - 1) as f64);
        let shape = Shape::Peg { radius_m: 0.008, height_m: 0.04 + 0.018 * n as f64 };
        let peg = BodySpec::new(format!("peg_{k}"), shape, Colour([222, 184, 135]));
        BodySpec { at_m: Some([x, 0.0]), ..peg }
    }));
    spec.bodies.extend((0..n).map(|k| {
        let outer_radius_m = 0.055 - 0.004 * k as f64;
        let shape = Shape::Disk { outer_radius_m, hole_radius_m: 0.012, thickness_m: 0.018 };
        BodySpec::new(format!("disk_{k}"), shape, Colour([200, 40, 25 * k as u8]))
    }));
    spec.arrangement = Arrangement::Tower { peg: "peg_0".to_owned() };
    spec
}

/// Lets a world stand for a minute: nothing moves.
#[track_caller]
fn stands(mut world: World, what: &str) {
    let before = world.truth();
    run(&mut world, 60.0);
    for (was, is) in before.bodies.iter().zip(&world.truth().bodies) {
        let moved = (is.position - was.position).norm();
        assert!(moved < CREEP_MAX_M && is.still, "{what}: {} moved by {moved} m", is.name);
    }
}

#[test]
fn two_to_twelve_blocks_of_mixed_sizes_stand() {
    for n in 2..=12 {
        for seed in 0..10 {
            let world = world(&mixed_blocks(n), seed);
            assert!(world.truth().bodies.iter().all(|body| body.upright));
            stands(world, &format!("{n} blocks, seed {seed}"));
        }
    }
}

#[test]
fn two_to_ten_disks_on_three_to_five_pegs_stand() {
    for (n, n_pegs) in (2..=10).flat_map(|n| (3..=5).map(move |n_pegs| (n, n_pegs))) {
        let world = world(&disks_on_pegs(n, n_pegs), n as u64);
        for (level, body) in world.truth().bodies[1 + n_pegs..].iter().enumerate() {
            let z = 0.012 + 0.018 * (level as f64 + 0.5);
            let off = body.position.z - z;
            assert!(off.abs() < 0.001, "{n} disks, {n_pegs} pegs: {} by {off} m", body.name);
            assert_eq!(body.peg.as_deref(), Some("peg_0"));
        }
        stands(world, &format!("{n} disks, {n_pegs} pegs"));
    }
}

#[test]
fn a_stack_of_twelve_blocks_does_not_sag_in_a_minute() {
    for seed in 0..3 {
        let mut world = world(&stack_of(12), seed);
        run(&mut world, 60.0);
        let top = world.truth().body("block_11").unwrap().position.z;
        assert!((top - 0.575).abs() < 0.001, "seed {seed}: the top is at {top} m");
    }
}
