//! `groundloop exemplar capture`: a proposal from a frame on the bus or from a file, and what `exemplar check` says
//! of it.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::common::{Ended, Process, data, project, runtime, unique_run};
use groundloop::geometry::PixelBox;
use groundloop::run::read_image;
use groundloop::transport::topics::CAMERA_RGB;
use groundloop::transport::wire::{FrameHeader, SCHEMA};
use groundloop::transport::{Bus, BusConfig, Publisher};
use serde_json::Value;
use tempfile::TempDir;

/// A labelled picture of the simulated camera.
const EXAMPLE: &str = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles";
/// A box that is proposed overlaps the labelled one by this share at least.
const IOU_MIN: f64 = 0.75;

fn capture(args: &[&str], out: &Path) -> Ended {
    let out = ["--out", out.to_str().unwrap()];
    Process::start(&[&["exemplar", "capture", "blocksworld"], args, &out].concat()).end()
}

fn check(folder: &Path) -> Ended {
    Process::start(&["exemplar", "check", folder.to_str().unwrap()]).end()
}

fn boxes(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// Each object is proposed where it is labelled, moved to the left by so many columns.
#[track_caller]
fn are_as_labelled(proposed: &Path, left: f64) {
    let edges = |value: &Value| -> PixelBox {
        let edges: Vec<f64> =
            value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        PixelBox::from([edges[0], edges[1], edges[2], edges[3]])
    };
    let (proposed, labelled) = (boxes(proposed), boxes(&project(&format!("{EXAMPLE}.json"))));
    for (name, label) in labelled.as_object().unwrap() {
        let label = edges(label);
        let label = PixelBox { x1: label.x1 - left, x2: label.x2 - left, ..label };
        let iou = edges(&proposed[name]).iou(&label);
        assert!(iou >= IOU_MIN, "{name}: {proposed:#}");
    }
    assert_eq!(proposed.as_object().unwrap().len(), labelled.as_object().unwrap().len());
}

#[test]
fn a_frame_on_the_bus_is_labelled() {
    let name = unique_run("capture");
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("mine");
    let image = read_image(&project(&format!("{EXAMPLE}.png"))).unwrap();
    let ended = runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        let (width, height, stride) = (320, 240, 320 * 3);
        let header =
            FrameHeader { schema: SCHEMA, width, height, stride, ..FrameHeader::default() };
        frames.publish(header, image.as_raw()).unwrap();
        let captured = || capture(&["--run", &name, "--set", "camera.wait_s=60"], &out);
        std::thread::scope(|scope| scope.spawn(captured).join().unwrap())
    });
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert!(
        ended.stdout.contains("taught by the 5 labelled examples sim_320x240"),
        "{}",
        ended.stdout
    );
    assert_eq!(read_image(&out.join("capture_1.png")).unwrap(), image);
    assert!(read_image(&out.join("capture_1.marked.png")).is_ok());
    are_as_labelled(&out.join("capture_1.json"), 0.0);
    let state = fs::read_to_string(out.join("capture_1.pddl")).unwrap();
    for fact in [
        "(on blue_block red_block)",
        "(on green_block blue_block)",
        "(on purple_block yellow_block)",
    ] {
        assert!(state.contains(&format!("\n    {fact}")), "{state}");
    }
    assert_eq!(state.matches("(on ").count(), 3, "{state}");
    let ended = check(&out);
    assert_eq!(ended.status.code(), Some(0), "{}{}", ended.stdout, ended.stderr);

    // What is not decided is missing, and no run takes it for false.
    let open = state.replacen("    (on blue_block", "    ;? (on blue_block", 1);
    fs::write(out.join("capture_1.pddl"), open).unwrap();
    let ended = check(&out);
    assert_eq!(ended.status.code(), Some(6), "{}{}", ended.stdout, ended.stderr);
    let said =
        "of the state: (on blue_block red_block) is undecided: where it holds take \";?\" away";
    assert!(ended.stdout.contains(said), "{}", ended.stdout);
    let exemplar = format!("perception.exemplar.folder={}", out.display());
    let ended = Process::start(&["run", "blocksworld", "--set", &exemplar]).end();
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("undecided: (on blue_block red_block)"), "{}", ended.stderr);
}

