//! Processes that run episodes side by side.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};

use super::super::Failure;
use crate::sweep::{SweepDesign, SweepLine};

/// How often an episode is tried whose process ends under it.
const TRIES_MAX: usize = 2;

/// Runs episodes in so many processes, and hands over what each comes to, in the order in which they end.
pub(super) fn run_all(
    (spec, design): (&Path, &SweepDesign),
    episodes: &[u64],
    jobs: usize,
    mut take: impl FnMut(SweepLine) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let next = Mutex::new(episodes.iter().copied());
    let is_over = AtomicBool::new(false);
    let (sender, ended) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, episodes.len().max(1)) {
            let (sender, next, is_over) = (sender.clone(), &next, &is_over);
            scope.spawn(move || {
                let mut worker = Worker::new(spec);
                let next = || next.lock().unwrap_or_else(PoisonError::into_inner).next();
                let left =
                    std::iter::from_fn(next).take_while(|_| !is_over.load(Ordering::Relaxed));
                for index in left {
                    // When nobody takes it, the sweep is over.
                    drop(sender.send(worker.episode(design, index)));
                }
            });
        }
        drop(sender);
        let done = ended.iter().try_for_each(|line| take(line?));
        is_over.store(true, Ordering::Relaxed);
        done
    })
}

/// One process that runs episodes, started when there is something to run.
struct Worker {
    spec: PathBuf,
    process: Option<Process>,
}

struct Process {
    child: Child,
    asked: ChildStdin,
    said: BufReader<ChildStdout>,
}

impl Worker {
    fn new(spec: &Path) -> Self {
        Self { spec: spec.to_owned(), process: None }
    }

    /// Runs one episode. A process that ends under it is replaced, and the episode tried again; then its end is
    /// what the episode came to.
    fn episode(&mut self, design: &SweepDesign, index: u64) -> Result<SweepLine, Failure> {
        let mut reason = String::new();
        for _ in 0..TRIES_MAX {
            let mut process = match self.process.take() {
                Some(process) => process,
                None => Process::start(&self.spec)?,
            };
            if let Some(line) = process.ask(index) {
                self.process = Some(process);
                return Ok(line);
            }
            reason = process.why_it_ended();
            tracing::warn!(episode = index, reason, "the process of an episode has ended");
        }
        let plan = design.episode(index);
        let plan = plan.ok_or_else(|| Failure::internal(format!("no episode {index}")))?;
        Ok(SweepLine::new(&plan, Err(&reason)))
    }
}

impl Process {
    fn start(spec: &Path) -> Result<Self, Failure> {
        let program = std::env::current_exe().map_err(Failure::internal)?;
        let mut child = Command::new(program)
            .args(["sweep", "worker"])
            .arg(spec)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(Failure::internal)?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (asked, said) = pipes.ok_or_else(|| Failure::internal("a process without pipes"))?;
        Ok(Self { child, asked, said: BufReader::new(said) })
    }

    /// What an episode came to; `None` when the process has ended.
    fn ask(&mut self, index: u64) -> Option<SweepLine> {
        writeln!(self.asked, "{index}").ok()?;
        let mut line = String::new();
        self.said.read_line(&mut line).ok()?;
        serde_json::from_str(&line).ok()
    }

    fn why_it_ended(mut self) -> String {
        // It may say something else than it should, and go on.
        drop(self.child.kill());
        match self.child.wait() {
            Ok(status) => format!("its process ended: {status}"),
            Err(error) => format!("its process was lost: {error}"),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        drop(self.child.kill().and_then(|()| self.child.wait()));
    }
}
