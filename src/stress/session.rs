//! One planner actor on a bus of its own, asked scene by scene.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::timeout;

use super::error::StressError;
use super::measure::Timing;
use super::workload::View;
use crate::actors::{Fatal, HealthReport, Monitor, Supervision, SupervisorConfig, supervise};
use crate::clock::{ClockKind, monotonic_ns};
use crate::logic::Facts;
use crate::messages::{GoalMessage, GoalUpdate, PlanMessage, PlanSource, PlanVerdict};
use crate::pddl::{Problem, Step};
use crate::planners::PlannerConfig;
use crate::run::{DomainFolder, PlannerSetup, new_run_id};
use crate::transport::convert::{WireContext, goal_to_wire, plan_from_wire, scene_to_wire};
use crate::transport::topics::{GOAL, PLAN, SCENE};
use crate::transport::wire::{SceneRecord, StepRecord, TaskHeader};
use crate::transport::{Bus, BusConfig, Depth, Publisher, Received, Subscriber};

/// One planner with its topics.
pub(super) struct Session {
    context: Arc<WireContext>,
    scenes: Publisher<TaskHeader, SceneRecord>,
    plans: Subscriber<TaskHeader, StepRecord>,
    /// Kept open: the goal is said once, and handed to whoever comes late.
    _goals: Publisher<TaskHeader, u8>,
    supervision: Supervision,
    cycle: u64,
    /// When each scene was sent whose plan has not come yet.
    sent_ns: BTreeMap<u64, u64>,
    answer_max: Duration,
    name: String,
}

/// A plan that came back.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// Number of its scene.
    pub(super) cycle: u64,
    /// Name of the source that gave it; "none" when the question could not be put.
    pub(super) rung: String,
    pub(super) timing: Timing,
    pub(super) verdict: PlanVerdict,
}

impl Answer {
    /// The plan's first step.
    pub(super) fn first_step(&self) -> Option<&Step> {
        match &self.verdict {
            PlanVerdict::Plan { steps, .. } => steps.first(),
            PlanVerdict::Unsolvable { .. }
            | PlanVerdict::OutOfBudget { .. }
            | PlanVerdict::Unsupported { .. }
            | PlanVerdict::Inconsistent { .. }
            | PlanVerdict::Missing { .. } => None,
        }
    }

    /// The plan's cost, where there is a plan.
    pub(super) fn cost(&self) -> Option<u64> {
        match &self.verdict {
            PlanVerdict::Plan { cost, .. } => Some(*cost),
            PlanVerdict::Unsolvable { .. }
            | PlanVerdict::OutOfBudget { .. }
            | PlanVerdict::Unsupported { .. }
            | PlanVerdict::Inconsistent { .. }
            | PlanVerdict::Missing { .. } => None,
        }
    }
}

/// What a session is started with.
pub(super) struct Start<'a> {
    pub(super) folder: &'a DomainFolder,
    pub(super) problem: &'a Problem,
    pub(super) planner: &'a PlannerConfig,
    /// The file that the planner's options stand in.
    pub(super) origin: &'a crate::files::FileRef,
    pub(super) bus: BusConfig,
    pub(super) answer_max: Duration,
    /// For messages.
    pub(super) name: String,
}

impl Session {
    /// Starts the planner actor and tells it the goal.
    pub(super) async fn start(start: Start<'_>) -> Result<Self, StressError> {
        let bus = tokio::task::block_in_place(|| Bus::open(&start.bus))?;
        let domain = &start.folder.domain;
        let context = Arc::new(WireContext::new(new_run_id(), start.folder.hash, domain.clone()));
        let setup = PlannerSetup {
            domain,
            config: start.planner,
            origin: start.origin,
            clock: ClockKind::Realtime,
        };
        let reference_states = std::iter::once(Facts::new(start.problem.init.clone()));
        let monitor = Monitor::default();
        let actor = setup.actor((&bus, &context), monitor.clone(), reference_states)?;
        // What fails here would fail again.
        let restarts = SupervisorConfig { restarts_max: 0, backoff_ms_min: 1, backoff_ms_max: 1 };
        let scenes = bus.publisher(&SCENE)?;
        let plans = bus.subscriber(&PLAN, Depth::newest())?;
        let goals = bus.publisher(&GOAL)?;
        let health = HealthReport::open(&bus, Arc::clone(&context), monitor)?;
        let supervision = supervise(vec![actor], restarts, health).await?;
        let goal = GoalMessage::new(start.problem.goal.clone(), Vec::new(), &start.problem.objects);
        let (header, text) = goal_to_wire(&GoalUpdate::Known(goal), &context);
        goals.publish(header, &text)?;
        Ok(Self {
            context,
            scenes,
            plans,
            _goals: goals,
            supervision,
            cycle: 0,
            sent_ns: BTreeMap::new(),
            answer_max: start.answer_max,
            name: start.name,
        })
    }

