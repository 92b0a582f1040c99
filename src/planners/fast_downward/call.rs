//! One call: files in a folder of its own, translation, search, and what the exit codes mean.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};

use super::encode::Encoded;
use super::process::{self, End, Ended, Limits};
use super::{Options, Parts, named};
use crate::pddl::Step;
use crate::planning::{Outcome, Proof};

/// A cheapest plan where the configured search is refused: LM-cut knows neither conditional
/// effects nor axioms.
const BLIND: &str = "astar(blind())";
/// Longest plan file that is read, bytes.
const PLAN_BYTES_MAX: u64 = 16 << 20;
/// Exit code of a search that does not support what the task uses.
const UNSUPPORTED: i32 = 34;

/// One run of Fast Downward on one task.
pub(super) struct Call<'a> {
    options: &'a Options,
    parts: &'a Parts,
    limits: Limits<'a>,
    /// Processor time so far, nanoseconds.
    pub(super) cpu_ns: u64,
    /// States that the last search says it has expanded.
    pub(super) expanded: u64,
}

/// The files of a call.
struct Files {
    folder: TemporaryFolder,
    domain: PathBuf,
    problem: PathBuf,
    /// Translated.
    task: PathBuf,
    plan: PathBuf,
}

impl<'a> Call<'a> {
    pub(super) fn new(options: &'a Options, parts: &'a Parts, limits: Limits<'a>) -> Self {
        Self { options, parts, limits, cpu_ns: 0, expanded: 0 }
    }

    /// A plan as Fast Downward gives it, unchecked.
    pub(super) fn plan(&mut self, encoded: &Encoded) -> Result<Vec<Step>, Outcome> {
        let files = Files::write(encoded).map_err(broken)?;
        if let Parts::Wheel(_) = self.parts {
            self.translate(&files, encoded)?;
        }
        let options = self.options;
        let first =
            if options.optimal { &options.optimal_search } else { &options.satisficing_search };
        let mut ended = self.search(first, &files)?;
        if options.optimal && ended.end == End::Exit(UNSUPPORTED) {
            ended = self.search(BLIND, &files)?;
        }
        // 1 to 3: out of memory or time, but not before a plan was found.
        if !matches!(ended.end, End::Exit(0..=3)) {
            return Err(self.failed(&ended, encoded));
        }
        let text = read_bounded(&files.plan).map_err(|error| Outcome::BadInput {
            reason: named(format!("it says that there is a plan, but its file: {error}")),
        })?;
        encoded.plan(&text).map_err(|error| Outcome::BadInput {
            reason: named(format!("its plan file cannot be read: {error}")),
        })
    }

    fn translate(&mut self, files: &Files, encoded: &Encoded) -> Result<(), Outcome> {
        let mut command = Command::new(&self.options.python);
        command.args(["-m", "fast_downward.translate"]).args([&files.domain, &files.problem]);
        command.arg("--sas-file").arg(&files.task).stdin(Stdio::null());
        let ended = self.run(&mut command, files)?;
        if ended.end == End::Exit(0) { Ok(()) } else { Err(self.failed(&ended, encoded)) }
    }

    fn search(&mut self, search: &str, files: &Files) -> Result<Ended, Outcome> {
        let mut command = match self.parts {
            Parts::Wheel(binary) => {
                let mut command = Command::new(binary);
                command.args(["--search", search, "--internal-plan-file"]).arg(&files.plan);
                command.stdin(File::open(&files.task).map_err(broken)?);
                command
            }
            Parts::Driver(program) => {
                let mut command = if program.extension().is_some_and(|end| end == "py") {
                    let mut python = Command::new(&self.options.python);
                    python.arg(program);
                    python
                } else {
                    Command::new(program)
                };
                command.arg("--plan-file").args([&files.plan, &files.domain, &files.problem]);
                command.args(["--search", search]).stdin(Stdio::null());
                command
            }
        };
        let ended = self.run(&mut command, files)?;
        self.expanded = expanded(&ended.stdout);
        Ok(ended)
    }

