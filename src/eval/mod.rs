//! Measurements on data sets: the paper's evaluation, and rendered scenes.

mod interval;
pub mod prodgv;
pub mod robustness;
#[cfg(feature = "sim")]
pub mod sim_grounding;
#[cfg(feature = "sim")]
pub mod grounding_factors;

pub use interval::wilson_95;
