//! One cycle, top to bottom.

use super::explain::deviations;
use super::re_observing::with_anomalies;
use super::{Answer, Cycle, Executive, Phase, join};
use crate::logic::Truth;
use crate::messages::{CommandKind, Event, Limit, PlanVerdict, ReplanCause, Verdict};
use crate::pddl::{Atom, Name, Step};
use crate::scene::{Origin, Scene, Visibility};

impl Executive {
    /// Hears the robot, judges what has ended, explains what has changed, follows the plan.
    pub(super) fn decide(&mut self, cycle: &mut Cycle<'_>) -> Answer {
        self.apply_statuses(cycle);
        self.judge(cycle);
        self.clear_held(cycle);
        self.explain(cycle);
        self.count_planner_timeouts(cycle);
        if let Some(verdict) = self.spent(cycle) {
            return Answer::End(verdict);
        }
        let unheard =
            self.failed_cycle.is_some_and(|failed| cycle.input.plan.cause.cycle <= failed);
        if unheard || matches!(self.phase, Phase::VerifyingEffects(_)) {
            return Answer::Command(CommandKind::Continue);
        }
        if let Some(answer) = self.await_view(cycle) {
            return answer;
        }
        if let Some(reason) = self.overdue(cycle) {
            if let Phase::Running(running) = &mut self.phase {
                running.fault = Some(reason.clone());
            }
            return self.cancel(cycle, reason);
        }
        let plan = cycle.input.plan.verdict.clone();
        match plan {
            PlanVerdict::Plan { steps, cost } => self.follow(cycle, &steps, cost),
            PlanVerdict::OutOfBudget { limit } => self.do_without_plan(cycle, &limit),
            PlanVerdict::Inconsistent { .. } if matches!(self.phase, Phase::Running(_)) => {
                // The step was right when it was started; the facts may be right again at its end.
                Answer::Command(CommandKind::Continue)
            }
            other if matches!(self.phase, Phase::Running(_)) => {
                let reason = format!("there is no plan any more ({other:?})");
                if cycle.is_settled() {
                    self.preempt(cycle, reason)
                } else {
                    Answer::Command(CommandKind::Continue)
                }
            }
            PlanVerdict::Missing { objects } => self.wait_for(cycle, &objects),
            PlanVerdict::Unsolvable { proof, unknowns } => {
                if unknowns {
                    let reason = format!("no plan without the unknown facts ({proof})");
                    let reason = with_anomalies(reason, &cycle.input.scene.anomalies, &[]);
                    return self.re_observe(cycle, &reason);
                }
                if !cycle.is_settled() {
                    return self.look(cycle, "the scene is not settled".to_owned());
                }
                Answer::End(Verdict::Unsolvable { proof })
            }
            PlanVerdict::Inconsistent { atoms } => {
                let atoms: Vec<String> = atoms.iter().map(ToString::to_string).collect();
                let reason = format!("these facts exclude each other: {}", atoms.join(", "));
                let reason = with_anomalies(reason, &cycle.input.scene.anomalies, &[]);
                self.re_observe(cycle, &reason)
            }
            PlanVerdict::Unsupported { feature } => Answer::End(Verdict::GaveUp {
                limit: Limit::Planner,
                detail: format!("unsupported: {feature}"),
            }),
        }
    }

    /// Compares what is seen with what was expected, and tells the difference.
    fn explain(&mut self, cycle: &mut Cycle<'_>) {
        let objects = &cycle.input.scene.objects;
        let nothing_seen = objects.iter().all(|o| o.visibility == Visibility::Implied);
        if nothing_seen || !cycle.is_settled() || matches!(self.phase, Phase::VerifyingEffects(_)) {
            return;
        }
        let known = self.expected.is_some();
        let changed = match &self.expected {
            Some(expected) => deviations(expected, &cycle.facts, &cycle.config.domain),
            None => Vec::new(),
        };
        for deviation in &changed {
            cycle.event(Event::Deviation(deviation.clone()));
            self.causes.push(ReplanCause::Deviation(deviation.clone()));
        }
        let facts = &cycle.facts;
        let done = cycle.events.iter().any(|event| matches!(event, Event::Done { .. }));
        if !known || done || !changed.is_empty() {
            let state = Event::State {
                facts: facts.known.iter().cloned().collect(),
                unknown: facts.unknown.iter().cloned().collect(),
                constrained: constrained(cycle.input.scene),
            };
            self.expected = Some(facts.clone());
            cycle.event(state);
        }
    }

