//! Other processes: topics, cameras, robots, clients, examples.

#[path = "../common/mod.rs"]
mod common;

mod cameras;
#[cfg(feature = "sim")]
mod examples;
mod exemplar_capture;
mod external_camera;
#[cfg(feature = "sim")]
mod external_robot;
mod foreign;
mod full_memory;
mod holds;
mod protocol;
mod python_client;
mod robot_alone;
mod ros2_bridge;
mod serve;
mod silence;
mod topics;
mod transport;
#[cfg(feature = "sim")]
mod versions;
