//! Every registered part keeps the promises of its kind: it is made from minimal options, refuses
//! unknown ones by name, gives the same answer to the same question, and panics on nothing.
//!
//! A part that is not in [`minimal`] fails: to register is to be tested.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

mod hardware;

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::Path;
use std::sync::Arc;

use crate::common::project;
use groundloop::geometry::{Aabb, CameraModel, Intrinsics, MaskRun, PixelBox};
use groundloop::goals::{GOALS, GoalInputs, GoalObject, GoalSource};
use groundloop::messages::{Motion, RobotState};
use groundloop::parts::{Part, PartChoice, PartContext, PartError, Registry, Role};
use groundloop::pddl::{Name, SourceText, parse_domain, parse_problem};
use groundloop::perception::detectors::{DETECTORS, DetectorInputs};
use groundloop::perception::grounders::{GROUNDERS, GrounderInputs};
use groundloop::perception::model::{Exemplars, ObjectBox};
use groundloop::perception::{
    DepthView, Detection, FrameView, ImageView, Observation, lift_detections,
};
use groundloop::planners::{PLANNERS, PlanQuery, PlannerInputs};
use groundloop::planning::{Budget, PlanRequest};
use groundloop::run::{DomainFolder, RunConfig, load_run};
use groundloop::scene::{SceneObject, Visibility};
use groundloop::skills::{SKILLS, SkillContext};
use nalgebra::{Isometry3, Point3, Vector3};

/// Nobody listens there.
const NOWHERE: &str = "url = 'http://127.0.0.1:9'";
const IMPATIENT: &str = "retry = { attempts_max = 1, connect_ms = 100, total_ms = 200 }";

/// What of a recording is played, again and again, and how raw bytes are read.
const RECORDED: &str = "topic = '/camera/image_raw'\nrate_hz = 100.0\nagain = true";
const RAW: &str = "size = [4, 2]\nencoding = 'rgb8'";

/// The least that makes a part, in a folder with `boxes.json`, `image.png`, `recording.mcap` and the program
/// `driver`; `None` where this build or machine may lack what the part needs.
fn minimal(role: &str, name: &str) -> Option<String> {
    match (role, name) {
        ("camera", "images") => Some("path = 'image.png'".to_owned()),
        ("camera", "mcap") => Some(format!("path = 'recording.mcap'\n{RECORDED}")),
        ("camera", "pipe") => Some(format!("command = ['yes']\n{RAW}")),
        ("camera", "external" | "sim")
        | ("robot", "external" | "none" | "sim")
        | ("grounder", "s2s" | "s2s-joint")
        | ("goal", "image" | "instruction" | "logical")
        | ("planner", "embedded")
        | ("skill", "pick" | "place")
        | ("detector", "colour") => Some(String::new()),
        ("detector", "annotated") => Some("boxes = 'boxes.json'".to_owned()),
        ("detector", "http") => Some(format!("{NOWHERE}\ndialect = 'hugging_face'\n{IMPATIENT}")),
        ("detector", "onnx") => None,
        ("goal", "language_model") => {
            Some(format!("{NOWHERE}\nmodel = 'm'\ndialect = 'llamacpp'\n{IMPATIENT}"))
        }
        ("planner", "fast-downward") => Some("program = 'driver'".to_owned()),
        _ => panic!("tests/house/parts/mod.rs: `minimal` lacks the {role} \"{name}\""),
    }
}

