//! What is measured of an episode: a reader of its topics, like any other.

use std::collections::VecDeque;
use std::sync::Arc;

use super::diary::Diary;
use crate::messages::{
    ActorHealth, Command, DecisionMessage, EpisodeEnd, GoalMessage, GoalUpdate, PlanMessage,
    Verdict,
};
use crate::metrics::{AnsweredCycle, EpisodeMetrics, EpisodeResult};
use crate::scene::Scene;
use crate::transport::convert::{
    WireContext, command_from_wire, decision_from_wire, end_from_wire, goal_from_wire,
    health_from_wire, plan_from_wire, scene_from_wire,
};
use crate::transport::topics::{DECISION, GOAL, HEALTH, PLAN, ROBOT_COMMAND, SCENE, VERDICT};
use crate::transport::wire::{
    CommandRecord, DecisionRecord, DeviceHeader, HealthRecord, SceneRecord, StepRecord,
    StreamHeader, TaskHeader,
};
use crate::transport::{Bus, Depth, Received, Subscriber, TransportError};

/// Messages of each topic that wait at most while the observer is busy.
const WAITING: usize = 64;
const DEPTH: Depth = Depth::all(WAITING);
/// Scenes, plans and commands that are kept until the decision that rests on them has come.
const KEPT_MAX: usize = 256;

/// Reads the topics of one episode.
pub(super) struct Observer {
    context: Arc<WireContext>,
    scenes: Subscriber<TaskHeader, SceneRecord>,
    plans: Subscriber<TaskHeader, StepRecord>,
    commands: Subscriber<DeviceHeader, CommandRecord>,
    decisions: Subscriber<StreamHeader, DecisionRecord>,
    verdicts: Subscriber<StreamHeader, u8>,
    goals: Subscriber<TaskHeader, u8>,
    healths: Subscriber<StreamHeader, HealthRecord>,
    waiting: Waiting,
    metrics: EpisodeMetrics,
    /// What was believed and planned, where that will be asked for.
    diary: Option<Diary>,
    last_decision: Option<u64>,
    last_scene: Option<Scene>,
    end: Option<EpisodeEnd>,
    /// Whether the last decision has come.
    is_decided: bool,
    goal: Option<GoalMessage>,
}

/// What the topics told of an episode.
pub(super) struct Observed {
    pub(super) result: EpisodeResult,
    pub(super) goal: Option<GoalMessage>,
    pub(super) diary: Diary,
    pub(super) health: Vec<ActorHealth>,
}

/// What no decision has been heard of yet, oldest first.
#[derive(Default)]
struct Waiting {
    scenes: VecDeque<Scene>,
    plans: VecDeque<PlanMessage>,
    /// With their numbers.
    commands: VecDeque<(u64, Command)>,
}

impl Observer {
    /// Opens the topics; before the actors start, so that nothing is missed.
    pub(super) fn open(bus: &Bus, context: Arc<WireContext>) -> Result<Self, TransportError> {
        Ok(Self {
            context,
            scenes: bus.subscriber(&SCENE, DEPTH)?,
            plans: bus.subscriber(&PLAN, DEPTH)?,
            commands: bus.subscriber(&ROBOT_COMMAND, DEPTH)?,
            decisions: bus.subscriber(&DECISION, Depth::numbered_elsewhere(WAITING))?,
            verdicts: bus.subscriber(&VERDICT, Depth::newest())?,
            goals: bus.subscriber(&GOAL, DEPTH)?,
            healths: bus.subscriber(&HEALTH, Depth::newest())?,
            waiting: Waiting::default(),
            metrics: EpisodeMetrics::default(),
            diary: None,
            last_decision: None,
            last_scene: None,
            end: None,
            is_decided: false,
            goal: None,
        })
    }

    /// Keeps what is believed and planned, too.
    pub(super) fn with_diary(mut self) -> Self {
        self.diary = Some(Diary::default());
        self
    }

