//! The report of a sweep as comma-separated values (RFC 4180).

use super::record::SweepRecord;
use super::report::{SweepReport, SweepTally};

/// The titles of a tally's columns.
const TALLY: [&str; 11] = [
    "episodes",
    "successes",
    "success_share",
    "success_share_95_low",
    "success_share_95_high",
    "false_reached",
    "errors",
    "faults",
    "dispatches",
    "against_truth",
    "against_evidence",
];
/// The titles of an episode's columns beside its factors.
const EPISODE: [&str; 16] = [
    "index",
    "point",
    "seed",
    "verdict",
    "reason",
    "goal_in_simulator",
    "cycles",
    "replans",
    "skills_done",
    "skills_failed",
    "sim_seconds",
    "faults",
    "dispatches",
    "against_truth",
    "against_evidence",
    "decision_hash",
];

/// One line for each episode.
pub fn episodes_csv(records: &[SweepRecord]) -> Vec<u8> {
    let factors: Vec<&String> =
        records.first().map(|record| record.factors.keys().collect()).unwrap_or_default();
    let titles = EPISODE.iter().map(ToString::to_string);
    let titles = titles.chain(factors.iter().map(ToString::to_string));
    let line = |record: &SweepRecord| {
        let own = [
            record.index.to_string(),
            record.point.to_string(),
            record.seed.to_string(),
            record.verdict.clone(),
            record.reason.clone(),
            record.goal_in_simulator.map_or_else(String::new, |holds| holds.to_string()),
            record.cycles.to_string(),
            record.replans.to_string(),
            record.skills_done.to_string(),
            record.skills_failed.to_string(),
            record.sim_seconds.to_string(),
            record.faults.to_string(),
            record.dispatches.to_string(),
            record.against_truth.to_string(),
            record.against_evidence.to_string(),
            record.decision_hash.clone(),
        ];
        own.into_iter().chain(record.factors.values().cloned()).collect()
    };
    table(titles.collect(), records.iter().map(line))
}

/// One line for each point of a grid; of a Latin hypercube, for each level of each factor.
pub fn points_csv(report: &SweepReport) -> Vec<u8> {
    let tally_titles = TALLY.iter().map(ToString::to_string);
    if report.points.is_empty() {
        let titles = ["factor", "level"].map(ToOwned::to_owned).into_iter().chain(tally_titles);
        let lines = report.levels.iter().map(|level| {
            let own = [level.factor.clone(), level.level.clone()];
            own.into_iter().chain(cells(&level.tally)).collect()
        });
        return table(titles.collect(), lines);
    }
    let factors = report.points.first().map(|point| point.factors.keys().cloned());
    let titles = factors.into_iter().flatten().chain(tally_titles);
    let lines = report.points.iter();
    let lines =
        lines.map(|point| point.factors.values().cloned().chain(cells(&point.tally)).collect());
    table(titles.collect(), lines)
}

fn cells(tally: &SweepTally) -> [String; TALLY.len()] {
    let [low, high] = tally.success_share_95;
    [
        tally.episodes.to_string(),
        tally.successes.to_string(),
        tally.share().map_or_else(String::new, |share| share.to_string()),
        low.to_string(),
        high.to_string(),
        tally.false_reached.to_string(),
        tally.errors.to_string(),
        tally.faults.to_string(),
        tally.dispatches.to_string(),
        tally.against_truth.to_string(),
        tally.against_evidence.to_string(),
    ]
}

fn table(titles: Vec<String>, lines: impl Iterator<Item = Vec<String>>) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in std::iter::once(titles).chain(lines) {
        // Into memory, and with as many fields in each line, nothing can fail.
        drop(writer.write_record(line));
    }
    writer.into_inner().unwrap_or_default()
}
