//! General shapes: they are placed, stand, are grasped, and are read as what they are.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod common;

use common::{pick_body, place, run, shapes, world};
use groundloop_sim::{Arrangement, BodySpec, FixedStack, MATERIALS, SceneSpec, World};
use nalgebra::Point3;

const SEEDS: u64 = 12;

/// Stacks at explicit places; the tray stays where it is.
fn stacked(stacks: &[(&[&str], [f64; 2])]) -> SceneSpec {
    let mut spec = shapes();
    let stacks = stacks.iter().map(|(bodies, at_m)| FixedStack {
        at_m: *at_m,
        yaw_deg: 0.0,
        bodies: bodies.iter().map(|name| (*name).to_owned()).collect(),
    });
    spec.arrangement = Arrangement::Fixed { stacks: stacks.collect(), towers: vec![] };
    spec
}

fn apart() -> SceneSpec {
    stacked(&[
        (&["mug"], [-0.3, 0.0]),
        (&["carton"], [-0.2, 0.0]),
        (&["can"], [-0.1, 0.0]),
        (&["pipe"], [0.0, 0.0]),
        (&["cube"], [0.0, -0.15]),
    ])
}

fn on(world: &World, name: &str) -> (Option<String>, bool) {
    let truth = world.truth();
    let body = truth.body(name).unwrap();
    assert!(body.upright && body.still, "{body:?}");
    (body.on.clone(), body.on_table)
}

#[test]
fn what_is_scattered_stands_clear_of_everything_on_the_table_or_in_the_tray() {
    let mut n_in_tray = 0;
    for seed in 0..SEEDS {
        let world = world(&shapes(), seed);
        let truth = world.truth();
        for body in truth.bodies.iter().filter(|body| body.kind != "compound" || body.name == "mug")
        {
            let (on, on_table) = on(&world, &body.name);
            assert!(on_table || on.as_deref() == Some("tray"), "seed {seed}: {body:?}");
            let is_inside = (body.position.x - 0.16).abs() < 0.1;
            assert_eq!(on.is_some(), is_inside, "seed {seed}: {body:?}");
            n_in_tray += usize::from(is_inside);
            for other in truth.bodies.iter().filter(|o| o.name != body.name && o.name != "tray") {
                let distance = (body.position - other.position).xy().norm();
                assert!(distance > 0.055, "seed {seed}: {} and {}", body.name, other.name);
            }
        }
    }
    assert!(n_in_tray > 10 && n_in_tray < 50, "{n_in_tray}");
}

#[test]
fn the_page_of_scenes_lists_every_material() {
    let page = include_str!("../../docs/scenes.md");
    assert!(MATERIALS.is_sorted_by(|(a, _), (b, _)| a < b));
    for (name, m) in MATERIALS {
        let numbers = format!("{} | {} | {} | {}", m.friction, m.density_kg_m3, m.gloss, m.polish);
        let row = format!("| `{name}` | {numbers} |");
        assert!(page.contains(&row), "docs/scenes.md lacks {row}");
    }
}

#[test]
fn types_are_told() {
    let world = world(&apart(), 0);
    let truth = world.truth();
    let types: Vec<&str> = truth.bodies.iter().map(|body| body.type_name.as_str()).collect();
    assert_eq!(types, ["tray", "compound", "box", "cylinder", "tube", "block"]);
}

#[test]
fn every_shape_is_lifted_from_the_table_and_set_down_in_the_tray() {
    for name in ["mug", "carton", "can", "pipe", "cube"] {
        let mut world = world(&apart(), 0);
        assert!(pick_body(&mut world, name, 0.075, 0.3), "{name} is grasped");
        let held = world.truth();
        let held = held.body(name).unwrap();
        assert!(held.held && held.position.z > 0.1, "{held:?}");
        place(&mut world, Point3::new(0.16, 0.0, 0.02 + 0.5 * held.size_m.z), 0.0, 0.3);
        run(&mut world, 1.0);
        assert_eq!(on(&world, name), (Some("tray".to_owned()), false), "{name}");
        assert!(!world.truth().body("tray").unwrap().clear);
    }
}

#[test]
fn what_is_wider_than_the_jaws_is_not_grasped() {
    let mut spec = apart();
    spec.bodies[0].fixed = None;
    spec.bodies[0].at_m = None;
    let Arrangement::Fixed { stacks, .. } = &mut spec.arrangement else { unreachable!() };
    stacks.push(FixedStack { at_m: [0.2, 0.0], yaw_deg: 0.0, bodies: vec!["tray".to_owned()] });
    let mut world = world(&spec, 0);
    assert!(!pick_body(&mut world, "tray", 0.1, 0.3));
    assert_eq!(on(&world, "tray"), (None, true), "a tray that can move stands on the table");
}

