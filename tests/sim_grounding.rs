//! `groundloop eval sim-grounding`: the measurement repeats itself, and shows what it is for.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test file")]

mod common;

use common::{Process, project, schema};
use groundloop::eval::sim_grounding::{Row, Source, Used, measure};
use groundloop::run::load_run;

fn rows(config: &str, seeds: u64) -> Vec<Row> {
    let sets = ["sim.camera.width=320", "sim.camera.height=240"].map(str::to_owned);
    let run = load_run(&project(config), &sets).unwrap_or_else(|e| panic!("{e}"));
    let folder = run.domain_folder().unwrap();
    let mut n_seen = 0;
    let rows = measure(&run, &folder, seeds, &mut |_, _, _| n_seen += 1).unwrap();
    assert_eq!(n_seen, 3 * seeds, "one scene for each camera and seed");
    rows
}

#[track_caller]
fn exact(rows: &[Row], camera: &str, used: Used) -> u64 {
    let is_row = |r: &&Row| (r.camera, r.objects, r.features) == (camera, Source::Labelled, used);
    rows.iter().find(is_row).unwrap().n_exact
}

/// Seen from obliquely above, boxes of the image do not tell behind from above.
#[test]
fn volumes_tell_what_boxes_do_not() {
    for config in ["configs/blocksworld.toml", "configs/hanoi.toml"] {
        let measured = rows(config, 6);
        assert_eq!(measured.len(), 18);
        let (boxes, volumes) =
            (exact(&measured, "oblique", Used::Boxes), exact(&measured, "oblique", Used::Volumes));
        assert!(boxes < volumes && volumes >= 5, "{config}: {boxes}, {volumes} of 6");
        assert_eq!(measured, rows(config, 6), "the same seeds give the same figures");
    }
}

#[test]
fn the_verb_prints_a_table_or_json() {
    let args = ["eval", "sim-grounding", "configs/hanoi.toml", "--seeds", "1"];
    let table = Process::start(&args).end();
    assert!(table.status.success() && table.stdout.contains("| 3-D volumes |"), "{}", table.stderr);
    let json = Process::start(&[&args[..], &["--json"]].concat()).end().json();
    schema::obeys("eval-sim-grounding", &json);
    assert_eq!(json["seeds"], serde_json::json!([1, 1]));
    let row = &json["rows"][0];
    assert_eq!((&row["domain"], &row["camera"]), (&"hanoi".into(), &"usual".into()));
    assert!(row["precision"].is_f64() && row["n_exact"].is_u64(), "{row}");
}
