//! Whatever is commanded and whatever goes wrong, the world stays sound.
#![expect(clippy::unwrap_used, reason = "a helper that fails is a failed test")]

mod common;

use common::{blocks, go, hanoi, run, world};
use groundloop_sim::{BodyTruth, GripperCommand, SceneSpec, WORKSPACE_M, World, WorldFault};
use nalgebra::Point3;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// One thing that happens to a world.
#[derive(Debug, Clone)]
enum Event {
    Command(GripperCommand),
    /// The fault's kind and the object's place in the scene.
    Fault(u8, usize),
}

fn event() -> impl Strategy<Value = Event> {
    let near_the_table = (-0.35..0.35_f64, -0.2..0.2_f64, 0.005..0.3_f64, -4.0..4.0_f64);
    let jaw = prop_oneof![Just(0.0), Just(0.08), Just(0.13)];
    let command = (near_the_table, jaw).prop_map(|((x, y, z, yaw_rad), opening_m)| {
        let position = Point3::new(x, y, z);
        Event::Command(GripperCommand { position, yaw_rad, opening_m, speed_m_s: 1.2 })
    });
    prop_oneof![4 => command, 1 => (0..10_u8, 0..8_usize).prop_map(|(f, o)| Event::Fault(f, o))]
}

/// Lets an event happen and some time pass.
fn apply(world: &mut World, event: &Event, spec: &SceneSpec) {
    match event {
        Event::Command(command) => world.command(command).unwrap(),
        Event::Fault(kind, idx) => {
            let name = |idx: usize| spec.bodies[idx % spec.bodies.len()].name.clone();
            let object = name(*idx);
            let fault = match kind {
                0 => WorldFault::Displace { object, to: None },
                1 => WorldFault::KnockOver { object },
                2 => WorldFault::BesidePeg { object },
                3 => WorldFault::Remove { object },
                4 => WorldFault::PutBack { object, to: None },
                5 => WorldFault::Swap { objects: [object, name(idx + 1)] },
                6 => WorldFault::Topple { object },
                7 => WorldFault::Hold { object, for_s: 0.5 },
                8 => WorldFault::Push { object, by_m: [0.03, -0.01] },
                _ => WorldFault::TakeFromGripper {},
            };
            // Most faults do not fit most states; that is part of the test.
            drop(world.apply_fault(&fault));
        }
    }
    run(world, 0.4);
}

/// The bodies after everything has come to rest with the gripper out of the way.
fn after(spec: &SceneSpec, seed: u64, events: &[Event]) -> Vec<BodyTruth> {
    let mut world = world(spec, seed);
    for (k, event) in events.iter().enumerate() {
        apply(&mut world, event, spec);
        if k % 3 == 2 {
            // Carry something about, so that held objects meet others.
            let at = world.truth().bodies[k % spec.bodies.len()].position;
            let [low, high] = WORKSPACE_M;
            let reached = |axis: usize| at[axis].clamp(low[axis], high[axis]);
            let at = Point3::new(reached(0), reached(1), reached(2));
            go(&mut world, at, 0.0, 0.13, 1.2);
            go(&mut world, at, 0.0, 0.0, 1.2);
        }
    }
    let up = Point3::new(0.0, 0.0, 0.5);
    go(&mut world, up, 0.0, 0.0, 1.2);
    go(&mut world, up, 0.0, 0.13, 1.2);
    run(&mut world, 4.0);
    world.truth().bodies
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::with_cases(60)
    })]

    #[test]
    fn blocks_end_at_rest_above_the_table_and_outside_each_other(
        seed in 0..1000_u64,
        events in proptest::collection::vec(event(), 1..14),
    ) {
        let bodies = after(&blocks(), seed, &events);
        for (k, body) in bodies.iter().enumerate() {
            prop_assert!(body.still, "{body:?}");
            prop_assert!(body.position.z > 0.0245, "{body:?}");
            for other in &bodies[..k] {
                // The spheres inside two cubes are outside each other.
                let distance = (body.position - other.position).norm();
                prop_assert!(distance > 0.0495, "{body:?} and {other:?}");
            }
        }
    }

    #[test]
    fn disks_end_above_the_table_and_outside_the_pegs(
        seed in 0..1000_u64,
        events in proptest::collection::vec(event(), 1..14),
    ) {
        let bodies = after(&hanoi(), seed, &events);
        for body in bodies.iter().filter(|body| body.kind == "disk") {
            prop_assert!(body.position.coords.iter().all(|value| value.abs() < 2.0), "{body:?}");
            prop_assert!(body.position.z > 0.0085, "{body:?}");
            if body.upright && body.on.is_some() && body.position.z < 0.1 {
                for peg in bodies.iter().filter(|body| body.kind == "peg") {
                    // Either the peg is in the hole, between polygons, or the ring is clear of it.
                    let offset = (body.position - peg.position).xy().norm();
                    let solid = 0.005..0.5 * body.size_m.x + 0.0075;
                    prop_assert!(!solid.contains(&offset), "{body:?} is in {}", peg.name);
                }
            }
        }
    }
}
