//! What is taken away, brought back, swapped, toppled, held by a person or shifted: each fault happens,
//! and is told apart from the others by what really is afterwards.

#![expect(clippy::unwrap_used, reason = "a helper that fails is a failed test")]

mod common;

use common::{blocks, centre, go, hanoi, pick_body, run, stack_of, world};
use groundloop_sim::{
    Arrangement, FaultError, FixedStack, GRIPPER_ID, Renderer, SceneSpec, Truth, World, WorldFault,
};
use nalgebra::{Point3, Vector3};

fn block(k: usize) -> String {
    format!("block_{k}")
}

/// Blocks in stacks at places, each from the bottom up.
fn stacked(stacks: &[([f64; 2], &[usize])]) -> SceneSpec {
    let mut spec = stack_of(stacks.iter().map(|(_, bodies)| bodies.len()).sum());
    let stack = |(at_m, bodies): &([f64; 2], &[usize])| FixedStack {
        at_m: *at_m,
        yaw_deg: 0.0,
        bodies: bodies.iter().copied().map(block).collect(),
    };
    let stacks = stacks.iter().map(stack).collect();
    spec.arrangement = Arrangement::Fixed { stacks, towers: vec![] };
    spec
}

/// A stack of three, one of one and a free block.
fn scene() -> SceneSpec {
    stacked(&[([-0.1, 0.0], &[0, 1, 2]), ([0.05, 0.0], &[3]), ([0.2, 0.0], &[4])])
}

fn on(truth: &Truth, name: &str) -> Option<String> {
    truth.body(name).unwrap().on.clone()
}

fn refused(world: &mut World, fault: &WorldFault) -> FaultError {
    let before = world.fingerprint();
    let error = world.apply_fault(fault).unwrap_err();
    assert_eq!(world.fingerprint(), before, "{error}");
    error
}

/// Pixels of a body in a rendered picture.
fn n_seen(world: &World, place: u16) -> usize {
    let frame = Renderer::new().render(world, &common::frontal(160, 120), 1).unwrap();
    frame.ids.iter().filter(|id| **id == place + 1 && **id != GRIPPER_ID).count()
}

#[test]
fn what_is_removed_is_neither_there_nor_seen_until_it_is_put_back() {
    let mut world = world(&scene(), 1);
    assert!(n_seen(&world, 4) > 20);
    let (object, to) = (block(4), None);
    let back = WorldFault::PutBack { object: object.clone(), to };
    assert_eq!(refused(&mut world, &back), FaultError::NotOut { object: object.clone() });
    let away = WorldFault::Remove { object: object.clone() };
    assert!(world.apply_fault(&away).unwrap().contains("block_4"));
    run(&mut world, 1.0);
    assert_eq!((world.truth().body("block_4"), n_seen(&world, 4)), (None, 0));
    assert_eq!(refused(&mut world, &away), FaultError::Out { object: object.clone() });
    // Its place is free: another object takes it, and the jaws close on nothing there.
    let here = WorldFault::Displace { object: block(3), to: Some([0.2, 0.0]) };
    world.apply_fault(&here).unwrap();
    assert!((centre(&world, "block_3").x - 0.2).abs() < 1e-6);
    world.apply_fault(&back).unwrap();
    run(&mut world, 1.0);
    let truth = world.truth();
    assert!(truth.body("block_4").is_some_and(|body| body.on_table && body.upright));
    assert!((centre(&world, "block_4") - centre(&world, "block_3")).norm() > 0.06);
    assert!(n_seen(&world, 4) > 20);
}

#[test]
fn what_stood_on_a_removed_block_falls_and_a_held_one_leaves_the_gripper() {
    let mut world = world(&scene(), 2);
    world.apply_fault(&WorldFault::Remove { object: block(1) }).unwrap();
    assert!(pick_body(&mut world, "block_4", 0.05, 0.35));
    assert_eq!(world.held(), Some("block_4"));
    world.apply_fault(&WorldFault::Remove { object: block(4) }).unwrap();
    assert_eq!((world.held(), world.gripper().holding), (None, false));
    run(&mut world, 1.0);
    let truth = world.truth();
    assert_ne!(on(&truth, "block_2"), Some(block(1)));
    assert!(truth.body("block_2").unwrap().position.z < 0.08);
    assert!([1, 4].iter().all(|k| truth.body(&block(*k)).is_none()));
}

