//! `groundloop dataset generate`: the same seed gives the same bytes, factors are obeyed, and the evaluation of
//! the paper's data set reads what is written.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{eval, project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::plan_text;
use groundloop::planning::Outcome;
use serde_json::{Value, json};
use tempfile::TempDir;

const SMALL: [&str; 4] = ["--set", "sim.camera.width=160", "--set", "sim.camera.height=120"];

/// Exit code, standard output and standard error of the verb.
fn call(out: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = cargo_bin_cmd!("groundloop");
    command.current_dir(project("")).args(["dataset", "generate"]).args(args);
    let output = command.arg("--out").arg(out).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[track_caller]
fn generated(out: &Path, args: &[&str]) -> Value {
    let (code, said, errors) = call(out, &[args, &SMALL, &["--json"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    let report = serde_json::from_str(&said).unwrap();
    schema::obeys("dataset-generate", &report);
    report
}

/// Every file below a folder.
fn bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        for entry in fs::read_dir(path).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().display().to_string();
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

fn index(out: &Path, domain: &str) -> Vec<Value> {
    let text = fs::read_to_string(out.join("data").join(domain).join("index.jsonl")).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_bytes_with_any_number_of_threads() {
    let root = TempDir::new().unwrap();
    let made = |name: &str, seed: &str, threads: &str| {
        let out = root.path().join(name);
        let factors = ["--vary", "objects=2..8", "--vary", "light.intensity=0.7..1.4"];
        let args = ["blocksworld", "--scenes", "7", "--seed", seed, "--threads", threads];
        let report = generated(&out, &[&args[..], &factors].concat());
        assert_eq!((&report["scenes"], &report["domain"]), (&json!(7), &json!("blocksworld")));
        bytes(&out)
    };
    let one = made("one", "5", "1");
    assert_eq!(one.len(), 7 * 7 + 2, "{:?}", one.keys());
    assert!(one == made("three", "5", "3"), "threads change something");
    let other = made("other", "6", "2");
    let photograph = "data/blocksworld/observations/problem1.jpg";
    assert_ne!(one[photograph], other[photograph]);
}

/// With its own boxes and its own goals or words, every pair is carried out, and every goal is understood.
#[test]
fn the_evaluation_reads_a_data_set_as_it_is() {
    let root = TempDir::new().unwrap();
    for (domain, objects) in [("blocksworld", "objects=2..4"), ("hanoi", "objects=2..3")] {
        let report = generated(root.path(), &[domain, "--scenes", "5", "--vary", objects]);
        assert_eq!(report["without_instruction"], 0, "{report}");
        let folder = root.path().join("data").join(domain);
        let read = |path: &str| fs::read_to_string(folder.join(path)).unwrap();
        for n in 1..=5 {
            let problem = read(&format!("problems/problem{n}.pddl"));
            let answer = plan_text(&read("domain.pddl"), &problem).unwrap();
            let Outcome::Solved(plan) = answer.outcome else { panic!("no plan: {problem}") };
            assert!(!plan.steps.is_empty(), "the goal holds already: {problem}");
        }
    }
    for goals in ["truth", "lexicon"] {
        let report = eval::report(
            root.path(),
            &["--detections", "annotated", "--goals", goals, "--details"],
        );
        for domain in ["blocksworld", "hanoi"] {
            let measured = &report["domains"][domain];
            assert_eq!(measured["left_out"], json!([]), "{domain}");
            let failures = measured["failures"].as_array().unwrap();
            let by_goal = failures.iter().find(|failure| failure["stage"] == "goal");
            assert_eq!(by_goal, None, "{domain}, {goals}");
            let stage = |failure: &Value| failure["stage"] == "detection";
            assert!(!failures.iter().any(stage), "{domain}: its boxes are its detections");
        }
    }
}

/// What the index says of a scene is so: how many objects, from where, and what its depth and masks show.
#[test]
fn factors_are_obeyed_and_depth_lies_where_the_camera_says() {
    let root = TempDir::new().unwrap();
    let factors = ["objects=3..5", "view.elevation_deg=20.0..50.0", "view.azimuth_deg=-30,30"];
    let factors: Vec<&str> = factors.iter().flat_map(|factor| ["--vary", *factor]).collect();
    let stacks = ["--vary", "scene.arrangement.stack_height_max=1"];
    generated(root.path(), &[&["blocksworld", "--scenes", "6"], &factors[..], &stacks].concat());
    let folder = root.path().join("data/blocksworld");
    let lines = index(root.path(), "blocksworld");
    assert_eq!(lines.len(), 6);
    for (line, n) in lines.iter().zip(1..) {
        assert_eq!(line["problem"], n);
        let boxes = read_json(&folder.join(format!("annotated_bboxes/problem{n}.json")));
        assert_eq!(boxes.as_object().unwrap().len() as u64, line["factors"]["objects"]);
        let problem = fs::read_to_string(folder.join(format!("problems/problem{n}.pddl"))).unwrap();
        let (_, facts) = problem.split_once(":init").unwrap();
        let (facts, _) = facts.split_once(":goal").unwrap();
        assert!(!facts.contains("(on ") && facts.contains("(handempty arm)"), "{problem}");
        let camera = read_json(&folder.join(format!("cameras/problem{n}.json")));
        let pose = |row: usize, col: usize| camera["world_from_camera"][row][col].as_f64().unwrap();
        let down = -pose(2, 2).asin().to_degrees();
        let wanted = line["factors"]["view.elevation_deg"].as_f64().unwrap();
        assert!((down - wanted).abs() < 1e-6, "{down}, {wanted}");
        let side = -pose(0, 2).atan2(pose(1, 2)).to_degrees();
        let wanted = line["factors"]["view.azimuth_deg"].as_f64().unwrap();
        assert!((side - wanted).abs() < 1e-6, "{side}, {wanted}");
        let depth =
            image::open(folder.join(format!("depth/problem{n}.png"))).unwrap().into_luma16();
        let masks = read_json(&folder.join(format!("masks/problem{n}.json")));
        for (name, runs) in masks.as_object().unwrap() {
            let number = |run: &Value, at: usize| run[at].as_u64().unwrap();
            let run = &runs[runs.as_array().unwrap().len() / 2];
            let (y, x) = (number(run, 0), u64::midpoint(number(run, 1), number(run, 2)));
            let z = f64::from(depth.get_pixel(x as u32, y as u32).0[0]) * 1e-3;
            let k = |key: &str| camera[key].as_f64().unwrap();
            let point = [(x as f64 - k("cx")) / k("fx") * z, (y as f64 - k("cy")) / k("fy") * z, z];
            let world = |row| (0..3).map(|i| pose(row, i) * point[i]).sum::<f64>() + pose(row, 3);
            assert!((-0.01..0.07).contains(&world(2)), "{name} of {n} is {} m high", world(2));
            assert!(world(0).abs() < 0.3 && world(1).abs() < 0.2, "{name} of {n} is on the table");
            let share = line["visible_shares"][name].as_f64().unwrap();
            assert!((0.05..=1.0).contains(&share), "{name} of {n}: {share}");
        }
    }
}

#[test]
fn what_cannot_be_made_is_told_before_anything_is_written() {
    let root = TempDir::new().unwrap();
    for (args, expect) in [
        (vec!["blocksworld", "--vary", "objects=2..9"], "expected 1 to 8, the bodies of scenes/"),
        (vec!["blocksworld", "--vary", "object=2"], "did you mean \"objects\"?"),
        (vec!["blocksworld", "--vary", "objects=2", "--vary", "objects=3"], "each factor once"),
        (
            vec!["blocksworld", "--vary", "light.intensity=0.5..9.0"],
            "light.intensity from 0.2 to 3",
        ),
        (vec!["blocksworld", "--vary", "sim.camera.widht=320"], "did you mean width?"),
        (vec!["blocksworld", "--vary", "scene.arangement.kind=tower"], "did you mean arrangement?"),
        (vec!["configs/photo_hanoi.toml"], "camera.kind: expected \"sim\""),
        (vec!["cooking"], "cooking: no shipped run file has a simulated camera"),
    ] {
        let (code, _, said) = call(root.path(), &args);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(expect), "{args:?}: {said}");
        assert!(!root.path().join("data").exists(), "{args:?} left something");
    }
    let (code, _, said) = call(root.path(), &["configs/hanoi.toml", "--scenes", "1"]);
    assert!(code == Some(2) && said.contains("a random arrangement, or more objects"), "{said}");
    assert!(!root.path().join("data/hanoi").exists(), "a part of a data set is left");
    generated(root.path(), &["hanoi", "--scenes", "1"]);
    let (code, _, said) = call(root.path(), &["hanoi", "--scenes", "1"]);
    assert!(code == Some(2) && said.contains("data/hanoi: it is there already"), "{said}");
}
