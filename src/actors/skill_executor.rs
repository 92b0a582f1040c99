//! Skill executor actor: hosts the executive; every plan gets one command.

use std::sync::Arc;

use tokio::sync::watch;

use super::scene_parser::fresh;
use super::{ActorError, Chaos, Checkpoint};
use crate::clock::{ClockKind, monotonic_ns};
use crate::executive::{CycleInput, Decision, Executive, ExecutiveConfig};
use crate::messages::{Event, PlanMessage, RobotState, Stop};
use crate::metrics::{EpisodeMetrics, EpisodeResult};
use crate::scene::Scene;
use crate::transport::convert::{
    WireContext, command_to_wire, device_header, outcome_to_wire, plan_from_wire,
    robot_state_from_wire, scene_from_wire, status_from_wire,
};
use crate::transport::topics::{
    OUTCOME, PLAN, RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS, SCENE,
};
use crate::transport::wire::{
    CommandRecord, DeviceHeader, OutcomeRecord, RobotStateRecord, SceneRecord, StatusRecord,
    StepRecord, TaskHeader,
};
use crate::transport::{Bus, Depth, Publisher, Received, Subscriber, TransportError};

/// Hears what people should be told; the cycle comes with it.
pub type Narrate = Arc<dyn Fn(u64, u64, &Event) + Send + Sync>;

/// What the actor is started with; shared by all its incarnations.
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct Args {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// What does not change.
    pub config: Arc<ExecutiveConfig>,
    /// Which clock scenes are aged by.
    pub clock: ClockKind,
    /// Hears what people should be told (frame's capture stamp in ns, cycle, note).
    pub narrate: Narrate,
    /// Stops the episode from outside.
    pub stop: watch::Receiver<Option<Stop>>,
    /// Where the episode's end is announced.
    pub end: watch::Sender<Option<EpisodeResult>>,
    /// Memory that outlives the actor.
    pub checkpoint: Checkpoint<Memory>,
    /// Panics on purpose.
    pub chaos: Chaos,
}

/// Memory that outlives the actor.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    executive: Executive,
    tally: EpisodeMetrics,
    scene: Option<Scene>,
    robot: Option<RobotState>,
    n_commands: u64,
    last_cycle: Option<u64>,
    last_status: Option<u64>,
}

struct Ports {
    plans: Subscriber<TaskHeader, StepRecord>,
    scenes: Subscriber<TaskHeader, SceneRecord>,
    states: Subscriber<DeviceHeader, RobotStateRecord>,
    statuses: Subscriber<DeviceHeader, StatusRecord>,
    commands: Publisher<DeviceHeader, CommandRecord>,
    outcomes: Publisher<TaskHeader, OutcomeRecord>,
}

/// Answers every plan with one command, until the episode has ended.
///
/// # Errors
/// [`ActorError`] when the bus fails.
pub async fn serve(args: Arc<Args>) -> Result<(), ActorError> {
    let bus = &args.bus;
    let mut ports = Ports {
        plans: bus.subscriber(&PLAN, Depth::newest())?,
        scenes: bus.subscriber(&SCENE, Depth::newest())?,
        states: bus.subscriber(&ROBOT_STATE, Depth::newest())?,
        statuses: bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH))?,
        commands: bus.publisher(&ROBOT_COMMAND)?,
        outcomes: bus.publisher(&OUTCOME)?,
    };
    let mut stop = args.stop.clone();
    let mut memory = args.checkpoint.load();
    loop {
        let read = |m: Received<_, _>| plan_from_wire(m.header(), m.records(), &args.context);
        let plan = tokio::select! {
            biased;
            why = told_to_stop(&mut stop) => return memory.halt(&args, &ports, why),
            plan = ports.plans.newest_of(read) => plan?,
        };
        if memory.last_cycle == Some(plan.cause.cycle) {
            continue; // a restarted planner's history
        }
        args.chaos.message("skill_executor");
        let Some(decision) = memory.decide(&args, &mut ports, &plan)? else { continue };
        memory.publish(&args, &ports, &decision)?;
        let ended = memory.account(&args, &plan, &decision);
        args.checkpoint.store(memory.clone());
        if ended {
            return Ok(());
        }
    }
}

/// Waits until somebody says stop; for ever when nobody is left who could.
async fn told_to_stop(stop: &mut watch::Receiver<Option<Stop>>) -> Stop {
    let why = stop.wait_for(Option::is_some).await.ok().and_then(|why| *why);
    match why {
        Some(why) => why,
        None => std::future::pending().await,
    }
}

impl Memory {
    /// Gathers what has arrived and decides; `None` while no scene has come.
    fn decide(
        &mut self,
        args: &Args,
        ports: &mut Ports,
        plan: &PlanMessage,
    ) -> Result<Option<Decision>, TransportError> {
        let read = |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        self.scene = ports.scenes.drain_newest_of(read)?.or(self.scene.take());
        let read = |m: Received<_, _>| robot_state_from_wire(m.header(), m.records());
        self.robot = ports.states.drain_newest_of(read)?.or(self.robot.take());
        let statuses = fresh(&mut ports.statuses, &mut self.last_status, status_from_wire)?;
        let Some(scene) = &self.scene else { return Ok(None) };
        let now_ns = match args.clock {
            ClockKind::Lockstep => scene.cause.capture_ns,
            ClockKind::Realtime => monotonic_ns(),
        };
        let robot = self.robot.as_ref();
        let input = CycleInput { scene, plan, robot, statuses: &statuses, now_ns };
        Ok(Some(self.executive.on(&args.config, &input)))
    }

    fn publish(
        &mut self,
        args: &Args,
        ports: &Ports,
        decision: &Decision,
    ) -> Result<(), ActorError> {
        for outcome in &decision.outcomes {
            let (header, record) = outcome_to_wire(outcome, &args.context)?;
            ports.outcomes.publish(header, &[record])?;
        }
        let header = device_header(self.n_commands, decision.command.capture_ns);
        ports.commands.publish(header, &[command_to_wire(&decision.command)?])?;
        self.n_commands += 1;
        Ok(())
    }

    /// Books latencies, tells people, and announces the end; returns whether it has come.
    fn account(&mut self, args: &Args, plan: &PlanMessage, decision: &Decision) -> bool {
        self.last_cycle = Some(plan.cause.cycle);
        if let Some(scene) = &self.scene {
            self.tally.count(scene, plan, decision, monotonic_ns());
        }
        let cause = &plan.cause;
        for event in &decision.events {
            (args.narrate)(cause.capture_ns, cause.cycle, event);
        }
        if decision.verdict.is_some() {
            self.announce(args, decision);
        }
        decision.verdict.is_some()
    }

    /// Stops from outside: the robot holds, and the verdict so far is announced.
    fn halt(mut self, args: &Args, ports: &Ports, why: Stop) -> Result<(), ActorError> {
        let cause = self.scene.as_ref().map(|s| s.cause).unwrap_or_default();
        let decision = self.executive.stop(cause.frame_sequence, cause.capture_ns, why);
        self.publish(args, ports, &decision)?;
        for event in &decision.events {
            (args.narrate)(cause.capture_ns, cause.cycle, event);
        }
        self.announce(args, &decision);
        Ok(())
    }

    fn announce(&self, args: &Args, decision: &Decision) {
        let Some(verdict) = decision.verdict.clone() else { return };
        let end = EpisodeResult {
            verdict,
            counts: self.executive.counts,
            tally: self.tally.clone(),
            remaining: self.executive.remaining().to_vec(),
            scene: self.scene.clone(),
        };
        args.end.send_replace(Some(end));
    }
}
