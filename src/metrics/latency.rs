//! Latency histograms.

use hdrhistogram::Histogram;
use schemars::JsonSchema;
use serde::Serialize;

/// Largest latency that a histogram tells apart, in microseconds (one minute).
const LATENCY_US_MAX: u64 = 60_000_000;

/// A histogram of microseconds with three significant digits.
#[derive(Debug, Clone)]
pub struct Latency(Histogram<u64>);

/// What is reported of a histogram, in microseconds; zeros when nothing was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Quantiles {
    /// How many values were recorded.
    pub count: u64,
    /// Median.
    pub p50: u64,
    /// 99th percentile.
    pub p99: u64,
    /// Largest.
    pub max: u64,
}

impl Default for Latency {
    #[expect(clippy::expect_used, reason = "the bounds are constants that satisfy the check")]
    fn default() -> Self {
        Self(Histogram::new_with_bounds(1, LATENCY_US_MAX, 3).expect("constant bounds are valid"))
    }
}

impl Latency {
    /// Records one value; what exceeds the range counts as the largest.
    pub fn record_us(&mut self, us: u64) {
        self.0.saturating_record(us);
    }

    /// Adds another histogram.
    pub fn merge(&mut self, other: &Self) {
        if let Err(error) = self.0.add(&other.0) {
            tracing::error!(%error, "histograms of one shape could not be added");
        }
    }

    /// Median, 99th percentile and maximum.
    pub fn quantiles(&self) -> Quantiles {
        Quantiles {
            count: self.0.len(),
            p50: self.0.value_at_quantile(0.5),
            p99: self.0.value_at_quantile(0.99),
            max: self.0.max(),
        }
    }
}
