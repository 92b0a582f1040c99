//! The clock that all processes of a run share.

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::clock::monotonic_resolution_ns;

pub(super) const CHECK: Check =
    Check { name: "clock", look: |_: Option<&RunNeeds>| vec![judge(monotonic_resolution_ns())] };

/// Steps of the clock that are too coarse to tell frames apart by, nanoseconds.
const COARSE_NS: u64 = 1_000_000;

fn judge(resolution_ns: u64) -> Judgement {
    let measured = format!("CLOCK_MONOTONIC in steps of {resolution_ns} ns");
    if resolution_ns <= COARSE_NS {
        return Judgement::ok(measured);
    }
    let remedy = "boot with a high-resolution timer (highres=on), or run on another machine: ages and latencies \
                  are coarse here";
    Judgement::warning(measured, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn a_clock_of_ten_milliseconds_is_coarse() {
        assert_eq!(judge(1), Judgement::ok("CLOCK_MONOTONIC in steps of 1 ns"));
        assert_eq!(judge(10_000_000).health, Health::Warning);
    }
}
