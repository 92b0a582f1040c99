//! Task success over the rate of faults, from the command line.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod common;

use std::fs;

use assert_cmd::cargo::cargo_bin_cmd;
use common::{SMALL_CAMERA, one_object, project, schema};
use serde_json::{Value, json};

/// What `eval faults` says of three blocks seen by a small camera; the code, and standard output.
fn eval(args: &[&str]) -> (Option<i32>, String) {
    let small = SMALL_CAMERA.iter().chain(&[
        "sim.scene=scenes/three_blocks.toml",
        "goal.text=Put red on blue and blue on green.",
    ]);
    let sets = small.flat_map(|set| ["--set", set]);
    let output = cargo_bin_cmd!("groundloop")
        .current_dir(project(""))
        .args(["eval", "faults"])
        .args(args)
        .args(if args.contains(&"--from") { Vec::new() } else { sets.collect() })
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

/// At rate 0 both loops reach the goal; at 1 the last block is dropped, and the open loop knows nothing of it.
#[test]
fn both_loops_are_measured_at_each_rate_on_the_same_seeds() {
    let folder = tempfile::TempDir::new().unwrap();
    let run = folder.path().join("dropped.toml");
    let during = "during = '(stack red_block blue_block arm)'";
    let fault = format!("[[fault]]\n{during}\naction = {{ kind = 'drop' }}\n");
    fs::write(&run, format!("extends = 'blocksworld'\n{fault}")).unwrap();
    let run = run.to_str().unwrap();
    let args = [run, "--rates", "0,1", "--episodes", "2", "--seed", "3", "--json"];
    let (code, text) = eval(&args);
    assert_eq!(code, Some(0), "{text}");
    let report = one_object(&text);
    schema::obeys("eval-faults", &report);
    assert_eq!(report["seeds"], json!([3, 4]));
    let rows = report["rows"].as_array().unwrap();
    let told = |row: &Value| {
        let keys = ["executive", "fault_rate", "episodes", "successes", "faults"];
        keys.map(|key| row[key].to_string().replace('"', "")).join(" ")
    };
    let told: Vec<String> = rows.iter().map(told).collect();
    let expected = [
        "closed_loop 0.0 2 2 0",
        "closed_loop 1.0 2 2 2",
        "open_loop 0.0 2 2 0",
        "open_loop 1.0 2 0 2",
    ];
    assert_eq!(told, expected);
    assert_eq!(rows[3]["failed_seeds"], json!([3, 4]));

    let (saved, plot) = (folder.path().join("saved.json"), folder.path().join("plot.svg"));
    fs::write(&saved, &text).unwrap();
    let [saved, plot] = [&saved, &plot].map(|path| path.to_str().unwrap());
    let (code, table) = eval(&["--from", saved, "--plot", plot]);
    assert_eq!(code, Some(0));
    assert!(table.contains("| open   |    1 |     0/2 |"), "{table}");
    assert!(fs::read_to_string(plot).unwrap().contains("2 episodes a point (seeds 3 to 4)"));
}
