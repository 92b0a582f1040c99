//! Settings in layers: TOML texts laid over one another, with the place of every value.
//!
//! `configs/defaults.toml` < files < `--set`. Tables merge key by key, everything else is replaced as
//! a whole. Every text is parsed into a tree that keeps spans (`tree.rs`), so that what is wrong with
//! a merged value is told at the line that holds it, and `groundloop config show` can say where each
//! value comes from.
//!
//! Libraries that were weighed: `figment` and `config` merge values and know their file, but no
//! line, no "did you mean" and one error at a time; `toml_edit` keeps spans only as long as nothing
//! is changed. So the merge is here (forty lines), on the spans of the `toml` crate; reading into
//! types is serde's, and `serde_path_to_error` tells which value it stumbled over.

mod bounds;
mod check;
mod choices;
mod layers;
mod options;
mod problem;
mod renamed;
mod show;
mod sources;
mod spelling;
#[cfg(test)]
mod tests;
mod toml_file;
mod tree;

pub(crate) use bounds::bound_numbers;
pub use layers::{Form, Layer, Layers};
pub use options::{default_options, options_file, read_options};
pub use problem::{SettingsProblem, joined};
pub use sources::{LayerOrigin, Written};
pub use spelling::{did_you_mean, near_hint};
pub use toml_file::TomlFile;

/// `configs/defaults.toml`: the reference of every key, and the only place where a default stands.
pub const DEFAULTS: &str = include_str!("../../configs/defaults.toml");

/// The name of the defaults in messages.
const DEFAULTS_NAME: &str = "configs/defaults.toml (embedded)";
