//! Figures of an episode: its result, latencies, and the decision hash.

mod answered_cycle;
mod latency;
mod decision_hash;
mod tally;
mod report;

pub use answered_cycle::AnsweredCycle;
pub use decision_hash::{DecisionHash, FORMAT as DECISIONS_FORMAT, encode as encode_decision};
pub use latency::{Latency, Quantiles};
pub use report::{DispatchAudit, EpisodeReport, FaultRecord, Latencies, UntrueDispatch};
pub use tally::{EpisodeMetrics, EpisodeResult};
