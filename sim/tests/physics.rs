//! Stacks stand, runs repeat, scenes are sound.
#![expect(clippy::unwrap_used, reason = "a helper that fails is a failed test")]

mod common;

use common::{blocks, centre, n_blocks, n_disks, run, stack_of, world, world_config};
use groundloop_sim::{Arrangement, GripperCommand, SceneError, SceneSpec, World, WorldFault};
use nalgebra::Point3;

fn check_stack(n: usize, seconds: f64) {
    for seed in 0..3 {
        let mut world = world(&stack_of(n), seed);
        run(&mut world, seconds);
        for level in 0..n {
            let at = centre(&world, &format!("block_{level}"));
            let z = 0.025 + 0.05 * level as f64;
            assert!((at.z - z).abs() < 0.001, "level {level} of {n}: z {} not {z}", at.z);
            assert!(at.x.hypot(at.y) < 0.003, "level {level} of {n} at {at}");
        }
    }
}

#[test]
fn a_stack_of_six_does_not_sag() {
    check_stack(6, 5.0);
}

#[test]
fn a_stack_of_eight_stands() {
    check_stack(8, 65.0);
}

/// Sweeps the gripper with a block through the scene while things are knocked about.
fn chaos(world: &mut World, from: u32, to: u32) {
    for k in from..to {
        let x = 0.3 * f64::from(k % 7) / 3.0 - 0.3;
        let y = 0.1 * f64::from(k % 5) / 2.0 - 0.1;
        let command = GripperCommand {
            position: Point3::new(x, y, 0.03 + 0.02 * f64::from(k % 4)),
            yaw_rad: f64::from(k),
            opening_m: if k % 6 < 3 { 0.08 } else { 0.0 },
            speed_m_s: 1.2,
        };
        world.command(&GripperCommand { yaw_rad: command.yaw_rad % 6.0, ..command }).unwrap();
        if k % 9 == 4 {
            let name = ["red_block", "blue_block", "green_block"][(k % 3) as usize].to_owned();
            world.apply_fault(&WorldFault::Displace { object: name, to: None }).unwrap();
        }
        run(world, 0.2);
    }
}

#[test]
fn equal_runs_are_equal_and_a_restored_clone_goes_on_equally() {
    let run_all = || {
        let mut world = world(&blocks(), 7);
        chaos(&mut world, 0, 60);
        let saved = world.clone();
        chaos(&mut world, 60, 120);
        (saved, world.fingerprint())
    };
    let (saved, first) = run_all();
    let (_, second) = run_all();
    assert_eq!(first, second);
    let mut restored = saved.clone();
    drop(saved);
    chaos(&mut restored, 60, 120);
    assert_eq!(restored.fingerprint(), first);
    let mut other = world(&blocks(), 8);
    chaos(&mut other, 0, 120);
    assert_ne!(other.fingerprint(), first);
}

#[test]
fn random_scenes_never_interpenetrate_and_stand_still() {
    for n in 3..=8 {
        for seed in 0..100 {
            // `World::new` refuses overlaps and scenes that do not come to rest.
            let world = world(&n_blocks(n, 4), seed);
            for body in world.truth().bodies {
                assert!(body.upright && body.still && (body.on_table || body.on.is_some()));
            }
        }
    }
}

#[test]
fn random_towers_are_legal_and_settle_without_overlap() {
    let mut pegs_used = std::collections::BTreeSet::new();
    for (n, seed) in (3..=5).flat_map(|n| (0..20).map(move |seed| (n, seed))) {
        let truth = world(&n_disks(n), seed).truth();
        for disk in truth.bodies.iter().filter(|body| body.kind == "disk") {
            pegs_used.insert(disk.peg.clone().unwrap());
            let below = truth.body(disk.on.as_ref().unwrap()).unwrap();
            assert!(below.kind == "peg" || below.size_m.x > disk.size_m.x, "{disk:?}");
        }
    }
    assert_eq!(pegs_used.len(), 3);
}