    /// Reads until the episode has ended.
    pub(super) async fn watch(&mut self) -> Result<(), TransportError> {
        loop {
            tokio::select! {
                biased;
                message = self.decisions.next() => {
                    if self.decided(&message?)? {
                        return Ok(());
                    }
                }
                message = self.verdicts.next() => {
                    // A stop ends the episode at once; any other end comes with a last decision, or without
                    // one where that was lost.
                    if self.ended(&message?) {
                        return Ok(());
                    }
                }
            }
        }
    }

    /// What the episode came to; `None` when it has not ended. Called once the actors have stopped.
    pub(super) fn finish(mut self) -> Result<Option<Observed>, TransportError> {
        self.drain()?;
        let Some(end) = self.end else { return Ok(None) };
        let scene = self.waiting.scene(end.cause.cycle).or(self.last_scene);
        let EpisodeEnd { verdict, counts, remaining, .. } = end;
        let tally = self.metrics;
        let read = |m: Received<_, _>| health_from_wire(m.header(), m.records(), &self.context);
        let health = self.healths.drain_newest_of(read)?.unwrap_or_default();
        let result = EpisodeResult { verdict, counts, tally, remaining, scene };
        let diary = self.diary.unwrap_or_default();
        Ok(Some(Observed { result, goal: self.goal, diary, health }))
    }

    /// Books an answered frame; whether the episode has ended with it, or was stopped meanwhile.
    fn decided(
        &mut self,
        message: &Received<StreamHeader, DecisionRecord>,
    ) -> Result<bool, TransportError> {
        let read = decision_from_wire(message.header(), message.records(), &self.context);
        let decision: DecisionMessage = match read {
            Ok(decision) if self.last_decision.is_none_or(|last| last < decision.sequence) => {
                decision
            }
            Ok(_) => return Ok(false), // a restarted executor's
            Err(error) => {
                tracing::warn!(topic = DECISION.name, %error, "rejected");
                return Ok(false);
            }
        };
        self.last_decision = Some(decision.sequence);
        self.drain()?;
        let mut has_ended = false;
        while let Some(message) = self.verdicts.poll_next()? {
            has_ended |= self.ended(&message);
        }
        let scene = self.waiting.scene(decision.cause.cycle);
        let plan = self.waiting.plan(decision.plan_cycle);
        let frame = decision.cause.frame_sequence;
        let command = self.waiting.command(decision.sequence, frame);
        if let (Some(scene), Some(plan), Some(command)) = (&scene, &plan, &command) {
            if let Some(diary) = &mut self.diary {
                diary.write(scene, plan);
            }
            let end = self.end.as_ref().filter(|_| decision.is_last);
            self.metrics.count(&AnsweredCycle {
                scene,
                plan,
                command,
                kind: decision.kind,
                verdict: end.map(|end| &end.verdict),
                answered_ns: decision.answered_ns,
            });
        } else {
            let cycle = decision.cause.cycle;
            tracing::error!(cycle, "a cycle is not measured: what it rests on was lost");
        }
        self.last_scene = scene.or(self.last_scene.take());
        self.is_decided |= decision.is_last;
        Ok((self.is_decided && self.end.is_some()) || has_ended)
    }

    /// Takes note of the verdict; whether nothing more comes: the episode was stopped, the last decision has
    /// come, or the verdict is said for the second time.
    fn ended(&mut self, message: &Received<StreamHeader, u8>) -> bool {
        match end_from_wire(message.header(), message.records(), &self.context) {
            Ok(end) => {
                let is_stopped = matches!(end.verdict, Verdict::Stopped(_));
                let is_repeated = self.end.replace(end).is_some();
                is_stopped || is_repeated || self.is_decided
            }
            Err(error) => {
                tracing::warn!(topic = VERDICT.name, %error, "rejected");
                false
            }
        }
    }

    /// Takes in what decisions rest on. The executor has heard of it before it decides.
    fn drain(&mut self) -> Result<(), TransportError> {
        let context = &self.context;
        while let Some(m) = self.scenes.poll_next()? {
            self.waiting.scenes.extend(scene_from_wire(m.header(), m.records(), context));
        }
        while let Some(m) = self.plans.poll_next()? {
            self.waiting.plans.extend(plan_from_wire(m.header(), m.records(), context));
        }
        while let Some(m) = self.commands.poll_next()? {
            let command = command_from_wire(m.header(), m.records());
            let sequence = m.header().sequence;
            self.waiting.commands.extend(command.map(|command| (sequence, command)));
        }
        while let Some(m) = self.goals.poll_next()? {
            if let Ok(GoalUpdate::Known(goal)) = goal_from_wire(m.header(), m.records(), context) {
                self.goal = Some(goal);
            }
        }
        self.waiting.bound();
        Ok(())
    }
}

