//! Skill executor actor: hosts the executive; every plan gets one command.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use super::patience::{Waited, waited, was_stopped};
use super::pause::{Pace, Requests};
use super::robot_states::RobotStates;
use super::scene_parser::{Handled, fresh};
use super::{ActorError, Checkpoint, CommandLine, Fatal, Monitor};
use crate::clock::{ClockKind, monotonic_ns};
use crate::executive::{
    CycleInput, Decision, Executive, ExecutiveConfig, HoldCause, Watch, WatchBounds, safe_command,
};
use crate::messages::{
    CommandKind, Control, DecisionMessage, Dispatch, EpisodeEnd, Event, EventMessage, GoalUpdate,
    PlanMessage, RobotState,
};
use crate::scene::{FrameRef, Scene};
use crate::transport::convert::{
    WireContext, decision_to_wire, dispatch_to_wire, end_to_wire, event_to_wire, goal_from_wire,
    outcome_to_wire, plan_from_wire, scene_from_wire, status_from_wire,
};
use crate::transport::topics::{
    CONTROL, DECISION, DISPATCH, EVENT, GOAL, OUTCOME, PLAN, RELIABLE_DEPTH, ROBOT_STATUS, SCENE,
    VERDICT,
};
use crate::transport::wire::{
    ControlRecord, DecisionRecord, DeviceHeader, DispatchRecord, OutcomeRecord, SceneRecord,
    StatusRecord, StepRecord, StreamHeader, TaskHeader,
};
use crate::transport::{Bus, Depth, Publisher, Received, SilenceCause, Subscriber, TransportError};

/// How often the verdict is said again once the episode has ended.
const VERDICT_PERIOD: Duration = Duration::from_millis(100);

/// How often a robot that moves is told to go on or to hold, besides the answers to frames.
const BEAT_PERIOD: Duration = Duration::from_millis(100);

/// What the actor is started with; shared by all its incarnations.
#[derive(Debug)]
pub struct SkillExecutorArgs {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// What does not change.
    pub config: Arc<ExecutiveConfig>,
    /// Which clock scenes are aged by.
    pub clock: ClockKind,
    /// The line to the robot.
    pub commands: Arc<CommandLine>,
    /// Time between two frames, seconds.
    pub frame_s: f64,
    /// How long the state of a robot that acts may be missing, wall time.
    pub robot_wait: Duration,
    /// Memory that outlives the actor.
    pub checkpoint: Checkpoint<SkillExecutorMemory>,
    /// Counts its messages, and lets faults happen on purpose.
    pub monitor: Monitor,
}

impl SkillExecutorArgs {
    /// Whether the robot moves while nobody answers. In lockstep the world stands still then.
    fn moves_freely(&self) -> bool {
        self.clock == ClockKind::Realtime && self.config.motion.is_some()
    }
}

/// Memory that outlives the actor.
#[derive(Debug, Clone, Default)]
pub struct SkillExecutorMemory {
    executive: Executive,
    scene: Option<Scene>,
    robot: Option<RobotState>,
    /// When the newest state came, monotonic clock.
    robot_heard_ns: u64,
    /// When the newest plan was answered, monotonic clock.
    answered_ns: u64,
    /// Whether people have been told that the robot holds since nobody watches it.
    is_unwatched: bool,
    /// Whether a command has been sent since.
    is_robot_asked: bool,
    /// The running step: said with every answer, for a scene parser that has missed it.
    dispatch: Option<Dispatch>,
    n_events: u64,
    requests: Requests,
    last_cycle: Option<u64>,
    last_status: Option<Handled>,
    /// Whether people have been told the goal.
    is_goal_told: bool,
}

