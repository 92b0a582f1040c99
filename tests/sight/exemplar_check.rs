//! `groundloop exemplar check`, and what runs and `ground` say of examples that are not as labelled.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{SMALL_CAMERA, files_below, project, schema};
use assert_cmd::Command;
use serde_json::{Value, json};
use tempfile::TempDir;

/// The program with arguments: exit code, standard output, standard error.
fn call(args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::cargo_bin("groundloop").unwrap();
    let output = command.current_dir(project("")).args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The report of a check; its exit code must say the same.
#[track_caller]
fn report(args: &[&str]) -> Value {
    let args = [&["exemplar", "check"], args, &["--json"]].concat();
    let (code, stdout, stderr) = call(&args);
    assert_eq!(stderr, "");
    let report: Value = serde_json::from_str(&stdout).unwrap();
    schema::obeys("exemplar-check", &report);
    assert_eq!(code, Some(if report["right"] == true { 0 } else { 6 }), "{report:#}");
    report
}

/// A copy of the blocksworld folder in which one label of the small camera's examples is wrong.
struct WrongDomain(TempDir);

/// Which example, and what is wrong: its yellow block is labelled far to the right.
const EXAMPLE: &str = "exemplar/sim_320x240/a_tower_and_singles";
const SHIFT: f64 = 10.0;

impl WrongDomain {
    fn new() -> Self {
        let copy = Self(TempDir::new().unwrap());
        let from = project("domains/blocksworld");
        for ending in ["pddl", "toml", "json", "png"] {
            for file in files_below(&from, ending) {
                let to = copy.0.path().join(file.strip_prefix(&from).unwrap());
                fs::create_dir_all(to.parent().unwrap()).unwrap();
                fs::copy(file, to).unwrap();
            }
        }
        let file = copy.file("json");
        let mut boxes: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        for edge in [0, 2] {
            let x = boxes["yellow_block"][edge].as_f64().unwrap();
            boxes["yellow_block"][edge] = json!(x + SHIFT);
        }
        fs::write(file, boxes.to_string()).unwrap();
        copy
    }

    fn folder(&self) -> &Path {
        self.0.path()
    }

    fn file(&self, ending: &str) -> PathBuf {
        self.folder().join(format!("{EXAMPLE}.{ending}"))
    }

    /// The flags of loose files.
    fn loose(&self) -> Vec<String> {
        let mut flags = vec!["--domain".to_owned(), "blocksworld".to_owned()];
        for (flag, ending) in [("image", "png"), ("boxes", "json"), ("state", "pddl")] {
            flags.push(format!("--exemplar-{flag}"));
            flags.push(self.file(ending).display().to_string());
        }
        flags
    }
}

const DISAGREES: &str =
    "a_tower_and_singles.json: yellow_block: the label disagrees with the picture";

#[test]
fn every_camera_of_a_shipped_run_file_has_examples_that_are_right() {
    let cameras = |config: &str| {
        let report = report(&[config]);
        assert_eq!(report["right"], true, "{report:#}");
        let cameras = report["cameras"].as_array().unwrap().iter();
        cameras.map(|c| (c["camera"].clone(), c["objects"].clone())).collect::<Vec<_>>()
    };
    assert_eq!(cameras("hanoi"), [(json!("main"), json!(48))]);
    let both = [(json!("main"), json!(24)), (json!("back"), json!(8))];
    assert_eq!(cameras("blocksworld_two_views"), both);
    let without = report(&["blocksworld_two_views", "--set", "cameras.back.kind=none"]);
    assert_eq!(without["cameras"].as_array().unwrap().len(), 1);
}

#[test]
fn a_wrong_label_is_told_in_a_run_file_and_in_loose_files() {
    let wrong = WrongDomain::new();
    let domain = format!("domain={}", wrong.folder().display());
    let sets = ["--set", &domain, "--set", SMALL_CAMERA[2]];
    let of_run = report(&[&["blocksworld"][..], &sets].concat());
    // Nothing else is told, not even of a block behind two others.
    let findings = of_run["cameras"][0]["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 1, "{of_run:#}");
    assert_eq!(
        (&findings[0]["kind"], &findings[0]["object"]),
        (&json!("other_box"), &json!("yellow_block"))
    );
    let edge = |key: &str| findings[0][key][0].as_f64().unwrap();
    assert!((edge("labelled_box") - edge("found_box") - SHIFT).abs() < 3.0, "{of_run:#}");

    let flags = wrong.loose();
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let of_files = report(&flags);
    assert_eq!(of_files["cameras"][0]["findings"][0]["kind"], "other_box");
    let (code, stdout, _) = call(&[&["exemplar", "check"][..], &flags].concat());
    assert_eq!(code, Some(6));
    assert!(stdout.starts_with("camera main: 1 labelled example, 8 objects: "), "{stdout}");
    assert!(stdout.contains(DISAGREES), "{stdout}");
}

#[test]
fn runs_and_ground_warn_and_go_on() {
    let wrong = WrongDomain::new();
    let image = wrong.file("png").display().to_string();
    let flags = wrong.loose();
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let (code, _, stderr) = call(&[&["ground", "--image", &image][..], &flags].concat());
    assert_eq!((code, stderr.matches(DISAGREES).count()), (Some(0), 1), "{stderr}");

    let domain = format!("domain={}", wrong.folder().display());
    let run = |domain: &str| {
        let sets = [&[domain, "limits.cycles_max=2"], &SMALL_CAMERA[..]].concat();
        let name = format!("exemplar-check-{}", std::process::id());
        let mut args = vec!["run", "blocksworld", "--json", "--episodes", "2", "--run", &name];
        args.extend(sets.iter().flat_map(|set| ["--set", *set]));
        let (code, _, stderr) = call(&args);
        assert_eq!(code, Some(4), "{stderr}");
        stderr
    };
    let stderr = run(&domain);
    assert_eq!(stderr.matches(DISAGREES).count(), 1, "once, whatever the episodes: {stderr}");
    let stderr = run("domain=blocksworld");
    assert!(!stderr.contains("WARN"), "{stderr}");
}

/// What cannot be told from outside is not tried: boxes from a file are those of another picture.
#[test]
fn boxes_from_a_file_are_not_compared_with_the_example() {
    let folder = TempDir::new().unwrap();
    let [boxes, options] = ["boxes.json", "options.toml"].map(|name| folder.path().join(name));
    fs::write(&boxes, r#"{"red_block": [1, 2, 30, 40]}"#).unwrap();
    fs::write(&options, format!("boxes = {:?}", boxes.display().to_string())).unwrap();
    let example = |ending: &str| project(&format!("domains/blocksworld/{EXAMPLE}.{ending}"));
    let [image, labels, state] = ["png", "json", "pddl"].map(|e| example(e).display().to_string());
    let options = options.display().to_string();
    let args = [
        ["--domain", "blocksworld"],
        ["--exemplar-image", &image],
        ["--exemplar-boxes", &labels],
        ["--exemplar-state", &state],
        ["--detector", "annotated"],
        ["--detector-options", &options],
    ];
    assert_eq!(report(&args.concat())["right"], true);
}

#[test]
fn what_is_checked_must_be_said() {
    for (args, expect) in [
        (&[][..], "CONFIG"),
        (&["blocksworld", "--domain", "blocksworld"], "cannot be used with"),
        (&["--domain", "blocksworld"], "--exemplar-image"),
        (&["blocksworld", "--detector", "colour"], "cannot be used with"),
        (&["no_such_file"], "no_such_file"),
    ] {
        let (code, _, stderr) = call(&[&["exemplar", "check"], args].concat());
        assert_eq!(code, Some(2), "{args:?}: {stderr}");
        assert!(stderr.contains(expect), "{args:?}: {stderr}");
    }
}
