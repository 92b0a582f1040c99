//! Frames show what geometry says, depend on nothing else, and keep colours apart.
#![expect(clippy::unwrap_used, reason = "a helper that fails is a failed test")]

mod common;

use common::{blocks, frontal, go, hanoi, n_blocks, shapes, world, world_config};
use groundloop_sim::{
    CameraSpec, Frame, GRIPPER_ID, NoiseSpec, Renderer, Shape, ShapePart, World, WorldFault,
};
use nalgebra::{Point3, Vector3};

fn camera() -> CameraSpec {
    let noise = NoiseSpec { rgb_sigma: 0.0, depth_sigma_m: 0.0 };
    CameraSpec { noise, ..frontal(320, 240) }
}

fn render(world: &World, camera: &CameraSpec) -> Frame {
    Renderer::new().render(world, camera, 0).unwrap()
}

/// Nearest hit of a ray with a body's exact shape: the multiple of `ray` from `eye`, body frame.
fn hit(shape: &Shape, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let half = shape.size_m() * 0.5;
    match shape {
        Shape::Block { .. } | Shape::Board { .. } | Shape::Box { .. } => box_hit(&half, eye, ray),
        Shape::Disk { hole_radius_m, .. } => ring_hit(*hole_radius_m, &half, eye, ray),
        Shape::Tube { inner_radius_m, .. } => ring_hit(*inner_radius_m, &half, eye, ray),
        Shape::Cylinder { .. } => ring_hit(0.0, &half, eye, ray),
        // The rod; its rounded tip is left to the tolerance.
        Shape::Peg { radius_m, .. } => {
            let hits = side_hits(*radius_m, half.z, eye, ray);
            hits.into_iter().filter(|t| *t > 0.0).min_by(f64::total_cmp)
        }
        Shape::Compound { parts } => {
            // What is written down has its lower face at z = 0; the scenes here are centred in x and y.
            let part_hit = |part: &ShapePart| match part {
                ShapePart::Box { size_m, at_m } => {
                    let half_part = Vector3::from(*size_m) * 0.5;
                    box_hit(&half_part, &(eye - middle(at_m, half_part.z, half.z)), ray)
                }
                ShapePart::Cylinder { radius_m, height_m, at_m } => {
                    let half_part = Vector3::new(*radius_m, *radius_m, 0.5 * height_m);
                    ring_hit(0.0, &half_part, &(eye - middle(at_m, half_part.z, half.z)), ray)
                }
            };
            parts.iter().filter_map(part_hit).min_by(f64::total_cmp)
        }
    }
}

/// The middle of a part in the frame of its compound.
fn middle([x, y, z]: &[f64; 3], half_part_z: f64, half_z: f64) -> Vector3<f64> {
    Vector3::new(*x, *y, z + half_part_z - half_z)
}

fn box_hit(half: &Vector3<f64>, eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let (mut enter, mut leave) = (0.0_f64, f64::MAX);
    for axis in 0..3 {
        let a = (-half[axis] - eye[axis]) / ray[axis];
        let b = (half[axis] - eye[axis]) / ray[axis];
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter < leave).then_some(enter)
}

fn ring_hit(
    hole_m: f64,
    half: &Vector3<f64>,
    eye: &Point3<f64>,
    ray: &Vector3<f64>,
) -> Option<f64> {
    let mut hits = Vec::new();
    for z in [-half.z, half.z] {
        let t = (z - eye.z) / ray.z;
        let radius = (eye + ray * t).coords.xy().norm();
        if (hole_m..half.x).contains(&radius) {
            hits.push(t);
        }
    }
    hits.extend(side_hits(half.x, half.z, eye, ray));
    hits.extend(side_hits(hole_m, half.z, eye, ray));
    hits.into_iter().filter(|t| *t > 0.0).min_by(f64::total_cmp)
}