struct Ports {
    goals: Subscriber<TaskHeader, u8>,
    plans: Subscriber<TaskHeader, StepRecord>,
    scenes: Subscriber<TaskHeader, SceneRecord>,
    states: RobotStates,
    statuses: Subscriber<DeviceHeader, StatusRecord>,
    controls: Subscriber<DeviceHeader, ControlRecord>,
    dispatches: Publisher<StreamHeader, DispatchRecord>,
    outcomes: Publisher<TaskHeader, OutcomeRecord>,
    decisions: Publisher<StreamHeader, DecisionRecord>,
    events: Publisher<StreamHeader, u8>,
    verdicts: Publisher<StreamHeader, u8>,
}

/// Answers every plan with one command, until the episode has ended.
///
/// # Errors
/// [`ActorError`] when the bus fails.
pub async fn serve(args: Arc<SkillExecutorArgs>) -> Result<(), ActorError> {
    let mut ports = Ports::open(&args.bus, args.clock)?;
    let mut memory = args.checkpoint.load();
    let mut beats = tokio::time::interval(BEAT_PERIOD);
    beats.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    let has_beats = args.moves_freely();
    let mut robot_deadline = Instant::now() + args.robot_wait;
    let mut last_look = Instant::now();
    let mut early: Option<PlanMessage> = None;
    loop {
        memory.forgive_stop(std::mem::replace(&mut last_look, Instant::now()), &args);
        let read = |m: Received<_, _>| plan_from_wire(m.header(), m.records(), &args.context);
        let read_scene =
            |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        let is_paused = memory.requests.pace == Pace::Paused;
        // Nothing can be decided for a robot that is not there yet.
        let waits = args.config.motion.is_some() && memory.robot.is_none();
        // In lockstep nothing else comes before the robot has answered.
        let is_asked = memory.is_robot_asked
            && args.config.motion.is_some()
            && args.clock == ClockKind::Lockstep;
        let plan = tokio::select! {
            biased;
            message = ports.controls.next() => {
                if let Some(decision) = memory.obey(&args, &ports, &message?)? {
                    return memory.stay_open(&args, &ports, &decision).await;
                }
                args.checkpoint.store(memory.clone());
                continue;
            }
            state = ports.states.next(), if waits || is_asked => {
                memory.hear_robot(state?);
                continue;
            }
            waited = waited(robot_deadline, args.robot_wait), if waits || is_asked => {
                if waited == Waited::Out {
                    return Err(robot_is_missing(&args, &mut ports.states));
                }
                robot_deadline = Instant::now() + args.robot_wait;
                continue;
            }
            plan = ports.plans.newest_of(read), if !is_paused && !waits => plan?,
            scene = ports.scenes.newest_of(read_scene), if early.is_some() && !is_paused => {
                memory.scene = Some(scene?);
                let Some(plan) = early.take() else { continue };
                plan
            }
            _ = beats.tick(), if has_beats && !waits => {
                memory.beat(&args, &mut ports)?;
                continue;
            }
        };
        if memory.last_cycle == Some(plan.cause.cycle) {
            continue; // a restarted planner's history
        }
        args.monitor.message("skill_executor").await;
        let Some(decision) = memory.decide(&args, &mut ports, &plan)? else {
            // Its scene was published before the plan, but to those who listened by then.
            early = Some(plan);
            continue;
        };
        memory.tell_goal(&args, &mut ports, plan.cause)?;
        let sequence = memory.publish(&args, &ports, &decision)?;
        memory.tell(&args, &ports, (&plan, sequence), &decision)?;
        args.checkpoint.store(memory.clone());
        if decision.verdict.is_some() {
            return memory.stay_open(&args, &ports, &decision).await;
        }
        robot_deadline = Instant::now() + args.robot_wait;
    }
}

