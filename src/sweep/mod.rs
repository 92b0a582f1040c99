//! Sweeps: many episodes over chosen factors, in shards that any machine or scheduler can run.
//!
//! ```text
//!  spec ─► design: episode n has these settings and this seed     (pure)
//!            └─► shard I of N ─► workers, a process each ─► store, a line an episode ─► merged ─► report
//! ```
//!
//! What an episode is follows from the spec and its number alone, so shards need not know of each other, and
//! N shards give the same records as one.

mod spec;
mod design;
mod shard;
mod record;
mod store;
mod slurm;
mod report;
mod tables;
mod plot;
mod page;

pub use design::{EpisodePlan, Setting, SweepDesign};
pub use page::{FailurePicture, SweepPage};
pub use plot::plot_sweep;
pub use record::{SweepLine, SweepRecord, SweepTiming};
pub use report::{SweepLevel, SweepPoint, SweepReport, SweepTally};
pub use shard::{Shard, ShardError};
pub use slurm::slurm_script;
pub use spec::{Level, ReportLayout, Sampling, SweepFactor, SweepSpec};
pub use store::{ShardFile, StoreError, SweepFolder};
pub use tables::{episodes_csv, points_csv};
