//! Every fault does what it says, at once or within two seconds, and leaves a sound scene.

mod common;

use common::{blocks, centre, hanoi, pick, run, stack_of, world};
use groundloop_sim::{Arrangement, FaultError, FixedStack, World, WorldFault};
use nalgebra::Point3;

/// Nothing moves, nothing is below the table, everything is in the free area of the table.
fn check_sound(world: &World, seed: u64) {
    for body in world.truth().bodies {
        assert!(body.still, "seed {seed}: {body:?}");
        assert!(body.position.z > 0.4 * body.size_m.z, "seed {seed}: {body:?}");
        let [x, y] = [body.position.x, body.position.y];
        assert!(x.abs() < 0.45 && y.abs() < 0.3, "seed {seed}: {body:?}");
    }
}

#[test]
fn displace_moves_an_object_to_a_free_place() {
    for seed in 0..20 {
        let mut world = world(&blocks(), seed);
        let before = centre(&world, "red_block");
        let to = (seed % 2 == 0).then_some([0.0, -0.1]);
        let fault = WorldFault::Displace { object: "red_block".to_owned(), to };
        assert!(world.apply_fault(&fault).unwrap().contains("red_block"));
        let put = centre(&world, "red_block");
        assert!((put - before).norm() > 0.04, "seed {seed}");
        run(&mut world, 2.0);
        let truth = world.truth();
        let red = truth.body("red_block").unwrap();
        assert!(red.on_table && red.upright, "seed {seed}: {red:?}");
        assert!((red.position - put).norm() < 0.03, "seed {seed}: pushed away again");
        check_sound(&world, seed);
    }
}

#[test]
fn knock_over_brings_the_object_and_what_stands_on_it_down() {
    for seed in 0..20 {
        for (n, knocked) in [(2, 1), (4, 3), (4, 2), (5, 1)] {
            let mut spec = stack_of(n + 1);
            let name = |k: usize| format!("block_{k}");
            let stacks = vec![
                FixedStack { at_m: [0.05, 0.0], yaw_deg: 0.0, bodies: (0..n).map(name).collect() },
                FixedStack { at_m: [-0.15, 0.0], yaw_deg: 0.0, bodies: vec![name(n)] },
            ];
            spec.arrangement = Arrangement::Fixed { stacks, towers: vec![] };
            let mut world = world(&spec, seed);
            world.apply_fault(&WorldFault::KnockOver { object: name(knocked) }).unwrap();
            run(&mut world, 3.0);
            let truth = world.truth();
            let below = name(knocked - 1);
            let fallen = truth.body(&name(knocked)).unwrap();
            assert_ne!(fallen.on.as_ref(), Some(&below), "seed {seed}, {n}, {knocked}");
            assert!(fallen.position.z < 0.05 * n as f64);
            check_sound(&world, seed);
        }
    }
}

#[test]
fn take_from_gripper_empties_the_gripper() {
    for seed in 0..10 {
        let mut world = world(&blocks(), seed);
        let truth = world.truth();
        let top = truth.bodies.iter().find(|body| body.clear).unwrap();
        assert_eq!(
            world.apply_fault(&WorldFault::TakeFromGripper {}),
            Err(FaultError::NothingHeld)
        );
        assert!(pick(&mut world, top.position, top.yaw_rad, 0.05, 0.35));
        assert!(world.truth().body(&top.name).unwrap().held);
        world.apply_fault(&WorldFault::TakeFromGripper {}).unwrap();
        assert!(!world.gripper().holding);
        run(&mut world, 1.0);
        let truth = world.truth();
        let taken = truth.body(&top.name).unwrap();
        assert!(taken.on_table && taken.upright && !taken.held, "seed {seed}: {taken:?}");
        check_sound(&world, seed);
    }
}

#[test]
fn beside_peg_lays_the_top_disk_in_front_of_the_board() {
    for seed in 0..10 {
        let mut spec = hanoi();
        spec.arrangement = toml::from_str("kind = 'random_towers'").unwrap();
        let mut world = world(&spec, seed);
        let truth = world.truth();
        for disk in truth.bodies.iter().filter(|body| body.kind == "disk") {
            let fault = WorldFault::BesidePeg { object: disk.name.clone() };
            let done = world.apply_fault(&fault);
            assert_eq!(done.is_ok(), world.truth().body(&disk.name).unwrap().peg.is_none());
        }
        run(&mut world, 1.0);
        let truth = world.truth();
        let off: Vec<_> =
            truth.bodies.iter().filter(|b| b.kind == "disk" && b.peg.is_none()).collect();
        assert!(!off.is_empty(), "seed {seed}");
        for disk in off {
            assert!(disk.on_table && disk.upright, "seed {seed}: {disk:?}");
            assert!(disk.position.y < -0.09, "seed {seed}: in front of the board");
        }
        check_sound(&world, seed);
    }
}

#[test]
fn faults_that_do_not_fit_are_refused_and_change_nothing() {
    let mut world = world(&hanoi(), 0);
    let before = world.fingerprint();
    let named = |name: &str| name.to_owned();
    let refused = |world: &mut World, fault: &WorldFault| world.apply_fault(fault).unwrap_err();
    let peg = WorldFault::Displace { object: named("left_peg"), to: None };
    assert!(matches!(refused(&mut world, &peg), FaultError::UnknownObject { .. }));
    let nan = WorldFault::Displace { object: named("red_disk"), to: Some([f64::NAN, 0.0]) };
    assert!(matches!(refused(&mut world, &nan), FaultError::BadNumber { key: "to", .. }));
    let far = WorldFault::Displace { object: named("red_disk"), to: Some([9.0, 0.0]) };
    assert!(matches!(refused(&mut world, &far), FaultError::NoFreePlace { .. }));
    let knock = WorldFault::KnockOver { object: named("red_disk") };
    assert!(matches!(refused(&mut world, &knock), FaultError::AroundPeg { .. }));
    let low = WorldFault::BesidePeg { object: named("blue_disk") };
    assert_eq!(
        refused(&mut world, &low),
        FaultError::NotClear { object: named("blue_disk"), on_top: named("green_disk") }
    );
    assert_eq!(world.fingerprint(), before);
}

#[test]
fn a_fault_while_the_gripper_is_low_keeps_clear_of_it() {
    let mut world = world(&blocks(), 3);
    common::go(&mut world, Point3::new(0.0, -0.1, 0.05), 0.0, 0.1, 1.2);
    let to = Some([0.0, -0.1]);
    let object = "red_block".to_owned();
    world.apply_fault(&WorldFault::Displace { object, to }).unwrap();
    let at = centre(&world, "red_block");
    assert!(at.x.hypot(at.y + 0.1) > 0.09);
}

#[test]
fn faults_are_read_from_toml() {
    let read = |text: &str| toml::from_str::<WorldFault>(text);
    let named = "red_block".to_owned();
    assert_eq!(
        read("kind = 'displace'\nobject = 'red_block'\nto = [0.1, 0]").unwrap(),
        WorldFault::Displace { object: named.clone(), to: Some([0.1, 0.0]) }
    );
    assert_eq!(
        read("kind = 'knock_over'\nobject = 'red_block'").unwrap(),
        WorldFault::KnockOver { object: named }
    );
    assert_eq!(read("kind = 'take_from_gripper'").unwrap(), WorldFault::TakeFromGripper {});
    assert!(read("kind = 'beside_peg'\nobject = 'x'\nto = [1, 2]").is_err());
}
