//! All scenes of a data set, by as many threads as are wanted.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use super::example::{Example, example};
use super::{DatasetReport, Factor, FactorReport, IndexLine, SceneSource};
use crate::clock::monotonic_ns;
use crate::hardware::sim::Labeller;
use crate::run::ConfigError;

/// The file that says how each scene was made.
const INDEX: &str = "index.jsonl";

/// What is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct DatasetRequest {
    /// The folder of the data set; the domain's files go to `data/<domain>/` below it.
    pub out: PathBuf,
    /// How many scenes.
    pub scenes: u64,
    /// Seed of everything random.
    pub seed: u64,
    /// What differs from scene to scene.
    pub factors: Vec<Factor>,
    /// How many threads work; the scenes are the same with any number.
    pub threads: usize,
}

/// Writes a data set; `done` is called after each scene.
///
/// # Errors
/// [`ConfigError`] naming the file, key or factor; a folder of the domain that is there already.
pub fn generate(
    source: &SceneSource,
    request: &DatasetRequest,
    done: &(dyn Fn() + Sync),
) -> Result<DatasetReport, ConfigError> {
    source.check(&request.factors)?;
    let started_ns = monotonic_ns();
    let domain = source.folder.domain.name.to_string();
    let folder = request.out.join("data").join(&domain);
    if folder.exists() {
        let reason = "it is there already; name another folder with --out, or remove it";
        return Err(fault(&folder, &reason));
    }
    let job = Job {
        source,
        request,
        folder: &folder,
        next: AtomicU64::new(1),
        is_over: AtomicBool::new(false),
        done,
    };
    let written = job.write();
    if written.is_err() {
        // A part of a data set would be taken for the whole.
        drop(fs::remove_dir_all(&folder));
    }
    let lines = written?;
    let wall_seconds = (monotonic_ns() - started_ns) as f64 * 1e-9;
    let factor = |f: &Factor| FactorReport { key: f.key.clone(), values: f.values_text() };
    Ok(DatasetReport {
        folder: folder.display().to_string(),
        domain,
        seed: request.seed,
        scenes: lines.len() as u64,
        objects: lines.iter().map(|line| line.visible_shares.len() as u64).sum(),
        arrangements_dropped: lines.iter().map(|line| u64::from(line.arrangements - 1)).sum(),
        without_instruction: lines.iter().filter(|line| !line.has_instruction).count() as u64,
        factors: request.factors.iter().map(factor).collect(),
        threads: request.threads,
        wall_seconds,
        scenes_per_second: lines.len() as f64 / wall_seconds,
    })
}

/// What the threads share.
struct Job<'a> {
    source: &'a SceneSource,
    request: &'a DatasetRequest,
    folder: &'a Path,
    /// The next scene that nobody works at.
    next: AtomicU64,
    /// Whether a scene has failed.
    is_over: AtomicBool,
    done: &'a (dyn Fn() + Sync),
}

impl Job<'_> {
    /// Makes all scenes, and writes the files that are about all of them.
    fn write(&self) -> Result<Vec<IndexLine>, ConfigError> {
        write(&self.folder.join("domain.pddl"), self.source.folder.domain_text.as_bytes())?;
        let lines = self.lines()?;
        let path = self.folder.join(INDEX);
        let index: Result<Vec<String>, _> = lines.iter().map(serde_json::to_string).collect();
        let index = index.map_err(|e| fault(&path, &e))?;
        write(&path, format!("{}\n", index.join("\n")).as_bytes())?;
        Ok(lines)
    }

    /// Makes all scenes; their lines in the order of their numbers.
    fn lines(&self) -> Result<Vec<IndexLine>, ConfigError> {
        let results: Vec<Result<Vec<IndexLine>, ConfigError>> = thread::scope(|scope| {
            let spawn = |_| scope.spawn(|| self.work());
            let workers: Vec<_> = (0..self.request.threads.max(1)).map(spawn).collect();
            let joined = workers.into_iter().map(thread::ScopedJoinHandle::join);
            joined.map(|ended| ended.unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
        });
        let mut lines = Vec::new();
        for result in results {
            lines.extend(result?);
        }
        lines.sort_by_key(|line| line.problem);
        Ok(lines)
    }

    /// Makes scenes until there are enough.
    fn work(&self) -> Result<Vec<IndexLine>, ConfigError> {
        let ended = self.work_on();
        if ended.is_err() {
            self.is_over.store(true, Ordering::Relaxed);
        }
        ended
    }

    fn work_on(&self) -> Result<Vec<IndexLine>, ConfigError> {
        let DatasetRequest { scenes, seed, factors, .. } = self.request;
        let mut labeller = Labeller::new(self.source.folder.scenes(), self.source.config.sim()?)?;
        let mut lines = Vec::new();
        while !self.is_over.load(Ordering::Relaxed) {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            if number > *scenes {
                break;
            }
            let made = example(self.source, &mut labeller, factors, (*seed, number));
            let Example { line, files } = made?;
            for (path, bytes) in files {
                write(&self.folder.join(path), &bytes)?;
            }
            lines.push(line);
            (self.done)();
        }
        Ok(lines)
    }
}

/// Writes a file, and the folders above it where they are missing.
fn write(path: &Path, bytes: &[u8]) -> Result<(), ConfigError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| fault(folder, &e))?;
    }
    fs::write(path, bytes).map_err(|e| fault(path, &e))
}

fn fault(path: &Path, reason: &dyn std::fmt::Display) -> ConfigError {
    ConfigError::File { path: path.display().to_string(), reason: reason.to_string() }
}
