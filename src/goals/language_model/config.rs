//! `[goal.options]` of a goal of kind `language_model`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::http::RetryPolicy;
use crate::http::chat::ChatDialect;

/// The options, as written.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Options {
    /// Where the server's API begins, such as `http://127.0.0.1:8080/v1`.
    pub(super) url: String,
    /// The model's name there.
    pub(super) model: String,
    /// What the server understands besides the common part.
    pub(super) dialect: ChatDialect,
    /// The environment variable that holds the key, for servers that want one.
    pub(super) key_env: Option<String>,
    /// The worked example; without the key the first of `language.toml` that can be read.
    pub(super) example: Option<ExampleOption>,
    /// How freely the model chooses its words; 0 repeats itself.
    pub(super) temperature: f64,
    /// Most answers that are asked for: the first, then one for each that was not valid.
    #[schemars(range(min = 1))]
    pub(super) attempts_max: u32,
    /// Most tokens of an answer.
    #[schemars(range(min = 1))]
    pub(super) tokens_max: u32,
    /// Bounds of each request, all attempts together.
    pub(super) retry: RetryPolicy,
}

/// A worked example, as written.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ExampleOption {
    /// What is said.
    pub(super) instruction: String,
    /// What it means, in PDDL.
    pub(super) goal: String,
    /// What is there, `name:type` each; without it, what the goal names.
    #[serde(default)]
    pub(super) objects: Vec<String>,
}
