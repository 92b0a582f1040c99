//! Whether a report is as good as an earlier one.

use std::collections::BTreeMap;

use super::measure::{Cell, Key};
use super::report::StressReport;

/// How much slower a median may be before it is a regression.
const SLOWER_MAX: f64 = 1.2;
/// Differences below this are within what the clock and cold caches do from run to run, nanoseconds:
/// cells of a few microseconds must get slower by about half to count.
const NOISE_NS: f64 = 2_000.0;

/// What is said of one cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckVerdict {
    /// As quick as before, or quicker.
    Passed,
    /// Slower by more than is allowed.
    Regressed,
    /// Fewer plans than `check_samples_min` in one of the reports.
    TooFew,
    /// The key is in one report only.
    Unmatched,
}

/// One cell beside its earlier self.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// The cell.
    pub key: Key,
    /// Median thread-CPU time before and now, nanoseconds, before normalised to this machine.
    pub before_ns: f64,
    /// Median of this run, nanoseconds.
    pub now_ns: f64,
    /// Whether it counts, and if so whether it is slower.
    pub verdict: CheckVerdict,
}

impl Judgement {
    /// How much slower it is; 1 = as before.
    pub fn ratio(&self) -> f64 {
        self.now_ns / self.before_ns.max(1.0)
    }
}

/// Compares the thread-CPU medians of two reports, cell by cell, in units of each report's own
/// calibration.
pub fn check(now: &StressReport, before: &StressReport, samples_min: u64) -> Vec<Judgement> {
    let factor = now.machine.calibration_ns as f64 / before.machine.calibration_ns.max(1) as f64;
    let earlier: BTreeMap<&Key, &Cell> = before.cells.iter().map(|c| (&c.key, c)).collect();
    let current: BTreeMap<&Key, &Cell> = now.cells.iter().map(|c| (&c.key, c)).collect();
    let mut keys: Vec<&Key> = now.cells.iter().map(|cell| &cell.key).collect();
    keys.extend(before.cells.iter().map(|c| &c.key).filter(|key| !current.contains_key(key)));
    let judge = |key: &Key| {
        let (now, before) = (current.get(key), earlier.get(key));
        let now_ns = now.map_or(0.0, |cell| median(cell));
        let before_ns = before.map_or(0.0, |cell| median(cell)) * factor;
        let verdict = match (now, before) {
            (Some(now), Some(before)) if now.count.min(before.count) < samples_min => {
                CheckVerdict::TooFew
            }
            (Some(_), Some(_)) => {
                let slower = now_ns > before_ns * SLOWER_MAX && now_ns > before_ns + NOISE_NS;
                if slower { CheckVerdict::Regressed } else { CheckVerdict::Passed }
            }
            _ => CheckVerdict::Unmatched,
        };
        Judgement { key: key.clone(), before_ns, now_ns, verdict }
    };
    keys.into_iter().map(judge).collect()
}

/// The least of the repeats' medians: whatever else the machine does makes one longer, never shorter.
fn median(cell: &Cell) -> f64 {
    cell.cpu_p50_ns_by_repeat.iter().min().map_or(0.0, |&ns| ns as f64)
}

#[cfg(test)]
mod tests {
    use super::super::measure::Samples;
    use super::super::{Machine, Workload};
    use super::*;
    use crate::stress::measure::Timing;

    fn report(calibration_ns: u64, cells: &[(&str, u64, usize)]) -> StressReport {
        let cell = |&(rung, cpu_ns, count): &(&str, u64, usize)| {
            let timing = Timing { decide_cpu_ns: cpu_ns, ..Timing::default() };
            let samples = Samples { timings: vec![vec![timing; count]; 3], ..Samples::default() };
            samples.cell(&Key {
                case: "c".to_owned(),
                size: 3,
                problem: None,
                feed: Workload::Random,
                rate: "max".to_owned(),
                rung: rung.to_owned(),
            })
        };
        let machine =
            Machine { processor: String::new(), processors: 1, load: Vec::new(), calibration_ns };
        StressReport {
            format: 1,
            config: String::new(),
            planner: String::new(),
            seed: 0,
            repeats: 3,
            machine,
            cells: cells.iter().map(cell).collect(),
            comparisons: Vec::new(),
        }
    }

    fn verdicts(now: &StressReport, before: &StressReport) -> Vec<CheckVerdict> {
        check(now, before, 30).iter().map(|judgement| judgement.verdict).collect()
    }

    #[test]
    fn a_slower_median_is_a_regression_on_a_machine_that_is_as_fast() {
        let before = report(1000, &[("search", 10_000, 20)]);
        assert_eq!(verdicts(&before, &before), [CheckVerdict::Passed]);
        let slower = report(1000, &[("search", 12_500, 20)]);
        assert_eq!(verdicts(&slower, &before), [CheckVerdict::Regressed]);
        assert_eq!(verdicts(&before, &slower), [CheckVerdict::Passed]);
        let on_a_slow_machine = report(1250, &[("search", 12_500, 20)]);
        assert_eq!(verdicts(&on_a_slow_machine, &before), [CheckVerdict::Passed]);
        let on_a_fast_machine = report(700, &[("search", 10_000, 20)]);
        assert_eq!(verdicts(&on_a_fast_machine, &before), [CheckVerdict::Regressed]);
    }

    #[test]
    fn a_disturbed_repeat_is_no_regression() {
        let before = report(1000, &[("search", 10_000, 20)]);
        let mut now = before.clone();
        now.cells[0].cpu_p50_ns_by_repeat = vec![25_000, 10_100, 19_000];
        assert_eq!(verdicts(&now, &before), [CheckVerdict::Passed]);
    }

    #[test]
    fn what_cannot_be_told_is_not_judged() {
        let before = report(1000, &[("table", 500, 20), ("search", 10_000, 3)]);
        let now = report(1000, &[("table", 700, 20), ("search", 90_000, 3), ("suffix", 1, 20)]);
        let expected = [CheckVerdict::Passed, CheckVerdict::TooFew, CheckVerdict::Unmatched];
        assert_eq!(verdicts(&now, &before), expected);
        let expected = [CheckVerdict::Passed, CheckVerdict::TooFew, CheckVerdict::Unmatched];
        assert_eq!(verdicts(&before, &now), expected);
    }
}
