//! Run files and folders that are right, and the messages of those that are not.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::*;
use crate::files::{FileRef, Folder};
use crate::parts::PartChoice;
use crate::perception::detectors::DETECTORS;

const BLOCKS: &str = include_str!("../../configs/blocksworld.toml");

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn blocks_folder() -> DomainFolder {
    DomainFolder::read(&root().join("domains/blocksworld")).unwrap()
}

/// Loads a text as `run.toml`, with settings over it.
fn load(text: &str, sets: &[&str]) -> Result<RunConfig, ConfigError> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("run.toml");
    fs::write(&path, text).unwrap();
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    load_run(&path, &sets)
}

#[test]
fn every_shipped_run_file_loads_with_all_that_it_names() {
    let mut n_files = 0;
    for entry in fs::read_dir(root().join("configs")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() || name.starts_with("stress") || name == "defaults.toml" {
            continue; // of another form
        }
        let run = load_run(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
        let folder = run.domain_folder().unwrap_or_else(|e| panic!("{e}"));
        let perception = &run.perception;
        if perception.exemplar.folder.is_some() {
            let examples = perception.exemplar.read(&folder, None);
            let examples = examples.unwrap_or_else(|e| panic!("{e}"));
            assert!(folder.detector(&run.detector_choice(), &examples).is_ok());
            assert!(folder.grounder(&run.grounder_choice(), &examples).is_ok());
        }
        assert!(run.robot.kind == "none" || folder.skills.is_some(), "{path:?}");
        n_files += 1;
    }
    assert!(n_files > 3);
}

#[test]
fn settings_override_keys_in_order() {
    let sets = [
        "seed=7",
        "camera.rate_hz=30",
        "camera.rate_hz = 25.5",
        "perception.exemplar.folder=other",
        "goal.text=Put red onto blue, please.",
        "limits.observing_s_max=3",
        "sim.camera.noise.rgb_sigma=0.0",
        "run=mine",
    ];
    let run = load(BLOCKS, &sets).unwrap();
    assert_eq!((run.seed, run.camera.rate_hz, run.limits.observing_s_max), (7, 25.5, 3.0));
    assert_eq!(run.perception.exemplar.folder.as_deref(), Some("other"), "no TOML: a string");
    assert_eq!(run.goal.text, "Put red onto blue, please.");
    assert_eq!((run.run.as_deref(), run.run_name().as_str()), (Some("mine"), "mine"));
    let noise = run.sim.as_ref().unwrap()["camera"]["noise"]["rgb_sigma"].as_float();
    assert_eq!(noise, Some(0.0));
    let plain = load(BLOCKS, &[]).unwrap();
    assert_eq!(plain.goal.kind, run.goal.kind, "everything else is as written");
    assert_eq!((plain.robot, plain.planner), (run.robot, run.planner));
}

#[track_caller]
fn check_examples(exemplar: &ExemplarConfig, data: Option<&Path>, expect: &[&str]) {
    let message = exemplar.read(&blocks_folder(), data).map(drop).unwrap_err().to_string();
    for part in expect {
        assert!(message.contains(part), "{part:?} is not in {message}");
    }
}

#[test]
fn labelled_examples_that_are_missing_are_named() {
    let none =
        ExemplarConfig { folder: None, image: None, boxes: None, state: None, number: Some(3) };
    let folder = |name: &str| ExemplarConfig { folder: Some(name.to_owned()), ..none.clone() };
    check_examples(&folder("no_such_camera"), None, &["exemplar/no_such_camera: "]);
    check_examples(&none, None, &["perception.exemplar: expected either folder, or image"]);
    let file = |end: &str| Some(format!("$data/problem{{n}}.{end}"));
    let (image, boxes, state) = (file("jpg"), file("json"), file("pddl"));
    let single = ExemplarConfig { image, boxes, state, ..none.clone() };
    check_examples(&single, None, &["perception.exemplar: expected --data DIR", "got none"]);
    check_examples(&single, Some(Path::new("photos")), &["photos/problem3.jpg: "]);
    let both = ExemplarConfig { folder: Some("sim_640x480".to_owned()), ..single };
    check_examples(&both, None, &["expected either folder, or image, boxes and state"]);

    let temporary = TempDir::new().unwrap();
    let here = folder(temporary.path().to_str().unwrap());
    check_examples(&here, None, &["no labelled example (*.json) in this folder"]);
    fs::write(temporary.path().join("a.json"), "{}").unwrap();
    check_examples(&here, None, &["a.json: its image is missing"]);
    fs::write(temporary.path().join("a.png"), "no picture").unwrap();
    check_examples(&here, None, &["a.png: "]);
}

/// Each fault of a labelled example is told with its file and what in it is wrong.
#[test]
fn labelled_examples_that_are_wrong_are_named_with_the_field() {
    let image = root().join("domains/blocksworld/exemplar/sim_320x240/d_touching.png");
    let image = fs::read(image).unwrap();
    let state = |objects: &str| {
        format!(
            "(define (problem p) (:domain blocksworld) (:objects {objects}) (:init) (:goal (and)))"
        )
    };
    let (good_state, good_boxes) = (state("a - block"), r#"{"a": [1, 2, 30, 40]}"#);
    let cases: [(&[u8], &str, &str, &[&str]); 10] = [
        (b"", good_boxes, &good_state, &["x.png: "]),
        (&image[..image.len() / 2], good_boxes, &good_state, &["x.png: "]),
        (b"GIF89a", good_boxes, &good_state, &["x.png: "]),
        (&image, "", &good_state, &["x.json: EOF"]),
        (&image, r#"{"a": [5, 2, 5, 40]}"#, &good_state, &["x.json: a: expected finite x1 < x2"]),
        (&image, r#"{"a": [1, 2, "NaN", 40]}"#, &good_state, &["x.json: a: expected four numbers"]),
        (&image, r#"{"a": [1, 2, 321, 40]}"#, &good_state, &["x.json: a: expected a box inside"]),
        (
            &image,
            r#"{"a": [1, 2, 3, 4], "A": [1, 2, 3, 4]}"#,
            &good_state,
            &["x.json: a: expected one"],
        ),
        (&image, good_boxes, &state("a - cupboard"), &["x.pddl", "cupboard"]),
        (&image, good_boxes, &state("a - block a - robot"), &["x.pddl", "declared twice"]),
    ];
    for (image, boxes, state, expect) in cases {
        let temporary = TempDir::new().unwrap();
        let file = |ending: &str, content: &[u8]| {
            fs::write(temporary.path().join(format!("x.{ending}")), content).unwrap();
        };
        file("png", image);
        file("json", boxes.as_bytes());
        file("pddl", state.as_bytes());
        let folder = temporary.path().to_str().map(str::to_owned);
        let (image, boxes, state, number) = (None, None, None, None);
        check_examples(&ExemplarConfig { folder, image, boxes, state, number }, None, expect);
    }
}

#[test]
fn parts_that_there_are_not_are_told_with_those_that_there_are() {
    let magic = |key: &str| PartChoice::new(key, "magic");
    let detector = blocks_folder().detector(&magic("perception.detector"), &[]).err().unwrap();
    let known = DETECTORS.names().collect::<Vec<_>>().join(" or ");
    let expect = format!("perception.detector: expected {known}, got magic");
    assert_eq!(detector.to_string(), expect);
    let grounder = blocks_folder().grounder(&magic("perception.grounder"), &[]).err().unwrap();
    let grounder = grounder.to_string();
    assert!(grounder.starts_with("perception.grounder: expected s2s"), "{grounder}");
}

#[test]
fn a_domain_is_found_by_name_or_path_and_missed_by_name() {
    let beside = Folder::Disk(root().join("configs"));
    let by_name = DomainFolder::find("hanoi", &beside).unwrap();
    let path = root().join("domains/hanoi");
    let elsewhere = Folder::Disk("elsewhere".into());
    let by_path = DomainFolder::find(path.to_str().unwrap(), &elsewhere).unwrap();
    let embedded = DomainFolder::read_files(&Folder::Embedded("domains/hanoi".to_owned())).unwrap();
    assert_eq!((&by_name.domain, by_name.hash), (&by_path.domain, by_path.hash));
    assert_eq!((&by_name.domain, by_name.hash), (&embedded.domain, embedded.hash));
    let missed = DomainFolder::find("kitchen", &beside).unwrap_err().to_string();
    assert!(missed.starts_with("domain: expected a folder with a domain.pddl"), "{missed}");
    assert!(missed.contains("(blocksworld, cooking, hanoi, sorting)"), "{missed}");
    assert!(missed.ends_with("got kitchen"), "{missed}");
    let near = DomainFolder::find("blockworld", &beside).unwrap_err().to_string();
    assert!(near.ends_with("got blockworld; did you mean \"blocksworld\"?"), "{near}");
    let given = DomainFolder::given(Path::new("hanoi")).unwrap();
    assert_eq!((&given.domain, given.hash), (&by_name.domain, by_name.hash));
    let missed = DomainFolder::given(Path::new("elsewhere/hanoy")).unwrap_err().to_string();
    assert!(missed.starts_with("--domain: expected a folder with a domain.pddl"), "{missed}");
}

/// Copies the domain's own files, without its folders.
fn copied(name: &str) -> TempDir {
    let to = TempDir::new().unwrap();
    for entry in fs::read_dir(root().join("domains").join(name)).unwrap() {
        let from = entry.unwrap().path();
        if from.is_file() {
            fs::copy(&from, to.path().join(from.file_name().unwrap())).unwrap();
        }
    }
    to
}

#[test]
fn a_domain_needs_its_perception_and_may_lack_skills_and_language() {
    let folder = copied("blocksworld");
    for file in ["skills.toml", "language.toml", "completion.pddl"] {
        fs::remove_file(folder.path().join(file)).unwrap();
    }
    let read = DomainFolder::read(folder.path()).unwrap();
    assert!(read.skills.is_none() && read.language.is_none() && read.rules.is_empty());
    fs::remove_file(folder.path().join("perception.toml")).unwrap();
    let message = DomainFolder::read(folder.path()).unwrap_err().to_string();
    assert!(message.contains("perception.toml: the domain folder needs this file"), "{message}");
}

#[test]
fn the_hash_tells_domains_apart_that_differ_in_any_file() {
    let shipped = blocks_folder().hash;
    for file in
        ["domain.pddl", "completion.pddl", "perception.toml", "language.toml", "skills.toml"]
    {
        let folder = copied("blocksworld");
        assert_eq!(DomainFolder::read(folder.path()).unwrap().hash, shipped);
        let path = folder.path().join(file);
        let comment = if file.ends_with("pddl") { "; " } else { "# " };
        fs::write(&path, format!("{comment}\n{}", fs::read_to_string(&path).unwrap())).unwrap();
        assert_ne!(DomainFolder::read(folder.path()).unwrap().hash, shipped, "{file}");
    }
}

#[test]
fn a_run_is_named_after_its_file_unless_it_says_otherwise() {
    let origin = root().join("configs/photo_blocksworld.toml");
    let mut run = load_run(&origin, &[]).unwrap();
    assert_eq!(run.run_name(), "photo_blocksworld");
    run.run = None;
    run.origin = FileRef::disk(Path::new("here/other.toml"));
    assert_eq!(run.run_name(), "other");
    let simulated = load(BLOCKS, &[]).unwrap().run_name();
    assert!(
        simulated.starts_with("run-"),
        "{simulated}: with the process, so that runs do not meet"
    );
}
