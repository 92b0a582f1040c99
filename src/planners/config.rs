//! `[planner]` of a run file.

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{PLANNERS, Planner, PlannerInputs};
use crate::messages::{PlanSource, Reuse};
use crate::mismatch::Mismatch;
use crate::parts::{PartChoice, PartContext, PartError};
use crate::planning::{Budget, GroundingLimits};

/// `[planner]` of a run file: which planner, and its budget of states and time.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlannerConfig {
    /// What plans.
    pub name: String,
    /// When the current plan is kept.
    pub reuse: Reuse,
    /// The sources of plans that are switched on.
    pub rungs: Vec<PlanSource>,
    /// Most states that the search for any plan expands in one call.
    pub expansions_max: u64,
    /// Most states that the search for a cheapest plan expands, before the search for any plan takes
    /// over.
    pub optimal_expansions_max: u64,
    /// Most states that are expanded to make a plan cheaper that is not proven to be a cheapest one.
    pub improve_expansions_max: u64,
    /// Longest search, milliseconds; in lockstep the counts alone bound it.
    pub deadline_ms: u64,
    /// Cost that each failure adds to a step.
    pub failure_penalty: u32,
    /// Bounds of grounding a task.
    pub grounding: GroundingConfig,
    /// Distances of states to the goal, computed beside the loop.
    pub table: TableConfig,
    /// The options of the planner.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
}

/// `[planner.grounding]`: how large a task may become when it is grounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroundingConfig {
    /// Most ground actions.
    pub actions_max: usize,
    /// Most ground atoms.
    pub atoms_max: usize,
    /// Most elementary steps.
    pub steps_max: u64,
}

impl GroundingConfig {
    /// As grounding takes them.
    pub fn limits(self) -> GroundingLimits {
        let Self { actions_max, atoms_max, steps_max } = self;
        GroundingLimits { actions_max, atoms_max, steps_max }
    }
}

impl From<&GroundingLimits> for GroundingConfig {
    fn from(limits: &GroundingLimits) -> Self {
        let GroundingLimits { actions_max, atoms_max, steps_max } = *limits;
        Self { actions_max, atoms_max, steps_max }
    }
}

/// `[planner.table]`: the goal-rooted distance table, which is made beside the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableConfig {
    /// Most states of the table.
    pub states_max: u64,
    /// Most memory of the table, bytes.
    pub bytes_max: u64,
    /// In lockstep a table is used from so many cycles after it was asked for, and waited for then.
    pub adopt_after_cycles: u64,
}

impl PlannerConfig {
    /// For single calls outside a loop: a planner by its name, within a budget.
    pub fn single(name: &str, budget: &Budget) -> Self {
        Self {
            name: name.to_owned(),
            reuse: Reuse::Valid,
            rungs: vec![PlanSource::Search],
            expansions_max: budget.greedy_expansions_max,
            optimal_expansions_max: budget.optimal_expansions_max,
            improve_expansions_max: 0,
            deadline_ms: u64::MAX,
            failure_penalty: 0,
            grounding: (&budget.grounding).into(),
            table: TableConfig { states_max: 0, bytes_max: 0, adopt_after_cycles: 0 },
            options: None,
        }
    }

    /// What one call of the planner may spend.
    pub fn budget(&self) -> Budget {
        let improves = self.rungs.contains(&PlanSource::Improve);
        Budget {
            optimal_expansions_max: self.optimal_expansions_max,
            greedy_expansions_max: self.expansions_max,
            improve_expansions_max: if improves { self.improve_expansions_max } else { 0 },
            grounding: self.grounding.limits(),
            ..Budget::standard()
        }
    }

    /// The planner that is chosen here; `file` is where its options stand.
    pub fn choice(&self, file: &Path) -> PartChoice {
        PartChoice::new("planner.name", &self.name).with_options(self.options.as_ref(), file)
    }

    /// Makes the planner; `file` is where its options stand.
    ///
    /// # Errors
    /// What [`PLANNERS`] says.
    pub fn planner(
        &self,
        file: &Path,
        environment: fn(&str) -> Option<String>,
    ) -> Result<Box<dyn Planner>, PartError> {
        let inputs = PlannerInputs { budget: &self.budget() };
        PLANNERS.build(&PartContext { choice: &self.choice(file), inputs, environment })
    }

    /// Checks what types cannot say.
    pub(crate) fn check(&self) -> Result<(), Mismatch> {
        if self.rungs.contains(&PlanSource::Search) {
            return Ok(());
        }
        let names: Vec<&str> = self.rungs.iter().map(|rung| rung.name()).collect();
        let expected = "\"search\" among them, since the first plan comes from there";
        Err(Mismatch::new("planner.rungs", expected, names.join(", ")))
    }
}
