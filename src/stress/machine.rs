//! What else the machine does, and how fast it is.

use std::hint::black_box;

use serde::{Deserialize, Serialize};

use crate::clock::thread_cpu_ns;

/// Words of the calibration's table: 256 KiB, about what a replan touches.
const TABLE_WORDS: usize = 1 << 15;
/// Steps of one calibration: about a millisecond.
const STEPS: u64 = 300_000;

/// How busy the machine is: running tasks, averaged over 1, 5 and 15 minutes.
pub(super) type Load = [f64; 3];

/// The load average now; zeros where the system does not tell.
pub(super) fn load() -> Load {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let mut numbers = text.split(' ').map(|word| word.parse().unwrap_or(0.0));
    std::array::from_fn(|_| numbers.next().unwrap_or(0.0))
}

/// The machine, for people.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Processor {
    /// The processor's name.
    pub(super) name: String,
    /// How many of them.
    pub(super) n: usize,
}

/// What the system says of its processors.
pub(super) fn processor() -> Processor {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let n = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    Processor { name: name.map_or("unknown", |(_, name)| name.trim()).to_owned(), n }
}

/// Thread-CPU nanoseconds of a fixed piece of work on integers and memory: what one unit of work
/// costs on this machine now.
pub(super) fn calibrate() -> u64 {
    let mut table: Vec<u64> = (0..TABLE_WORDS as u64).collect();
    let started_ns = thread_cpu_ns();
    let mut at: u64 = 0x9e37_79b9_7f4a_7c15;
    for _ in 0..STEPS {
        at ^= at << 13;
        at ^= at >> 7;
        at ^= at << 17;
        let slot = &mut table[at as usize % TABLE_WORDS];
        *slot = slot.wrapping_mul(0x2545_f491_4f6c_dd1d).wrapping_add(at);
        at = at.wrapping_add(*slot >> 32);
    }
    black_box((at, table));
    (thread_cpu_ns() - started_ns).max(1)
}
