//! Run files and domain folders: text on disk to checked values, before anything starts.

mod error;
mod find;
mod load;
mod cameras;
mod task_queue;
mod run_file;
mod camera_choice;
mod schema;
mod domain_folder;
mod exemplars;
mod scaled_examples;
mod fitted_examples;
mod proposal;
mod self_check;
mod still_image;
mod planner;
mod hardware;
mod ready_detectors;
mod wiring;
mod diary;
mod observer;
mod scoring;
mod audit;
mod episode;
mod service;
#[cfg(test)]
mod tests;

pub(crate) use camera_choice::region_at;
pub use cameras::{CameraConfig, ExemplarConfig, OtherCameraConfig};
pub use domain_folder::DomainFolder;
pub use episode::{Episode, EpisodeOptions, run_episode};
pub use error::{ConfigError, RunError};
pub use exemplars::{ExemplarFiles, read_image};
pub(crate) use exemplars::{environment, in_data, view_of};
pub(crate) use find::{find_sweep, given_domain};
pub use hardware::HardwarePorts;
pub use load::{Layered, load_run, read_pddl, read_text};
pub(crate) use planner::{PlannerSetup, new_run_id};
pub use proposal::ExemplarProposal;
pub use run_file::{
    DetectorMode, GoalConfig, PerceptionConfig, RobotConfig, RunConfig, ServicesConfig,
};
pub(crate) use schema::{file_schema, schema_with_parts};
pub use schema::{run_file_schema, run_schema};
pub use self_check::CameraCheck;
pub use service::{ServeNews, ServeOptions, serve, told_to_stop};
pub use still_image::{StillImageParts, StillImageReader};
pub use task_queue::ServeConfig;
pub use wiring::PreparedRun;
