//! When a single planning call is to end: after a time, at a size, or because somebody says so.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::signal::unix::{SignalKind, signal};

use super::Failure;
use crate::clock::monotonic_ns;

/// How often the size of the process is looked at, nanoseconds.
const LOOK_NS: u64 = 20_000_000;

/// Limits of one call, and whether one was met.
#[derive(Debug)]
pub(super) struct StopConditions {
    deadline_ns: u64,
    memory_bytes_max: u64,
    signalled: Arc<AtomicBool>,
    looked_ns: Cell<u64>,
    met: Cell<Option<&'static str>>,
}

impl StopConditions {
    /// From now on. Ctrl-C and SIGTERM no longer end the process, but the call.
    pub(super) fn start(
        time_limit_s: Option<f64>,
        memory_limit_mb: Option<u64>,
    ) -> Result<Self, Failure> {
        let now_ns = monotonic_ns();
        let time_ns = time_limit_s.map_or(u64::MAX, |s| (s * 1e9) as u64);
        Ok(Self {
            deadline_ns: now_ns.saturating_add(time_ns),
            memory_bytes_max: memory_limit_mb.map_or(u64::MAX, |mb| mb.saturating_mul(1 << 20)),
            signalled: listen()?,
            looked_ns: Cell::new(now_ns),
            met: Cell::new(None),
        })
    }

    /// Whether the call is to end.
    pub(super) fn is_met(&self) -> bool {
        if self.met.get().is_none() {
            self.met.set(self.look());
        }
        self.met.get().is_some()
    }

    /// What ended the call, if anything here did.
    pub(super) fn met(&self) -> Option<&'static str> {
        self.met.get()
    }

    fn look(&self) -> Option<&'static str> {
        if self.signalled.load(Ordering::Relaxed) {
            return Some("stopped from outside");
        }
        let now_ns = monotonic_ns();
        if now_ns >= self.deadline_ns {
            return Some("the time limit was met");
        }
        if self.memory_bytes_max < u64::MAX && now_ns >= self.looked_ns.get() + LOOK_NS {
            self.looked_ns.set(now_ns);
            if resident_bytes() >= self.memory_bytes_max {
                return Some("the memory limit was met");
            }
        }
        None
    }
}

/// Notes Ctrl-C and SIGTERM.
fn listen() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(Failure::internal)?;
    let (mut interrupt, mut terminate) = {
        let _entered = runtime.enter();
        let interrupt = signal(SignalKind::interrupt()).map_err(Failure::internal)?;
        (interrupt, signal(SignalKind::terminate()).map_err(Failure::internal)?)
    };
    let heard = Arc::clone(&flag);
    let wait = move || {
        runtime.block_on(async move {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
        });
        heard.store(true, Ordering::Relaxed);
    };
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(wait)
        .map_err(Failure::internal)?;
    Ok(flag)
}

/// Memory that the process has now; 0 where the system does not say.
fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
