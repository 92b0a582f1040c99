//! What several test files need: run files with a small camera, and episodes on a bus of their own.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "each test file uses a part of it, and a failed step must fail the test"
)]

pub mod eval;
pub mod external;
pub mod report;
pub mod schema;

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::Mutex;

use groundloop::hardware::FaultConfig;
use groundloop::messages::{Control, Event, ReplanCause, Stop};
use groundloop::run::{
    Episode, EpisodeOptions, PreparedRun, RunConfig, RunError, load_run, run_episode,
};
use groundloop::transport::convert::{control_to_wire, device_header};
use groundloop::transport::topics::CONTROL;
use groundloop::transport::wire::{ControlRecord, DeviceHeader};
use groundloop::transport::{Bus, BusConfig, EventReader, Publisher};
use rustix::process::{Pid, Signal, kill_process};
use tokio::sync::watch;

/// Overrides that make the simulated camera small, and use its labelled examples.
pub const SMALL_CAMERA: [&str; 3] =
    ["sim.camera.width=320", "sim.camera.height=240", "perception.exemplar.folder=sim_320x240"];

/// A path below the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A shipped run file with a small camera, and overrides.
pub fn small(name: &str, sets: &[&str]) -> RunConfig {
    let sets: Vec<String> = SMALL_CAMERA.iter().chain(sets).map(ToString::to_string).collect();
    load_run(&project("configs").join(name), &sets).unwrap()
}

/// An episode on a bus of its own; removes what the bus leaves behind.
pub struct TestRun {
    root: tempfile::TempDir,
    prefix: String,
    /// Where to send a stop.
    pub stop: watch::Sender<Option<Stop>>,
    /// What the topic `event` said.
    pub events: Mutex<Vec<Event>>,
}

impl TestRun {
    pub fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        let unique = root.path().file_name().unwrap().to_str().unwrap().replace('.', "");
        let prefix = format!("gltest_{unique}_");
        Self { root, prefix, stop: watch::Sender::new(None), events: Mutex::default() }
    }

    pub fn bus(&self, run: &str) -> BusConfig {
        BusConfig {
            root: Some(self.root.path().to_owned()),
            prefix: self.prefix.clone(),
            run: run.to_owned(),
        }
    }

    /// Runs an episode to its end.
    pub fn run(&self, config: RunConfig) -> Result<Episode, RunError> {
        let prepared = PreparedRun::read(config, None)?;
        runtime().block_on(self.watch(&prepared))
    }

    /// Runs an episode, reads its events and forwards a stop, all over the bus.
    async fn watch(&self, prepared: &PreparedRun) -> Result<Episode, RunError> {
        let bus = Bus::open(&self.bus("test"))?;
        let controls: Publisher<DeviceHeader, ControlRecord> = bus.publisher(&CONTROL)?;
        let mut events = EventReader::open(&bus)?;
        let mut stop = self.stop.subscribe();
        let episode = run_episode(prepared, EpisodeOptions { bus, snapshot: None });
        tokio::pin!(episode);
        let mut is_stopped = false;
        let ended = loop {
            tokio::select! {
                biased;
                event = events.next() => self.events.lock().unwrap().push(event?.event),
                why = stop.wait_for(Option::is_some), if !is_stopped => {
                    is_stopped = true;
                    let request = control_to_wire(Control::Stop(why.unwrap().unwrap()));
                    controls.publish(device_header(0, 0), &[request])?;
                }
                ended = &mut episode => break ended,
            }
        };
        while let Some(event) = events.poll()? {
            self.events.lock().unwrap().push(event.event);
        }
        ended
    }

    /// The deviations that replans were told to be caused by.
    pub fn replan_causes(&self) -> Vec<String> {
        let events = self.events.lock().unwrap();
        let causes = events.iter().filter_map(|event| {
            if let Event::Replan { causes, .. } = event { Some(causes) } else { None }
        });
        let deviations = causes.flatten().filter_map(|cause| match cause {
            ReplanCause::Deviation(deviation) => Some(deviation.to_string()),
            ReplanCause::Failure { .. } => None,
        });
        deviations.collect()
    }

    /// What was told, as text.
    pub fn told(&self) -> String {
        format!("{:#?}", self.events.lock().unwrap())
    }
}

impl Drop for TestRun {
    fn drop(&mut self) {
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                drop(std::fs::remove_file(entry.path()));
            }
        }
    }
}

/// A runtime like the program's.
pub fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap()
}

/// Runs an episode that must come to a verdict.
pub fn episode(config: RunConfig) -> Episode {
    let run = TestRun::new();
    run.run(config).unwrap()
}

/// An actor that panics at a message, counted from 1.
pub fn panic_of(actor: &str, nth: u32) -> FaultConfig {
    let action = toml::Table::from_iter([("kind".to_owned(), "panic".into())]);
    let message = Some(actor.to_owned());
    FaultConfig { message, nth: Some(nth), action, ..FaultConfig::default() }
}