/// A folder with the files that minimal options name.
fn folder() -> tempfile::TempDir {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("boxes.json"), "{}").unwrap();
    image::RgbImage::new(640, 480).save(folder.path().join("image.png")).unwrap();
    let recording = project("tests/attach/recordings/ros2.mcap");
    std::fs::copy(recording, folder.path().join("recording.mcap")).unwrap();
    let driver = folder.path().join("driver");
    std::fs::write(&driver, "#!/bin/sh\nexit 12\n").unwrap();
    std::fs::set_permissions(&driver, std::fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

/// Makes every part of a role twice, shows both to `use_it`, and compares what comes of them.
fn keeps_promises<T: Role + ?Sized, A: PartialEq + Debug>(
    registry: &'static Registry<T>,
    inputs: &dyn Fn() -> T::Inputs<'static>,
    use_it: &dyn Fn(&mut T) -> A,
) {
    let folder = folder();
    assert!(registry.names().is_sorted_by(|a, b| a < b), "{registry:?}");
    for part in registry.0 {
        let Part { name, help, .. } = part;
        assert!(!help.is_empty() && !help.ends_with('.') && !help.contains('\n'), "{name}");
        for option in part.described() {
            assert!(!option.meaning.is_empty(), "{name}: {} says nothing", option.name);
        }
        let Some(options) = minimal(T::NAME, name) else {
            // It may be missing, or its files are; it says so.
            let error = made(registry, name, "", &folder, inputs()).map(drop).unwrap_err();
            assert!(!error.to_string().is_empty());
            continue;
        };
        let unknown = format!("no_such_option = 1\n{options}");
        let error = made(registry, name, &unknown, &folder, inputs()).map(drop).unwrap_err();
        let said = error.to_string();
        assert!(matches!(error, PartError::Options { .. }), "{name}: {said}");
        assert!(said.contains("no_such_option") && said.contains("run.toml"), "{name}: {said}");
        let answers = [(), ()].map(|()| {
            let mut part = made(registry, name, &options, &folder, inputs())
                .unwrap_or_else(|error| panic!("{} {name}: {error}", T::NAME));
            use_it(&mut part)
        });
        assert_eq!(answers[0], answers[1], "{} {name}", T::NAME);
    }
}

fn made<T: Role + ?Sized>(
    registry: &Registry<T>,
    name: &str,
    options: &str,
    folder: &tempfile::TempDir,
    inputs: T::Inputs<'_>,
) -> Result<Box<T>, PartError> {
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new(T::KEY, name);
    let choice = kept(choice.with_options(Some(&options), folder.path().join("run.toml")));
    registry.build(&PartContext { choice, inputs, environment: |_| None })
}

/// Lives as long as the test: inputs borrow it.
fn kept<V>(value: V) -> &'static V {
    Box::leak(Box::new(value))
}

fn blocks() -> &'static DomainFolder {
    kept(DomainFolder::read(&project("domains/blocksworld")).unwrap())
}

fn run_file() -> &'static RunConfig {
    kept(load_run(&project("configs/blocksworld.toml"), &[]).unwrap())
}

fn exemplars(folder: &DomainFolder) -> &'static Exemplars {
    let examples = run_file().perception.exemplar.read(folder, None).unwrap();
    kept(Exemplars::new(examples.into_iter().map(|(_, example)| example).collect()).unwrap())
}

/// Images that no camera should give.
fn absurd_images() -> Vec<(usize, usize, Vec<u8>)> {
    let sizes = [(0, 0), (1, 1), (1, 400), (16, 8), (64, 48)];
    let fill = |byte: fn(usize) -> u8| {
        sizes.map(|(w, h)| (w, h, (0..3 * w * h).map(byte).collect::<Vec<u8>>()))
    };
    [fill(|_| 0), fill(|_| 255), fill(|i| (i * 97 % 251) as u8)].concat()
}

/// Objects that no detector should find.
fn absurd_objects() -> Vec<Vec<ObjectBox>> {
    let boxes = [
        [0.0, 0.0, 1.0, 1.0],
        [f64::NAN; 4],
        [f64::INFINITY, 0.0, f64::NEG_INFINITY, 1.0],
        [5.0, 5.0, 5.0, 5.0],
        [-1e300, -1e300, 1e300, 1e300],
    ];
    let types = ["block", "arm", "no_such_type", ""];
    let all = boxes.iter().enumerate().flat_map(|(i, edges)| {
        types.map(|kind| {
            let mut object = ObjectBox::new(
                Name::new(format!("o{i}{kind}")),
                Name::new(kind),
                PixelBox::from(*edges),
            );
            if i % 2 == 1 {
                let centre = Point3::new(f64::NAN, edges[0], 0.0);
                object.volume = Some(Aabb { centre, extent: [edges[1], 0.0, f64::NAN] });
            }
            object
        })
    });
    vec![Vec::new(), all.collect()]
}

/// Depth images that no camera should give, some of another size than any image.
fn absurd_depths() -> Vec<(usize, usize, Vec<f32>)> {
    let fills = [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX, 0.7];
    let sizes = [(1, 1), (1, 400), (64, 48), (65, 47)];
    let all = sizes.iter().flat_map(|&(w, h)| {
        let mixed = (0..w * h).map(move |i| fills[i * 7 % fills.len()]).collect();
        fills.map(|fill| (w, h, vec![fill; w * h])).into_iter().chain([(w, h, mixed)])
    });
    all.collect()
}

/// Cameras of a known and of an absurd kind.
fn cameras() -> [CameraModel; 2] {
    let camera = |f: f64, c: f64| CameraModel {
        intrinsics: Intrinsics { fx: f, fy: f, cx: c, cy: c },
        // It looks along y.
        world_from_camera: Isometry3::new(
            Vector3::new(0.0, -0.7, c),
            Vector3::x() * -std::f64::consts::FRAC_PI_2,
        ),
    };
    [camera(50.0, 32.0), camera(0.0, f64::NAN)]
}

