//! Frames by hand: detections, robot states and statuses in, scenes out.

mod absence;
mod anomalies;
mod cameras;
mod facts;
mod names;

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};

use super::*;
use crate::executive::predicted_effects;
use crate::geometry::{CameraModel, Intrinsics, MaskRun, PixelBox};
use crate::logic::Truth;
use crate::messages::StatusKind;
use crate::pddl::Atom;
use crate::pddl::{SourceText, parse_plan};
use crate::perception::grounders::{Basis, Evidence, GrounderError, Grounding, Judged};
use crate::perception::model::ObjectBox;
use crate::perception::{DepthView, Detection, Detections, Observation, PhraseBox};
use crate::run::DomainFolder;
use crate::scene::{Scene, Visibility};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Edge of a block: 50 pixels, 5 cm.
const EDGE: f64 = 50.0;
/// Time between two frames, seconds.
const FRAME_S: f64 = 0.1;
const CONFIRM_FRAMES: u32 = 3;
const HIDDEN_FRAMES_MAX: u32 = 5;

/// A block is on another when its box stands on the other's.
struct Touching;

impl Grounder for Touching {
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        let objects = observation.objects;
        let is_block = |o: &&ObjectBox| o.type_name == "block";
        let mut judged = Vec::new();
        for above in objects.iter().filter(is_block) {
            for below in objects.iter().filter(is_block).filter(|b| b.name != above.name) {
                let (a, b) = (above.pixel_box, below.pixel_box);
                let truth = (a.y2 - b.y1).abs() < 5.0 && (a.centre().0 - b.centre().0).abs() < 25.0;
                let atom = Atom::new("on", &[above.name.as_str(), below.name.as_str()]);
                let evidence = Evidence { exemplar: "none".to_owned(), atom: atom.clone() };
                let evidence = Arc::new(evidence);
                judged.push(Judged {
                    atom,
                    truth: Truth::from(truth),
                    basis: Basis::Observed,
                    d_pos: if truth { 1.0 } else { 3.0 },
                    d_neg: if truth { 3.0 } else { 1.0 },
                    nearest_pos: Arc::clone(&evidence),
                    nearest_neg: evidence,
                });
            }
        }
        Ok(Grounding { judged, anomalies: Vec::new() })
    }
}

/// One pixel is one millimetre: the camera looks along y at a plane one metre away, and the lower
/// edge of the picture is the table.
fn camera() -> CameraModel {
    let axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    CameraModel {
        intrinsics: Intrinsics { fx: 1000.0, fy: 1000.0, cx: 320.0, cy: 240.0 },
        world_from_camera: Isometry3::from_parts(Translation3::new(0.0, -1.0, 0.24), rotation),
    }
}

fn detection(type_name: &str, label: &str, edges: [f64; 4]) -> Detection {
    let row = |y| MaskRun { y, x_start: edges[0] as u32, x_end: edges[2] as u32 };
    Detection {
        mask: (edges[1] as u32..edges[3] as u32).map(row).collect(),
        ..Detection::new(type_name.into(), label.into(), PixelBox::from(edges))
    }
}

/// A block with its middle at `x` millimetres, `level` blocks above the table.
fn block(colour: &str, x: f64, level: f64) -> Detection {
    let (left, bottom) = (320.0 + x - EDGE / 2.0, HEIGHT as f64 - level * EDGE);
    detection("block", colour, [left, bottom - EDGE, left + EDGE, bottom])
}

/// A robot far above the picture.
fn robot() -> RobotState {
    RobotState {
        capture_ns: 0,
        position: Point3::new(0.0, 0.025, 0.6),
        yaw_rad: 0.0,
        opening_m: 0.05,
        holding: false,
        command_id: None,
        phase: 0,
        answered: None,
    }
}

/// A scene parser whose camera and robot are the test.
struct Eyes {
    config: ParserConfig,
    parser: SceneParser,
    robot: RobotState,
    dispatches: Vec<Dispatch>,
    /// The last scene: what a step changes depends on it.
    last: Scene,
    statuses: Vec<Status>,
    /// What another camera sees, a quarter of a metre to the right of the first: its depth in metres, and
    /// what it finds.
    twin: Option<(f32, Vec<Detection>)>,
    /// Where the goal's phrases are in the next frame.
    phrases: Vec<PhraseBox>,
    /// What the first camera measures where no block is, in metres.
    behind_m: f32,
    /// What is there and is not detected.
    missed: Vec<Detection>,
    /// Where something is half a metre before the camera, in pixels.
    hand: Option<[f64; 4]>,
    n_frames: u64,
}

