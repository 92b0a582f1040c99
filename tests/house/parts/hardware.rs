//! What cameras and robots promise: numbered frames that are what they say, and an answer to every command.

use std::sync::Arc;

use groundloop::clock::ClockKind;
use groundloop::geometry::Intrinsics;
use groundloop::hardware::{CAMERAS, Camera, HardwareInputs, ROBOTS, Robot, SharedWorld};
use groundloop::messages::{Command, CommandKind, Expect, Frame, Motion, StatusKind, Waypoint};
use groundloop::parts::{Registry, Role};
use groundloop::run::DomainFolder;
use nalgebra::Point3;

use crate::common;

use super::{blocks, folder, keeps_promises, kept, made, minimal, run_file};

fn hardware(folder: &'static DomainFolder, clock: ClockKind) -> HardwareInputs<'static> {
    let run = run_file();
    HardwareInputs {
        clock,
        camera: "main",
        rate_hz: run.camera.rate_hz,
        seed: run.seed,
        folder: &folder.files,
        origin: &run.origin,
        domain: &folder.domain,
        sim: run.sim.as_ref(),
        faults: &[],
        world: kept(SharedWorld::default()),
    }
}

fn command(id: u64, kind: CommandKind) -> Command {
    Command { id, frame_sequence: id, capture_ns: 0, kind, step: None }
}

/// Motions that no robot can carry out.
fn absurd_motions() -> Vec<Motion> {
    let waypoint = |x: f64| Waypoint {
        position: Point3::new(x, 0.0, x),
        yaw_rad: x,
        opening_m: x,
        speed_m_s: x,
        expect: Expect::Holding,
        retractable: true,
    };
    let numbers = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300];
    let single = numbers.map(|x| vec![waypoint(x)]);
    let several = vec![vec![], vec![waypoint(1e300), waypoint(-1.0)]];
    let all = single.into_iter().chain(several);
    all.map(|waypoints| Motion { waypoints }).collect()
}

/// Tells a robot all that makes no sense, and reads what it says; an absurd motion must fail.
fn answers(robot: &mut dyn Robot) -> Vec<String> {
    let mut said = Vec::new();
    let others = [CommandKind::Hold, CommandKind::Cancel, CommandKind::Continue];
    let starts = absurd_motions().into_iter().map(CommandKind::Start);
    let kinds = others.iter().cloned().chain(starts).chain(others.iter().cloned());
    for (id, kind) in (0..).zip(kinds) {
        robot.accept(&command(id, kind.clone()));
        let statuses = robot.pending();
        let (_, state) = robot.state();
        if matches!(kind, CommandKind::Start(_)) {
            let [status] = &statuses[..] else { panic!("{kind:?}: {statuses:?}") };
            let StatusKind::Failed(reason) = &status.kind else { panic!("{kind:?}: {status:?}") };
            assert!(!reason.is_empty() && status.command_id == id, "{kind:?}: {status:?}");
        }
        assert!(state.position.iter().all(|x| x.is_finite()), "{kind:?}: {state:?}");
        assert!(state.opening_m.is_finite() && state.yaw_rad.is_finite(), "{kind:?}: {state:?}");
        assert_eq!(state.command_id, None, "{kind:?}");
        said.push(format!("{statuses:?} {:?} {}", state.position, state.holding));
        robot.published();
        assert!(robot.pending().is_empty(), "what has been sent is not said again");
    }
    said
}

#[test]
fn robots() {
    let folder = blocks();
    for clock in [ClockKind::Lockstep, ClockKind::Realtime] {
        keeps_promises(&ROBOTS, &|| hardware(folder, clock), &|port| {
            let Some(open) = &port.open else { return vec![format!("{}", port.acts)] };
            let mut robot = open();
            assert_eq!(robot.period().is_some(), clock == ClockKind::Realtime);
            let mut said = answers(&mut *robot);
            if clock == ClockKind::Realtime {
                said.clear(); // it depends on time
                robot.tick();
            }
            said
        });
    }
}

/// A robot carries on a motion that it has accepted, whatever else it is told, and says how it ended once.
#[test]
fn a_motion_in_progress_survives_absurd_commands() {
    let folder = blocks();
    keeps_promises(&ROBOTS, &|| hardware(folder, ClockKind::Lockstep), &|port| {
        let Some(open) = &port.open else { return Vec::new() };
        let mut robot = open();
        let here = robot.state().1;
        let up = Waypoint {
            position: here.position + nalgebra::Vector3::new(0.1, 0.0, 0.0),
            yaw_rad: here.yaw_rad,
            opening_m: here.opening_m,
            speed_m_s: 0.2,
            expect: Expect::Empty,
            retractable: true,
        };
        let mut said = Vec::new();
        let start = CommandKind::Start(Motion { waypoints: vec![up] });
        let absurd = absurd_motions().into_iter().map(CommandKind::Start);
        let rest = std::iter::repeat_n(CommandKind::Continue, 20);
        for (id, kind) in (0..).zip([start].into_iter().chain(absurd).chain(rest)) {
            robot.accept(&command(id, kind));
            said.extend(robot.pending().into_iter().map(|status| (status.command_id, status.kind)));
            robot.published();
        }
        let first = said.iter().filter(|(id, _)| *id == 0).map(|(_, kind)| kind);
        assert_eq!(first.collect::<Vec<_>>(), [&StatusKind::Accepted, &StatusKind::Done]);
        let is_failed = |(_, kind): &&(u64, StatusKind)| matches!(kind, StatusKind::Failed(_));
        assert_eq!(said.iter().filter(is_failed).count(), absurd_motions().len(), "{said:?}");
        said
    });
}

