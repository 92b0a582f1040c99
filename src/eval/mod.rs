//! Measurements on data sets: the paper's evaluation, and rendered scenes.

pub mod prodgv;
pub mod robustness;
#[cfg(feature = "sim")]
pub mod sim_grounding;
