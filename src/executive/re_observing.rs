//! Re-observation: more frames from where the robot stands, then views that it makes free.

use nalgebra::Point3;

use super::limits::LookTime;
use super::{Answer, Cycle, Executive, Phase};
use crate::messages::{CommandKind, CommandWatch, Event, Expect, Motion};
use crate::pddl::Name;
use crate::scene::Anomaly;
use crate::skills::SkillContext;

/// A motion of the tool for the sake of the camera's view.
#[derive(Debug, Clone)]
pub(super) struct ReObserving {
    pub(super) command_id: u64,
    pub(super) watch: CommandWatch,
    pub(super) started_ns: u64,
    /// When it was told to cancel.
    pub(super) cancelled_ns: Option<u64>,
}

impl Executive {
    /// Looks again for a reason that another view may remove. The present view and each view pose
    /// of the robot have equal shares of `limits.observing_s_max`.
    pub(super) fn re_observe(&mut self, cycle: &mut Cycle<'_>, reason: &str) -> Answer {
        let answer = self.look(cycle, reason.to_owned());
        if matches!(answer, Answer::End(_)) {
            return answer;
        }
        let spent = (self.looked, cycle.config.limits.observing_s_max);
        self.take_view(cycle, spent, reason).unwrap_or(answer)
    }

    /// Goes to the next view pose when its share of a budget of time has come: the present view and
    /// each pose have equal shares. `spent` says how much of how many seconds is used up.
    pub(super) fn take_view(
        &mut self,
        cycle: &mut Cycle<'_>,
        (spent, max_s): (LookTime, f64),
        reason: &str,
    ) -> Option<Answer> {
        let motion = cycle.config.motion.as_ref()?;
        let due = spent.shares(motion.view_poses.len() + 1, max_s);
        if !matches!(self.phase, Phase::Idle)
            || self.views_taken >= due
            || cycle.input.hold.is_some()
        {
            return None;
        }
        self.go_to_view(cycle, reason)
    }

    /// Starts the motion to the next view pose; `None` when all have been taken.
    fn go_to_view(&mut self, cycle: &mut Cycle<'_>, reason: &str) -> Option<Answer> {
        let (config, robot) = (cycle.config.motion.as_ref()?, cycle.input.robot?);
        let pose = config.view_poses.get(self.views_taken)?;
        self.views_taken += 1;
        let view = format!("look from view {}", self.views_taken);
        let objects = &cycle.input.scene.objects;
        let mut context = SkillContext::new(objects, config, robot, self.held.clone());
        let waypoints = context.approach(Point3::from(*pose), Expect::Anything).to_vec();
        self.last_command_id += 1;
        self.phase = Phase::ReObserving(ReObserving {
            command_id: self.last_command_id,
            watch: CommandWatch::new(self.last_command_id, cycle.input.scene.cause.frame_sequence),
            started_ns: cycle.input.now_ns,
            cancelled_ns: None,
        });
        cycle.event(Event::Look { reason: format!("{view}: {reason}") });
        Some(Answer::Command(CommandKind::Start(Motion { waypoints })))
    }

    /// Waits until a view pose is reached. One that takes too long is cancelled: the frames from
    /// there are as good as any.
    pub(super) fn await_view(&mut self, cycle: &Cycle<'_>) -> Option<Answer> {
        let Phase::ReObserving(re_observing) = &mut self.phase else { return None };
        let seconds = cycle.input.now_ns.saturating_sub(re_observing.started_ns) as f64 / 1e9;
        if re_observing.cancelled_ns.is_none() && seconds > cycle.config.limits.skill_timeout_s {
            re_observing.cancelled_ns = Some(cycle.input.now_ns);
            return Some(Answer::Command(CommandKind::Cancel));
        }
        Some(Answer::Command(CommandKind::Continue))
    }

    /// Looks again while there are anomalies that concern what comes next. Anomalies that stay after
    /// `limits.observing_s_max` are told and accepted: what depends on them is unknown, and
    /// nothing is done on unknown facts.
    pub(super) fn re_observe_anomalies(
        &mut self,
        cycle: &mut Cycle<'_>,
        concerned: &[Name],
    ) -> Option<Answer> {
        let scene = cycle.input.scene;
        self.accepted_anomalies.retain(|anomaly| scene.anomalies.contains(anomaly));
        let new: Vec<Anomaly> = relevant(&scene.anomalies, concerned)
            .filter(|anomaly| !self.accepted_anomalies.contains(*anomaly))
            .cloned()
            .collect();
        let first = new.first()?;
        let max_s = cycle.config.limits.observing_s_max;
        if !self.looked.after(cycle.frame_ns, max_s).exceeds(max_s) {
            return Some(self.re_observe(cycle, &first.to_string()));
        }
        cycle.event(Event::Look { reason: format!("accepted after repeated looks: {first}") });
        self.accepted_anomalies.extend(new);
        None
    }
}

/// Why something is not known, with the anomalies that concern it.
pub(super) fn with_anomalies(reason: String, anomalies: &[Anomaly], concerned: &[Name]) -> String {
    let anomalies: Vec<String> = relevant(anomalies, concerned).map(ToString::to_string).collect();
    if anomalies.is_empty() { reason } else { format!("{reason}: {}", anomalies.join(", ")) }
}

/// The anomalies about any of these objects; about any object at all for none.
fn relevant<'a>(anomalies: &'a [Anomaly], concerned: &[Name]) -> impl Iterator<Item = &'a Anomaly> {
    anomalies.iter().filter(|anomaly| {
        concerned.is_empty() || anomaly.objects.iter().any(|object| concerned.contains(object))
    })
}