/// Frames that are looked at of every camera.
const N_FRAMES: u64 = 5;

/// Takes frames of a camera, with the answer to each that lets a world in lockstep go on.
async fn frames(camera: &mut dyn Camera, mut robot: Option<Box<dyn Robot>>) -> Vec<Frame> {
    let mut frames = Vec::new();
    for number in 0..N_FRAMES {
        if let Some(robot) = &mut robot {
            robot.published();
        }
        let Some(frame) = camera.next().await.unwrap() else { return frames };
        frames.push(frame.clone());
        if let Some(robot) = &mut robot {
            robot.accept(&command(number, CommandKind::Continue));
        }
    }
    frames
}

/// Fails unless each frame is what it says, and comes after the one before.
fn are_sound(name: &str, frames: &[Frame], size: Option<[u32; 2]>) {
    assert_eq!(frames.len() as u64, N_FRAMES, "{name}");
    for pair in frames.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence + 1, "{name}");
        assert!(pair[1].capture_ns > pair[0].capture_ns, "{name}: {}", pair[1].capture_ns);
    }
    for Frame { sequence, width, height, rgb, depth_m, model, .. } in frames {
        let n_pixels = *width as usize * *height as usize;
        assert!(n_pixels > 0 && rgb.len() == 3 * n_pixels, "{name} #{sequence}");
        if let Some(size) = size {
            assert_eq!([*width, *height], size, "{name} #{sequence}");
        }
        if let Some(depth_m) = depth_m {
            assert_eq!(depth_m.len(), n_pixels, "{name} #{sequence}");
            assert!(depth_m.iter().all(|m| m.is_finite() && *m >= 0.0), "{name} #{sequence}");
        }
        if let Some(model) = model {
            let Intrinsics { fx, fy, cx, cy } = model.intrinsics;
            assert!(fx > 0.0 && fy > 0.0 && fx.is_finite() && fy.is_finite(), "{name}: {model:?}");
            assert!((0.0..f64::from(*width)).contains(&cx), "{name}: {model:?}");
            assert!((0.0..f64::from(*height)).contains(&cy), "{name}: {model:?}");
            let translation = model.world_from_camera.translation.vector;
            assert!(translation.iter().all(|x| x.is_finite()), "{name}: {model:?}");
            let norm = model.world_from_camera.rotation.quaternion().norm();
            assert!((norm - 1.0).abs() < 1e-9, "{name}: {model:?}");
        }
    }
}

#[test]
fn cameras() {
    let domain = blocks();
    let runtime = common::runtime();
    let directory = folder();
    for clock in [ClockKind::Lockstep, ClockKind::Realtime] {
        keeps_promises(&CAMERAS, &|| hardware(domain, clock), &|port| port.image_size);
        for part in CAMERAS.0 {
            let options = minimal("camera", part.name).unwrap();
            let inputs = hardware(domain, clock);
            let camera = made(&CAMERAS, part.name, &options, &directory, inputs).unwrap();
            let Some(open) = camera.open.clone() else { continue };
            // In lockstep the simulated camera shows its next frame once the robot of its world has spoken.
            let robot = (part.name == "sim" && clock == ClockKind::Lockstep)
                .then(|| made(&ROBOTS, "sim", "", &directory, inputs).unwrap())
                .and_then(|port| port.open.map(|open| open()));
            let name = format!("{} {clock:?}", part.name);
            runtime.block_on(async {
                let running =
                    tokio::spawn(async move { frames(&mut *open().unwrap(), robot).await });
                are_sound(&name, &running.await.unwrap(), camera.image_size);
            });
        }
    }
}

/// Fails unless a part cannot be made, and the message has all of some words.
#[track_caller]
fn refused<T: Role + ?Sized>(
    registry: &Registry<T>,
    name: &str,
    options: &str,
    directory: &tempfile::TempDir,
    inputs: T::Inputs<'_>,
    words: &[&str],
) {
    let error = made(registry, name, options, directory, inputs).map(drop).unwrap_err().to_string();
    assert!(words.iter().all(|word| error.contains(word)), "{name} {options}: {error}");
}

