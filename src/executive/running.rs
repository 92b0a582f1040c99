//! A step in the robot's hands: statuses, timeouts, and what it came to.

use super::limits::LookTime;
use super::re_observing::ReObserving;
use super::{Cycle, Executive, Phase};
use crate::logic::{Facts, Truth};
use crate::messages::{
    CommandWatch, Effects, Event, ReplanCause, RobotState, StatusKind, StepOutcome,
};
use crate::pddl::{Name, Step};
use crate::scene::Visibility;

/// A step that the robot carries out.
#[derive(Debug, Clone)]
pub(super) struct Running {
    pub(super) step: Step,
    pub(super) command_id: u64,
    pub(super) watch: CommandWatch,
    pub(super) started_ns: u64,
    /// Points of the motion until which it may be cancelled.
    pub(super) retractable: Vec<bool>,
    /// Where the objects were that the motion goes to.
    pub(super) targets: Vec<(Name, nalgebra::Point3<f64>)>,
    /// What the step should change.
    pub(super) effects: Effects,
    /// When it was told to cancel.
    pub(super) cancelled_ns: Option<u64>,
    /// Why it counts as failed even if it is cancelled as told.
    pub(super) fault: Option<String>,
    /// Whether the robot has said that it carries it out.
    pub(super) is_accepted: bool,
}

/// A step that has ended; its effects are being looked for.
#[derive(Debug, Clone)]
pub(super) struct VerifyingEffects {
    pub(super) step: Step,
    pub(super) started_ns: u64,
    pub(super) ended_ns: u64,
    pub(super) effects: Effects,
    pub(super) ending: Ending,
    pub(super) fault: Option<String>,
    /// Time spent on looking for its effects.
    pub(super) looked: LookTime,
}

/// What the robot said at the end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Ending {
    Done,
    Failed(String),
    Cancelled,
    /// Nothing; its states show that it has ended.
    Unreported,
}

impl Executive {
    /// Takes in what the robot says: a running step may end.
    pub(super) fn apply_statuses(&mut self, cycle: &Cycle<'_>) {
        for status in cycle.input.statuses {
            if let Phase::ReObserving(re_observing) = &self.phase
                && status.command_id == re_observing.command_id
                && status.kind != StatusKind::Accepted
            {
                // However it ended: the next frames show what can be seen from there.
                self.phase = Phase::Idle;
            }
            let Phase::Running(running) = &mut self.phase else { continue };
            // The word may be lost: who moves has accepted.
            let moves = |robot: &RobotState| robot.command_id == Some(running.command_id);
            running.is_accepted |= cycle.input.robot.is_some_and(moves);
            if status.command_id != running.command_id {
                continue;
            }
            let mut refused = None;
            let ending = match &status.kind {
                StatusKind::Accepted => {
                    running.is_accepted = true;
                    continue;
                }
                StatusKind::Done => Ending::Done,
                StatusKind::Failed(reason) => {
                    refused =
                        (!running.is_accepted).then(|| (running.step.clone(), reason.clone()));
                    Ending::Failed(reason.clone())
                }
                StatusKind::Cancelled => Ending::Cancelled,
            };
            let verifying = running.ended(status.capture_ns, ending);
            self.phase = Phase::VerifyingEffects(verifying);
            if let Some((step, reason)) = refused {
                self.not_again(cycle, &step, reason);
            }
        }
        self.miss_no_end(cycle);
    }

    /// A motion that has ended though nobody has heard so: the status, or the command, was lost.
    fn miss_no_end(&mut self, cycle: &Cycle<'_>) {
        let Some(robot) = cycle.input.robot else { return };
        let is_over = match &mut self.phase {
            Phase::Running(Running { watch, .. })
            | Phase::ReObserving(ReObserving { watch, .. }) => watch.is_over(robot),
            Phase::Idle | Phase::VerifyingEffects(_) => false,
        };
        if is_over {
            self.phase = match &self.phase {
                Phase::Running(running) => {
                    let verifying = running.ended(robot.capture_ns, Ending::Unreported);
                    Phase::VerifyingEffects(verifying)
                }
                Phase::ReObserving(_) | Phase::Idle | Phase::VerifyingEffects(_) => Phase::Idle,
            };
        }
    }

    /// Forgets what was held once the gripper of an idle robot is empty.
    pub(super) fn clear_held(&mut self, cycle: &Cycle<'_>) {
        let holding = cycle.input.robot.is_some_and(|robot| robot.holding);
        if matches!(self.phase, Phase::Idle) && !holding {
            self.held = None;
        }
    }

    /// Judges a step that has ended, once the scene has settled.
    pub(super) fn judge(&mut self, cycle: &mut Cycle<'_>) {
        let Phase::VerifyingEffects(verifying) = &mut self.phase else { return };
        let max_s = cycle.config.limits.observing_s_max;
        verifying.looked = verifying.looked.after(cycle.frame_ns, max_s);
        // What was seen before the end says nothing about what came of it.
        let is_older = cycle.input.scene.cause.capture_ns < verifying.ended_ns;
        let waiting = (is_older || !cycle.is_settled()) && !verifying.looked.exceeds(max_s);
        if waiting {
            return;
        }
        let verifying = verifying.clone();
        self.phase = Phase::Idle;
        let lacking = lacking(&verifying.effects, &cycle.facts);
        let reason = match (&verifying.ending, lacking) {
            (Ending::Cancelled, _) => match &verifying.fault {
                Some(fault) => fault.clone(),
                None => return,
            },
            (Ending::Failed(reason), _) => reason.clone(),
            (Ending::Done, Some(what)) => format!("done, but {what}"),
            (Ending::Unreported, Some(what)) => format!("ended without a word, and {what}"),
            (Ending::Done | Ending::Unreported, None) => {
                let seconds = verifying.ended_ns.saturating_sub(verifying.started_ns) as f64 / 1e9;
                self.succeed(cycle, &verifying, seconds);
                return;
            }
        };
        self.fail(cycle, &verifying.step, reason);
    }

