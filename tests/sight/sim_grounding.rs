//! `groundloop eval sim-grounding`: the measurement repeats itself, and shows what it is for.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test file")]

use crate::common::{Process, project, schema};
use groundloop::dataset::SceneSource;
use groundloop::eval::grounding_factors::{FactorRow, GroundingFactor, measure_factors};
use groundloop::eval::sim_grounding::{Row, Source, Used, measure};
use groundloop::run::{Layered, load_run};
use groundloop::settings::Form;

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

fn factors(config: &str, factors: &[GroundingFactor], seeds: u64) -> Vec<FactorRow> {
    let sets =
        ["sim.camera.width=320", "sim.camera.height=240", "sim.scene=scenes/evaluation.toml"];
    let sets = sets.map(str::to_owned);
    let layered = Layered::read(&project(config), &sets, Form::Run).unwrap();
    let source = SceneSource::new(layered).unwrap();
    measure_factors(&source, factors, seeds, &|| {}).unwrap()
}

/// Each level is measured on every scene, levels of occlusion share them, and little is wrong with what is easy.
#[test]
fn every_level_of_a_factor_is_measured() {
    use GroundingFactor::{Exemplars, Noise, Objects, Occlusion};
    let measured = factors("configs/hanoi.toml", &[Objects, Occlusion, Exemplars], 4);
    let of = |factor, used| -> Vec<&FactorRow> {
        let is_row = |r: &&FactorRow| {
            r.factor == factor && r.row.features == used && r.row.objects == Source::Labelled
        };
        measured.iter().filter(is_row).collect()
    };
    let levels = |factor| -> Vec<&str> {
        of(factor, Used::Boxes).iter().map(|row| row.level.as_str()).collect()
    };
    assert_eq!(levels(Objects), ["2", "3", "4", "5"]);
    assert_eq!(levels(Exemplars), ["1", "2", "3", "4", "5", "6"]);
    let n_scenes = |factor| of(factor, Used::Boxes).iter().map(|r| r.row.n_scenes).sum::<u64>();
    assert_eq!([n_scenes(Objects), n_scenes(Occlusion)], [16, 4]);
    let exact = of(Objects, Used::Volumes)[0];
    assert_eq!((exact.row.n_exact, exact.recall), (4, 1.0), "two disks with depth");
    assert!(exact.exact_share_95[0] < 0.6, "four scenes are few: {exact:?}");
    let again = factors("configs/hanoi.toml", &[Occlusion], 4);
    assert!(again.iter().all(|row| measured.contains(row)), "the same seeds give the same figures");
    let noisy = factors("configs/blocksworld.toml", &[Noise], 3);
    let exact = |level: &str| -> u64 {
        let is_row = |r: &&FactorRow| {
            r.level == level && (r.row.objects, r.row.features) == (Source::Detected, Used::Volumes)
        };
        noisy.iter().filter(is_row).map(|r| r.row.n_true).sum()
    };
    assert!(exact("0") > exact("20"), "noise takes objects away: {noisy:?}");
}

#[test]
fn the_verb_prints_a_table_or_json() {
    let args = ["eval", "sim-grounding", "configs/hanoi.toml", "--seeds", "1"];
    let table = Process::start(&args).end();
    assert!(table.status.success() && table.stdout.contains("| 3-D volumes |"), "{}", table.stderr);
    let over = [&args[..], &["--over", "exemplars", "--json"]].concat();
    let json = Process::start(&over).end().json();
    schema::obeys("eval-sim-grounding", &json);
    let row = &json["factors"][0];
    assert_eq!((&row["factor"], &row["level"]), (&"exemplars".into(), &"1".into()));
    let table = Process::start(&over[..over.len() - 1]).end();
    assert!(table.stdout.contains("| exemplars | 6"), "{}{}", table.stdout, table.stderr);
    let json = Process::start(&[&args[..], &["--json"]].concat()).end().json();
    schema::obeys("eval-sim-grounding", &json);
    assert_eq!(json["seeds"], serde_json::json!([1, 1]));
    let row = &json["rows"][0];
    assert_eq!((&row["domain"], &row["camera"]), (&"hanoi".into(), &"usual".into()));
    assert!(row["precision"].is_f64() && row["n_exact"].is_u64(), "{row}");
}
