//! The only place that reads clocks. Nothing read here enters a decision or a hash.

mod stamps;

use rustix::time::{ClockId, Timespec, clock_getres, clock_gettime};
use schemars::JsonSchema;
use serde::Deserialize;

pub use stamps::{StampFault, Stamps};

/// Nanoseconds of the monotonic clock (the same in all processes of one machine).
pub fn monotonic_ns() -> u64 {
    nanoseconds(ClockId::Monotonic)
}

/// Processor time that this process has used so far, all threads, in nanoseconds.
pub fn process_cpu_ns() -> u64 {
    nanoseconds(ClockId::ProcessCPUTime)
}

/// Processor time of the calling thread so far, in nanoseconds.
pub fn thread_cpu_ns() -> u64 {
    nanoseconds(ClockId::ThreadCPUTime)
}

/// The smallest step of the monotonic clock, in nanoseconds.
pub fn monotonic_resolution_ns() -> u64 {
    in_ns(clock_getres(ClockId::Monotonic))
}

fn nanoseconds(id: ClockId) -> u64 {
    in_ns(clock_gettime(id))
}

fn in_ns(time: Timespec) -> u64 {
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    let nanos = u64::try_from(time.tv_nsec).unwrap_or(0);
    seconds * 1_000_000_000 + nanos
}

/// Which clock drives the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ClockKind {
    /// Simulated time advances by one frame per answer; runs as fast as the machine allows.
    Lockstep,
    /// Everything runs free; the newest frame wins.
    Realtime,
}
