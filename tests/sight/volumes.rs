//! Volumes from colour and depth are where the simulator's bodies are, in pictures of every kind.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test file")]

use crate::common::project;
use groundloop::hardware::sim::{model_of, read_scene};
use groundloop::parts::PartChoice;
use groundloop::perception::detectors::Detector;
use groundloop::perception::{DepthView, FrameView, ImageView, lift_detections};
use groundloop::run::{DomainFolder, RunConfig, load_run};
use groundloop_sim::{BodyTruth, Frame, Renderer, World};

/// Scenes that are looked at, each with the run file of its domain. No block hides another there.
const SCENES: [(&str, &str); 2] = [
    ("configs/blocksworld.toml", "scenes/five_blocks.toml"),
    ("configs/hanoi.toml", "scenes/four_disks.toml"),
];
/// A middle may be off by this much, in metres: about six pixels.
const OFF_MAX_M: f64 = 0.007;
/// An edge may be too long or too short by this much, in metres.
const LONGER_MAX_M: f64 = 0.013;

/// What disturbs a frame once it is rendered.
type Disturb = fn(&mut Frame);

/// Looks at a scene through the colour detector, and measures every body that moves.
struct Look {
    run: RunConfig,
    folder: DomainFolder,
    detector: Box<dyn Detector>,
    renderer: Renderer,
}

impl Look {
    fn new(config: &str, sets: &[&str]) -> Self {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        let run = load_run(&project(config), &sets).unwrap_or_else(|e| panic!("{e}"));
        let folder = run.domain_folder().unwrap();
        let examples = run.perception.exemplar.read(&folder, None).unwrap();
        let choice = PartChoice::new("perception.detector", "colour");
        let detector = folder.detector(&choice, &examples).unwrap();
        Self { run, folder, detector, renderer: Renderer::new() }
    }

    /// How many volumes were measured in one scene; panics at the first that is somewhere else.
    fn check(&mut self, scene: &str, seed: u64, disturb: Disturb) -> usize {
        let sim = self.run.sim().unwrap();
        let scene = read_scene(&self.folder.files.file(scene)).unwrap();
        let world = World::new(&scene, &sim.world, seed).unwrap();
        let mut frame = self.renderer.render(&world, &sim.camera, seed).unwrap();
        disturb(&mut frame);
        let (width, height) = (frame.width as usize, frame.height as usize);
        let image = ImageView::new(width, height, &frame.rgb).unwrap();
        let depth = DepthView::new(width, height, &frame.depth_m).unwrap();
        let model = model_of(&sim.camera);
        let mut found = self.detector.detect(&image, &[]).unwrap().objects;
        let view = FrameView { image: Some(image), depth: Some(depth), camera: Some(&model) };
        lift_detections(&self.folder.perception, &view, &mut found);
        let truth = world.truth();
        let bodies = truth.bodies.iter().filter(|body| matches!(body.kind, "block" | "disk"));
        for body in bodies.clone() {
            let is_body = |label: &str| body.name == format!("{label}_{}", body.kind);
            let seen = found.iter().find(|d| is_body(d.label.as_str()));
            let measured = seen.and_then(|d| d.measured);
            let Some(measured) = measured else { panic!("seed {seed}: no {}", body.name) };
            compare(body, &measured.volume, seed);
        }
        bodies.count()
    }
}

fn compare(body: &BodyTruth, volume: &groundloop::geometry::Aabb, seed: u64) {
    let off = (volume.centre - body.position).norm();
    let longer = (0..3).map(|axis| (volume.extent[axis] - body.size_m[axis]).abs());
    let longer = longer.fold(0.0, f64::max);
    assert!(off < OFF_MAX_M && longer < LONGER_MAX_M, "seed {seed}: {volume:?} for {body:?}");
}

#[track_caller]
fn check(sets: &[&str], disturb: Disturb) {
    for (config, scene) in SCENES {
        let mut look = Look::new(config, sets);
        let n: usize = (1..=5).map(|seed| look.check(scene, seed, disturb)).sum();
        assert!(n >= 20, "{n} volumes");
    }
}

#[test]
fn smooth_edges_move_no_volume() {
    for samples in ["sim.camera.samples=1", "sim.camera.samples=2", "sim.camera.samples=3"] {
        check(&[samples], |_| {});
    }
}

#[test]
fn noise_moves_no_volume() {
    check(&["sim.camera.noise.rgb_sigma=12.0", "sim.camera.samples=3"], |_| {});
}

/// A depth camera knows nothing beside an edge, and has holes elsewhere.
#[test]
fn holes_in_the_depth_move_no_volume() {
    check(&["sim.camera.samples=3"], |frame| {
        let (width, before) = (frame.width as usize, frame.depth_m.clone());
        for i in 2 * width..before.len() - 2 * width {
            let around = [i - 2, i + 2, i - width, i + width];
            if around.iter().any(|&j| (before[j] - before[i]).abs() > 0.03) {
                frame.depth_m[i] = 0.0;
            }
        }
        for at in (0..before.len() - 6 * width).step_by(599) {
            for row in 0..4 {
                frame.depth_m[at + row * width..][..5].fill(0.0);
            }
        }
    });
}

/// Depth and colour come from two cameras side by side, two pixels apart.
#[test]
fn depth_beside_the_colours_moves_no_volume() {
    let shifts: [Disturb; 4] = [
        |frame| frame.depth_m.rotate_right(2),
        |frame| frame.depth_m.rotate_left(2),
        |frame| frame.depth_m.rotate_right(frame.width as usize + 1),
        |frame| frame.depth_m.rotate_left(frame.width as usize + 1),
    ];
    for shift in shifts {
        check(&["sim.camera.samples=3"], shift);
    }
}