    /// Sends a scene; returns its number.
    pub(super) fn send(&mut self, view: &View) -> Result<u64, StressError> {
        self.cycle += 1;
        let scene = view.scene(self.cycle);
        let (mut header, records) = scene_to_wire(&scene, &self.context)?;
        let now_ns = monotonic_ns();
        header.frame_send_ns = now_ns;
        self.sent_ns.insert(self.cycle, now_ns);
        self.scenes.publish(header, &records)?;
        Ok(self.cycle)
    }

    /// The next plan that comes; `None` when none comes in that time.
    pub(super) async fn answer(&mut self, within: Duration) -> Result<Option<Answer>, StressError> {
        let context = Arc::clone(&self.context);
        let read = |m: Received<_, _>| plan_from_wire(m.header(), m.records(), &context);
        let fatal = &mut self.supervision.fatal;
        let message = tokio::select! {
            plan = timeout(within, self.plans.newest_of(read)) => match plan {
                Ok(plan) => plan?,
                Err(_) => return Ok(None),
            },
            failed = fatal.wait_for(Option::is_some) => {
                let fatal = failed.ok().and_then(|fatal| fatal.clone());
                return Err(fatal.unwrap_or_else(gone).into());
            }
        };
        Ok(Some(self.received(message)))
    }

    /// Sends a scene and waits for its plan.
    pub(super) async fn ask(&mut self, view: &View) -> Result<Answer, StressError> {
        let cycle = self.send(view)?;
        let until_ns = monotonic_ns().saturating_add(nanoseconds(self.answer_max));
        loop {
            let left = Duration::from_nanos(until_ns.saturating_sub(monotonic_ns()));
            match self.answer(left).await? {
                Some(answer) if answer.cycle == cycle => return Ok(answer),
                Some(_) => {}
                None => {
                    let seconds = self.answer_max.as_secs_f64();
                    return Err(StressError::Silent { case: self.name.clone(), seconds });
                }
            }
        }
    }

    /// Waits, so that what is made beside the loop is finished.
    pub(super) async fn pause(&self, pause: Duration) {
        tokio::time::sleep(pause).await;
    }

    fn received(&mut self, message: PlanMessage) -> Answer {
        let now_ns = monotonic_ns();
        let cycle = message.cause.cycle;
        let sent_ns = self.sent_ns.remove(&cycle).unwrap_or(now_ns);
        // What an older scene asked for is not answered any more.
        self.sent_ns = self.sent_ns.split_off(&cycle);
        let timing = Timing { round_trip_ns: now_ns.saturating_sub(sent_ns), ..timing(&message) };
        Answer { cycle, rung: rung(&message), timing, verdict: message.verdict }
    }

    /// Stops the planner.
    pub(super) async fn stop(self) {
        self.supervision.stop().await;
    }
}

pub(super) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

fn gone() -> Fatal {
    let reason = "it has stopped by itself".to_owned();
    Fatal::Restarts { actor: "planner", failures: 1, reason }
}

fn timing(message: &PlanMessage) -> Timing {
    Timing {
        observe_cpu_ns: message.observe.cpu_ns,
        decide_cpu_ns: message.decide.cpu_ns,
        wall_ns: message.observe.wall_ns + message.decide.wall_ns,
        round_trip_ns: 0,
    }
}

/// The rung's name; "none" when the question could not be put.
fn rung(message: &PlanMessage) -> String {
    message.source.map_or("none", PlanSource::name).to_owned()
}
