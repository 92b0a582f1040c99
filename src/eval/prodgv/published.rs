//! The paper's own figures, quoted beside what is measured. They are data: `published.toml`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Figures of one framework, by domain. What the paper does not give is not there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Name of the framework.
    pub framework: String,
    /// Number of exemplars that it is shown.
    pub shot: u32,
    /// What grounds the state.
    pub grounding: String,
    /// The planner.
    pub planner: String,
    /// Precision and recall of observed facts.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub pr: BTreeMap<String, [f64; 2]>,
    /// Share of valid problems.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub problem_valid: BTreeMap<String, f64>,
    /// Share of valid plans; the paper mixes denominators.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub plan_valid: BTreeMap<String, f64>,
    /// Share of plans that solve the true problem.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub success: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    row: Vec<Published>,
}

/// The rows of the paper's tables, in its order.
pub fn published() -> Vec<Published> {
    // The file is a part of the program, and a test reads it.
    toml::from_str::<File>(include_str!("published.toml")).map(|file| file.row).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_whole() {
        let rows = published();
        assert_eq!(rows.len(), 9);
        let own = rows.last().unwrap();
        assert_eq!((own.pr["hanoi"], own.success["hanoi"]), ([0.94, 0.91], 0.65));
        let shares = rows.iter().flat_map(|row| {
            row.pr.values().flatten().chain(row.plan_valid.values()).chain(row.success.values())
        });
        assert!(shares.into_iter().all(|share| (0.0..=1.0).contains(share)));
    }
}