#[test]
fn what_is_wrong_with_a_camera_is_named() {
    let domain = blocks();
    let directory = folder();
    std::fs::create_dir(directory.path().join("empty")).unwrap();
    let inputs = || hardware(domain, ClockKind::Realtime);
    for (options, words) in [
        ("path = 'nowhere'", &["nowhere", "No such file"][..]),
        ("path = 'empty'", &["empty", "no image (jpg, jpeg, png)"]),
        ("path = 'boxes.json'", &["boxes.json", "image"]),
        ("path = 'image.png'\nrepeat = 0", &["camera.options.repeat", "0"]),
        ("path = 'image.png'\nrepeat = -1", &["camera.options.repeat"]),
        ("path = 7", &["camera.options.path", "7"]),
        ("", &["path"]),
    ] {
        refused(&CAMERAS, "images", options, &directory, inputs(), words);
    }
    let raw = |more: &str| format!("command = ['yes']\nsize = [4, 2]\n{more}");
    for (options, words) in [
        (raw("encoding = 'rgb24'"), &["camera.options.encoding", "rgb8", "rgb24"][..]),
        (raw("encoding = '16UC1'"), &["camera.options.encoding", "depth follows"]),
        (raw("encoding = 'rgb8'\ndepth = 'mono8'"), &["camera.options.depth", "16UC1"]),
        (raw("encoding = 'rgb8'\nstride = 11"), &["camera.options.stride: expected 12 to", "11"]),
        (raw("encoding = 'rgb8'\nintrinsics = 'boxes.json'"), &["boxes.json", "a camera matrix"]),
        (raw("encoding = 'rgb8'\npose = [0, 0, 0, 0, 0, 0, 1]"), &["pose", "intrinsics beside"]),
        (
            raw("encoding = 'rgb8'\nintrinsics_px = [9, 9, 1, 1]\npose = [0, 0, 0, 0, 0, 0, 2]"),
            &["camera.options.pose", "unit quaternion"],
        ),
        (
            raw("encoding = 'rgb8'\nintrinsics_px = [-9, 9, 1, 1]"),
            &["camera.options.intrinsics_px", "positive focal lengths"],
        ),
        ("command = []\nsize = [4, 2]\nencoding = 'rgb8'".to_owned(), &["camera.options.command"]),
    ] {
        refused(&CAMERAS, "pipe", &options, &directory, inputs(), words);
    }
    for (options, words) in [
        ("path = 'none.mcap'\ntopic = '/a'", &["none.mcap", "No such file"][..]),
        ("path = 'image.png'\ntopic = '/a'", &["image.png"]),
        ("path = 'recording.mcap'\ntopic = '/a'", &["topics with pictures: ", "/camera/image_raw"]),
    ] {
        refused(&CAMERAS, "mcap", options, &directory, inputs(), words);
    }
    let sim = kept(toml::Table::from_iter([("no_such_key".to_owned(), 1.into())]));
    let inputs = HardwareInputs { sim: Some(sim), ..inputs() };
    refused(&CAMERAS, "sim", "", &directory, inputs, &["[sim]", "no_such_key"]);
    refused(&ROBOTS, "sim", "", &directory, inputs, &["[sim]", "no_such_key"]);
}

/// What is known of a camera goes with its frames.
#[test]
fn intrinsics_and_pose_go_with_the_frames() {
    let directory = folder();
    let known = "pose = [0.1, -0.7, 0.5, 1.0, 0.0, 0.0, 0.0]";
    let given = format!("{known}\nintrinsics_px = [9.0, 8.0, 1.5, 0.5]");
    for (kind, known, focal_px) in
        [("images", &*given, 9.0), ("pipe", &*given, 9.0), ("mcap", known, 20.0)]
    {
        let options = format!("{}\n{known}", minimal("camera", kind).unwrap());
        let inputs = hardware(blocks(), ClockKind::Realtime);
        let camera = made(&CAMERAS, kind, &options, &directory, inputs).unwrap();
        let open = Arc::clone(camera.open.as_ref().unwrap());
        let shown = common::runtime().block_on(async {
            let playing = tokio::spawn(async move { frames(&mut *open().unwrap(), None).await });
            playing.await.unwrap()
        });
        let model = shown[0].model.unwrap();
        assert_eq!(model.intrinsics.fx, focal_px, "{kind}");
        assert_eq!(model.world_from_camera.translation.vector.x, 0.1, "{kind}");
        // Turned half around x, what lies before the camera lies below.
        let before = model.world_from_camera * Point3::new(0.0, 0.0, 1.0);
        assert!((before.z + 0.5).abs() < 1e-9, "{kind}: {before}");
    }
}

/// An image that is broken is told when the camera is opened, by its path.
#[test]
fn a_broken_image_is_named() {
    let directory = folder();
    std::fs::create_dir(directory.path().join("photos")).unwrap();
    let photo = |name: &str| directory.path().join("photos").join(name);
    std::fs::copy(directory.path().join("image.png"), photo("a.png")).unwrap();
    std::fs::write(photo("b.png"), "this is no picture").unwrap();
    let inputs = hardware(blocks(), ClockKind::Realtime);
    let camera = made(&CAMERAS, "images", "path = 'photos'", &directory, inputs).unwrap();
    let open = Arc::clone(camera.open.as_ref().unwrap());
    let error = common::runtime().block_on(async move { open().map(drop).unwrap_err() });
    assert!(error.to_string().contains("b.png"), "{error}");
}