#[test]
fn swapped_objects_change_places_and_nothing_else_moves() {
    let mut world = world(&scene(), 3);
    let before = world.truth();
    let at = |truth: &Truth, k: usize| truth.body(&block(k)).unwrap().position;
    world.apply_fault(&WorldFault::Swap { objects: [block(2), block(4)] }).unwrap();
    run(&mut world, 1.0);
    let after = world.truth();
    assert!((at(&after, 2) - at(&before, 4)).norm() < 0.003);
    assert!((at(&after, 4) - at(&before, 2)).norm() < 0.003);
    assert_eq!((on(&after, "block_4"), on(&after, "block_2")), (Some(block(1)), None));
    assert!([0, 1, 3].iter().all(|k| (at(&after, *k) - at(&before, *k)).norm() < 0.002));

    let swap = |a: usize, b: usize| WorldFault::Swap { objects: [block(a), block(b)] };
    assert_eq!(refused(&mut world, &swap(3, 3)), FaultError::SameObject { object: block(3) });
    let covered = FaultError::NotClear { object: block(1), on_top: block(4) };
    assert_eq!(refused(&mut world, &swap(1, 3)), covered);
    assert!(pick_body(&mut world, "block_3", 0.05, 0.35));
    assert_eq!(refused(&mut world, &swap(2, 3)), FaultError::Held { object: block(3) });
}

#[test]
fn toppling_brings_the_whole_tower_down_and_knocking_only_the_upper_part() {
    for seed in 0..12 {
        for n in 2..=5 {
            let tower: Vec<usize> = (0..n).collect();
            let spec = stacked(&[([0.0, 0.0], &tower), ([-0.2, 0.0], &[n])]);
            let mut toppled = world(&spec, seed);
            let mut knocked = toppled.clone();
            let object = block(seed as usize % n);
            toppled.apply_fault(&WorldFault::Topple { object }).unwrap();
            knocked.apply_fault(&WorldFault::KnockOver { object: block(n - 1) }).unwrap();
            run(&mut toppled, 5.0);
            run(&mut knocked, 5.0);
            let stands =
                |world: &World, k: usize| on(&world.truth(), &block(k)) == Some(block(k - 1));
            assert!((1..n).all(|k| !stands(&toppled, k)), "seed {seed}: {:?}", toppled.truth());
            assert!((1..n - 1).all(|k| stands(&knocked, k)) && !stands(&knocked, n - 1));
            for body in toppled.truth().bodies {
                assert!(body.still && body.position.z > 0.02, "seed {seed}: {body:?}");
                let [x, y] = [body.position.x, body.position.y];
                assert!(x.abs() < 0.45 && y.abs() < 0.3, "seed {seed}, {n}: {body:?}");
            }
        }
    }
    let mut world = world(&scene(), 1);
    let alone = refused(&mut world, &WorldFault::Topple { object: block(3) });
    assert_eq!(alone, FaultError::NotStacked { object: block(3) });
}

#[test]
fn what_a_person_holds_comes_back_by_itself_on_a_free_place() {
    for seed in 0..10 {
        let mut world = world(&blocks(), seed);
        let clear = world.truth().bodies.into_iter().find(|body| body.clear).unwrap();
        let object = clear.name.clone();
        let hold = WorldFault::Hold { object: object.clone(), for_s: 2.0 };
        world.apply_fault(&hold).unwrap();
        run(&mut world, 1.9);
        assert_eq!(world.truth().body(&object), None, "seed {seed}: back too early");
        run(&mut world, 0.6);
        let truth = world.truth();
        let back = truth.body(&object).expect("it is back");
        assert!(back.on_table && back.upright, "seed {seed}: {back:?}");
    }
    let mut world = world(&scene(), 1);
    let never = WorldFault::Hold { object: block(3), for_s: 0.0 };
    assert!(matches!(refused(&mut world, &never), FaultError::BadNumber { key: "for_s", .. }));
}

/// A person who finds no free place waits for one.
#[test]
fn what_a_person_holds_stays_away_while_the_table_is_full() {
    let mut config = common::world_config();
    config.free_area_m = [[0.0, 0.0], [0.01, 0.01]];
    let spec = stacked(&[([0.0, 0.0], &[0]), ([0.2, 0.0], &[1])]);
    let mut world = World::new(&spec, &config, 1).unwrap();
    world.apply_fault(&WorldFault::Hold { object: block(1), for_s: 0.5 }).unwrap();
    run(&mut world, 2.0);
    assert_eq!(world.truth().body("block_1"), None);
    world.apply_fault(&WorldFault::Remove { object: block(0) }).unwrap();
    run(&mut world, 1.0);
    assert!(world.truth().body("block_1").unwrap().on_table);
}