impl Eyes {
    fn new(domain: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(domain);
        let folder = DomainFolder::read(&path).unwrap();
        let belief = BeliefConfig {
            confirm_s: f64::from(CONFIRM_FRAMES - 1) * FRAME_S,
            hidden_s_max: f64::from(HIDDEN_FRAMES_MAX) * FRAME_S,
            grasp_reach_m: 0.03,
        };
        let self_filter = SelfFilterConfig {
            beyond_jaws_m: 0.02,
            half_depth_m: 0.02,
            below_m: 0.01,
            above_m: 0.5,
        };
        let config = ParserConfig {
            domain: folder.domain,
            perception: folder.perception,
            rules: folder.rules,
            skills: folder.skills.unwrap(),
            grounder: Box::new(Touching),
            belief,
            self_filter: Some(self_filter),
        };
        Self {
            config,
            parser: SceneParser::default(),
            robot: robot(),
            dispatches: Vec::new(),
            last: Scene::default(),
            statuses: Vec::new(),
            twin: None,
            phrases: Vec::new(),
            behind_m: 1.0,
            missed: Vec::new(),
            hand: None,
            n_frames: 0,
        }
    }

    /// The scene of the next frame.
    fn look(&mut self, detections: &[Detection]) -> Scene {
        self.n_frames += 1;
        let depth_m = self.depth_m(detections);
        let cause = FrameRef {
            cycle: self.n_frames,
            frame_sequence: self.n_frames,
            capture_ns: (self.n_frames as f64 * FRAME_S * 1e9) as u64,
            frame_send_ns: 0,
        };
        let (dispatches, statuses) =
            (std::mem::take(&mut self.dispatches), std::mem::take(&mut self.statuses));
        let model = camera();
        let (twin_m, found) = self.twin.clone().unwrap_or_default();
        let mut twin_model = camera();
        twin_model.world_from_camera.translation.x += 0.25;
        let twin_depth_m = vec![twin_m; WIDTH * HEIGHT];
        let twins = [OtherView {
            camera: "twin",
            view: FrameView {
                image: None,
                depth: DepthView::new(WIDTH, HEIGHT, &twin_depth_m).ok(),
                camera: Some(&twin_model),
            },
            detections: Detections { objects: found, ..Detections::default() },
        }];
        let context = FrameContext {
            cause,
            view: FrameView {
                image: None,
                depth: DepthView::new(WIDTH, HEIGHT, &depth_m).ok(),
                camera: Some(&model),
            },
            others: if self.twin.is_some() { &twins } else { &[] },
            robot: Some(&self.robot),
            dispatches: &dispatches,
            statuses: &statuses,
        };
        let phrases = std::mem::take(&mut self.phrases);
        let detections =
            Detections { objects: detections.to_vec(), phrases, ..Detections::default() };
        self.last = self.parser.parse(&self.config, &context, detections).unwrap();
        self.last.clone()
    }

    /// One metre where something is.
    fn depth_m(&self, detections: &[Detection]) -> Vec<f32> {
        let mut depth_m = vec![self.behind_m; WIDTH * HEIGHT];
        let things = detections.iter().chain(&self.missed).map(|d| (d.pixel_box, 1.0));
        for (b, m) in things.chain(self.hand.map(|edges| (PixelBox::from(edges), 0.5))) {
            for y in b.y1 as usize..(b.y2 as usize).min(HEIGHT) {
                depth_m[y * WIDTH + b.x1 as usize..y * WIDTH + b.x2 as usize].fill(m);
            }
        }
        depth_m
    }

    /// The last of some frames that all look the same.
    fn stare(&mut self, n_frames: u32, detections: &[Detection]) -> Scene {
        let scenes = (0..n_frames).map(|_| self.look(detections));
        scenes.last().unwrap()
    }

    /// With the next frame, the robot is told to carry out a step.
    fn start(&mut self, step: &str) {
        let source = SourceText { name: "step".to_owned(), text: step.to_owned() };
        let step = parse_plan(&source).unwrap().remove(0);
        let (objects, facts) = (self.last.typed_objects(), self.last.confirmed());
        let effects = predicted_effects(&self.config.domain, &objects, &facts, &step);
        let cause = self.last.cause;
        self.dispatches.push(Dispatch { sequence: 0, cause, command_id: 1, step, effects });
    }

    /// With the next frame, the robot says how the step ended.
    fn end(&mut self, kind: StatusKind) {
        self.statuses.push(Status { sequence: 0, capture_ns: 0, command_id: 1, kind });
    }

    /// The gripper closes at `x` millimetres and some height.
    fn grasp(&mut self, x: f64, z: f64) {
        self.robot.position = Point3::new(x / 1000.0, 0.025, z / 1000.0);
        self.robot.holding = true;
    }
}

fn atom(text: &str) -> Atom {
    let words: Vec<&str> = text.split(' ').collect();
    Atom::new(words[0], &words[1..])
}

/// Believed truth values.
#[track_caller]
fn check(scene: &Scene, expect: &[(&str, Truth)]) {
    for (text, truth) in expect {
        assert_eq!(scene.confirmed().truth(&atom(text)), *truth, "({text})");
    }
}

/// What is seen of an object: its visibility and the middle column of its box.
fn seen(scene: &Scene, name: &str) -> (Visibility, f64) {
    let object = scene.object(name).unwrap();
    (object.visibility, object.pixel_box.unwrap().centre().0 - 320.0)
}

/// Names of the visible types' objects, in the scene's order.
fn names(scene: &Scene) -> Vec<&str> {
    let seen = scene.objects.iter().filter(|o| o.visibility != Visibility::Implied);
    seen.map(|o| o.name.as_str()).collect()
}