#[test]
fn shapes_stand_on_each_other_for_a_minute() {
    let spec =
        stacked(&[(&["carton", "cube", "can"], [-0.2, 0.0]), (&["pipe", "mug"], [0.16, 0.0])]);
    let mut world = world(&spec, 0);
    let height = |world: &World, name: &str| world.truth().body(name).unwrap().position.z;
    run(&mut world, 60.0);
    assert_eq!(on(&world, "carton"), (None, true));
    assert_eq!(on(&world, "cube").0.as_deref(), Some("carton"));
    assert_eq!(on(&world, "can").0.as_deref(), Some("cube"));
    assert_eq!(on(&world, "pipe").0.as_deref(), Some("tray"));
    assert_eq!(on(&world, "mug").0.as_deref(), Some("pipe"));
    assert!((height(&world, "can") - 0.10).abs() < 0.001, "{}", height(&world, "can"));
    assert!((height(&world, "mug") - 0.081).abs() < 0.001, "{}", height(&world, "mug"));
}

#[test]
fn random_stacks_hold_every_shape_with_the_wider_ones_below() {
    let mut spec = shapes();
    spec.arrangement = toml::from_str(
        "kind = 'random_stacks'\nslots_x_m = [-0.2, -0.1]\nrows_y_m = [-0.1, 0.1]\nstack_height_max = 2",
    )
    .unwrap();
    for seed in 0..SEEDS {
        let world = world(&spec, seed);
        let truth = world.truth();
        for body in &truth.bodies {
            let below = body.on.as_ref().map(|below| truth.body(below).unwrap().size_m.x);
            assert!(below.is_none_or(|width| width >= body.size_m.x), "seed {seed}: {body:?}");
        }
    }
}

/// The message of a scene whose body `at` is changed.
fn refused(at: usize, change: impl Fn(&mut BodySpec)) -> String {
    let mut spec = apart();
    change(&mut spec.bodies[at]);
    spec.check().unwrap_err().to_string()
}

#[test]
fn what_a_scene_says_wrong_is_named() {
    let message = refused(4, |body| body.material = Some("gold".to_owned()));
    assert!(message.contains("material of pipe") && message.contains("wood"), "{message}");
    assert!(message.contains("brass"), "{message}");
    let message = refused(0, |body| body.fixed = None);
    assert!(message.contains("at_m of tray: a compound that can move"), "{message}");
    let message = refused(1, |body| body.fixed = Some(true));
    assert!(message.contains("at_m of mug: a compound that is fixed needs a place"), "{message}");
    let message = refused(1, |body| body.type_name = Some(String::new()));
    assert!(message.contains("type of mug"), "{message}");
    let peg = toml::from_str("kind = 'peg'\nradius_m = 0.008\nheight_m = 0.1").unwrap();
    let message = refused(2, |body| {
        body.shape = Clone::clone(&peg);
        body.fixed = Some(false);
    });
    assert!(message.contains("fixed of carton: a peg cannot move"), "{message}");
    let mut spec = shapes();
    let materials = "friction = 3.0\ndensity_kg_m3 = 8500.0";
    spec.materials.insert("brass".to_owned(), toml::from_str(materials).unwrap());
    assert!(spec.check().unwrap_err().to_string().contains("friction of material brass"));
    let full = "kind = 'scattered'\nareas_m = [[[0.0, 0.0], [0.01, 0.01]]]";
    let spec = SceneSpec { arrangement: toml::from_str(full).unwrap(), ..shapes() };
    let message = World::new(&spec, &common::world_config(), 0).unwrap_err().to_string();
    assert!(message.contains("no free place for "), "{message}");
}

#[test]
fn scenery_is_what_says_so_and_boards_that_no_domain_knows() {
    let mut board: BodySpec = toml::from_str(
        "name = 'b'\nshape = { kind = 'board', size_m = [0.4, 0.2, 0.01] }\ncolour = '#ffffff'",
    )
    .unwrap();
    assert!(board.is_scenery(|_| false) && !board.is_scenery(|kind| kind == "board"));
    board.type_name = Some("board".to_owned());
    assert!(!board.is_scenery(|_| false));
    board.type_name = Some("scenery".to_owned());
    assert!(board.is_scenery(|_| true));
}
