//! Episodes as figures: latencies, hashes, reports.

mod tally;
mod report;

pub use report::{EpisodeReport, Latencies};
pub use tally::{EpisodeEnd, Tally};
