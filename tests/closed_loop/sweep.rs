//! Sweeps from the command line: shards, a killed shard, reports, schedulers.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{Process, one_object, project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use rustix::process::Signal;
use tempfile::TempDir;

/// Three blocks in small pictures; the loop open and closed, and at rate 1 a block is dropped: 4 episodes.
const SWEEP: &str = r#"
run = "DROPPED"
seed = 3
set.sim = { scene = "scenes/three_blocks.toml", camera = { width = 160, height = 120 } }
set.goal.text = "Put red on blue and blue on green."

[[factor]]
key = "fault_rate"
values = [0.0, 1.0]

[[factor]]
name = "loop"
levels = [{ name = "closed" }, { name = "open", set.executive = "open_loop" }]

[report]
x = "fault_rate"
by = "loop"
"#;
const DROPPED: &str = r#"
extends = "blocksworld"
[[fault]]
during = "(stack red_block blue_block arm)"
action = { kind = "drop" }
"#;

/// A folder with the sweep file and what is its run file.
struct Work(TempDir);

impl Work {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let run = folder.path().join("dropped.toml");
        fs::write(&run, DROPPED).unwrap();
        fs::write(folder.path().join("s.toml"), SWEEP.replace("DROPPED", run.to_str().unwrap()))
            .unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// What a verb of `sweep` says: code, standard output, standard error.
    fn sweep(&self, args: &[&str], variables: &[(&str, &str)]) -> (Option<i32>, String, String) {
        let output = cargo_bin_cmd!("groundloop")
            .current_dir(project(""))
            .envs(variables.iter().copied())
            .args(["sweep", args[0]])
            .args(args[1..].iter().map(|arg| arg.replace('@', self.0.path().to_str().unwrap())))
            .output()
            .unwrap();
        let [out, err] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        (output.status.code(), out, err)
    }

    fn run(&self, args: &[&str], variables: &[(&str, &str)]) {
        let args = [&["run", "@/s.toml"], args].concat();
        let (code, out, err) = self.sweep(&args, variables);
        assert_eq!(code, Some(0), "{out}{err}");
    }
}

/// Of two shards, the number of one comes from a scheduler. At rate 1 the open loop knows nothing of the block that
/// was dropped.
#[test]
fn two_shards_equal_one_and_are_reported() {
    let work = Work::new();
    work.run(&["--out", "@/one"], &[]);
    work.run(&["--out", "@/two", "--shard", "2/2", "--jobs", "1"], &[]);
    let (code, _, err) = work.sweep(&["merge", "@/two"], &[]);
    assert_eq!(code, Some(2));
    assert!(err.contains("2 of 4 episodes are missing (0, 2)"), "{err}");
    let slurm = [("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_ARRAY_TASK_COUNT", "2")];
    work.run(&["--out", "@/two", "--shard", "auto", "--jobs", "1"], &slurm);
    let (code, out, _) = work.sweep(&["merge", "@/two"], &[]);
    assert_eq!(code, Some(0), "{out}");
    let [one, two] = ["one", "two"].map(|name| work.text(&format!("{name}/episodes.jsonl")));
    assert_eq!(one, two);

    let args = ["report", "@/one", "--json", "--pictures", "1"];
    let (code, out, err) = work.sweep(&args, &[]);
    assert_eq!(code, Some(0), "{err}");
    let report = one_object(&out);
    schema::obeys("sweep-report", &report);
    let points: Vec<String> = report["points"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| {
            format!("{} {} {}", p["factors"]["fault_rate"], p["factors"]["loop"], p["successes"])
        })
        .collect();
    let expected =
        [r#""0.0" "closed" 1"#, r#""1.0" "closed" 1"#, r#""0.0" "open" 1"#, r#""1.0" "open" 0"#];
    assert_eq!(points, expected);
    assert_eq!(report["all"]["faults"], 2);
    let page = work.text("one/report/index.html");
    assert!(page.contains("data:image/png;base64,"), "the failure has a picture");
    assert!(page.contains("groundloop run ") && page.contains("--seed 3"), "and a command");
    assert!(work.text("one/report/success.svg").contains("fault rate"));
    assert!(work.text("one/report/points.csv").starts_with("fault_rate,loop,episodes,successes,"));
    assert_eq!(work.text("one/report/episodes.csv").lines().count(), 5);
}

#[test]
fn a_killed_sweep_goes_on_where_it_was() {
    let work = Work::new();
    let [spec, out] = ["s.toml", "out"].map(|name| work.path(name));
    let [spec, out] = [&spec, &out].map(|path| path.to_str().unwrap());
    let args = ["sweep", "run", spec, "--out", out, "--jobs", "1", "--log", "info"];
    let mut killed = Process::start(&args);
    killed.wait_for_line("an episode has ended");
    killed.signal(Signal::KILL);
    assert_eq!(killed.end().status.code(), None);
    let before = work.text("out/shard-1-of-1.part").lines().count();
    assert!((1..4).contains(&before), "{before}");
    let (code, _, err) = work.sweep(&["run", "@/s.toml", "--out", "@/out"], &[]);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains(&format!("{} of 4 episodes run", 4 - before)), "{err}");
    assert_eq!(work.text("out/episodes.jsonl").lines().count(), 4);
    let (_, _, err) = work.sweep(&["run", "@/s.toml", "--out", "@/out"], &[]);
    assert!(err.contains("shard 1 of 1 is done"), "{err}");
}

