//! The loop as a pure state machine: what was seen, planned and reported in; one command out.
//!
//! It keeps no clock and does no I/O; everything arrives in [`CycleInput`].

mod limits;
mod safe_state;
mod explain;
mod dispatch;
mod running;
mod re_observing;
mod planner_timeouts;
mod places;
mod infeasible;
mod finish;
mod open_loop;
mod decide;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::logic::Facts;
use crate::messages::{
    AnswerKind, Command, CommandKind, Dispatch, EpisodeCounts, Event, PlanMessage, ReplanCause,
    RobotState, Status, StepOutcome, Stop, Verdict,
};
use crate::pddl::{Domain, Name, Step};
use crate::scene::{Anomaly, FrameRef, Scene};
use crate::skills::{Held, MotionConfig, SkillMap};

pub use dispatch::predicted_effects;
pub use explain::deviations;
pub use limits::Limits;
use limits::LookTime;
pub use open_loop::ExecutiveMode;
pub use safe_state::{HoldCause, Overdue, Watch, WatchBounds, safe_command};

use decide::Awaited;
use finish::GoalSeen;
use infeasible::Infeasible;
use planner_timeouts::PlannerTimeouts;
use re_observing::ReObserving;
use running::{Running, VerifyingEffects};

/// What does not change during an episode.
#[derive(Debug, Clone)]
pub struct ExecutiveConfig {
    /// Whose actions predict what a step changes.
    pub domain: Domain,
    /// How its actions are carried out.
    pub skills: SkillMap,
    /// How the robot moves; `None` without a robot: the first confirmed plan ends the episode.
    pub motion: Option<MotionConfig>,
    /// Every bound of the loop.
    pub limits: Limits,
    /// Whether the loop is closed.
    pub mode: ExecutiveMode,
}

/// Everything one cycle looks at.
#[derive(Debug, Clone, Copy)]
pub struct CycleInput<'a> {
    /// The newest scene.
    pub scene: &'a Scene,
    /// The newest plan.
    pub plan: &'a PlanMessage,
    /// The newest robot state; `None` without a robot.
    pub robot: Option<&'a RobotState>,
    /// How old that state is, nanoseconds; 0 in lockstep, where the robot answers every frame.
    pub robot_age_ns: u64,
    /// Why the robot must hold now; nothing when it may move.
    pub hold: Option<HoldCause>,
    /// What the robot has said since the last cycle.
    pub statuses: &'a [Status],
    /// Run time now: the frame's stamp in lockstep, the monotonic clock otherwise, nanoseconds.
    pub now_ns: u64,
}

/// The answer to one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// What the robot is told.
    pub command: Command,
    /// Which kind of answer this is.
    pub kind: AnswerKind,
    /// What people are told.
    pub events: Vec<Event>,
    /// The step that starts, for the scene parser.
    pub dispatch: Option<Dispatch>,
    /// How dispatched steps ended, for the planner.
    pub outcomes: Vec<StepOutcome>,
    /// How the episode ends, when it does.
    pub verdict: Option<Verdict>,
}

/// The loop's memory. A clone is a checkpoint: a restarted actor goes on from it.
#[derive(Debug, Clone, Default)]
pub struct Executive {
    /// What is counted over the episode.
    pub counts: EpisodeCounts,
    phase: Phase,
    /// What should be seen, if nothing but the skills changes the world.
    expected: Option<Facts>,
    /// The plan that is followed, without what has been done.
    remaining: Option<Vec<Step>>,
    /// Deviations and failures since the last plan switch.
    causes: Vec<ReplanCause>,
    held: Option<Held>,
    last_command_id: u64,
    /// The last command of the episode before, 0 without one.
    command_id_before: u64,
    n_dispatches: u64,
    n_outcomes: u64,
    failures: BTreeMap<Step, u32>,
    /// The cycle of the last failure: its plan does not know of it yet.
    failed_cycle: Option<u64>,
    /// Time spent on looking since the last dispatch.
    looked: LookTime,
    /// How many of the robot's view poses have been taken since the last dispatch.
    views_taken: usize,
    /// Anomalies that another look did not remove.
    accepted_anomalies: BTreeSet<Anomaly>,
    unseen: LookTime,
    /// Since when the goal is seen to hold.
    goal_seen: Option<GoalSeen>,
    /// Steps for which there was no motion.
    infeasible: Vec<Infeasible>,
    /// What is left of the plan of an open loop, once there is one.
    blind_plan: Option<VecDeque<Step>>,
    /// What people were last told to wait for.
    awaited: Option<Awaited>,
    planner_timeouts: PlannerTimeouts,
    /// The picture that the last cycle rested on: its number, and when it was captured.
    last_frame: Option<(u64, u64)>,
    visits: BTreeMap<String, u32>,
    last_dispatch_state: Option<String>,
    started_ns: Option<u64>,
}

/// What the robot is doing, as the loop knows it.
#[derive(Debug, Clone, Default)]
enum Phase {
    /// Nothing.
    #[default]
    Idle,
    /// A step.
    Running(Running),
    /// A step has ended; the scene has not settled yet.
    VerifyingEffects(VerifyingEffects),
    /// A motion that frees the camera's view.
    ReObserving(ReObserving),
}

