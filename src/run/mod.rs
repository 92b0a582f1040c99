//! Run files and domain folders: text on disk to checked values, before anything starts.

mod error;
mod load;
mod run_file;
mod domain_folder;
mod exemplars;
mod still_image;
mod planner;
mod hardware;
mod wiring;
mod observer;
mod episode;
#[cfg(test)]
mod tests;

pub use domain_folder::DomainFolder;
pub use episode::{Episode, EpisodeOptions, run_episode};
pub use error::{ConfigError, RunError};
pub(crate) use exemplars::{environment, in_data, view_of};
pub use exemplars::{exemplar_from_files, read_image};
pub use hardware::HardwarePorts;
pub use load::{load_run, read_text};
pub(crate) use planner::{PlannerSetup, new_run_id};
pub use run_file::{
    CameraConfig, ExemplarConfig, GoalConfig, PerceptionConfig, RobotConfig, RunConfig,
};
pub use still_image::{StillImageParts, StillImageReader};
pub use wiring::PreparedRun;