/// How many panics on purpose have happened.
pub fn n_panics(episode: &Episode) -> usize {
    episode.report.faults.iter().filter(|record| record.kind == "panic").count()
}

/// The folder with outside data, from the one environment variable; prints what is skipped without
/// it.
#[expect(clippy::disallowed_methods, reason = "the one documented variable, for tests only")]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
pub fn data(below: &str, what: &str) -> Option<PathBuf> {
    let folder = std::env::var("GROUNDLOOP_DATA").ok().map(|root| Path::new(&root).join(below));
    let found = folder.filter(|folder| folder.is_dir());
    if found.is_none() {
        println!("skipped: {what}: set GROUNDLOOP_DATA to a folder with {below}/");
    }
    found
}

/// The program of an example, which a run of all tests builds before it runs any.
///
/// # Panics
/// When it is missing or older than what it is made of: `cargo test --test NAME` builds no examples.
#[track_caller]
pub fn example(name: &str) -> PathBuf {
    // Tests and examples lie in folders beside each other.
    let folder = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().join("examples");
    let program = folder.join(name);
    let how = format!("cargo build --release --example {name}");
    let Ok(built) = std::fs::metadata(&program) else {
        panic!("{} is missing, build it: {how}", program.display());
    };
    // Cargo's own list of the files that it is made of: `program: file file …`.
    let list = std::fs::read_to_string(folder.join(format!("{name}.d"))).unwrap();
    let (_, sources) = list.trim().split_once(": ").unwrap();
    for source in sources.replace("\\ ", "\0").split(' ').map(|s| s.replace('\0', " ")) {
        let changed = std::fs::metadata(&source).and_then(|file| file.modified());
        let is_older = changed.is_ok_and(|changed| changed > built.modified().unwrap());
        assert!(!is_older, "{} is older than {source}, build it: {how}", program.display());
    }
    program
}

/// Another program as a child process; it is killed when this is dropped.
pub struct Killed(pub Child);

impl Killed {
    /// Starts it in the project's folder.
    pub fn start(program: &Path, args: &[&str], stdout: Stdio) -> Self {
        let mut command = Command::new(program);
        command.args(args).current_dir(project("")).stdin(Stdio::null()).stdout(stdout);
        Self(command.spawn().unwrap())
    }
}

impl Drop for Killed {
    fn drop(&mut self) {
        // It may have ended already.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// The program as a child process in the project's folder; it is killed when this is dropped.
pub struct Process {
    child: Child,
    /// What it has said on standard error so far, and what it will say.
    lines: BufReader<ChildStderr>,
    said: Vec<String>,
}

/// How a process has ended.
pub struct Ended {
    pub status: ExitStatus,
    pub stdout: String,
    /// All lines of standard error.
    pub stderr: String,
}

impl Process {
    pub fn start(args: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_groundloop"))
            .args(args)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap());
        Self { child, lines, said: Vec::new() }
    }

    /// Reads standard error up to the first line that contains `text`.
    #[track_caller]
    pub fn wait_for_line(&mut self, text: &str) {
        loop {
            let mut line = String::new();
            let n_bytes = self.lines.read_line(&mut line).unwrap();
            assert_ne!(n_bytes, 0, "no line with {text:?} in:\n{}", self.said.concat());
            let found = line.contains(text);
            self.said.push(line);
            if found {
                return;
            }
        }
    }

    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    /// Reads all that it says until it ends by itself.
    pub fn end(mut self) -> Ended {
        let mut rest = String::new();
        self.lines.read_to_string(&mut rest).unwrap();
        self.said.push(rest);
        let mut stdout = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut stdout).unwrap();
        let status = self.child.wait().unwrap();
        Ended { status, stdout, stderr: self.said.concat() }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

impl Ended {
    /// The one JSON object that standard output must consist of.
    #[track_caller]
    pub fn json(&self) -> serde_json::Value {
        one_object(&self.stdout)
    }
}

/// The one JSON object that a text must consist of.
#[track_caller]
pub fn one_object(text: &str) -> serde_json::Value {
    let value: serde_json::Value = serde_json::from_str(text)
        .unwrap_or_else(|e| panic!("expected one JSON object ({e}), got: {text}"));
    assert!(value.is_object(), "{text}");
    value
}

/// A name for a run on the bus that no other test and no other process has.
pub fn unique_run(test: &str) -> String {
    format!("gltest-{test}-{}", std::process::id())
}

/// Copies a folder with all that is in it.
pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (from, to) = {
            let path = entry.unwrap().path();
            let to = to.join(path.file_name().unwrap());
            (path, to)
        };
        if from.is_dir() {
            copy_folder(&from, &to);
        } else {
            std::fs::copy(&from, &to).unwrap();
        }
    }
}

/// Everything below a folder whose name ends with `.ending`, in order, without what is built.
pub fn files_below(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The folders directly below a folder, in order.
pub fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut folders: Vec<PathBuf> = entries.filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

/// A path as it is written in the project.
pub fn in_project(path: &Path) -> String {
    path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().display().to_string()
}
