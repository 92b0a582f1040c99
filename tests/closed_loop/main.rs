//! Episodes: the loop, its faults, stress and sweeps.

#[path = "../common/mod.rs"]
mod common;

mod control;
#[cfg(feature = "sim")]
mod decisions;
#[cfg(feature = "sim")]
mod episodes;
mod faults;
#[cfg(feature = "sim")]
mod serve;
mod signals;
mod slow_detector;
mod stress;
mod sweep;
mod system_faults;
