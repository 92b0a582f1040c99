//! What came of the episodes of a sweep, counted.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::design::SweepDesign;
use super::record::SweepRecord;
use super::spec::{ReportLayout, Sampling};
use crate::eval::wilson_95;

/// A factor with more levels, all of them numbers, is shown in so many parts of its range.
const BINS: usize = 8;
/// Most failures that are listed.
const FAILURES_MAX: usize = 500;

/// Output of `groundloop sweep report --json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(title = "groundloop sweep report --json")]
pub struct SweepReport {
    /// The name of the sweep.
    pub name: String,
    /// How many episodes the sweep has.
    pub expected: u64,
    /// What came of those that are there.
    pub all: SweepTally,
    /// One row for each point of a grid; none of a Latin hypercube, where each episode has its own.
    pub points: Vec<SweepPoint>,
    /// One row for each level of each factor, over all levels of the others.
    pub levels: Vec<SweepLevel>,
    /// The episodes that failed or are wrong, in order; the first 500.
    pub failures: Vec<SweepRecord>,
    /// How the plot is laid out.
    #[serde(skip)]
    pub layout: ReportLayout,
}

/// Counts over episodes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, JsonSchema)]
pub struct SweepTally {
    /// How many there are.
    pub episodes: u32,
    /// In how many the goal is said to be reached (or the plan executed), and holds in the simulator.
    pub successes: u32,
    /// Wilson's 95 % interval of their share.
    pub success_share_95: [f64; 2],
    /// In how many the goal is said to be reached and does not hold in the simulator.
    pub false_reached: u32,
    /// How many ended without a verdict.
    pub errors: u32,
    /// Faults that happened.
    pub faults: u64,
    /// Steps that were started.
    pub dispatches: u64,
    /// Those whose precondition did not really hold.
    pub against_truth: u64,
    /// Those of them that went against what could be known.
    pub against_evidence: u64,
    /// Mean length in run time, seconds.
    pub sim_seconds_mean: f64,
}

/// One point of a grid.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweepPoint {
    /// The level of each factor.
    pub factors: BTreeMap<String, String>,
    /// What came of its episodes.
    #[serde(flatten)]
    pub tally: SweepTally,
}

/// One level of a factor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweepLevel {
    /// The factor.
    pub factor: String,
    /// The level, or a part of the factor's range.
    pub level: String,
    /// What came of its episodes.
    #[serde(flatten)]
    pub tally: SweepTally,
}

impl SweepTally {
    /// Counts episodes.
    pub fn of<'a>(records: impl IntoIterator<Item = &'a SweepRecord>) -> Self {
        let mut tally = Self::default();
        let mut sim_seconds = 0.0;
        for record in records {
            tally.episodes += 1;
            tally.successes += u32::from(record.is_success());
            tally.false_reached += u32::from(record.is_false());
            tally.errors += u32::from(record.is_error());
            tally.faults += record.faults;
            tally.dispatches += record.dispatches;
            tally.against_truth += record.against_truth;
            tally.against_evidence += record.against_evidence;
            sim_seconds += record.sim_seconds;
        }
        tally.success_share_95 = wilson_95(tally.successes, tally.episodes);
        tally.sim_seconds_mean = sim_seconds / f64::from(tally.episodes.max(1));
        tally
    }

    /// The share of successes; `None` of no episodes.
    pub fn share(&self) -> Option<f64> {
        (self.episodes > 0).then(|| f64::from(self.successes) / f64::from(self.episodes))
    }
}

impl SweepReport {
    /// Counts the records of a sweep.
    pub fn new(name: &str, design: &SweepDesign, records: &[SweepRecord]) -> Self {
        let factors = design.spec().factor.iter().map(|factor| factor.title().to_owned());
        let is_failure = |record: &&SweepRecord| !record.is_success() || record.is_wrong();
        Self {
            name: name.to_owned(),
            expected: design.len(),
            all: SweepTally::of(records),
            points: match design.spec().sampling {
                Sampling::Grid => points(records),
                Sampling::LatinHypercube => Vec::new(),
            },
            levels: factors.flat_map(|factor| levels(&factor, records)).collect(),
            failures: records.iter().filter(is_failure).take(FAILURES_MAX).cloned().collect(),
            layout: design.spec().report.clone(),
        }
    }
}

/// One row for each point.
fn points(records: &[SweepRecord]) -> Vec<SweepPoint> {
    let mut by_point: BTreeMap<u64, Vec<&SweepRecord>> = BTreeMap::new();
    for record in records {
        by_point.entry(record.point).or_default().push(record);
    }
    let row = |records: Vec<&SweepRecord>| {
        let factors = records.first()?.factors.clone();
        Some(SweepPoint { factors, tally: SweepTally::of(records) })
    };
    by_point.into_values().filter_map(row).collect()
}

/// One row for each level of a factor, in the order of the episodes, or, where there are many numbers, for
/// each part of their range.
fn levels(factor: &str, records: &[SweepRecord]) -> Vec<SweepLevel> {
    let mut by_level: Vec<(String, Vec<&SweepRecord>)> = Vec::new();
    for record in records {
        let Some(level) = record.factors.get(factor) else { continue };
        match by_level.iter_mut().find(|(known, _)| known == level) {
            Some((_, of_level)) => of_level.push(record),
            None => by_level.push((level.clone(), vec![record])),
        }
    }
    let numbers: Option<Vec<f64>> =
        by_level.iter().map(|(level, _)| level.parse::<f64>().ok()).collect();
    if let Some(numbers) = numbers.filter(|numbers| numbers.len() > BINS) {
        by_level = binned(by_level, &numbers);
    }
    let row = |(level, records): (String, Vec<&SweepRecord>)| SweepLevel {
        factor: factor.to_owned(),
        level,
        tally: SweepTally::of(records),
    };
    by_level.into_iter().map(row).collect()
}

type OfLevel<'a> = (String, Vec<&'a SweepRecord>);

fn binned<'a>(levels: Vec<OfLevel<'a>>, numbers: &[f64]) -> Vec<OfLevel<'a>> {
    let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
    let high = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = (high - low) / BINS as f64;
    let edge = |bin: usize| low + bin as f64 * width;
    let name = |bin: usize| format!("{:.3} to {:.3}", edge(bin), edge(bin + 1));
    let mut bins: Vec<OfLevel<'a>> = (0..BINS).map(|bin| (name(bin), Vec::new())).collect();
    for ((_, records), number) in levels.into_iter().zip(numbers) {
        let bin = (((number - low) / width) as usize).min(BINS - 1);
        bins[bin].1.extend(records);
    }
    bins
}