/// An episode that cannot even begin is a row of the results, not their end.
#[test]
fn an_episode_without_a_verdict_is_told_among_the_others() {
    let work = Work::new();
    let text = work.text("s.toml").replace("values = [0.0, 1.0]", "values = [0.0]");
    let impossible = "name = \"open\", set.sim.scene = \"nowhere.toml\"";
    let text = text.replace("name = \"open\", set.executive = \"open_loop\"", impossible);
    fs::write(work.path("s.toml"), text).unwrap();
    let (code, _, err) = work.sweep(&["run", "@/s.toml", "--out", "@/out"], &[]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("success 1/2, 1 without a verdict"), "{err}");
    let records = work.text("out/episodes.jsonl");
    let failed = records.lines().nth(1).unwrap();
    assert!(
        failed.contains("\"verdict\":\"error\"") && failed.contains("nowhere.toml"),
        "{failed}"
    );
}

#[test]
fn wrong_keys_are_told_before_anything_runs() {
    let work = Work::new();
    let text = work.text("s.toml").replace("key = \"fault_rate\"", "key = \"fault_rat\"");
    fs::write(work.path("s.toml"), text).unwrap();
    let (code, _, err) = work.sweep(&["run", "@/s.toml", "--out", "@/out"], &[]);
    assert_eq!(code, Some(2));
    assert!(err.contains("fault_rate"), "did you mean: {err}");
    assert!(!work.path("out").exists());
    let (code, _, err) = work.sweep(&["run", "qick", "--out", "@/out"], &[]);
    assert_eq!(code, Some(2));
    assert!(err.contains("did you mean the shipped \"quick\""), "{err}");
}

/// Every shipped sweep can be read, with every one of its levels.
#[test]
fn shipped_sweeps_are_right() {
    let folder = project("configs/sweeps");
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let output = cargo_bin_cmd!("groundloop").args(["sweep", "show", &name]).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let head = fs::read_to_string(&path).unwrap();
        let n = said.split(" episodes of ").next().unwrap().rsplit(' ').next().unwrap();
        assert!(
            name == "quick" || head.contains(&format!("{n} episodes")),
            "{name} has {n} episodes"
        );
    }
}

/// The sweep file that the page explains is one, and so is each level that it shows.
#[test]
fn the_page_shows_a_sweep_file() {
    let page = fs::read_to_string(project("docs/sweeps.md")).unwrap();
    let shown = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let work = Work::new();
    let level = page.split("`{ name = \"dim\"").nth(1).unwrap().split('`').next().unwrap();
    let level = format!("{{ name = \"dim\"{level}");
    let light = format!("[[factor]]\nname = \"light\"\nlevels = [{level}]\n");
    fs::write(work.path("shown.toml"), shown.replace("[report]", &format!("{light}[report]")))
        .unwrap();
    let (code, said, err) = work.sweep(&["show", "@/shown.toml"], &[]);
    assert_eq!(code, Some(0), "{err}");
    assert!(said.contains("24 episodes of blocksworld_faults") && said.contains("dim"), "{said}");
}

/// A job array on a real Slurm, where there is one.
#[test]
fn a_job_array_of_slurm_runs_the_shards() {
    let answers = Command::new("sinfo").output().is_ok_and(|output| output.status.success());
    if !answers {
        println!("skipped: a job array: install slurm-wlm, and start slurmctld and slurmd");
        return;
    }
    let work = Work::new();
    let args = ["slurm", "@/s.toml", "--shards", "2", "--out", "@/out"];
    let (code, script, err) = work.sweep(&args, &[]);
    assert_eq!(code, Some(0), "{err}");
    fs::create_dir(work.path("out")).unwrap();
    fs::write(work.path("job.sh"), script).unwrap();
    let done = Command::new("sbatch")
        .args(["--wait", work.path("job.sh").to_str().unwrap()])
        .env("PATH", path_with_program())
        .status()
        .unwrap();
    assert!(done.success());
    let (code, _, err) = work.sweep(&["merge", "@/out"], &[]);
    assert_eq!(code, Some(0), "{err}");
    work.run(&["--out", "@/one"], &[]);
    assert_eq!(work.text("out/episodes.jsonl"), work.text("one/episodes.jsonl"));
}

/// The shards as tasks of `HyperQueue`, where its Python package is.
#[test]
fn hyperqueue_runs_the_shards() {
    let has = Command::new("python3").args(["-c", "import hyperqueue"]).output();
    if !has.is_ok_and(|output| output.status.success()) {
        println!("skipped: HyperQueue: pip install hyperqueue");
        return;
    }
    let work = Work::new();
    let script = project("tests/hyperqueue_shards.py");
    let program = env!("CARGO_BIN_EXE_groundloop");
    let [spec, out] = ["s.toml", "out"].map(|name| work.path(name));
    let done = Command::new("python3")
        .arg(script)
        .args([Path::new(program), &spec, &out])
        .arg("2")
        .current_dir(work.0.path())
        .status()
        .unwrap();
    assert!(done.success());
    let (code, _, err) = work.sweep(&["merge", "@/out"], &[]);
    assert_eq!(code, Some(0), "{err}");
}

/// The search path with the program's folder first.
fn path_with_program() -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_groundloop")).parent().unwrap();
    #[expect(clippy::disallowed_methods, reason = "what the system looks for programs in")]
    let path = std::env::var("PATH").unwrap_or_default();
    format!("{}:{path}", folder.display())
}
