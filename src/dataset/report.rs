//! What is said of a data set: a line for each scene, and the whole.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

/// A line of `index.jsonl`: one scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IndexLine {
    /// The number in the names of its files.
    pub problem: u64,
    /// The seed of its arrangement, light and noise.
    pub seed: u64,
    /// How many arrangements were drawn until every object could be seen.
    pub arrangements: u32,
    /// The value of each factor.
    pub factors: BTreeMap<String, toml::Value>,
    /// The share of each object's outline that the camera sees, 0 to 1.
    pub visible_shares: BTreeMap<String, f64>,
    /// Whether there is an instruction: words that read back as the goal.
    pub has_instruction: bool,
}

/// Output of `groundloop dataset generate --json`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(title = "groundloop dataset generate --json")]
pub struct DatasetReport {
    /// The folder of the domain's files.
    pub folder: String,
    /// The domain's name.
    pub domain: String,
    /// Seed of everything random.
    pub seed: u64,
    /// How many scenes were written.
    pub scenes: u64,
    /// Objects with a box, over all scenes.
    pub objects: u64,
    /// Arrangements that were drawn and not taken: an object could not be seen, or the bodies did not come
    /// to rest.
    pub arrangements_dropped: u64,
    /// Scenes without an instruction: the domain's `language.toml` has no words that read back as their goal.
    pub without_instruction: u64,
    /// What differs from scene to scene.
    pub factors: Vec<FactorReport>,
    /// How many threads worked.
    pub threads: usize,
    /// How long it took, seconds of wall time.
    pub wall_seconds: f64,
    /// Scenes in each second of wall time.
    pub scenes_per_second: f64,
}

/// What differs from scene to scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FactorReport {
    /// Its key.
    pub key: String,
    /// Its values: `LO..HI`, or a list.
    pub values: String,
}
