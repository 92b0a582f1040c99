//! When the scheduled disturbances of a run file happen.

use groundloop_sim::{SceneSpec, Shape, WorldFault};

use crate::hardware::FaultConfig;
use crate::mismatch::Mismatch;
use crate::pddl::Step;
use crate::settings::near_hint;

/// The disturbances that have not happened yet.
#[derive(Debug, Clone, Default)]
pub(super) struct FaultSchedule {
    waiting: Vec<Scheduled>,
}

#[derive(Debug, Clone)]
struct Scheduled {
    trigger: Trigger,
    action: WorldFault,
}

#[derive(Debug, Clone)]
enum Trigger {
    /// At this simulated time, nanoseconds.
    At(u64),
    /// A while after the `left`-th start of a step that fits.
    During { pattern: String, left: u32, after_ns: u64 },
}

impl FaultSchedule {
    /// The schedule of a run file.
    pub(super) fn new(faults: &[FaultConfig]) -> Result<Self, String> {
        let scheduled = faults.iter().map(|fault| {
            let action: WorldFault = fault.action.clone().try_into().map_err(|e| format!("{e}"))?;
            let nanoseconds = |seconds: f64| (seconds.max(0.0) * 1e9) as u64;
            let trigger = match (&fault.during, fault.at_s) {
                (Some(pattern), _) => Trigger::During {
                    pattern: pattern.clone(),
                    left: fault.nth.unwrap_or(1),
                    after_ns: nanoseconds(fault.after_s.unwrap_or(0.0)),
                },
                (None, at_s) => Trigger::At(nanoseconds(at_s.unwrap_or(0.0))),
            };
            Ok(Scheduled { trigger, action })
        });
        Ok(Self { waiting: scheduled.collect::<Result<_, String>>()? })
    }

    /// Takes note that a step has started.
    pub(super) fn started(&mut self, step: &Step, now_ns: u64) {
        for fault in &mut self.waiting {
            if let Trigger::During { pattern, left, after_ns } = &mut fault.trigger
                && fits(pattern, step)
            {
                *left = left.saturating_sub(1);
                if *left == 0 {
                    fault.trigger = Trigger::At(now_ns + *after_ns);
                }
            }
        }
    }

    /// Takes out what is due.
    pub(super) fn due(&mut self, now_ns: u64) -> Vec<WorldFault> {
        let is_due = |fault: &Scheduled| matches!(fault.trigger, Trigger::At(at) if at <= now_ns);
        let (due, waiting) = std::mem::take(&mut self.waiting).into_iter().partition(is_due);
        self.waiting = waiting;
        let due: Vec<Scheduled> = due;
        due.into_iter().map(|fault| fault.action).collect()
    }
}

/// What faults name that a scene does not have, each by its key.
pub fn fault_mismatches(scene: &SceneSpec, faults: &[FaultConfig]) -> Vec<Mismatch> {
    let unknown = |(idx, fault): (usize, &FaultConfig)| {
        let action: WorldFault = fault.action.clone().try_into().ok()?;
        let (object, what, kind): (_, _, fn(&Shape) -> bool) = match &action {
            WorldFault::Displace { object, .. } | WorldFault::KnockOver { object } => {
                (object, "an object that can move", |shape| !shape.is_fixed())
            }
            WorldFault::BesidePeg { object } => {
                (object, "a disk", |shape| matches!(shape, Shape::Disk { .. }))
            }
            WorldFault::Remove { object }
            | WorldFault::PutBack { object, .. }
            | WorldFault::Topple { object }
            | WorldFault::Hold { object, .. } => {
                (object, "an object that can move", |shape| !shape.is_fixed())
            }
            WorldFault::Push { object, .. } => (object, "an object", |_| true),
            WorldFault::Swap { .. } | WorldFault::TakeFromGripper {} => return None,
        };
        let fits = scene.bodies.iter().filter(|body| kind(&body.shape));
        let known: Vec<&str> = fits.map(|body| body.name.as_str()).collect();
        if known.contains(&object.as_str()) {
            return None;
        }
        let list = if known.is_empty() { "there is none".to_owned() } else { known.join(", ") };
        let expected = format!("{what} in the scene ({list})");
        let got = format!("\"{object}\"{}", near_hint(object, known));
        Some(Mismatch::new(format!("fault[{idx}].action.object"), expected, got))
    };
    faults.iter().enumerate().filter_map(unknown).collect()
}

/// Whether a pattern is the step, or its action: `stack` fits `(stack a b arm)`.
fn fits(pattern: &str, step: &Step) -> bool {
    pattern == step.action.as_str() || pattern == step.to_string()
}