/// No state has come for too long.
fn robot_is_missing(args: &SkillExecutorArgs, states: &mut RobotStates) -> ActorError {
    let seconds = args.robot_wait.as_secs_f64();
    let unusable = |reason: &str| Fatal::BadInput {
        message: format!("no usable state on robot/state for {seconds:.1} s: {reason}"),
    };
    if let Some(reason) = states.refused() {
        return unusable(reason).into();
    }
    let silence = match states.silence(&args.bus) {
        Ok(silence) => silence,
        Err(error) => return error.into(),
    };
    if !silence.cause.is_absence() {
        return unusable(&silence.to_string()).into();
    }
    let what = format!("the robot: no state on robot/state for {seconds:.1} s");
    let is_nobody = silence.cause == SilenceCause::NoWriter;
    let remedy =
        if is_nobody { "start the process that plays it, or raise robot.wait_s; " } else { "" };
    Fatal::Missing { what, how: format!("{remedy}{silence}") }.into()
}

impl Ports {
    fn open(bus: &Bus, clock: ClockKind) -> Result<Self, TransportError> {
        Ok(Self {
            goals: bus.subscriber(&GOAL, Depth::newest())?,
            plans: bus.subscriber(&PLAN, Depth::newest())?,
            scenes: bus.subscriber(&SCENE, Depth::newest())?,
            states: RobotStates::open(bus, clock)?,
            statuses: bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH))?,
            controls: bus.subscriber(&CONTROL, Depth::all(RELIABLE_DEPTH))?,
            dispatches: bus.publisher(&DISPATCH)?,
            outcomes: bus.publisher(&OUTCOME)?,
            decisions: bus.publisher(&DECISION)?,
            events: bus.publisher(&EVENT)?,
            verdicts: bus.publisher(&VERDICT)?,
        })
    }
}

impl SkillExecutorMemory {
    /// At the start of another episode: identities of motions go on growing from `command_id`, and requests of
    /// before `since_ns` (monotonic clock) were meant for others.
    pub fn after(command_id: u64, since_ns: u64) -> Self {
        let (executive, requests) = (Executive::after(command_id), Requests::since(since_ns));
        Self { executive, requests, ..Self::default() }
    }

    /// Between frames, a robot that moves is told to go on as long as somebody watches it.
    fn beat(&mut self, args: &SkillExecutorArgs, ports: &mut Ports) -> Result<(), ActorError> {
        if let Some(state) = ports.states.drain()? {
            self.hear_robot(state);
        }
        if !self.executive.is_moving() {
            return Ok(());
        }
        let cause = self.hold_cause(args, self.answered_ns);
        args.commands.say_again(safe_command(CommandKind::Continue, cause.as_ref()))?;
        self.tell_hold(args, ports, cause)
    }

    /// Why the robot must hold, when the newest plan has come at `planned_ns`.
    fn hold_cause(&self, args: &SkillExecutorArgs, planned_ns: u64) -> Option<HoldCause> {
        if !args.moves_freely() {
            return None;
        }
        let now_ns = monotonic_ns();
        let since = |then_ns: Option<u64>| then_ns.map_or(0, |then| now_ns.saturating_sub(then));
        let watch = Watch {
            is_over: false,
            is_paused: self.requests.pace == Pace::Paused,
            plan_ns: now_ns.saturating_sub(planned_ns),
            robot_ns: now_ns.saturating_sub(self.robot_heard_ns),
            scene_age_ns: since(self.scene.as_ref().map(|scene| scene.cause.capture_ns)),
            robot_age_ns: since(self.robot.as_ref().map(|robot| robot.capture_ns)),
        };
        watch.hold_cause(&WatchBounds::of(&args.config.limits, args.frame_s))
    }

    /// Tells people once that the robot holds since nobody watches it.
    fn tell_hold(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        cause: Option<HoldCause>,
    ) -> Result<(), ActorError> {
        let cause = cause.filter(|cause| *cause != HoldCause::Paused);
        let was_unwatched = std::mem::replace(&mut self.is_unwatched, cause.is_some());
        let Some(cause) = cause.filter(|_| !was_unwatched) else { return Ok(()) };
        let frame = self.scene.as_ref().map(|scene| scene.cause).unwrap_or_default();
        self.event(args, ports, frame, Event::Look { reason: cause.to_string() })
    }

