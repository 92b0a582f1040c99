//! The replanning stress test: scenes of a changing world go to the planner actor over its real
//! topics, as fast as wanted, and what each plan took is kept apart by the rung that gave it.

mod error;
mod config;
mod template;
mod world;
mod workload;
mod case;
mod measure;
mod machine;
mod session;
mod reference;
mod run;
mod report;
mod check;
mod logs;
mod plot;

pub use case::{Instance, instances};
pub use check::{CheckVerdict, Judgement, check};
pub use config::{
    CaseConfig, Rate, StressConfig, load_stress, stress_file_schema, stress_of, stress_schema,
};
pub use error::StressError;
pub use logs::{Logs, write_logs};
pub use measure::{Cell, TimingQuantiles};
pub use plot::plot;
pub use report::{Comparison, Machine, StressReport};
pub use run::{Options, Progress, run_stress};
pub use template::Template;
pub use workload::{View, Workload, WorkloadGenerator};