    /// Runs one program of the call in the call's folder.
    fn run(&mut self, command: &mut Command, files: &Files) -> Result<Ended, Outcome> {
        let ended = process::run(command.current_dir(&files.folder.0), self.limits);
        let ended = ended.map_err(|error| Outcome::BadInput {
            reason: named(format!("{}: {error}", command.get_program().display())),
        })?;
        self.cpu_ns += ended.cpu_ns;
        Ok(ended)
    }

    /// What an end without a plan means. The codes are those of the driver, and of both programs
    /// that it starts.
    fn failed(&self, ended: &Ended, encoded: &Encoded) -> Outcome {
        let timeout = ("planner.options.timeout_s", u64::from(self.options.timeout_s));
        let memory = ("planner.options.memory_mb", u64::from(self.options.memory_mb));
        let out_of = |(limit, value)| Outcome::OutOfBudget { limit, value };
        let said = last_line(&ended.stderr).or_else(|| last_line(&ended.stdout));
        let said = encoded.in_own_names(said.unwrap_or("it says nothing"));
        let key = if self.options.optimal { "optimal_search" } else { "satisficing_search" };
        let unsupported = |what: String| Outcome::Unsupported { feature: named(what) };
        match ended.end {
            End::Late | End::Exit(21 | 23) => out_of(timeout),
            End::Interrupted => Outcome::Interrupted,
            End::Exit(20 | 22 | 24) => out_of(memory),
            End::Exit(10 | 11) => Outcome::Unsolvable { proof: Proof::OtherPlanner },
            End::Exit(12) => out_of(("planner.options.satisficing_search (it is incomplete)", 0)),
            End::Exit(31) => unsupported(format!("its translator refuses the task: {said}")),
            End::Exit(33) => {
                unsupported(format!("it does not know the search planner.options.{key}: {said}"))
            }
            End::Exit(UNSUPPORTED) => unsupported(format!(
                "the search planner.options.{key} does not support what the task uses: {said}"
            )),
            End::Exit(37) => unsupported(said),
            End::Exit(code) => Outcome::BadInput { reason: named(format!("exit {code}: {said}")) },
            End::Signal(signal) => {
                Outcome::BadInput { reason: named(format!("killed by signal {signal}: {said}")) }
            }
        }
    }
}

impl Files {
    fn write(encoded: &Encoded) -> io::Result<Self> {
        let folder = TemporaryFolder::new()?;
        let file = |name: &str| folder.0.join(name);
        let (domain, problem) = (file("domain.pddl"), file("problem.pddl"));
        let (task, plan) = (file("output.sas"), file("plan"));
        fs::write(&domain, &encoded.domain)?;
        fs::write(&problem, &encoded.problem)?;
        Ok(Self { folder, domain, problem, task, plan })
    }
}

fn broken(error: io::Error) -> Outcome {
    Outcome::BadInput { reason: named(error) }
}

/// A folder for one call; it goes when this does.
struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    fn new() -> io::Result<Self> {
        /// So that calls of one process do not meet.
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("groundloop-fast-downward-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::DirBuilder::new().mode(0o700).create(&path)?;
        Ok(Self(path))
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.0) {
            tracing::warn!(path = %self.0.display(), %error, "a temporary folder stays");
        }
    }
}

fn read_bounded(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    File::open(path)?.take(PLAN_BYTES_MAX + 1).read_to_string(&mut text)?;
    if text.len() as u64 > PLAN_BYTES_MAX {
        return Err(io::Error::other(format!("longer than {PLAN_BYTES_MAX} bytes")));
    }
    Ok(text)
}

fn last_line(text: &str) -> Option<&str> {
    text.lines().rev().map(str::trim).find(|line| !line.is_empty())
}

/// The number in `[t=0.001s, 9952 KB] Expanded 12 state(s).`
fn expanded(stdout: &str) -> u64 {
    let number = |line: &str| {
        let (_, rest) = line.split_once("Expanded ")?;
        rest.split(' ').next()?.parse().ok()
    };
    stdout.lines().rev().find_map(number).unwrap_or(0)
}