#[test]
fn a_pushed_tower_moves_as_one() {
    let mut world = world(&scene(), 4);
    let before = world.truth();
    world.apply_fault(&WorldFault::Push { object: block(0), by_m: [-0.03, 0.04] }).unwrap();
    run(&mut world, 0.1);
    let on_the_way = centre(&world, "block_0") - before.body("block_0").unwrap().position;
    assert!((0.002..0.04).contains(&on_the_way.norm()), "it takes a while: {on_the_way}");
    run(&mut world, 2.0);
    let after = world.truth();
    for (k, moves) in [(0, true), (1, true), (2, true), (3, false), (4, false)] {
        let [from, to] = [&before, &after].map(|truth| truth.body(&block(k)).unwrap());
        let way = if moves { Vector3::new(-0.03, 0.04, 0.0) } else { Vector3::zeros() };
        assert!((to.position - from.position - way).norm() < 0.002, "{to:?}");
        assert_eq!((&to.on, to.still), (&from.on, true));
    }
    let high = WorldFault::Push { object: block(1), by_m: [0.02, 0.0] };
    let stacked = FaultError::NotAtBottom { object: block(1), below: block(0) };
    assert_eq!(refused(&mut world, &high), stacked);
    let push = |by_m: [f64; 2]| WorldFault::Push { object: block(3), by_m };
    let met = refused(&mut world, &push([0.13, 0.0]));
    assert!(met.to_string().contains("block_4 is in the way"), "{met}");
    let far = refused(&mut world, &push([0.0, -0.5]));
    assert!(far.to_string().contains("free_area_m"), "{far}");
    for bad in [[0.0, 0.0], [f64::NAN, 0.0]] {
        let bad = refused(&mut world, &push(bad));
        assert!(matches!(bad, FaultError::BadNumber { key: "by_m", .. }), "{bad}");
    }
}

/// A peg is pushed with its board, and all disks stay where they are on it.
#[test]
fn a_pushed_board_takes_its_pegs_and_disks_along() {
    for (object, seed) in [("board", 1), ("left_peg", 2), ("right_peg", 3)] {
        let mut spec = hanoi();
        spec.arrangement = toml::from_str("kind = 'random_towers'").unwrap();
        let mut world = world(&spec, seed);
        let before = world.truth();
        let object = object.to_owned();
        world.apply_fault(&WorldFault::Push { object, by_m: [0.04, -0.02] }).unwrap();
        run(&mut world, 2.0);
        let after = world.truth();
        for (from, to) in before.bodies.iter().zip(&after.bodies) {
            let way = to.position - from.position;
            assert!((way - Vector3::new(0.04, -0.02, 0.0)).norm() < 0.002, "{to:?}");
            assert_eq!((&to.on, &to.peg, to.still), (&from.on, &from.peg, true));
        }
    }
}

#[test]
fn slippery_jaws_close_on_an_object_and_take_nothing_until_they_open() {
    let mut world = world(&scene(), 5);
    let at = centre(&world, "block_4");
    let over = Point3::new(at.x, at.y, 0.3);
    go(&mut world, at, 0.0, 0.066, 1.2);
    world.make_slippery();
    go(&mut world, at, 0.0, 0.0, 1.2);
    let gripper = world.gripper();
    assert!(
        !gripper.holding && gripper.opening_m > 0.045,
        "the pads are at the block: {gripper:?}"
    );
    go(&mut world, over, 0.0, 0.0, 1.2);
    assert!(!world.gripper().holding && world.gripper().opening_m < 0.01);
    assert!((centre(&world, "block_4") - at).norm() < 0.002, "the block stays");
    assert!(pick_body(&mut world, "block_4", 0.05, 0.3), "the next grasp holds");
}

#[test]
fn what_falls_out_of_the_jaws_is_not_taken_again() {
    let mut world = world(&scene(), 6);
    assert_eq!(world.let_fall(), None);
    assert!(pick_body(&mut world, "block_4", 0.05, 0.2));
    let held_z = centre(&world, "block_4").z;
    for _ in 0..10 {
        world.slide_held(0.001);
        run(&mut world, 0.05);
    }
    assert!(world.gripper().holding);
    assert!((held_z - centre(&world, "block_4").z - 0.01).abs() < 0.002, "it hangs lower");
    assert_eq!(world.let_fall(), Some(block(4)));
    run(&mut world, 1.0);
    assert!(!world.gripper().holding);
    assert!(world.truth().body("block_4").unwrap().on_table);
}

#[test]
fn what_an_unnamed_fault_may_be_done_to() {
    let mut world = world(&scene(), 7);
    let displace = WorldFault::Displace { object: "any".to_owned(), to: None };
    assert_eq!(world.fault_candidates(&displace), [block(2), block(3), block(4)]);
    world.apply_fault(&WorldFault::Remove { object: block(3) }).unwrap();
    assert_eq!(world.fault_candidates(&displace), [block(2), block(4)]);
    let back = WorldFault::PutBack { object: "any".to_owned(), to: None };
    assert_eq!(world.fault_candidates(&back), [block(3)]);
    let knock = WorldFault::KnockOver { object: "any".to_owned() };
    assert_eq!(world.fault_candidates(&knock), [0, 1, 2, 4].map(block));
}

#[test]
fn worlds_with_faults_under_way_are_copied_with_them() {
    let mut world = world(&scene(), 8);
    world.apply_fault(&WorldFault::Hold { object: block(4), for_s: 0.5 }).unwrap();
    world.apply_fault(&WorldFault::Push { object: block(0), by_m: [0.0, 0.05] }).unwrap();
    run(&mut world, 0.1);
    let mut copy = world.clone();
    run(&mut world, 2.0);
    run(&mut copy, 2.0);
    assert_eq!(world.fingerprint(), copy.fingerprint());
    assert!(copy.truth().body("block_4").is_some());
}
