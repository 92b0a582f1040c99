//! The replanning stress test as people call it, and the worlds that it shows.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::report::keys;
use crate::common::{folders_in, one_object, project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::pddl::{Problem, Step};
use groundloop::planning::{Budget, Outcome, PlanRequest, plan};
use groundloop::run::DomainFolder;
use groundloop::stress::{Template, Workload, WorkloadGenerator};
use hdrhistogram::Histogram;
use hdrhistogram::serialization::Deserializer;
use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};
use serde_json::{Value, json};

const TINY: &str = r#"
seed = 3
repeats = 2
answer_s_max = 600.0
check_samples_min = 6

[planner]
name = "embedded"
reuse = "valid"
rungs = ["trajectory", "suffix", "table", "search", "improve"]
expansions_max = 10000
optimal_expansions_max = 10000
improve_expansions_max = 0
deadline_ms = 600000
failure_penalty = 5
[planner.table]
states_max = 0
bytes_max = 0
adopt_after_cycles = 1

[[case]]
name = "blocks"
domain = "blocksworld"
sizes = [3]
feeds = ["progress", "deviation", "objects", "flip", "random"]
rates_hz = ["max"]
samples = 12
walk_steps = 20
optimal_samples = 4

[[case]]
name = "by rate"
domain = "hanoi"
sizes = [3]
feeds = ["progress"]
rates_hz = [2000]
samples = 12
walk_steps = 20
[case.planner]
rungs = ["search"]
"#;

struct Ran {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        fs::write(desk.file("tiny.toml"), TINY).unwrap();
        desk
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Calls `stress` with a file of the desk, in the project's folder; `@` stands for the desk.
    fn stress(&self, config: &str, args: &[&str]) -> Ran {
        let place = self.0.path().to_str().unwrap();
        let args = args.iter().map(|arg| arg.replace('@', place));
        let mut command = cargo_bin_cmd!("groundloop");
        command.current_dir(project("")).arg("stress").arg(self.file(config)).args(args);
        let output = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Ran { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&fs::read_to_string(self.file(name)).unwrap()).unwrap()
    }
}

#[test]
fn one_run_gives_a_report_logs_and_a_picture() {
    let desk = Desk::new();
    let args = ["--json", "--save", "@/saved.json", "--logs", "@/logs", "--plot", "@/plot.svg"];
    let ran = desk.stress("tiny.toml", &args);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let report = one_object(&ran.stdout);
    schema::obeys("stress", &report);
    assert_eq!(
        keys(&report),
        ["format", "config", "planner", "seed", "repeats", "machine", "cells", "comparisons"]
    );
    assert_eq!(keys(&report["machine"]), ["processor", "processors", "load", "calibration_ns"]);
    assert_eq!(desk.json("saved.json"), report);
    let cells = report["cells"].as_array().unwrap();
    let quantiles = ["p50", "p90", "p99", "p999", "max"];
    let mut rungs = BTreeSet::new();
    for cell in cells {
        for kind in ["cpu_ns", "observe_cpu_ns", "decide_cpu_ns", "wall_ns", "round_trip_ns"] {
            assert_eq!(keys(&cell[kind]), quantiles, "{cell}");
            let rising: Vec<u64> =
                quantiles.iter().map(|q| cell[kind][q].as_u64().unwrap()).collect();
            assert!(rising.is_sorted(), "{cell}");
        }
        assert!(cell["cpu_ns"]["p50"].as_u64().unwrap() > 0 || cell["count"] == json!(0));
        rungs.insert(cell["rung"].as_str().unwrap());
    }
    for rung in ["cold", "trajectory", "search"] {
        assert!(rungs.contains(rung), "{rungs:?}");
    }
    let counted = |feed: &str, rate: &str| -> u64 {
        let of_feed = cells.iter().filter(|c| c["feed"] == feed && c["rate"] == rate);
        of_feed.filter(|c| c["rung"] != "cold").map(|c| c["count"].as_u64().unwrap()).sum()
    };
    for feed in ["progress", "deviation", "objects", "flip", "random"] {
        assert_eq!(counted(feed, "max"), 24, "12 plans in each of 2 repeats");
    }
    let by_rate = cells.iter().filter(|c| c["rate"] == "2000");
    let missed: u64 = by_rate.map(|c| c["missed"].as_u64().unwrap()).sum();
    assert!(counted("progress", "2000") + missed >= 24, "every scene is answered or missed");
    let ratios = cells.iter().filter_map(|c| c["cost_ratio"]["mean"].as_f64());
    let ratios: Vec<f64> = ratios.collect();
    assert!(!ratios.is_empty() && ratios.iter().all(|&ratio| ratio >= 1.0), "{ratios:?}");
    check_logs(&desk.file("logs"), cells);
    let svg = fs::read_to_string(desk.file("plot.svg")).unwrap();
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert!(
        ["blocks", "trajectory"].iter().all(|word| svg.lines().any(|line| line.trim() == *word))
    );
}

/// The logs hold what the report counts.
fn check_logs(folder: &Path, cells: &[Value]) {
    let text = fs::read_to_string(folder.join("blocks-3-random-max.hlog")).unwrap();
    let mut counted = 0;
    for entry in IntervalLogIterator::new(text.as_bytes()) {
        let LogEntry::Interval(interval) = entry.unwrap() else { continue };
        let tag = interval.tag().unwrap();
        if tag.as_str() != "cold.cpu" && tag.as_str().split_once('.').unwrap().1 == "cpu" {
            let bytes = base64::Engine::decode(
                &base64::engine::general_purpose::STANDARD,
                interval.encoded_histogram(),
            );
            let histogram: Histogram<u64> =
                Deserializer::new().deserialize(&mut bytes.unwrap().as_slice()).unwrap();
            counted += histogram.len();
        }
    }
    let of_feed = cells.iter().filter(|c| c["feed"] == "random" && c["rung"] != "cold");
    assert_eq!(counted, of_feed.map(|c| c["count"].as_u64().unwrap()).sum::<u64>());
}