    /// While this process stood still, no robot could be heard.
    fn forgive_stop(&mut self, last_look: Instant, args: &SkillExecutorArgs) {
        if was_stopped(last_look.elapsed(), args.robot_wait).is_some() {
            self.robot_heard_ns = monotonic_ns();
        }
    }

    fn hear_robot(&mut self, state: RobotState) {
        (self.robot, self.robot_heard_ns) = (Some(state), monotonic_ns());
        self.is_robot_asked = false;
    }

    /// Gathers what has arrived and decides; `None` while no scene has come.
    fn decide(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &mut Ports,
        plan: &PlanMessage,
    ) -> Result<Option<Decision>, ActorError> {
        let read = |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        self.scene = ports.scenes.drain_newest_of(read)?.or(self.scene.take());
        if let Some(state) = ports.states.drain()? {
            self.hear_robot(state);
        }
        let silence_ns = u128::from(monotonic_ns().saturating_sub(self.robot_heard_ns));
        // In lockstep the robot speaks when it has been told something.
        let may_be_silent = args.config.motion.is_none() || args.clock == ClockKind::Lockstep;
        if !may_be_silent && silence_ns > args.robot_wait.as_nanos() {
            return Err(robot_is_missing(args, &mut ports.states));
        }
        let statuses = fresh(&mut ports.statuses, &mut self.last_status, status_from_wire)?;
        let Some(scene) = &self.scene else { return Ok(None) };
        let robot = self.robot.as_ref();
        let now_ns = match args.clock {
            // A camera may show what was; the robot says what is.
            ClockKind::Lockstep => {
                robot.map_or(0, |robot| robot.capture_ns).max(scene.cause.capture_ns)
            }
            ClockKind::Realtime => monotonic_ns(),
        };
        let robot_age_ns = match args.clock {
            ClockKind::Lockstep => 0,
            ClockKind::Realtime => robot.map_or(0, |r| now_ns.saturating_sub(r.capture_ns)),
        };
        let hold = self.hold_cause(args, monotonic_ns());
        let statuses = &statuses;
        let input = CycleInput { scene, plan, robot, robot_age_ns, hold, statuses, now_ns };
        let was_moving = self.executive.is_moving();
        let decision = self.executive.on(&args.config, &input);
        self.tell_hold(args, ports, hold.filter(|_| was_moving))?;
        Ok(Some(decision))
    }

    /// Tells people the goal once, before anything moves for it.
    fn tell_goal(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &mut Ports,
        cause: FrameRef,
    ) -> Result<(), ActorError> {
        if self.is_goal_told {
            return Ok(());
        }
        let read = |m: Received<_, _>| goal_from_wire(m.header(), m.records(), &args.context);
        let Some(GoalUpdate::Known(goal)) = ports.goals.drain_newest_of(read)? else {
            return Ok(());
        };
        self.is_goal_told = true;
        let event = Event::Goal { goal: goal.goal.to_string(), said: goal.said };
        self.event(args, ports, cause, event)
    }

    fn publish(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        decision: &Decision,
    ) -> Result<u64, ActorError> {
        for outcome in &decision.outcomes {
            let (header, record) = outcome_to_wire(outcome, &args.context)?;
            ports.outcomes.publish(header, &[record])?;
        }
        let is_running = self.executive.running_step().is_some();
        self.dispatch = decision.dispatch.clone().or(self.dispatch.take()).filter(|_| is_running);
        if let Some(dispatch) = &self.dispatch {
            // Before the command: whoever sees what the command leads to has heard of it.
            let (header, records) = dispatch_to_wire(dispatch, &args.context)?;
            ports.dispatches.publish(header, &records)?;
        }
        self.is_robot_asked = true;
        args.commands.send(&decision.command)
    }