/// A photograph of another shape than any labelled example, and one more beside it.
#[test]
fn a_photograph_of_another_shape_is_labelled() {
    let folder = TempDir::new().unwrap();
    let image = read_image(&project(&format!("{EXAMPLE}.png"))).unwrap();
    let left = 40;
    let square = image::imageops::crop_imm(&image, left, 0, 240, 240).to_image();
    let path = folder.path().join("photo.png");
    square.save(&path).unwrap();
    let out = folder.path().join("mine");
    let ended = capture(&["--image", path.to_str().unwrap(), "--name", "square"], &out);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert!(ended.stdout.contains("cut or continued from 320x240 to 240x240"), "{}", ended.stdout);
    are_as_labelled(&out.join("square.json"), f64::from(left));
    // Nothing that a person may have worked on is written over.
    let again = capture(&["--image", path.to_str().unwrap(), "--name", "square"], &out);
    assert_eq!(again.status.code(), Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("has an example square already"), "{}", again.stderr);
}

/// Photographs of real blocks, proposed from simulated examples alone: all boxes, and no wrong fact.
#[test]
fn photographs_are_labelled_from_simulated_examples() {
    let Some(data) = data("prodgv", "photographs") else { return };
    let folder = TempDir::new().unwrap();
    let part = |kind: &str, number: u32, ending: &str| {
        data.join(format!("data/blocksworld/{kind}/problem{number}.{ending}"))
    };
    let on = |text: &str| -> BTreeSet<String> {
        let lines = text.lines().map(|line| line.trim().trim_end_matches(')'));
        lines.filter(|line| line.starts_with("(on ")).map(str::to_owned).collect()
    };
    for number in [2, 5] {
        let (image, name) = (part("observations", number, "jpg"), format!("p{number}"));
        let ended = capture(&["--image", image.to_str().unwrap(), "--name", &name], folder.path());
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        let proposed = boxes(&folder.path().join(format!("{name}.json")));
        let labelled = boxes(&part("annotated_bboxes", number, "json"));
        let names = |value: &Value| -> BTreeSet<String> {
            value.as_object().unwrap().keys().cloned().collect()
        };
        assert_eq!(names(&proposed), names(&labelled), "{number}");
        let state = fs::read_to_string(folder.path().join(format!("{name}.pddl"))).unwrap();
        let labelled = fs::read_to_string(part("problems", number, "pddl")).unwrap();
        let (init, _goal) = labelled.split_once("(:goal").unwrap();
        assert_eq!(on(&state), on(init), "{number}");
    }
}

/// Where nothing can teach a detector, there is an empty list, and a word of what to do.
#[test]
fn without_any_example_the_list_is_empty_and_says_why() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("mine");
    let image = project(&format!("{EXAMPLE}.png"));
    let args = ["--image", image.to_str().unwrap(), "--set", "domain=cooking"];
    let ended = capture(&args, &out);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert!(ended.stdout.contains("no labelled example yet"), "{}", ended.stdout);
    assert_eq!(boxes(&out.join("capture_1.json")), serde_json::json!({}));
    let state = fs::read_to_string(out.join("capture_1.pddl")).unwrap();
    assert!(state.contains("; No object was found: write each object into the boxes"), "{state}");
    let ended = check(&out);
    assert_eq!(ended.status.code(), Some(2), "{}{}", ended.stdout, ended.stderr);
    assert!(ended.stderr.contains("no object is labelled yet"), "{}", ended.stderr);
}

#[test]
fn a_camera_that_is_not_there_is_told() {
    let folder = TempDir::new().unwrap();
    let name = unique_run("capture-nobody");
    let ended = capture(&["--run", &name, "--set", "camera.wait_s=0.2"], folder.path());
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    let said = format!("nobody writes camera/main/rgb of run \"{name}\"");
    assert!(ended.stderr.contains(&said), "{}", ended.stderr);
}