/// Where a ray meets the side of an upright cylinder around the origin.
fn side_hits(radius: f64, half_height: f64, eye: &Point3<f64>, ray: &Vector3<f64>) -> Vec<f64> {
    let (o, d) = (eye.coords.xy(), ray.xy());
    let (a, b, c) = (d.norm_squared(), o.dot(&d), o.norm_squared() - radius * radius);
    let root = (b * b - a * c).sqrt();
    let inside = |t: &f64| t.is_finite() && (eye.z + ray.z * t).abs() <= half_height;
    [(-b - root) / a, (-b + root) / a].into_iter().filter(inside).collect()
}

/// Depth and id of a pixel by exact geometry: bodies, table and the wall behind it.
fn oracle(world: &World, camera: &CameraSpec, column: u32, row: u32) -> (f64, u16) {
    let k = camera.intrinsics();
    let ray = Vector3::new((f64::from(column) - k.cx) / k.fx, (f64::from(row) - k.cy) / k.fy, 1.0);
    let ray = camera.world_from_camera() * ray;
    let eye = camera.position_m;
    let mut nearest = (f64::MAX, 0);
    // The wall at y = 1.15 m and the table, both up to 6 m to the sides.
    for t in [(1.15 - eye.y) / ray.y, -eye.z / ray.z] {
        let at = eye + ray * t;
        if t > 0.0 && t < nearest.0 && at.x.abs() < 6.0 && at.y < 1.16 && at.z > -0.01 {
            nearest.0 = t;
        }
    }
    for (id, body) in (1..).zip(world.bodies()) {
        let body_from_world = body.world_from_body.inverse();
        if let Some(t) = hit(&body.spec.shape, &(body_from_world * eye), &(body_from_world * ray))
            && t < nearest.0
        {
            nearest = (t, id);
        }
    }
    if nearest.0 < f64::MAX { nearest } else { (0.0, 0) }
}

/// Compares a frame with the oracle. Edges are drawn 2.5 mm round and rims as 40 segments.
fn check_geometry(world: &World, camera: &CameraSpec) {
    let frame = render(world, camera);
    let (mut n, mut n_ids, mut n_near, mut n_bodies) = (0, 0, 0, 0);
    let is_compound = |(_, body): &(u16, groundloop_sim::BodyView<'_>)| {
        matches!(body.spec.shape, Shape::Compound { .. })
    };
    let compounds = (1_u16..).zip(world.bodies()).filter(is_compound).map(|(id, _)| id);
    let compounds: Vec<u16> = compounds.collect();
    for row in (0..camera.height).step_by(3) {
        for column in (0..camera.width).step_by(2) {
            let (depth, id) = oracle(world, camera, column, row);
            let pixel = (row * camera.width + column) as usize;
            n += 1;
            n_bodies += usize::from(id != 0);
            let difference = (f64::from(frame.depth_m[pixel]) - depth).abs();
            // The rim of a tray ends before its floor: an edge like one between two bodies.
            let is_inner_edge = compounds.contains(&id) && difference > 0.012;
            if frame.ids[pixel] != id || is_inner_edge {
                continue;
            }
            n_ids += 1;
            assert!(difference < 0.012, "{column}, {row}, id {id}: off by {difference}");
            n_near += usize::from(difference < 0.0005);
        }
    }
    assert!(n_bodies > n / 60, "something is seen: {n_bodies} of {n}");
    assert!(n_ids * 1000 > n * 990, "{n_ids} of {n} ids agree");
    assert!(n_near * 100 > n_ids * 98, "{n_near} of {n_ids} depths agree");
}

#[test]
fn depth_and_ids_are_those_of_exact_geometry() {
    for seed in 0..4 {
        check_geometry(&world(&n_blocks(7, 4), seed), &camera());
        let mut towers = hanoi();
        towers.arrangement = toml::from_str("kind = 'random_towers'").unwrap();
        check_geometry(&world(&towers, seed), &camera());
        check_geometry(&world(&shapes(), seed), &camera());
    }
    let above = CameraSpec {
        position_m: Point3::new(0.02, -0.01, 0.9),
        look_at_m: Point3::new(0.02, -0.01, 0.0),
        ..camera()
    };
    let mut config = world_config();
    config.gripper_home = Point3::new(0.55, 0.4, 0.5);
    check_geometry(&World::new(&n_blocks(7, 4), &config, 9).unwrap(), &above);
}

