//! Processors, and what else they do.

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::clock::ClockKind;

pub(super) const CHECK: Check = Check {
    name: "cores",
    look: |needs: Option<&RunNeeds>| {
        let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
        let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
        let load = load.split_whitespace().next().and_then(|load| load.parse().ok());
        let rate_hz = needs.filter(|needs| needs.clock == ClockKind::Realtime).map(|n| n.rate_hz);
        vec![judge(n_cores, load, rate_hz)]
    },
};

/// Cores that a run in real time wants for itself: the loop is a pipeline of two threads.
const WANTED: f64 = 2.0;

/// `load` is the mean number of threads that wanted a core in the last minute, `rate_hz` the rate of a run in real
/// time.
fn judge(n_cores: usize, load: Option<f64>, rate_hz: Option<f64>) -> Judgement {
    let busy = load.map_or_else(String::new, |load| format!(", {load:.1} busy"));
    let cores = if n_cores == 1 { "1 core" } else { &format!("{n_cores} cores") };
    let measured = format!("{cores}{busy}");
    let free = n_cores as f64 - load.unwrap_or(0.0);
    match rate_hz {
        None => Judgement::ok(format!("{measured}; in lockstep a run only takes longer")),
        Some(rate_hz) if free < WANTED.min(n_cores as f64) / 2.0 => {
            let measured =
                format!("{measured}; the run has {:.0} ms for a frame", 1000.0 / rate_hz);
            Judgement::warning(measured, "end other programs, or lower camera.rate_hz")
        }
        Some(rate_hz) => {
            Judgement::ok(format!("{measured}; the run has {:.0} ms for a frame", 1000.0 / rate_hz))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn a_busy_machine_is_told_of_runs_in_real_time() {
        assert_eq!(judge(2, Some(0.1), Some(10.0)).health, Health::Ok);
        let busy = judge(2, Some(4.0), Some(10.0));
        assert_eq!(busy.health, Health::Warning);
        assert_eq!(busy.measured, "2 cores, 4.0 busy; the run has 100 ms for a frame");
        assert_eq!(judge(2, Some(4.0), None).health, Health::Ok, "lockstep");
        assert_eq!(judge(1, Some(0.2), Some(10.0)).health, Health::Ok);
        assert_eq!(judge(8, None, Some(30.0)).health, Health::Ok, "a system that does not say");
    }
}