/// An image and a depth image that do not belong together, with the camera that is said to show both.
fn each_absurd_frame(mut show: impl FnMut(&FrameView<'_>)) {
    let (images, depths) = (absurd_images(), absurd_depths());
    for (width, height, rgb) in &images {
        let image = ImageView::new(*width, *height, rgb).ok();
        show(&FrameView { image, depth: None, camera: None });
        for (width, height, depth_m) in &depths {
            let depth = Some(DepthView::new(*width, *height, depth_m).unwrap());
            for camera in &cameras() {
                show(&FrameView { image, depth, camera: Some(camera) });
            }
        }
    }
}

#[test]
fn detectors() {
    let folder = blocks();
    let inputs = || DetectorInputs { domain: &folder.domain, perception: &folder.perception };
    keeps_promises(&DETECTORS, &inputs, &|detector| {
        let phrases = ["red block", "", "((("].map(str::to_owned);
        let mut answers = Vec::new();
        for (width, height, rgb) in absurd_images() {
            let Ok(view) = ImageView::new(width, height, &rgb) else { continue };
            let learnt = detector.learn(&view, &absurd_objects().concat());
            let detected = detector.detect(&view, &phrases);
            answers.push(format!("{learnt:?} {detected:?}"));
            let mut objects = detected.map(|found| found.objects).unwrap_or_default();
            for (width, height, depth_m) in absurd_depths() {
                let depth = Some(DepthView::new(width, height, &depth_m).unwrap());
                let camera = Some(&cameras()[0]);
                let frame = FrameView { image: Some(view), depth, camera };
                lift_detections(&folder.perception, &frame, &mut objects);
                answers.push(format!("{objects:?}"));
            }
        }
        answers
    });
}

/// Whatever a detector says of a frame, giving it a box in the world says something sound or nothing.
#[test]
fn absurd_detections_are_measured_soundly_or_not_at_all() {
    let perception = &blocks().perception;
    let run = |y, x_start, x_end| MaskRun { y, x_start, x_end };
    let masks = [
        vec![],
        vec![run(0, 0, 0)],
        vec![run(5, 9, 3), run(5, 2, 4)],
        (0..40).map(|y| run(y, 3, 50)).collect(),
        vec![run(u32::MAX, u32::MAX - 3, u32::MAX)],
    ];
    let mut objects: Vec<Detection> = Vec::new();
    for object in absurd_objects().concat().iter().filter(|o| o.type_name == "block") {
        for mask in &masks {
            let detection =
                Detection::new(object.type_name.clone(), Name::new("red"), object.pixel_box);
            objects.push(Detection { mask: mask.clone(), score: f32::NAN, ..detection });
        }
    }
    let mut n_measured = 0;
    for (width, height, depth_m) in &absurd_depths() {
        let depth = Some(DepthView::new(*width, *height, depth_m).unwrap());
        for camera in &cameras() {
            let frame = FrameView { image: None, depth, camera: Some(camera) };
            lift_detections(perception, &frame, &mut objects);
            for estimate in objects.iter().filter_map(|object| object.measured.as_ref()) {
                n_measured += 1;
                let Aabb { centre, extent } = estimate.volume;
                assert!(centre.iter().all(|v| v.is_finite()), "{estimate:?}");
                assert!(extent.iter().all(|v| v.is_finite() && *v >= 0.0), "{estimate:?}");
            }
        }
    }
    assert!(n_measured > 0);
}

#[test]
fn grounders() {
    let folder = blocks();
    let exemplars = exemplars(folder);
    let (domain, perception) = (&folder.domain, &folder.perception);
    keeps_promises(&GROUNDERS, &|| GrounderInputs { domain, perception, exemplars }, &|grounder| {
        let mut answers = Vec::new();
        for objects in absurd_objects() {
            each_absurd_frame(|frame| {
                let observation = Observation { frame: *frame, ..Observation::of_boxes(&objects) };
                answers.push(format!("{:?}", grounder.ground(&observation)));
            });
        }
        answers
    });
}

#[test]
fn goals() {
    let folder = blocks();
    let texts = ["(clear red_block)", "", "(((", "put \u{0} \u{1F980} onto \u{202E}", "of of of"];
    let long = "red over ".repeat(2000);
    for text in texts.into_iter().chain([long.as_str()]) {
        let text: &'static str = kept(text.to_owned());
        let (language, perception) = (folder.language.as_ref(), Some(&folder.perception));
        let inputs = || {
            // A photograph of the goal is whatever the text says.
            let read_image = |_: &Path| Err("there is nothing to see".to_owned());
            let read_image = Some(Arc::new(read_image) as _);
            GoalInputs { origin: "goal", text, language, perception, read_image }
        };
        let directory = self::folder();
        for part in GOALS.0 {
            let Some(options) = minimal("goal", part.name) else { continue };
            let read = || {
                let source = made(&GOALS, part.name, &options, &directory, inputs());
                let objects = |names: &[&str]| {
                    let object = |name: &&str| GoalObject {
                        name: Name::new(name),
                        type_name: Name::new("block"),
                        colour: None,
                        pixel_box: Some(PixelBox::from([f64::NAN; 4])),
                    };
                    names.iter().map(object).collect::<Vec<GoalObject>>()
                };
                let read = |source: &dyn GoalSource, names: &[&str]| {
                    source.read(&folder.domain, &objects(names)).map_err(|e| e.render())
                };
                source.map(|source| {
                    [&[][..], &["red_block", "", "red_block"]].map(|names| read(&*source, names))
                })
            };
            assert_eq!(format!("{:?}", read()), format!("{:?}", read()), "{}", part.name);
            let unknown = format!("no_such_option = 1\n{options}");
            let error = made(&GOALS, part.name, &unknown, &directory, inputs()).unwrap_err();
            assert!(error.to_string().contains("no_such_option"), "{}: {error}", part.name);
        }
    }
}

#[test]
fn planners() {
    let folder = blocks();
    let budget = kept(Budget { greedy_expansions_max: 1000, ..Budget::standard() });
    let empty = "(define (problem p) (:domain blocksworld) (:init) (:goal (and)))";
    let hopeless = "(define (problem p) (:domain blocksworld) (:objects a b - block)
        (:init) (:goal (and (on a b) (on b a))))";
    let problems = [empty, hopeless].map(|text| {
        parse_problem(&SourceText::new("problem", text), &folder.domain).unwrap().value
    });
    let bare = "(define (domain bare) (:predicates (p)))";
    let bare = parse_domain(&SourceText::new("bare", bare)).unwrap().value;
    let nothing = "(define (problem p) (:domain bare) (:init) (:goal (p)))";
    let nothing = parse_problem(&SourceText::new("problem", nothing), &bare).unwrap().value;
    keeps_promises(&PLANNERS, &|| PlannerInputs { budget }, &|planner| {
        let mut answers: Vec<String> = Vec::new();
        for (domain, problem) in
            problems.iter().map(|p| (&folder.domain, p)).chain([(&bare, &nothing)])
        {
            let query = PlanQuery::once(domain, &PlanRequest::new(problem));
            answers.push(format!("{:?}", planner.plan(&query).outcome));
        }
        answers
    });
}

