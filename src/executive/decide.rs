//! One cycle, top to bottom.

use super::explain::deviations;
use super::limits::LookTime;
use super::re_observing::with_anomalies;
use super::{Answer, Cycle, Executive, ExecutiveMode, Phase, counted, join};
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
        if cycle.config.mode == ExecutiveMode::OpenLoop
            && let Some(answer) = self.carry_on_blindly(cycle)
        {
            return answer;
        }
        self.explain(cycle);
        self.count_planner_timeouts(cycle);
        if !(cycle.input.plan.verdict.is_goal() && cycle.is_settled()) {
            self.goal_seen = None;
        }
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
                let reason = format!("no plan from the present state: {other}");
                if cycle.is_settled() {
                    self.preempt(cycle, reason)
                } else {
                    Answer::Command(CommandKind::Continue)
                }
            }
            PlanVerdict::Missing { objects } => self.wait_for(cycle, &objects),
            PlanVerdict::Unsolvable { proof, unknowns } => {
                if unknowns {
                    let reason = format!("no plan from the known facts alone ({proof})");
                    let reason = with_anomalies(reason, &cycle.input.scene.anomalies, &[]);
                    return self.re_observe(cycle, &reason);
                }
                if !cycle.is_settled() {
                    return self.look(cycle, cycle.unsettled());
                }
                Answer::End(Verdict::Unsolvable { proof })
            }
            PlanVerdict::Inconsistent { atoms } => {
                let atoms: Vec<String> = atoms.iter().map(ToString::to_string).collect();
                let reason = format!("mutually exclusive facts: {}", atoms.join(", "));
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

    /// Whether the episode has taken too long, or a robot does not answer.
    pub(super) fn out_of_time(&self, cycle: &Cycle<'_>) -> Option<Verdict> {
        let limits = &cycle.config.limits;
        let give_up = |limit, detail| Some(Verdict::GaveUp { limit, detail });
        let started_ns = self.started_ns.unwrap_or(cycle.input.now_ns);
        let seconds = cycle.input.now_ns.saturating_sub(started_ns) as f64 / 1e9;
        if self.is_hung(cycle) {
            let detail = format!("cancel not confirmed within {} s", limits.skill_timeout_s);
            return give_up(Limit::SkillTimeout, detail);
        }
        if self.counts.cycles > limits.cycles_max {
            return give_up(Limit::Cycles, format!("{} cycles", limits.cycles_max));
        }
        if seconds > limits.seconds_max {
            return give_up(Limit::Seconds, format!("{} s", limits.seconds_max));
        }
        None
    }

    /// Whether a budget of the whole episode is used up.
    fn spent(&self, cycle: &Cycle<'_>) -> Option<Verdict> {
        if let Some(verdict) = self.out_of_time(cycle) {
            return Some(verdict);
        }
        if self.failures_total() <= cycle.config.limits.failures_max {
            return None;
        }
        let worst = self.failures.iter().max_by_key(|(_, n)| **n);
        let worst = worst.map(|(step, n)| format!(", {step} {n} times")).unwrap_or_default();
        let detail = format!("{} failed skills{worst}", self.failures_total());
        Some(Verdict::GaveUp { limit: Limit::Failures, detail })
    }

    /// Follows a plan: keeps the running step, switches, or starts the first step.
    fn follow(&mut self, cycle: &mut Cycle<'_>, steps: &[Step], cost: u64) -> Answer {
        self.unseen = LookTime::default();
        self.awaited = None;
        let go_on = Answer::Command(CommandKind::Continue);
        if !cycle.is_settled() {
            return match self.phase {
                Phase::Running(_) => go_on,
                Phase::Idle | Phase::VerifyingEffects(_) | Phase::ReObserving(_) => {
                    self.look(cycle, cycle.unsettled())
                }
            };
        }
        self.switch(cycle, steps, cost);
        if let Some(reason) = hidden_from_goal(cycle)
            && !matches!(self.phase, Phase::Running(_))
        {
            return self.re_observe(cycle, &reason);
        }
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
                let reason = format!("the plan now starts with {step}");
                self.preempt(cycle, reason)
            }
            (_, None) => self.finish(cycle),
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

    /// Waits for one more frame, for at most `limits.observing_s_max` before the next step.
    pub(super) fn look(&mut self, cycle: &mut Cycle<'_>, reason: String) -> Answer {
        let is_first = self.looked.is_zero();
        let max_s = cycle.config.limits.observing_s_max;
        self.looked = self.looked.after(cycle.frame_ns, max_s);
        if self.looked.exceeds(max_s) {
            return Answer::End(Verdict::GaveUp { limit: Limit::Observing, detail: reason });
        }
        if is_first {
            cycle.event(Event::Look { reason });
        }
        Answer::Command(CommandKind::Continue)
    }

    /// Waits for the goal, or for objects that it names, and says for which whenever that changes. Objects
    /// are looked for from the robot's view poses, too.
    fn wait_for(&mut self, cycle: &mut Cycle<'_>, objects: &[Name]) -> Answer {
        let max_s = cycle.config.limits.unseen_s_max;
        self.unseen = self.unseen.after(cycle.frame_ns, max_s);
        let (awaited, text) = Awaited::of(cycle.input.scene, objects);
        if self.unseen.exceeds(max_s) {
            let detail = format!("after {max_s} s still waiting for {text}");
            return Answer::End(Verdict::GaveUp { limit: Limit::Unseen, detail });
        }
        if self.awaited < Some(awaited) {
            self.awaited = Some(awaited);
            cycle.event(Event::Look { reason: format!("waiting for {text}") });
        }
        let view = (awaited == Awaited::Named && cycle.is_settled())
            .then(|| self.take_view(cycle, (self.unseen, max_s), &text));
        view.flatten().unwrap_or(Answer::Command(CommandKind::Continue))
    }

    /// After a failure that needed no motion: the next frame decides.
    pub(super) fn give_up_or_wait(&self, cycle: &Cycle<'_>) -> Answer {
        self.spent(cycle).map_or(Answer::Command(CommandKind::Continue), Answer::End)
    }
}

