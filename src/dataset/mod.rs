//! Data sets of rendered scenes in the layout of ProDG-v, under controlled factors.
//!
//! Every scene is a pure function of the data set's seed, its own number and the factors: who renders it,
//! and when, changes nothing.

mod factor;
mod scene_source;
mod instruction;
mod example;
mod report;
mod generate;

pub use factor::{Factor, FactorValue, OWN_KEYS};
pub use generate::{DatasetRequest, generate};
pub use report::{DatasetReport, FactorReport, IndexLine};
pub use scene_source::{DrawnScene, SceneSetting, SceneSource};