#[test]
fn a_camera_among_the_blocks_sees_clipped_surfaces_at_their_depth() {
    // 3 cm above the table, so that table and blocks pass below and beside the camera.
    let close = CameraSpec {
        position_m: Point3::new(-0.12, -0.06, 0.03),
        look_at_m: Point3::new(0.1, 0.0, 0.03),
        fov_y_deg: 80.0,
        ..camera()
    };
    check_geometry(&world(&n_blocks(7, 4), 2), &close);
}

#[test]
fn a_frame_depends_on_nothing_but_world_camera_and_seed() {
    let mut used = Renderer::new();
    let camera = frontal(320, 240);
    let fine = CameraSpec { samples: 2, ..camera.clone() };
    let first = world(&blocks(), 1);
    let expected = Renderer::new().render(&first, &camera, 5).unwrap();
    let expected_fine = Renderer::new().render(&first, &fine, 5).unwrap();
    for seed in 0..3 {
        let other = world(&hanoi(), seed);
        used.render(&other, &frontal(64, 48), seed).unwrap();
        used.render(&other, &fine, seed).unwrap();
        assert_eq!(used.render(&first, &camera, 5).unwrap(), expected);
        assert_eq!(used.render(&first, &fine, 5).unwrap(), expected_fine);
    }
    let reseeded = used.render(&first, &camera, 6).unwrap();
    assert_ne!(reseeded.rgb, expected.rgb);
    assert_eq!(reseeded.ids, expected.ids);
    assert_eq!(expected_fine.ids, expected.ids);
}

#[test]
fn what_has_moved_leaves_no_trace_in_a_kept_image() {
    let mut used = Renderer::new();
    let mut scene = world(&blocks(), 4);
    for k in 0..6 {
        go(&mut scene, Point3::new(0.05 * f64::from(k) - 0.1, -0.05, 0.06), 0.3, 0.1, 1.2);
        let frame = used.render(&scene, &camera(), 0).unwrap();
        assert_eq!(frame, render(&scene, &camera()));
    }
}

/// Mean colour of the pixels with an id, and their number.
fn mean_colour(frame: &Frame, id: u16) -> ([f64; 3], usize) {
    let (mut sum, mut n) = ([0.0; 3], 0);
    for (colour, _) in frame.rgb.chunks_exact(3).zip(&frame.ids).filter(|(_, i)| **i == id) {
        (0..3).for_each(|k| sum[k] += f64::from(colour[k]));
        n += 1;
    }
    (sum.map(|s| s / (n as f64).max(1.0)), n)
}

/// Hue in degrees.
fn hue([r, g, b]: [f64; 3]) -> f64 {
    (3.0_f64.sqrt() * (g - b)).atan2(2.0 * r - g - b).to_degrees()
}

#[test]
fn objects_keep_their_hue_and_are_in_view_under_any_light() {
    for seed in 0..12 {
        for spec in [blocks(), hanoi()] {
            let world = world(&spec, seed);
            let mut camera = frontal(640, 480);
            camera.light.seed = seed;
            let frame = Renderer::new().render(&world, &camera, seed).unwrap();
            for (id, body) in (1..).zip(&spec.bodies) {
                let (colour, n) = mean_colour(&frame, id);
                assert!(n > 400, "seed {seed}: {} has {n} pixels", body.name);
                let turned = hue(colour) - hue(body.colour.0.map(f64::from));
                let turned = (turned + 540.0).rem_euclid(360.0) - 180.0;
                assert!(turned.abs() < 10.0, "seed {seed}: {} turned by {turned}", body.name);
            }
            assert!(!frame.ids.contains(&GRIPPER_ID), "the gripper is out of view at home");
        }
    }
}