/// What is waited for before there is a plan, in the order in which it comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Awaited {
    /// An object that is confirmed.
    Objects,
    /// A scene without unconfirmed facts.
    Settled,
    /// The goal.
    Goal,
    /// Objects that the goal names.
    Named,
}

impl Awaited {
    /// What is waited for, and how far it has come; `named` are the objects that the goal names and
    /// that are not in the scene.
    fn of(scene: &Scene, named: &[Name]) -> (Self, String) {
        let seen = scene.objects.iter().filter(|o| o.visibility != Visibility::Implied);
        let n_objects = u32::try_from(seen.count()).unwrap_or(u32::MAX);
        let confirmed = match n_objects {
            0 => "no object confirmed".to_owned(),
            n => format!("{} confirmed", counted(n, "object")),
        };
        if !named.is_empty() {
            let names = join(named);
            return (Self::Named, format!("objects of the goal: {names} ({confirmed})"));
        }
        match (n_objects, scene.unsettled) {
            (0, _) => (Self::Objects, format!("a settled scene: {confirmed}")),
            (_, 0) => (Self::Goal, format!("the goal: not resolved with {confirmed}")),
            (_, n) => {
                let facts = counted(n, "fact");
                (Self::Settled, format!("a settled scene: {facts} unconfirmed"))
            }
        }
    }
}

/// The facts that a constraint decided.
fn constrained(scene: &Scene) -> Vec<Atom> {
    let decided = scene.facts.iter().filter(|fact| fact.origin == Origin::Constrained);
    decided.filter(|fact| fact.confirmed != Truth::False).map(|fact| fact.atom.clone()).collect()
}

/// Why a goal that speaks of all objects is neither reached nor planned for: an object may be hidden.
fn hidden_from_goal(cycle: &Cycle<'_>) -> Option<String> {
    let hiding = cycle.input.scene.anomalies.iter().find(|anomaly| anomaly.may_hide())?;
    let reason = || format!("the goal speaks of all objects, and one may be hidden: {hiding}");
    cycle.input.plan.of_all.then(reason)
}