    /// Whether a budget of the whole episode is used up.
    fn spent(&self, cycle: &Cycle<'_>) -> Option<Verdict> {
        let limits = &cycle.config.limits;
        let give_up = |limit, detail| Some(Verdict::GaveUp { limit, detail });
        let started_ns = self.started_ns.unwrap_or(cycle.input.now_ns);
        let seconds = cycle.input.now_ns.saturating_sub(started_ns) as f64 / 1e9;
        if self.is_hung(cycle) {
            return give_up(Limit::SkillTimeout, "the robot does not break off".to_owned());
        }
        if self.counts.cycles > limits.cycles_max {
            return give_up(Limit::Cycles, format!("{} cycles", limits.cycles_max));
        }
        if seconds > limits.seconds_max {
            return give_up(Limit::Seconds, format!("{} s", limits.seconds_max));
        }
        if self.failures_total() > limits.failures_max {
            let worst = self.failures.iter().max_by_key(|(_, n)| **n);
            let worst = worst.map(|(step, n)| format!(", {step} {n} times")).unwrap_or_default();
            let detail = format!("{} failed skills{worst}", self.failures_total());
            return give_up(Limit::Failures, detail);
        }
        None
    }

    /// Follows a plan: keeps the running step, switches, or starts the first step.
    fn follow(&mut self, cycle: &mut Cycle<'_>, steps: &[Step], cost: u64) -> Answer {
        self.unseen_frames = 0;
        let go_on = Answer::Command(CommandKind::Continue);
        if !cycle.is_settled() {
            return match self.phase {
                Phase::Running(_) => go_on,
                Phase::Idle | Phase::VerifyingEffects(_) | Phase::ReObserving(_) => {
                    self.look(cycle, "the scene is not settled".to_owned())
                }
            };
        }
        self.switch(cycle, steps, cost);
        let first = steps.first();
        match (&self.phase, first) {
            (Phase::Running(running), Some(step)) if running.step == *step => {
                match self.moved(cycle) {
                    Some(reason) => self.preempt(cycle, reason),
                    None => go_on,
                }
            }
            (Phase::Running(_), None) => go_on,
            (Phase::Running(_), Some(step)) => {
                let reason = format!("{step} comes first now");
                self.preempt(cycle, reason)
            }
            (_, None) => {
                self.re_observe_anomalies(cycle, &[]).unwrap_or(Answer::End(Verdict::Reached))
            }
            (_, Some(step)) => {
                let step = step.clone();
                self.dispatch(cycle, &step)
            }
        }
    }

    /// Takes over a new plan; tells and counts the switch when it has a cause.
    fn switch(&mut self, cycle: &mut Cycle<'_>, steps: &[Step], cost: u64) {
        let old = match &self.remaining {
            Some(remaining) if remaining == steps => {
                return;
            }
            Some(remaining) => remaining.first().cloned(),
            None => None,
        };
        let is_first = self.remaining.is_none();
        self.remaining = Some(steps.to_vec());
        let causes = std::mem::take(&mut self.causes);
        if !is_first && !causes.is_empty() {
            self.counts.replans += 1;
            cycle.replanned = true;
            cycle.event(Event::Replan { causes, old });
        }
        if !steps.is_empty() {
            cycle.event(Event::Plan { steps: steps.to_vec(), cost });
        }
    }

    /// Waits for one more frame, at most `limits.looks_max` times in a row.
    pub(super) fn look(&mut self, cycle: &mut Cycle<'_>, reason: String) -> Answer {
        self.looks += u32::from(cycle.is_new_frame);
        if self.looks > cycle.config.limits.looks_max {
            return Answer::End(Verdict::GaveUp { limit: Limit::Looks, detail: reason });
        }
        if self.looks == 1 && cycle.is_new_frame {
            cycle.event(Event::Look { reason });
        }
        Answer::Command(CommandKind::Continue)
    }

    /// Waits for objects that the goal names.
    fn wait_for(&mut self, cycle: &mut Cycle<'_>, objects: &[Name]) -> Answer {
        self.unseen_frames += u32::from(cycle.is_new_frame);
        let detail = if objects.is_empty() {
            "what is seen does not allow the goal to be understood".to_owned()
        } else {
            format!("never seen: {}", join(objects))
        };
        if self.unseen_frames > cycle.config.limits.unseen_frames_max {
            return Answer::End(Verdict::GaveUp { limit: Limit::UnseenFrames, detail });
        }
        if self.unseen_frames == 1 && cycle.is_new_frame {
            let reason = if objects.is_empty() {
                "the goal cannot be understood before more is seen".to_owned()
            } else {
                format!("the goal names {}, which nobody has seen yet", join(objects))
            };
            cycle.event(Event::Look { reason });
        }
        Answer::Command(CommandKind::Continue)
    }

    /// After a failure that needed no motion: the next frame decides.
    pub(super) fn give_up_or_wait(&self, cycle: &Cycle<'_>) -> Answer {
        self.spent(cycle).map_or(Answer::Command(CommandKind::Continue), Answer::End)
    }
}

/// The facts that a constraint decided.
fn constrained(scene: &Scene) -> Vec<Atom> {
    let decided = scene.facts.iter().filter(|fact| fact.origin == Origin::Constrained);
    decided.filter(|fact| fact.confirmed != Truth::False).map(|fact| fact.atom.clone()).collect()
}