    fn succeed(&mut self, cycle: &mut Cycle<'_>, verifying: &VerifyingEffects, seconds: f64) {
        self.counts.skills_done += 1;
        if let Some(expected) = &mut self.expected {
            apply(&verifying.effects, expected);
        }
        if let Some(remaining) = &mut self.remaining
            && remaining.first() == Some(&verifying.step)
        {
            remaining.remove(0);
        }
        cycle.event(Event::Done { step: verifying.step.clone(), seconds });
        self.report(cycle, &verifying.step, true);
    }

    /// Counts a failure and tells planner and people.
    pub(super) fn fail(&mut self, cycle: &mut Cycle<'_>, step: &Step, reason: String) {
        self.counts.skills_failed += 1;
        self.failed_cycle = Some(cycle.input.plan.cause.cycle);
        let failures = self.failures.entry(step.clone()).or_default();
        *failures += 1;
        let failures = *failures;
        cycle.event(Event::Failed { step: step.clone(), reason: reason.clone(), failures });
        self.causes.push(ReplanCause::Failure { step: step.clone(), reason });
        self.report(cycle, step, false);
    }

    fn report(&mut self, cycle: &mut Cycle<'_>, step: &Step, succeeded: bool) {
        let sequence = self.n_outcomes;
        self.n_outcomes += 1;
        let failures = self.failures.get(step).copied().unwrap_or(0);
        cycle.outcomes.push(StepOutcome { sequence, step: step.clone(), succeeded, failures });
    }

    /// Whether a running step's time is up.
    pub(super) fn overdue(&self, cycle: &Cycle<'_>) -> Option<String> {
        let Phase::Running(running) = &self.phase else { return None };
        let seconds = cycle.input.now_ns.saturating_sub(running.started_ns) as f64 / 1e9;
        let timeout_s = cycle.config.limits.skill_timeout_s;
        (seconds > timeout_s).then(|| format!("longer than limits.skill_timeout_s = {timeout_s}"))
    }

    /// Whether something that a running step goes to is no longer where it was.
    pub(super) fn moved(&self, cycle: &Cycle<'_>) -> Option<String> {
        let Phase::Running(running) = &self.phase else { return None };
        let limit = cycle.config.limits.target_moved_m_max;
        running.targets.iter().find_map(|(name, planned)| {
            let object = cycle.input.scene.object(name.as_str())?;
            if object.visibility == Visibility::Held {
                return None; // it goes with the tool
            }
            let moved = (object.volume?.centre - planned).norm();
            (moved > limit).then(|| {
                format!("{name} has moved by {moved:.2} m (limits.target_moved_m_max = {limit})")
            })
        })
    }

    /// Whether the robot did not even cancel in time.
    pub(super) fn is_hung(&self, cycle: &Cycle<'_>) -> bool {
        let cancelled_ns = match &self.phase {
            Phase::Running(running) => running.cancelled_ns,
            Phase::ReObserving(re_observing) => re_observing.cancelled_ns,
            Phase::Idle | Phase::VerifyingEffects(_) => None,
        };
        cancelled_ns.is_some_and(|at| {
            let seconds = cycle.input.now_ns.saturating_sub(at) as f64 / 1e9;
            seconds > cycle.config.limits.skill_timeout_s
        })
    }
}

impl Running {
    /// The step once it has ended.
    fn ended(&self, ended_ns: u64, ending: Ending) -> VerifyingEffects {
        VerifyingEffects {
            step: self.step.clone(),
            started_ns: self.started_ns,
            ended_ns,
            effects: self.effects.clone(),
            ending,
            fault: self.fault.clone(),
            looked: LookTime::default(),
        }
    }

    /// Whether the motion may be cancelled where the robot is now.
    pub(super) fn is_retractable(&self, phase: usize) -> bool {
        self.retractable.get(phase).copied().unwrap_or(false)
    }
}

/// What of a step's changes is not to be seen; `None` when all is.
fn lacking(effects: &Effects, facts: &Facts) -> Option<String> {
    let not_added = effects.add.iter().find(|atom| facts.truth(atom) != Truth::True);
    let not_deleted = effects
        .delete
        .iter()
        .find(|atom| !effects.add.contains(*atom) && facts.truth(atom) != Truth::False);
    not_added
        .map(|atom| format!("{atom} is not observed"))
        .or_else(|| not_deleted.map(|atom| format!("{atom} still holds")))
}

/// Applies a step's changes to expected facts.
fn apply(effects: &Effects, facts: &mut Facts) {
    for atom in &effects.delete {
        facts.set(atom.clone(), Truth::False);
    }
    for atom in &effects.add {
        facts.set(atom.clone(), Truth::True);
    }
}
