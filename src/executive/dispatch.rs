//! No action leaves unless its preconditions are known to hold in the newest confirmed state.

use super::limits::LookTime;
use super::re_observing::with_anomalies;
use super::running::Running;
use super::{Answer, Cycle, Executive, Phase};
use crate::logic::{Facts, Truth, Universe, bind, effects, evaluate, unsatisfied};
use crate::messages::{CommandKind, CommandWatch, Dispatch, Effects, Event, Limit, Verdict};
use crate::pddl::{Domain, Step, Typed};
use crate::skills::{Held, Preempt, SkillError};

/// Why a step may not start.
enum Refusal {
    /// The scene is too old, too young, or another one.
    NotYet(String),
    /// Something that must hold is not known.
    Unknown(String),
}

impl Executive {
    /// Starts a step, or says why not.
    pub(super) fn dispatch(&mut self, cycle: &mut Cycle<'_>, step: &Step) -> Answer {
        if cycle.config.motion.is_none() || cycle.input.robot.is_none() {
            let looked_into = self.re_observe_anomalies(cycle, &[]);
            return looked_into.unwrap_or(Answer::End(Verdict::Planned));
        }
        // A robot that was told to hold when another episode ended may not stand yet.
        let moving = cycle.input.robot.and_then(|robot| robot.command_id);
        if moving.is_some_and(|id| id <= self.command_id_before) {
            return self.look(cycle, "the robot does not stand still yet".to_owned());
        }
        match Self::may_start(cycle, step) {
            Ok(()) => {}
            Err(Refusal::NotYet(reason)) => return self.look(cycle, reason),
            Err(Refusal::Unknown(reason)) => {
                let reason = with_anomalies(reason, &cycle.input.scene.anomalies, &step.args);
                return self.re_observe(cycle, &reason);
            }
        }
        if let Some(answer) = self.re_observe_anomalies(cycle, &step.args) {
            return answer;
        }
        if let Some(verdict) = self.state_revisit_guard(cycle) {
            return Answer::End(verdict);
        }
        if let Some(reason) = self.known_infeasible(cycle, step) {
            return self.re_observe(cycle, &format!("{step} cannot be carried out: {reason}"));
        }
        let started = self.start(cycle, step);
        started.unwrap_or_else(|error| self.cannot_carry_out(cycle, step, &error))
    }

    /// Starts a step, whatever holds; the robot and its motion are configured.
    ///
    /// # Errors
    /// What was perceived does not allow a motion.
    pub(super) fn start(
        &mut self,
        cycle: &mut Cycle<'_>,
        step: &Step,
    ) -> Result<Answer, SkillError> {
        let (Some(motion_config), Some(robot)) = (&cycle.config.motion, cycle.input.robot) else {
            return Ok(Answer::End(Verdict::Planned));
        };
        let objects = &cycle.input.scene.objects;
        let held = self.held.clone().or_else(|| Held::found(objects, motion_config));
        let (motion, held) =
            cycle.config.skills.motion(step, objects, robot, held, motion_config)?;
        self.last_command_id += 1;
        (self.looked, self.views_taken) = (LookTime::default(), 0);
        let cause = cycle.input.scene.cause;
        let target_objects = cycle.config.skills.target_objects(step);
        let targets = target_objects.iter().filter(|name| self.held_name() != Some(name.as_str()));
        let targets: Vec<_> = targets
            .filter_map(|name| {
                Some((name.clone(), cycle.input.scene.object(name.as_str())?.volume?.centre))
            })
            .collect();
        let typed = cycle.input.scene.typed_objects();
        let effects = predicted_effects(&cycle.config.domain, &typed, &cycle.facts, step);
        cycle.dispatch = Some(Dispatch {
            sequence: self.n_dispatches,
            cause,
            command_id: self.last_command_id,
            step: step.clone(),
            effects: effects.clone(),
        });
        self.n_dispatches += 1;
        self.phase = Phase::Running(Running {
            step: step.clone(),
            command_id: self.last_command_id,
            watch: CommandWatch::new(self.last_command_id, cause.frame_sequence),
            started_ns: cause.capture_ns,
            retractable: motion.waypoints.iter().map(|w| w.retractable).collect(),
            targets,
            effects,
            cancelled_ns: None,
            fault: None,
            is_accepted: false,
        });
        self.held = held.or(self.held.take());
        cycle.event(Event::Started { step: step.clone() });
        Ok(Answer::Command(CommandKind::Start(motion)))
    }

    fn held_name(&self) -> Option<&str> {
        self.held.as_ref().map(|held| held.object.as_str())
    }