#[test]
fn a_tower_of_five_turned_disks_neither_sags_nor_creeps_and_leaves_40_mm_of_peg() {
    let mut spec = n_disks(5);
    spec.arrangement = Arrangement::Tower { peg: "middle_peg".to_owned() };
    let mut world = world(&spec, 0);
    run(&mut world, 5.0);
    for level in 0..5 {
        let z = 0.012 + 0.018 * (f64::from(level) + 0.5);
        let at = centre(&world, &format!("disk_{level}"));
        assert!((at.z - z).abs() < 0.0002, "level {level}: {at} not {z}");
        // It was placed up to 1 mm off the peg's axis along each axis.
        assert!(at.x.abs() < 0.0012 && at.y.abs() < 0.0012, "level {level}: {at}");
    }
    let top = centre(&world, "middle_peg").z + 0.065;
    assert!(top - centre(&world, "disk_4").z - 0.009 > 0.0395);
}

#[test]
fn time_counts_whole_steps_without_drift() {
    let mut world = world(&stack_of(1), 0);
    assert_eq!(world.time_ns(), 0);
    for frame in 1..=300_u64 {
        world.advance_to(frame * 33_333_333);
    }
    assert_eq!(world.time_ns(), 10_000_000_000);
    world.advance_to(5);
    assert_eq!(world.time_ns(), 10_000_000_000);
}

fn refusal(text: &str) -> String {
    match toml::from_str::<SceneSpec>(text) {
        Ok(spec) => World::new(&spec, &world_config(), 0).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    }
}

const RED: &str = "[[bodies]]\nname='red'\nshape={kind='block',size_m=0.05}\ncolour='#ff0000'\n";
const BLUE: &str = "[[bodies]]\nname='blue'\nshape={kind='block',size_m=0.05}\ncolour='#0000ff'\n";

#[test]
fn bad_scenes_are_refused_with_the_field_or_the_body() {
    let fixed = |stacks: &str| format!("{RED}{BLUE}[arrangement]\nkind='fixed'\nstacks=[{stacks}]");
    let check = |text: &str, expected: &str| {
        let message = refusal(text);
        assert!(message.contains(expected), "expected {expected:?} in {message:?}");
    };
    check(
        &fixed("{at_m=[0,0],bodies=['red']},{at_m=[0.03,0],bodies=['blue']}"),
        "red and blue would overlap by",
    );
    check(&fixed("{at_m=[0,0],bodies=['red']}"), "blue is placed 0 times");
    check(&fixed("{at_m=[0,0],bodies=['red','blue','red']}"), "red is placed 2 times");
    check(&fixed("{at_m=[0,0],bodies=['red','green']}"), "\"green\"");
    check(&fixed("{at_m=[0,nan],bodies=['red','blue']}"), "at_m[1]");
    check(&format!("{RED}{RED}[arrangement]\nkind='random_towers'"), "\"red\"");
    check(&format!("{RED}[arrangement]\nkind='random_towers'"), "at least one peg");
    check(&format!("{RED}[arrangement]\nkind='tower'\npeg='p'"), "\"p\"");
    let slots = "[arrangement]\nkind='random_stacks'\nslots_x_m=[0.0]\nstack_height_max=1";
    check(&format!("{RED}{BLUE}{slots}"), "2 blocks do not fit on 1 slots");
    check(&format!("{RED}{slots}\nspeed=1"), "speed");
    check(&format!("{}{slots}", RED.replace("0.05", "5")), "size_m of red");
    check(&format!("{}{slots}", RED.replace("size_m", "size")), "size");
    check(&format!("{RED}at_m=[0,0]\n{slots}"), "at_m of red");
    let peg =
        "[[bodies]]\nname='p'\nshape={kind='peg',radius_m=0.008,height_m=0.1}\ncolour=[1,2,3]\n";
    check(&format!("{peg}{slots}"), "at_m of p");
    check(&format!("bodies=[]\n{slots}"), "1 to 64 bodies");
}

#[test]
fn the_overlap_error_is_typed() {
    let text = format!(
        "{RED}{BLUE}[arrangement]\nkind='fixed'\n\
         stacks=[{{at_m=[0,0],bodies=['red']}},{{at_m=[0,0.01],bodies=['blue']}}]"
    );
    let spec: SceneSpec = toml::from_str(&text).unwrap();
    let error = World::new(&spec, &world_config(), 0).unwrap_err();
    assert!(matches!(error, SceneError::Overlap { depth_mm, .. } if (depth_mm - 40.0).abs() < 1.0));
}