impl Executive {
    /// The loop of another episode for a robot that has been commanded before: identities of motions go on
    /// growing from `command_id`.
    pub fn after(command_id: u64) -> Self {
        Self { last_command_id: command_id, command_id_before: command_id, ..Self::default() }
    }

    /// Decides the answer to one cycle.
    pub fn on(&mut self, config: &ExecutiveConfig, input: &CycleInput<'_>) -> Decision {
        let mut cycle = Cycle {
            config,
            input,
            facts: input.scene.confirmed(),
            events: Vec::new(),
            dispatch: None,
            outcomes: Vec::new(),
            replanned: false,
            frame_ns: self.since_last_frame_ns(input.scene.cause),
        };
        self.counts.cycles += 1;
        self.started_ns.get_or_insert(input.scene.cause.capture_ns);
        let answer = self.decide(&mut cycle);
        let (kind, verdict) = match answer {
            Answer::Command(kind) => (safe_command(kind, input.hold.as_ref()), None),
            Answer::End(verdict) => (CommandKind::Hold, Some(verdict)),
        };
        let started = matches!(kind, CommandKind::Start(_));
        let replanned = cycle.replanned;
        if let Some(verdict) = &verdict {
            cycle.events.push(Event::End(verdict.clone()));
        }
        Decision {
            command: Command {
                id: self.last_command_id,
                frame_sequence: input.scene.cause.frame_sequence,
                capture_ns: input.scene.cause.capture_ns,
                kind,
                step: self.running_step().cloned(),
            },
            kind: match (replanned, started) {
                (true, _) => AnswerKind::Replan,
                (false, true) => AnswerKind::Dispatch,
                (false, false) => AnswerKind::Continue,
            },
            events: cycle.events,
            dispatch: cycle.dispatch,
            outcomes: cycle.outcomes,
            verdict,
        }
    }

    /// How much later than the picture of the last cycle this one was captured, nanoseconds; a new one counts
    /// for something even when it is the first.
    fn since_last_frame_ns(&mut self, cause: FrameRef) -> u64 {
        match self.last_frame.replace((cause.frame_sequence, cause.capture_ns)) {
            Some((sequence, _)) if sequence == cause.frame_sequence => 0,
            Some((_, before_ns)) => cause.capture_ns.saturating_sub(before_ns).max(1),
            None => 1,
        }
    }

    /// The command and verdict for a stop from outside: the robot holds.
    pub fn stop(&mut self, frame_sequence: u64, capture_ns: u64, stop: Stop) -> Decision {
        let verdict = Verdict::Stopped(stop);
        Decision {
            command: self.hold(frame_sequence, capture_ns),
            kind: AnswerKind::Continue,
            events: vec![Event::End(verdict.clone())],
            dispatch: None,
            outcomes: Vec::new(),
            verdict: Some(verdict),
        }
    }

    /// The command for a pause: the robot holds. A step that it cancels with that is planned
    /// anew.
    pub fn hold(&self, frame_sequence: u64, capture_ns: u64) -> Command {
        Command {
            id: self.last_command_id,
            frame_sequence,
            capture_ns,
            kind: CommandKind::Hold,
            step: self.running_step().cloned(),
        }
    }

    /// The plan that is followed, without what has been done.
    pub fn remaining(&self) -> &[Step] {
        self.remaining.as_deref().unwrap_or_default()
    }

    /// Whether the robot has been told to move: for a step, or for another view.
    pub fn is_moving(&self) -> bool {
        matches!(self.phase, Phase::Running(_) | Phase::ReObserving(_))
    }

    /// The step that the robot is carrying out.
    pub fn running_step(&self) -> Option<&Step> {
        match &self.phase {
            Phase::Running(running) => Some(&running.step),
            Phase::Idle | Phase::VerifyingEffects(_) | Phase::ReObserving(_) => None,
        }
    }

    fn failures_total(&self) -> u32 {
        self.failures.values().sum()
    }
}

/// One cycle in the making.
struct Cycle<'a> {
    config: &'a ExecutiveConfig,
    input: &'a CycleInput<'a>,
    facts: Facts,
    events: Vec<Event>,
    dispatch: Option<Dispatch>,
    outcomes: Vec<StepOutcome>,
    replanned: bool,
    /// How much later than the picture of the last cycle that of the scene was captured, nanoseconds; 0 when it
    /// is the same one: while a detector works beside the loop, one scene is carried over several frames.
    frame_ns: u64,
}

impl Cycle<'_> {
    fn event(&mut self, event: Event) {
        self.events.push(event);
    }

    fn is_settled(&self) -> bool {
        self.input.scene.unsettled == 0
    }

    /// Why a scene that is not settled is looked at again.
    fn unsettled(&self) -> String {
        format!("scene not settled: {}", counted(self.input.scene.unsettled, "unconfirmed fact"))
    }
}

/// What a cycle comes to.
enum Answer {
    Command(CommandKind),
    End(Verdict),
}

/// A number of things for messages.
fn counted(n: u32, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// A name list for messages.
fn join(names: &[Name]) -> String {
    names.iter().map(Name::as_str).collect::<Vec<_>>().join(", ")
}
