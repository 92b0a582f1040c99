//! Runs a program that may hang, flood its pipes, or leave children behind.

use std::io::{self, Read};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, PidfdFlags, Resource, Rlimit, Signal, kill_process_group, pidfd_open, prlimit,
};

use crate::clock::monotonic_ns;

/// Bytes that are kept of each pipe: the last ones, where errors stand. The rest is read and
/// dropped, so that no writer blocks.
const KEPT_BYTES_MAX: usize = 64 << 10;
/// How long pipes may stay open once the program has ended: a child that has left the process
/// group can hold them for ever.
const PIPES_WAIT: Duration = Duration::from_secs(1);
/// How often the clock and the interrupt are looked at while the program runs, nanoseconds.
const LOOK_NS: i64 = 20_000_000;
/// Nanoseconds of one clock tick in `/proc/<pid>/stat` (always 100 to the second on Linux).
const TICK_NS: u64 = 10_000_000;

/// What a program may use.
#[derive(Clone, Copy)]
pub(super) struct Limits<'a> {
    /// When it is killed, monotonic nanoseconds.
    pub(super) deadline_ns: u64,
    /// Address space of each of its processes, bytes.
    pub(super) memory_bytes: u64,
    /// `true` kills it.
    pub(super) interrupt: &'a dyn Fn() -> bool,
}

/// How a program has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// By itself, with this code.
    Exit(i32),
    /// By a signal that came from elsewhere.
    Signal(i32),
    /// Killed at the deadline.
    Late,
    /// Killed since nobody waits any more.
    Interrupted,
}

/// What is left of a program.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) end: End,
    /// The last bytes of standard output.
    pub(super) stdout: String,
    /// The last bytes of standard error.
    pub(super) stderr: String,
    /// Processor time of the program and of the children that it has waited for.
    pub(super) cpu_ns: u64,
}

/// Runs a program to its end or to a limit. It gets a process group of its own, and nobody of that
/// group survives this call.
pub(super) fn run(command: &mut Command, limits: Limits<'_>) -> io::Result<Ended> {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).process_group(0).spawn()?;
    let mut group = Group { pid: Pid::from_child(&child), child, is_reaped: false };
    let bytes = Some(limits.memory_bytes);
    // It may have ended already; a limit that cannot be set is none.
    if let Err(error) =
        prlimit(Some(group.pid), Resource::As, Rlimit { current: bytes, maximum: bytes })
    {
        tracing::debug!(%error, "no limit of memory");
    }
    let stdout = reader("stdout", group.child.stdout.take())?;
    let stderr = reader("stderr", group.child.stderr.take())?;
    let killed = group.wait(limits)?;
    let cpu_ns = cpu_ns(group.pid);
    let status = group.reap()?;
    let end = match (killed, status.code(), status.signal()) {
        (Some(killed), ..) => killed,
        (None, Some(code), _) => End::Exit(code),
        (None, None, signal) => End::Signal(signal.unwrap_or(0)),
    };
    Ok(Ended { end, stdout: text(&stdout), stderr: text(&stderr), cpu_ns })
}

/// A child with all of its process group.
struct Group {
    pid: Pid,
    child: Child,
    is_reaped: bool,
}

impl Group {
    /// Waits until the child has ended, by itself (`None`) or killed. It is not reaped: its number
    /// stays its own until the rest of the group is killed.
    fn wait(&self, limits: Limits<'_>) -> io::Result<Option<End>> {
        let fd = pidfd_open(self.pid, PidfdFlags::empty())?;
        let mut killed = None;
        loop {
            let timeout = Timespec { tv_sec: 0, tv_nsec: LOOK_NS };
            match poll(&mut [PollFd::new(&fd, PollFlags::IN)], Some(&timeout)) {
                Ok(0) => {}
                Ok(_) => return Ok(killed),
                Err(error) if error == rustix::io::Errno::INTR => {}
                Err(error) => return Err(error.into()),
            }
            if killed.is_none() && monotonic_ns() >= limits.deadline_ns {
                killed = Some(End::Late);
                self.kill();
            } else if killed.is_none() && (limits.interrupt)() {
                killed = Some(End::Interrupted);
                self.kill();
            }
        }
    }

    fn kill(&self) {
        if let Err(error) = kill_process_group(self.pid, Signal::KILL) {
            tracing::debug!(%error, "a process group had ended before");
        }
    }

    /// Kills what is left of the group, then lets the child go.
    fn reap(&mut self) -> io::Result<std::process::ExitStatus> {
        self.kill();
        let status = self.child.wait()?;
        self.is_reaped = true;
        Ok(status)
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        if !self.is_reaped
            && let Err(error) = self.reap()
        {
            tracing::warn!(%error, "a child could not be waited for");
        }
    }
}

/// Reads a pipe to its end on a thread of its own and hands over its last bytes.
fn reader<R: Read + Send + 'static>(name: &str, pipe: Option<R>) -> io::Result<Receiver<Vec<u8>>> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let read = move || {
        let mut kept: Vec<u8> = Vec::new();
        let mut buffer = [0; 8192];
        let mut pipe = pipe;
        while let Some(pipe) = &mut pipe {
            match pipe.read(&mut buffer) {
                Ok(0) => break,
                Ok(n) => kept.extend(&buffer[..n]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(_) => break,
            }
            if kept.len() > 2 * KEPT_BYTES_MAX {
                kept.drain(..kept.len() - KEPT_BYTES_MAX);
            }
        }
        kept.drain(..kept.len().saturating_sub(KEPT_BYTES_MAX));
        if sender.send(kept).is_err() {
            tracing::debug!("a pipe stayed open for longer than anybody waits");
        }
    };
    std::thread::Builder::new().name(name.to_owned()).spawn(read)?;
    Ok(receiver)
}

fn text(pipe: &Receiver<Vec<u8>>) -> String {
    let bytes = pipe.recv_timeout(PIPES_WAIT).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Processor time of a child that has ended and is not yet reaped.
fn cpu_ns(pid: Pid) -> u64 {
    let read = |file: &str| {
        let path = format!("/proc/{}/{file}", pid.as_raw_nonzero());
        std::fs::read_to_string(path).unwrap_or_default()
    };
    // Exact, but of the first thread alone.
    let exact = read("schedstat").split(' ').next().and_then(|ns| ns.parse().ok()).unwrap_or(0);
    // With waited-for children and other threads, but in ticks. The name before it may hold spaces.
    let stat = read("stat");
    let fields = stat.rsplit(") ").next().unwrap_or_default().split(' ').skip(11).take(4);
    let ticks: u64 = fields.filter_map(|field| field.parse::<u64>().ok()).sum();
    exact.max(ticks * TICK_NS)
}