/// Multiplies every median of a report.
fn doctored(report: &Value, factor: f64) -> Value {
    let mut report = report.clone();
    for cell in report["cells"].as_array_mut().unwrap() {
        for median in cell["cpu_p50_ns_by_repeat"].as_array_mut().unwrap() {
            *median = json!((median.as_u64().unwrap() as f64 * factor) as u64);
        }
    }
    report
}

#[test]
fn a_check_tells_a_regression_from_noise() {
    let desk = Desk::new();
    let args = ["--case", "blocks", "--save", "@/base.json"];
    assert_eq!(desk.stress("tiny.toml", &args).code, Some(0));
    let base = desk.json("base.json");
    let check = |factor: f64| {
        let baseline = doctored(&base, factor).to_string();
        fs::write(desk.file("doctored.json"), baseline).unwrap();
        desk.stress("tiny.toml", &["--case", "blocks", "--check", "@/doctored.json"])
    };
    // So far apart that no load of the machine matters.
    let passed = check(1000.0);
    assert_eq!(passed.code, Some(0), "{}", passed.stdout);
    assert!(passed.stdout.contains("passed") && !passed.stdout.contains("REGRESSED"));
    assert!(passed.stdout.contains("too few to tell"), "{}", passed.stdout);
    let failed = check(0.001);
    assert_eq!(failed.code, Some(6), "{}", failed.stdout);
    assert!(failed.stdout.contains("REGRESSED"), "{}", failed.stdout);
}

#[test]
fn what_cannot_be_is_refused_before_anything_is_measured() {
    let desk = Desk::new();
    let refused = |code: i32, args: &[&str], said: &str| {
        let ran = desk.stress("tiny.toml", args);
        assert_eq!(ran.code, Some(code), "{args:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(said), "{args:?}: no {said:?} in {}", ran.stderr);
        assert_eq!(ran.stdout, "");
    };
    refused(2, &["--case", "bricks"], "blocks or by rate");
    fs::write(desk.file("no.json"), "{}").unwrap();
    refused(2, &["--check", "@/no.json"], "no.json: expected a report of groundloop stress");
    refused(2, &["--check", "@/nowhere.json"], "nowhere.json");
    fs::write(desk.file("options.toml"), "python = \"./nowhere\"").unwrap();
    let compare = ["--compare", "fast-downward", "--compare-options", "@/options.toml"];
    refused(5, &compare, "pip install up-fast-downward");
    for (from, to, said) in [
        ("repeats = 2", "repeats = 0", "repeats: expected an integer, 1 or more"),
        ("rates_hz = [2000]", "rates_hz = [0]", "a positive number"),
        ("sizes = [3]", "sizes = []", "sizes or problems"),
        ("rungs = [\"search\"]", "rungs = [\"table\"]", "planner.rungs"),
        ("seed = 3", "sede = 3", "sede"),
    ] {
        fs::write(desk.file("bad.toml"), TINY.replace(from, to)).unwrap();
        let ran = desk.stress("bad.toml", &[]);
        assert_eq!(ran.code, Some(2), "{to}: {}", ran.stderr);
        assert!(ran.stderr.contains(said), "{to}: {}", ran.stderr);
    }
}

fn template(folder: &DomainFolder, size: u32) -> Problem {
    let text = fs::read_to_string(folder.files.base().join("stress.toml")).unwrap();
    let template = Template::parse("stress.toml", &text).unwrap();
    template.problem("stress.toml", &folder.domain, size).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn every_domain_makes_problems_of_any_size_that_have_plans() {
    for path in folders_in(&project("domains")) {
        let folder = DomainFolder::read(&path).unwrap();
        for size in 1..=3 {
            let problem = template(&folder, size);
            let planned = plan(&folder.domain, &PlanRequest::new(&problem), &Budget::standard());
            assert!(matches!(planned.outcome, Outcome::Solved(_)), "{}, {size}", path.display());
        }
        assert!(template(&folder, 40).objects.len() >= 40);
    }
}

#[test]
fn the_same_seed_gives_the_same_views() {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let problem = template(&folder, 4);
    let views = |feed, seed| {
        let mut feeder = WorkloadGenerator::new(feed, (&folder.domain, &problem), 30, seed);
        (0..40).map(|_| feeder.next(None)).collect::<Vec<_>>()
    };
    for feed in [
        Workload::Progress,
        Workload::Deviation,
        Workload::Flip,
        Workload::Objects,
        Workload::Random,
    ] {
        assert_eq!(views(feed, 1), views(feed, 1), "{feed:?}");
        assert_ne!(views(feed, 1), views(feed, 2), "{feed:?}");
    }
    let gone = views(Workload::Objects, 1).iter().filter(|view| view.objects.len() == 4).count();
    assert_eq!(gone, 20, "an object is gone in every second view");
    let unknown =
        views(Workload::Flip, 1).iter().filter(|view| !view.facts.unknown.is_empty()).count();
    assert!(unknown > 0);
}

#[test]
fn progress_does_the_step_that_the_plan_begins_with() {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let problem = template(&folder, 3);
    let mut feeder = WorkloadGenerator::new(Workload::Progress, (&folder.domain, &problem), 0, 1);
    let view = feeder.next(Some(&Step::new("pick_up", &["b2", "arm"])));
    assert!(view.facts.known.iter().any(|atom| atom.to_string() == "(holding b2)"));
    assert!(view.counts);
}
