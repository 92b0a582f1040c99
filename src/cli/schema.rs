//! `groundloop schema`: the JSON Schema of what a verb's `--json` writes.

use clap::builder::PossibleValuesParser;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde_json::Value;

use super::reports::{
    ConfigReport, DoctorReport, DomainCheckReport, ExemplarCheckReport, GoalReport, GroundReport,
    PartsReport, PlanReport, RunReport, ServeReport, TaskReport, ValidationReport,
};
use super::{Failure, out};
use crate::eval::prodgv::EvaluationReport;
use crate::eval::robustness::RobustnessReport;
use crate::stress::StressReport;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The verb; where it has two words, both with a hyphen between them.
    #[arg(value_name = "VERB", value_parser = names())]
    verb: String,
}

/// Makes a schema.
type Make = fn() -> Schema;

/// The schemas of all verbs that have `--json`, in alphabetical order.
const SCHEMAS: &[(&str, Make)] = &[
    ("config-show", schema::<ConfigReport>),
    #[cfg(feature = "sim")]
    ("dataset-generate", schema::<crate::dataset::DatasetReport>),
    ("doctor", schema::<DoctorReport>),
    ("domain-check", schema::<DomainCheckReport>),
    ("eval-prodg-v", schema::<EvaluationReport>),
    ("eval-robustness", schema::<RobustnessReport>),
    #[cfg(feature = "sim")]
    ("eval-sim-grounding", schema::<super::reports::SimGroundingReport>),
    ("exemplar-check", schema::<ExemplarCheckReport>),
    ("goal", schema::<GoalReport>),
    ("ground", schema::<GroundReport>),
    ("parts", schema::<PartsReport>),
    ("plan", schema::<PlanReport>),
    ("run", schema::<RunReport<'_>>),
    ("serve", schema::<ServeReport<'_>>),
    ("stress", schema::<StressReport>),
    ("sweep-report", schema::<crate::sweep::SweepReport>),
    ("task", schema::<TaskReport<'_>>),
    ("validate", schema::<ValidationReport>),
];

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(SCHEMAS.iter().map(|(name, _)| *name))
}

/// The schema of a report as it is written, with the documentation of its fields.
fn schema<T: JsonSchema>() -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let joined = RecursiveTransform(join_lines);
    settings.with_transform(joined).into_generator().into_root_schema_for::<T>()
}

/// Descriptions are doc comments, whose lines end where the source's do.
fn join_lines(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace('\n', " ");
    }
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    if let Some((_, make)) = SCHEMAS.iter().find(|(name, _)| *name == args.verb) {
        out::line(&serde_json::to_string_pretty(&make()).map_err(Failure::internal)?);
    }
    Ok(0)
}