    /// Tells what a cycle came to: events, the end if it has come, and what the command rests on.
    fn tell(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        (plan, sequence): (&PlanMessage, u64),
        decision: &Decision,
    ) -> Result<(), ActorError> {
        let answered_ns = monotonic_ns();
        self.answered_ns = answered_ns;
        self.last_cycle = Some(plan.cause.cycle);
        if self.requests.pace == Pace::Once {
            self.requests.pace = Pace::Paused;
        }
        for event in &decision.events {
            self.event(args, ports, plan.cause, event.clone())?;
        }
        self.announce(args, ports, decision)?;
        let message = DecisionMessage {
            sequence,
            cause: self.scene.as_ref().map(|scene| scene.cause).unwrap_or_default(),
            plan_cycle: plan.cause.cycle,
            kind: decision.kind,
            answered_ns,
            is_last: decision.verdict.is_some(),
        };
        let (header, record) = decision_to_wire(&message, &args.context);
        Ok(ports.decisions.publish(header, &[record])?)
    }

    fn event(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        cause: FrameRef,
        event: Event,
    ) -> Result<(), ActorError> {
        let message = EventMessage { sequence: self.n_events, cause, event };
        let (header, text) = event_to_wire(&message, &args.context)?;
        ports.events.publish(header, &text)?;
        self.n_events += 1;
        Ok(())
    }

    /// The episode has ended. The ports stay open for late joiners, until the supervisor stops the
    /// actor; the verdict is said again for whoever has missed it.
    async fn stay_open(
        &self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        decision: &Decision,
    ) -> Result<(), ActorError> {
        loop {
            tokio::time::sleep(VERDICT_PERIOD).await;
            if args.moves_freely() {
                args.commands.say_again(CommandKind::Hold)?;
            }
            self.announce(args, ports, decision)?;
        }
    }

    /// Does what is asked from outside; what the episode has ended with, if it has.
    fn obey(
        &mut self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        message: &Received<DeviceHeader, ControlRecord>,
    ) -> Result<Option<Decision>, ActorError> {
        let before = self.requests.pace;
        let control = self.requests.take(message);
        let cause = self.scene.as_ref().map(|scene| scene.cause).unwrap_or_default();
        match control {
            Some(Control::Stop(why)) => {
                let decision = self.executive.stop(cause.frame_sequence, cause.capture_ns, why);
                self.publish(args, ports, &decision)?;
                for event in &decision.events {
                    self.event(args, ports, cause, event.clone())?;
                }
                self.announce(args, ports, &decision)?;
                return Ok(Some(decision));
            }
            Some(Control::Pause) if before != Pace::Paused => {
                // In lockstep the world stands still as long as nothing is commanded.
                if args.moves_freely() {
                    let hold = self.executive.hold(cause.frame_sequence, cause.capture_ns);
                    self.is_robot_asked = true;
                    args.commands.send(&hold)?;
                }
                self.event(args, ports, cause, Event::Paused)?;
            }
            Some(Control::Resume) if before != Pace::Free => {
                // Nothing was answered since somebody wanted it so.
                self.answered_ns = monotonic_ns();
                self.event(args, ports, cause, Event::Resumed)?;
            }
            Some(Control::Pause | Control::Resume | Control::Step) | None => {}
        }
        Ok(None)
    }

    fn announce(
        &self,
        args: &SkillExecutorArgs,
        ports: &Ports,
        decision: &Decision,
    ) -> Result<(), ActorError> {
        let Some(verdict) = decision.verdict.clone() else { return Ok(()) };
        let end = EpisodeEnd {
            cause: self.scene.as_ref().map(|scene| scene.cause).unwrap_or_default(),
            verdict,
            counts: self.executive.counts,
            remaining: self.executive.remaining().to_vec(),
        };
        let (header, text) = end_to_wire(&end, &args.context)?;
        Ok(ports.verdicts.publish(header, &text)?)
    }
}
