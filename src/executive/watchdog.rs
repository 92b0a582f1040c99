//! Whether a robot that moves may go on between two frames: somebody must be watching it.

/// A camera may miss this many frames in a row before nobody watches.
const FRAMES_MISSED_MAX: f64 = 3.0;

/// For how long nothing has come, by the executor's own clock, nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Silence {
    /// Since the newest plan, which every frame leads to.
    pub plan_ns: u64,
    /// Since the newest state of the robot.
    pub robot_ns: u64,
}

impl Silence {
    /// Why the robot must hold; nothing when it may go on. `ms_max` is `limits.unwatched_ms_max`, and
    /// `frame_s` the time between two frames.
    pub fn reason_to_hold(self, ms_max: u64, frame_s: f64) -> Option<String> {
        let key = "limits.unwatched_ms_max";
        let ms_max = (ms_max as f64).max(1000.0 * FRAMES_MISSED_MAX * frame_s);
        let said =
            [("frame has led to a plan", self.plan_ns), ("state of the robot", self.robot_ns)];
        said.into_iter().find_map(|(what, ns)| {
            let ms = ns as f64 / 1e6;
            (ms > ms_max).then(|| {
                format!(
                    "the robot holds: no {what} for {ms:.0} ms ({key}, three frames: {ms_max:.0})"
                )
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(plan_ms: u64, robot_ms: u64, frame_s: f64) -> bool {
        let silence = Silence { plan_ns: plan_ms * 1_000_000, robot_ns: robot_ms * 1_000_000 };
        silence.reason_to_hold(1000, frame_s).is_some()
    }

    #[test]
    fn a_robot_that_nobody_watches_holds() {
        assert!(!check(900, 900, 0.1));
        assert!(check(1001, 0, 0.1), "frames do not come");
        assert!(check(0, 1001, 0.1), "the robot says nothing");
        assert!(!check(2900, 0, 1.0), "a slow camera is slow");
        assert!(check(3100, 0, 1.0));
    }
}