/// Objects of a scene that no camera should show.
fn absurd_scene() -> Vec<SceneObject> {
    let numbers = [0.0, -1.0, 1e300, f64::NAN, f64::INFINITY];
    let objects = numbers.iter().enumerate().map(|(i, &number)| SceneObject {
        name: Name::new(format!("o{i}")),
        type_name: Name::new("block"),
        pixel_box: None,
        volume: (i > 0).then(|| Aabb {
            centre: Point3::new(number, 0.0, number),
            extent: [number, 0.0, number],
        }),
        score: f32::NAN,
        visibility: Visibility::Visible,
        seen_ns: 0,
    });
    objects.collect()
}

fn robot_state() -> RobotState {
    RobotState {
        capture_ns: 0,
        position: Point3::new(0.0, 0.0, 0.5),
        yaw_rad: 0.0,
        opening_m: 0.05,
        holding: false,
        command_id: None,
        phase: 0,
        answered: None,
    }
}

#[test]
fn skills() {
    let config = run_file().robot.motion.as_ref().unwrap();
    let objects = absurd_scene();
    keeps_promises(&SKILLS, &|| (), &|skill| {
        let mut answers = Vec::new();
        let names = ["o0", "o1", "o2", "o3", "o4", "", "nobody"].map(Name::new);
        for object in &names {
            for other in &names {
                for key in ["onto", "around", "object"] {
                    let args = BTreeMap::from([(key, other.clone()), ("object", object.clone())]);
                    let mut context = SkillContext::new(&objects, config, &robot_state(), None);
                    let mut motion = Motion::default();
                    let ended = skill.extend(&args, &mut context, &mut motion);
                    answers.push(format!("{ended:?} {motion:?}"));
                }
            }
        }
        answers
    });
}
