//! Episodes as figures: latencies, hashes, reports; and measurements on data sets.

pub mod prodgv;
#[cfg(feature = "sim")]
pub mod sim_grounding;
mod decision_hash;
mod tally;
mod report;

pub use decision_hash::{DecisionHash, FORMAT as DECISIONS_FORMAT, encode as encode_decision};
pub use report::{EpisodeReport, Latencies};
pub use tally::{EpisodeEnd, Tally};
