//! Episodes as figures: latencies, hashes, reports; and measurements on data sets.

pub mod prodgv;
#[cfg(feature = "sim")]
pub mod sim_grounding;
mod tally;
mod report;

pub use report::{EpisodeReport, Latencies};
pub use tally::{EpisodeEnd, Tally};
