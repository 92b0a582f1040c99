//! Episodes as figures: latencies, hashes, reports; and the evaluation on the paper's data set.

pub mod prodgv;
mod tally;
mod report;

pub use report::{EpisodeReport, Latencies};
pub use tally::{EpisodeEnd, Tally};