    /// Somebody watches, age, settledness, preconditions.
    fn may_start(cycle: &Cycle<'_>, step: &Step) -> Result<(), Refusal> {
        if let Some(cause) = &cycle.input.hold {
            return Err(Refusal::NotYet(cause.to_string()));
        }
        let age_ns = cycle.input.now_ns.saturating_sub(cycle.input.scene.cause.capture_ns);
        let age_ms = age_ns / 1_000_000;
        let limit = cycle.config.limits.state_age_ms_max;
        if age_ms > limit {
            let reason =
                format!("the newest scene is {age_ms} ms old (limits.state_age_ms_max = {limit})");
            return Err(Refusal::NotYet(reason));
        }
        let age_ms = cycle.input.robot_age_ns / 1_000_000;
        if age_ms > limit {
            let reason = format!(
                "the newest robot state is {age_ms} ms old (limits.state_age_ms_max = {limit})"
            );
            return Err(Refusal::NotYet(reason));
        }
        if !cycle.is_settled() {
            return Err(Refusal::NotYet(cycle.unsettled()));
        }
        let domain = &cycle.config.domain;
        let action = domain.action(step.action.as_str());
        let Some((action, bindings)) = action.and_then(|a| Some((a, bind(a, &step.args)?))) else {
            return Err(Refusal::NotYet(format!("{step} is not an action of the domain")));
        };
        let objects = cycle.input.scene.typed_objects();
        let universe = Universe { types: &domain.types, objects: &objects };
        let truth = |atom: &_| cycle.facts.truth(atom);
        match evaluate(&action.precondition, &bindings, &universe, &truth) {
            Truth::True => Ok(()),
            Truth::Unknown => {
                let reason = format!("the precondition of {step} is not known to hold");
                Err(Refusal::Unknown(reason))
            }
            Truth::False => {
                let failing = unsatisfied(&action.precondition, &bindings, &universe, &truth);
                let failing = failing.join(", ");
                let reason = format!("the precondition of {step} does not hold: {failing}");
                Err(Refusal::NotYet(reason))
            }
        }
    }

    /// Counts how often the present state was left before by a dispatch.
    fn state_revisit_guard(&mut self, cycle: &Cycle<'_>) -> Option<Verdict> {
        let state: Vec<String> = cycle.facts.known.iter().map(ToString::to_string).collect();
        let state = state.concat();
        if self.last_dispatch_state.as_ref() == Some(&state) {
            return None;
        }
        let visits = self.visits.entry(state.clone()).or_default();
        *visits += 1;
        let visits = *visits;
        self.last_dispatch_state = Some(state);
        let limit = cycle.config.limits.revisits_max;
        (visits > limit + 1).then(|| Verdict::GaveUp {
            limit: Limit::Revisits,
            detail: format!("livelock: the same state was left {} times before", visits - 1),
        })
    }

    /// Cancels a running step where its motion allows it; otherwise it finishes.
    pub(super) fn preempt(&mut self, cycle: &mut Cycle<'_>, reason: String) -> Answer {
        let go_on = Answer::Command(CommandKind::Continue);
        let (Phase::Running(running), Some(robot)) = (&self.phase, cycle.input.robot) else {
            return go_on;
        };
        let action = cycle.config.skills.action(&running.step.action);
        let policy = action.map_or(Preempt::RetractEmpty, |a| a.preempt);
        let allowed = match policy {
            Preempt::Retract => true,
            Preempt::RetractEmpty => !robot.holding,
        };
        if allowed && running.is_retractable(robot.phase) {
            self.cancel(cycle, reason)
        } else {
            go_on
        }
    }

    /// Cancels a running step wherever its motion is: the tool goes straight up and keeps what
    /// it holds. Said once.
    pub(super) fn cancel(&mut self, cycle: &mut Cycle<'_>, reason: String) -> Answer {
        let go_on = Answer::Command(CommandKind::Continue);
        let Phase::Running(running) = &mut self.phase else { return go_on };
        if running.cancelled_ns.is_some() {
            return go_on;
        }
        running.cancelled_ns = Some(cycle.input.now_ns);
        let step = running.step.clone();
        cycle.event(Event::Cancel { step, reason });
        Answer::Command(CommandKind::Cancel)
    }
}

/// What a step changes from a state, as the domain's action says.
pub fn predicted_effects(
    domain: &Domain,
    objects: &[Typed],
    facts: &Facts,
    step: &Step,
) -> Effects {
    let universe = Universe { types: &domain.types, objects };
    let predicted = domain.action(step.action.as_str()).and_then(|action| {
        let bindings = bind(action, &step.args)?;
        Some(effects(action, &bindings, &universe, &|atom| facts.truth(atom)))
    });
    predicted.map_or_else(Effects::default, |changes| Effects {
        add: changes.add,
        delete: changes.delete,
    })
}
