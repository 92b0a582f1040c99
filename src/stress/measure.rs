//! What was measured: plans by case, workload, rate and source.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Workload;

/// What belongs together in a report.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Key {
    /// Name of the case in the stress file.
    pub case: String,
    /// Size of the problem: the counter `n` of its template.
    pub size: u32,
    /// Name of the problem file; `null` for a problem of a template.
    pub problem: Option<String>,
    /// How the world changes.
    pub feed: Workload,
    /// Scenes per second, or "max".
    pub rate: String,
    /// Which source of the plan-reuse cascade answered; "cold" is the first plan of all, with
    /// grounding.
    pub rung: String,
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { case, size, problem, feed, rate, rung } = self;
        let size = problem.clone().unwrap_or_else(|| size.to_string());
        write!(f, "{case} {size}, {} at {rate}, {rung}", feed.name())
    }
}

/// One plan that came back, nanoseconds.
#[expect(clippy::struct_field_names, reason = "the unit stands last in every name")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Timing {
    /// Processor time of the planner's thread: taking the scene in, and deciding.
    pub(super) observe_cpu_ns: u64,
    pub(super) decide_cpu_ns: u64,
    /// Wall time of both.
    pub(super) wall_ns: u64,
    /// From sending the scene to having the plan.
    pub(super) round_trip_ns: u64,
}

impl Timing {
    pub(super) fn cpu_ns(&self) -> u64 {
        self.observe_cpu_ns + self.decide_cpu_ns
    }
}

/// Quantiles in nanoseconds, exact: every value is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct TimingQuantiles {
    /// Median.
    pub p50: u64,
    /// 90th percentile.
    pub p90: u64,
    /// 99th percentile.
    pub p99: u64,
    /// 99.9th percentile.
    pub p999: u64,
    /// Largest.
    pub max: u64,
}

impl TimingQuantiles {
    /// Of some values; zeros of none.
    pub(super) fn of(values: impl IntoIterator<Item = u64>) -> Self {
        let mut values: Vec<u64> = values.into_iter().collect();
        values.sort_unstable();
        let at = |share: f64| {
            let rank = (share * values.len() as f64).ceil() as usize;
            values.get(rank.saturating_sub(1)).copied().unwrap_or(0)
        };
        Self { p50: at(0.5), p90: at(0.9), p99: at(0.99), p999: at(0.999), max: at(1.0) }
    }
}

/// Plan cost over the cost of a cheapest plan.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CostRatio {
    /// How many plans were compared.
    pub count: u64,
    /// Mean of the ratios.
    pub mean: f64,
    /// The worst one.
    pub max: f64,
}

/// The plans of one key.
#[derive(Debug, Clone, Default)]
pub(super) struct Samples {
    /// By repeat.
    pub(super) timings: Vec<Vec<Timing>>,
    /// Plans that came later than the next scene.
    pub(super) missed: u64,
    /// Plan cost and cheapest cost.
    pub(super) costs: Vec<(u64, u64)>,
}

/// All samples of a stress test.
pub(super) type AllSamples = BTreeMap<Key, Samples>;

/// The plans of one case, size, workload, rate and source.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Cell {
    /// What it is.
    #[serde(flatten)]
    pub key: Key,
    /// Number of plans over all repeats.
    pub count: u64,
    /// Thread-CPU time of the planner for one plan: `observe` and `decide` together.
    pub cpu_ns: TimingQuantiles,
    /// Thread-CPU time of taking in the scene.
    pub observe_cpu_ns: TimingQuantiles,
    /// Thread-CPU time of finding the plan.
    pub decide_cpu_ns: TimingQuantiles,
    /// Wall-clock time of the same work.
    pub wall_ns: TimingQuantiles,
    /// Wall-clock time from sending the scene to receiving the plan.
    pub round_trip_ns: TimingQuantiles,
    /// Plans that came later than the next scene; at "max" there is no such thing.
    pub missed: u64,
    /// Plan cost over the cost of a cheapest plan, where that is known.
    pub cost_ratio: Option<CostRatio>,
    /// Median thread-CPU time of each repeat.
    pub cpu_p50_ns_by_repeat: Vec<u64>,
}

impl Samples {
    pub(super) fn all(&self) -> impl Iterator<Item = &Timing> {
        self.timings.iter().flatten()
    }

    pub(super) fn cell(&self, key: &Key) -> Cell {
        let of = |value: fn(&Timing) -> u64| TimingQuantiles::of(self.all().map(value));
        let by_repeat = self.timings.iter().filter(|timings| !timings.is_empty());
        let median =
            |timings: &Vec<Timing>| TimingQuantiles::of(timings.iter().map(Timing::cpu_ns)).p50;
        Cell {
            key: key.clone(),
            count: self.all().count() as u64,
            cpu_ns: of(Timing::cpu_ns),
            observe_cpu_ns: of(|t| t.observe_cpu_ns),
            decide_cpu_ns: of(|t| t.decide_cpu_ns),
            wall_ns: of(|t| t.wall_ns),
            round_trip_ns: of(|t| t.round_trip_ns),
            missed: self.missed,
            cost_ratio: cost_ratio(&self.costs),
            cpu_p50_ns_by_repeat: by_repeat.map(median).collect(),
        }
    }
}

fn cost_ratio(costs: &[(u64, u64)]) -> Option<CostRatio> {
    let ratio = |&(cost, cheapest): &(u64, u64)| {
        if cheapest == 0 { 1.0 } else { cost as f64 / cheapest as f64 }
    };
    let ratios: Vec<f64> = costs.iter().map(ratio).collect();
    (!ratios.is_empty()).then(|| CostRatio {
        count: ratios.len() as u64,
        mean: ratios.iter().sum::<f64>() / ratios.len() as f64,
        max: ratios.iter().copied().fold(0.0, f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_ranks() {
        let quantiles = TimingQuantiles::of(1..=1000);
        let TimingQuantiles { p50, p90, p99, p999, max } = quantiles;
        assert_eq!([p50, p90, p99, p999, max], [500, 900, 990, 999, 1000]);
        assert_eq!(TimingQuantiles::of([7]).p50, 7);
        assert_eq!(TimingQuantiles::of([]), TimingQuantiles::default());
    }

    #[test]
    fn ratios_are_of_cost_to_the_cheapest() {
        let ratio = cost_ratio(&[(3, 2), (4, 4), (0, 0)]).unwrap();
        assert_eq!((ratio.count, ratio.max), (3, 1.5));
        assert_eq!(cost_ratio(&[]), None);
    }
}