#[test]
fn the_gripper_is_seen_at_work() {
    let mut world = world(&blocks(), 4);
    go(&mut world, Point3::new(0.0, -0.1, 0.1), 0.0, 0.1, 1.2);
    let (_, n) = mean_colour(&render(&world, &camera()), GRIPPER_ID);
    assert!(n > 1000, "{n} pixels");
}

#[test]
fn what_a_fault_sets_down_is_in_full_view() {
    for seed in 0..12 {
        for (spec, object, fault) in [
            (blocks(), 0, WorldFault::Displace { object: "red_block".to_owned(), to: None }),
            (hanoi(), 7, WorldFault::BesidePeg { object: "red_disk".to_owned() }),
            (hanoi(), 7, WorldFault::Displace { object: "red_disk".to_owned(), to: None }),
        ] {
            let mut world = world(&spec, seed);
            world.apply_fault(&fault).unwrap();
            common::run(&mut world, 1.0);
            let (_, n) = mean_colour(&render(&world, &camera()), object + 1);
            let expected = if object == 0 { 350 } else { 120 };
            assert!(n > expected, "seed {seed}, {fault:?}: {n} pixels of it are seen");
        }
    }
}

/// The same body with more gloss is brighter where the light shines on its edge, and darker nowhere.
#[test]
fn a_material_shines_as_it_says() {
    let mut spec = shapes();
    let frame = |spec: &groundloop_sim::SceneSpec| render(&world(spec, 1), &camera());
    let matt = toml::from_str("friction = 0.6\ndensity_kg_m3 = 600.0\ngloss = 0.0").unwrap();
    let shiny = toml::from_str("friction = 0.6\ndensity_kg_m3 = 600.0\ngloss = 0.8").unwrap();
    let can = spec.bodies.iter_mut().find(|body| body.name == "can").unwrap();
    can.material = Some("of_the_can".to_owned());
    spec.materials.insert("of_the_can".to_owned(), matt);
    let dull = frame(&spec);
    spec.materials.insert("of_the_can".to_owned(), shiny);
    let shiny = frame(&spec);
    assert!(dull.ids == shiny.ids);
    let brighter = dull.rgb.iter().zip(&shiny.rgb).filter(|(dull, shiny)| dull < shiny).count();
    assert!(brighter > 20, "{brighter} values");
    assert!(dull.rgb.iter().zip(&shiny.rgb).all(|(dull, shiny)| shiny >= dull));
}

#[test]
fn shadows_darken_the_table_beside_a_block() {
    let mut spec = n_blocks(1, 1);
    spec.arrangement =
        toml::from_str("kind = 'fixed'\nstacks = [{ at_m = [0.0, 0.0], bodies = ['block_0'] }]")
            .unwrap();
    let (lit, camera) = (world(&spec, 0), camera());
    let frame = render(&lit, &camera);
    let k = camera.intrinsics();
    let brightness = |x: f64, y: f64| {
        let seen = camera.world_from_camera().inverse() * Point3::new(x, y, 0.0);
        let column = (k.fx * seen.x / seen.z + k.cx).round() as usize;
        let row = (k.fy * seen.y / seen.z + k.cy).round() as usize;
        let pixel = row * camera.width as usize + column;
        assert_eq!(frame.ids[pixel], 0);
        u32::from(frame.rgb[3 * pixel]) + u32::from(frame.rgb[3 * pixel + 1])
    };
    // The light comes from the front left: the shadow falls to the back right.
    assert!(brightness(0.033, 0.02) * 3 < brightness(-0.06, 0.02) * 2);
}

#[test]
fn bad_cameras_are_refused_by_field() {
    let scene = world(&n_blocks(1, 1), 0);
    let refused =
        |camera: &CameraSpec| Renderer::new().render(&scene, camera, 0).unwrap_err().field;
    assert_eq!(refused(&CameraSpec { samples: 0, ..camera() }), "samples");
    assert_eq!(refused(&CameraSpec { width: 100_000, ..camera() }), "width");
    let nowhere = CameraSpec { look_at_m: camera().position_m, ..camera() };
    assert!(refused(&nowhere).starts_with("distance"));
}
