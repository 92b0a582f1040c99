//! What several test files need: run files with a small camera, and episodes on a bus of their own.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::allow_attributes,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "each test file uses a part of it, and a failed step must fail the test"
)]

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use groundloop::app::{Episode, EpisodeOptions, Prepared, RunError, run_episode};
use groundloop::config::{RunConfig, load_run};
use groundloop::executive::{Note, Stop};
use groundloop::transport::BusConfig;
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

/// What an episode told.
pub type Notes = Arc<Mutex<Vec<Note>>>;

/// An episode on a bus of its own; removes what the bus leaves behind.
pub struct TestRun {
    root: tempfile::TempDir,
    prefix: String,
    /// Where to send a stop.
    pub stop: watch::Sender<Option<Stop>>,
    /// What was told.
    pub notes: Notes,
}

impl TestRun {
    pub fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        let unique = root.path().file_name().unwrap().to_str().unwrap().replace('.', "");
        let prefix = format!("gltest_{unique}_");
        Self { root, prefix, stop: watch::Sender::new(None), notes: Notes::default() }
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
        let prepared = Prepared::read(config, None)?;
        let notes = Arc::clone(&self.notes);
        let options = EpisodeOptions {
            bus: self.bus("test"),
            narrate: Arc::new(move |_, _, note: &Note| notes.lock().unwrap().push(note.clone())),
            stop: self.stop.subscribe(),
            snapshot: None,
        };
        runtime().block_on(run_episode(&prepared, options))
    }

    /// What was told, as text.
    pub fn told(&self) -> String {
        format!("{:#?}", self.notes.lock().unwrap())
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
