//! Scenes and skills shared by the tests.
#![expect(dead_code, reason = "each test file uses its own part")]
#![expect(clippy::unwrap_used, reason = "a helper that fails is a failed test")]

use std::collections::BTreeMap;

use groundloop_sim::{
    Arrangement, BodySpec, CameraSpec, Colour, FixedStack, GripperCommand, SceneSpec, Shape, World,
    WorldConfig,
};
use nalgebra::{Point3, Vector3};

/// One control period of the skills below, in nanoseconds.
pub(crate) const PERIOD_NS: u64 = 33_333_333;

pub(crate) fn blocks() -> SceneSpec {
    toml::from_str(include_str!("../data/blocks.toml")).unwrap()
}

pub(crate) fn hanoi() -> SceneSpec {
    toml::from_str(include_str!("../data/hanoi.toml")).unwrap()
}

/// A box, a cylinder, a tube and a block scattered around and into a tray.
pub(crate) fn shapes() -> SceneSpec {
    toml::from_str(include_str!("../data/shapes.toml")).unwrap()
}

/// `n` blocks in random stacks.
pub(crate) fn n_blocks(n: usize, stack_height_max: usize) -> SceneSpec {
    let mut spec = blocks();
    spec.bodies = (0..n).map(block).collect();
    if let Arrangement::RandomStacks { stack_height_max: max, .. } = &mut spec.arrangement {
        *max = stack_height_max;
    }
    spec
}

/// `n` disks from 52 mm radius down and three pegs, in random towers.
pub(crate) fn n_disks(n: usize) -> SceneSpec {
    let mut spec = hanoi();
    spec.bodies.retain(|body| body.shape.kind() != "disk");
    spec.bodies.extend((0..n).map(|k| {
        let shape = Shape::Disk {
            outer_radius_m: 0.052 - 0.007 * k as f64,
            hole_radius_m: 0.012,
            thickness_m: 0.018,
        };
        BodySpec::new(format!("disk_{k}"), shape, Colour([200, 40, 40 * k as u8]))
    }));
    spec.arrangement = Arrangement::RandomTowers {};
    spec
}

/// `n` blocks in one stack at the origin.
pub(crate) fn stack_of(n: usize) -> SceneSpec {
    let bodies: Vec<BodySpec> = (0..n).map(block).collect();
    let names = bodies.iter().map(|body| body.name.clone()).collect();
    let stack = FixedStack { at_m: [0.0, 0.0], yaw_deg: 0.0, bodies: names };
    let arrangement = Arrangement::Fixed { stacks: vec![stack], towers: vec![] };
    SceneSpec { bodies, arrangement, materials: BTreeMap::new() }
}

fn block(k: usize) -> BodySpec {
    let shape = Shape::Block { size_m: 0.05 };
    BodySpec::new(format!("block_{k}"), shape, Colour([200, 40, 20 * k as u8]))
}

fn tabletop() -> toml::Table {
    include_str!("../data/tabletop.toml").parse().unwrap()
}

/// A table top with light wooden objects.
pub(crate) fn world_config() -> WorldConfig {
    tabletop()["world"].clone().try_into().unwrap()
}

/// Low and frontal. It sees x from -0.36 to 0.36 m on the table (at y = 0), y from -0.35 m on, and
/// heights up to 0.37 m at y = 0; a gripper at its home at z = 0.55 m is out of view.
pub(crate) fn frontal(width: u32, height: u32) -> CameraSpec {
    CameraSpec { width, height, ..tabletop()["camera"].clone().try_into().unwrap() }
}

pub(crate) fn world(spec: &SceneSpec, seed: u64) -> World {
    World::new(spec, &world_config(), seed).unwrap()
}

/// Runs for a number of simulated seconds.
pub(crate) fn run(world: &mut World, seconds: f64) {
    world.advance_to(world.time_ns() + (seconds * 1e9) as u64);
}

pub(crate) fn centre(world: &World, name: &str) -> Point3<f64> {
    world.truth().body(name).unwrap().position
}

/// Sends the gripper to a target and waits until it is there, three seconds at most.
pub(crate) fn go(
    world: &mut World,
    position: Point3<f64>,
    yaw_rad: f64,
    opening_m: f64,
    speed_m_s: f64,
) {
    world.command(&GripperCommand { position, yaw_rad, opening_m, speed_m_s }).unwrap();
    let start = world.time_ns();
    while world.time_ns() < start + 3_000_000_000 {
        world.advance_to(world.time_ns() + PERIOD_NS);
        if world.gripper().at_target {
            return;
        }
    }
}

/// Grasps at a point and lifts to `carry_z`. Returns whether something is held.
pub(crate) fn pick(
    world: &mut World,
    at: Point3<f64>,
    yaw_rad: f64,
    width_m: f64,
    carry_z: f64,
) -> bool {
    let open = (width_m + 0.016).min(0.13);
    go(world, Point3::new(at.x, at.y, carry_z), yaw_rad, open, 1.2);
    go(world, at, yaw_rad, open, 0.6);
    go(world, at, yaw_rad, 0.0, 0.6);
    go(world, Point3::new(at.x, at.y, carry_z), yaw_rad, 0.0, 0.6);
    world.gripper().holding
}

/// Grasps a body at its true centre.
pub(crate) fn pick_body(world: &mut World, name: &str, width_m: f64, carry_z: f64) -> bool {
    let at = centre(world, name);
    pick(world, at, 0.0, width_m, carry_z)
}

/// Brings what is held to a point, lets go and goes up again.
pub(crate) fn place(world: &mut World, at: Point3<f64>, yaw_rad: f64, carry_z: f64) {
    let opening = world.gripper().opening_m;
    go(world, Point3::new(at.x, at.y, carry_z), yaw_rad, 0.0, 1.2);
    go(world, at, yaw_rad, 0.0, 0.4);
    go(world, at, yaw_rad, opening + 0.016, 0.4);
    go(world, Point3::new(at.x, at.y, carry_z), yaw_rad, opening + 0.016, 0.8);
}

/// Carries what is held about as fast as the gripper can; returns how far it moved in the grip, in
/// metres. It stays held.
pub(crate) fn shake(world: &mut World, held: &str) -> f64 {
    let relative = |world: &World| centre(world, held) - world.gripper().position;
    let (held_at, mut moved_m) = (relative(world), 0.0_f64);
    for k in 0..6 {
        let x = if k % 2 == 0 { 0.3 } else { -0.3 };
        let position = Point3::new(x, 0.1 * f64::from(k % 3), 0.4);
        let yaw_rad = 0.3 * f64::from(k);
        let command = GripperCommand { position, yaw_rad, opening_m: 0.0, speed_m_s: 1.2 };
        world.command(&command).unwrap();
        for _ in 0..40 {
            world.advance_to(world.time_ns() + PERIOD_NS / 2);
            assert!(world.gripper().holding, "{held} is lost");
            moved_m = moved_m.max((relative(world) - held_at).norm());
        }
    }
    moved_m
}

/// A small seeded error, up to `size_m` along each axis of the table.
pub(crate) fn error(seed: u64, size_m: f64) -> Vector3<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678;
    let mut unit = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    };
    Vector3::new((2.0 * unit() - 1.0) * size_m, (2.0 * unit() - 1.0) * size_m, 0.0)
}
