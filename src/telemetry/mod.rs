//! Clocks and latency histograms.

mod clock;
mod latency;

pub use clock::{monotonic_ns, process_cpu_ns, thread_cpu_ns};
pub use latency::{Latency, Quantiles};
