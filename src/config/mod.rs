//! Run files and domain folders: text on disk to checked values, before anything starts.

mod error;
mod load;
mod planner;
mod run;
mod domain_folder;
mod exemplars;
mod eye;
#[cfg(test)]
mod tests;

pub use domain_folder::DomainFolder;
pub use error::ConfigError;
pub(crate) use exemplars::{choose, environment, in_data};
pub use exemplars::{exemplar_from_files, read_image};
pub use eye::Eye;
pub use load::{load_run, read_text};
pub use planner::{PlannerConfig, TableConfig};
pub use run::{
    CameraConfig, CameraKind, ClockKind, ExemplarConfig, FaultConfig, GoalConfig, PanicConfig,
    PerceptionConfig, RobotConfig, RobotKind, RunConfig, SupervisorConfig,
};