impl Waiting {
    /// The scene of a cycle; older ones are forgotten, and it stays: several plans may meet it.
    fn scene(&mut self, cycle: u64) -> Option<Scene> {
        while self.scenes.front().is_some_and(|scene| scene.cause.cycle < cycle) {
            self.scenes.pop_front();
        }
        self.scenes.front().filter(|scene| scene.cause.cycle == cycle).cloned()
    }

    fn plan(&mut self, cycle: u64) -> Option<PlanMessage> {
        while self.plans.front().is_some_and(|plan| plan.cause.cycle < cycle) {
            self.plans.pop_front();
        }
        self.plans.front().filter(|plan| plan.cause.cycle == cycle)?;
        self.plans.pop_front()
    }

    /// The command of that number for that frame. Another writer answers frames of which a message was lost on
    /// purpose, and what two writers say comes in any order.
    fn command(&mut self, sequence: u64, frame: u64) -> Option<Command> {
        let is_it = |(number, command): &(u64, Command)| {
            *number == sequence && command.frame_sequence == frame
        };
        let at = self.commands.iter().position(is_it);
        let found = at.and_then(|at| self.commands.remove(at));
        self.commands.retain(|(number, _)| *number > sequence);
        found.map(|(_, command)| command)
    }

    /// Forgets the oldest where too much waits.
    fn bound(&mut self) {
        self.scenes.drain(..self.scenes.len().saturating_sub(KEPT_MAX));
        self.plans.drain(..self.plans.len().saturating_sub(KEPT_MAX));
        self.commands.drain(..self.commands.len().saturating_sub(KEPT_MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{AnswerKind, EpisodeCounts, Stop};
    use crate::pddl::{SourceText, parse_domain};
    use crate::scene::FrameRef;
    use crate::transport::convert::{decision_to_wire, end_to_wire};
    use crate::transport::{Bus, BusConfig};

    /// The last decision before a stop may still be unread when the stop has been announced.
    #[tokio::test]
    async fn a_stop_ends_the_episode_though_a_decision_is_read_with_it() {
        let root = tempfile::tempdir().unwrap();
        let prefix = root.path().file_name().unwrap().to_str().unwrap().replace('.', "");
        let path = Some(root.path().to_owned());
        let bus = BusConfig { root: path, prefix, run: "observer".to_owned() };
        let bus = Bus::open(&bus).unwrap();
        let text = SourceText::new("domain.pddl", "(define (domain none))");
        let domain = parse_domain(&text).unwrap().value;
        let context = Arc::new(WireContext::new(1, 2, domain));
        let mut observer = Observer::open(&bus, Arc::clone(&context)).unwrap();

        let decisions = bus.publisher(&DECISION).unwrap();
        let decision = DecisionMessage {
            sequence: 0,
            cause: FrameRef::default(),
            plan_cycle: 0,
            kind: AnswerKind::Continue,
            answered_ns: 0,
            is_last: false,
        };
        let (header, record) = decision_to_wire(&decision, &context);
        decisions.publish(header, &[record]).unwrap();
        let verdicts = bus.publisher(&VERDICT).unwrap();
        let end = EpisodeEnd {
            cause: FrameRef::default(),
            verdict: Verdict::Stopped(Stop::Request),
            counts: EpisodeCounts::default(),
            remaining: Vec::new(),
        };
        let (header, text) = end_to_wire(&end, &context).unwrap();
        verdicts.publish(header, &text).unwrap();

        let is_over = tokio::select! {
            biased;
            ended = observer.watch() => ended.is_ok(),
            () = std::future::ready(()) => false,
        };
        assert!(is_over, "the observer waits for more");
    }
}
