//! One episode: start the actors, wait for the end, report.

use std::sync::{Arc, PoisonError};
use std::time::Duration;

use tokio::sync::Mutex;

use super::DomainFolder;
use super::audit::{Audit, every_object};
use super::diary::Diary;
use super::observer::{Observed, Observer};
use super::scoring::{Words, with_unseen};
use super::wiring::{Before, PreparedRun, Shared};
use super::{HardwarePorts, RunError};
use crate::actors::scene_parser::SceneParserMemory;
use crate::actors::{
    ActorSpec, Checkpoint, CommandLine, Fatal, HealthReport, Monitor, SnapshotRequest, Supervision,
    SystemFaults, snapshot, supervise,
};
use crate::clock::{monotonic_ns, process_cpu_ns};
use crate::executive::ExecutiveMode;
use crate::hardware::TrueHistory;
use crate::logic::Bindings;
use crate::messages::{ActorHealth, GoalMessage, RunDescriptor};
use crate::metrics::{EpisodeReport, EpisodeResult, FaultRecord, Latencies};
use crate::scene::Scene;
use crate::transport::convert::{WireContext, run_to_wire};
use crate::transport::topics::RUN;
use crate::transport::wire::{DeviceHeader, SCHEMA};
use crate::transport::{Bus, Publisher};

/// How long actors may take to end.
const STOP_MAX: Duration = Duration::from_secs(2);

/// How an episode is run.
#[derive(Debug)]
pub struct EpisodeOptions {
    /// The bus: narration is read from its topic `event`, and a stop is asked for on `control`.
    pub bus: Bus,
    /// A picture of one cycle.
    pub snapshot: Option<SnapshotRequest>,
}

/// What an episode came to.
#[derive(Debug, Clone)]
pub struct Episode {
    /// What was counted and measured.
    pub report: EpisodeReport,
    /// The executor's own account.
    pub end: EpisodeResult,
    /// Why the picture that was asked for could not be written.
    pub snapshot_fault: Option<String>,
}

/// Runs one episode to its verdict.
///
/// # Errors
/// [`RunError`] when it ends without one.
pub async fn run_episode(
    prepared: &PreparedRun,
    options: EpisodeOptions,
) -> Result<Episode, RunError> {
    let started = Started::now();
    let context = prepared.new_context();
    prepared.check_room()?;
    let mut description = Description::open(&options.bus)?;
    description.tell(prepared, (options.bus.run(), context.run_id), false)?;
    let station = Station::open(prepared, options.bus, &context)?;
    let drawing = Arc::new(Mutex::new(None));
    let snapshot = options.snapshot.map(|request| {
        let args = snapshot::SnapshotArgs {
            bus: station.bus.clone(),
            context: Arc::clone(&context),
            perception: prepared.folder.perception.clone(),
            instruction: prepared.config.goal.text.clone(),
            request,
            drawing: Arc::clone(&drawing),
        };
        let args = Arc::new(args);
        ActorSpec::new("snapshot", move || snapshot::serve(Arc::clone(&args)))
    });
    let more = snapshot.into_iter().chain(station.hardware_actors()).collect();
    let play = Play { context, started, before: None, more };
    let played = Box::pin(station.play(prepared, play)).await;
    let snapshot_fault = drawing.lock().await.take();
    Ok(Episode { snapshot_fault, ..played? })
}

/// When an episode began.
pub(super) struct Started {
    wall_ns: u64,
    cpu_ns: u64,
}

impl Started {
    pub(super) fn now() -> Self {
        Self { wall_ns: monotonic_ns(), cpu_ns: process_cpu_ns() }
    }

    /// Wall-clock and processor time since, seconds.
    fn seconds(&self) -> [f64; 2] {
        let spent_ns = [monotonic_ns() - self.wall_ns, process_cpu_ns() - self.cpu_ns];
        spent_ns.map(|ns| ns as f64 / 1e9)
    }
}

/// One episode of a station.
pub(super) struct Play {
    pub(super) context: Arc<WireContext>,
    pub(super) started: Started,
    /// What came before, where the station outlives its episodes.
    pub(super) before: Option<Before>,
    /// Actors that end with the episode, besides those that every run has.
    pub(super) more: Vec<ActorSpec>,
}

/// What an episode takes place on, and what may outlive it: the hardware, the line to the robot, and what is
/// counted of the actors.
pub(super) struct Station {
    /// For who watches.
    plain: Bus,
    /// For who is watched: its messages may be lost on purpose.
    pub(super) bus: Bus,
    hardware: HardwarePorts,
    faults: SystemFaults,
    monitor: Monitor,
    commands: Arc<CommandLine>,
    pub(super) health: HealthReport,
    /// The memory of the newest scene parser.
    parser: std::sync::Mutex<Checkpoint<SceneParserMemory>>,
}

impl Station {
    pub(super) fn open(
        prepared: &PreparedRun,
        plain: Bus,
        context: &Arc<WireContext>,
    ) -> Result<Self, RunError> {
        let hardware = prepared.hardware()?;
        let config = &prepared.config;
        let faults = config.faults_at_rate();
        let faults = (faults.as_slice(), config.seed);
        let shape = config.used_cameras();
        let faults = SystemFaults::open(faults, &config.loop_shape(&shape), &plain)?;
        let monitor = Monitor::new(faults.clone());
        let bus = plain.disturbed(Arc::new(faults.clone()));
        let commands = Arc::new(CommandLine::open(&bus)?);
        let health = HealthReport::open(&bus, Arc::clone(context), monitor.clone())?;
        let parser = std::sync::Mutex::default();
        Ok(Self { plain, bus, hardware, faults, monitor, commands, health, parser })
    }

    /// The actors that play the hardware in this process.
    pub(super) fn hardware_actors(&self) -> Vec<ActorSpec> {
        self.hardware.actors(&self.bus, &self.monitor)
    }

    /// Another episode begins; what it goes on from. The actors of `kept` live on.
    pub(super) fn go_on_in(&self, context: &Arc<WireContext>, kept: &[&str]) -> Before {
        self.monitor.keep_only(kept);
        self.health.go_on_in(Arc::clone(context));
        let last = self.commands.last();
        let (command_id, frame_sequence) = last.map_or((0, None), |(id, frame)| (id, Some(frame)));
        // In memory of its own: a parser that hangs may still write into that of the last episode.
        let parser = &mut *self.parser.lock().unwrap_or_else(PoisonError::into_inner);
        *parser = Checkpoint::new(parser.load().handed_over(frame_sequence));
        Before { command_id, frame_sequence, since_ns: monotonic_ns() }
    }

    /// The line to the robot, where one acts.
    pub(super) fn line(&self) -> Option<&CommandLine> {
        self.hardware.robot.acts.then_some(&*self.commands)
    }

    /// Runs one episode to its verdict.
    pub(super) async fn play(
        &self,
        prepared: &PreparedRun,
        Play { context, started, before, more }: Play,
    ) -> Result<Episode, RunError> {
        let mut observer = Observer::open(&self.plain, Arc::clone(&context))?;
        if self.hardware.camera.history.is_some() {
            observer = observer.with_diary();
        }
        let n_faults =
            before.map_or([0; 2], |_| [self.world_faults().len(), self.faults.records().len()]);
        let shared = Shared {
            context,
            monitor: self.monitor.clone(),
            commands: Arc::clone(&self.commands),
            before,
            parser: self.parser.lock().unwrap_or_else(PoisonError::into_inner).clone(),
        };
        let mut actors = prepared.core_actors(&self.bus, &shared, &self.hardware)?;
        actors.extend(more);
        let config = prepared.config.supervisor.clone();
        let mut supervision = supervise(actors, config, self.health.clone()).await?;
        let ended = tokio::select! {
            ended = observer.watch() => ended.map_err(RunError::from),
            fatal = supervision.failed() => Err(fatal.into()),
        };
        stop_all(supervision, self.line().filter(|_| ended.is_err())).await;
        ended?;
        let Observed { result, goal, diary, health } =
            observer.finish()?.ok_or_else(Fatal::gone)?;
        let mut report = report(prepared.config.seed, &result, &health, started.seconds());
        report.goal = goal.as_ref().map(|goal| goal.goal.to_string()).unwrap_or_default();
        report.faults = self.world_faults().split_off(n_faults[0]);
        report.faults.extend(self.faults.records().split_off(n_faults[1]));
        report.faults.sort_by_key(|record| (record.at_ns, record.fault));
        if let Some(history) = &self.hardware.camera.history {
            let mut history = history();
            let answered = before.and_then(|before| before.frame_sequence);
            history.dispatches.retain(|dispatch| Some(dispatch.frame_sequence) > answered);
            judge(prepared, &history, (&diary, &result, goal.as_ref()), &mut report);
        }
        Ok(Episode { report, end: result, snapshot_fault: None })
    }

    /// What has gone wrong in the simulated world, so far.
    fn world_faults(&self) -> Vec<FaultRecord> {
        self.hardware.robot.faults.as_ref().map(|faults| faults()).unwrap_or_default()
    }
}

/// Stops all actors; on a line to the robot it is told to hold: at once, and after the last actor has
/// said its last word.
pub(super) async fn stop_all(supervision: Supervision, line: Option<&CommandLine>) {
    line.inspect(|line| line.hold());
    if tokio::time::timeout(STOP_MAX, supervision.stop()).await.is_err() {
        tracing::warn!("actors that did not end within {} s are left alone", STOP_MAX.as_secs());
    }
    line.inspect(|line| line.hold());
}

/// Judges an episode by what really was.
fn judge(
    prepared: &PreparedRun,
    history: &TrueHistory,
    (diary, result, goal): (&Diary, &EpisodeResult, Option<&GoalMessage>),
    report: &mut EpisodeReport,
) {
    let DomainFolder { domain, perception, rules, .. } = &*prepared.folder;
    let seen = result.scene.as_ref().map(Scene::typed_objects).unwrap_or_default();
    let objects = &with_unseen(seen, domain, &history.now);
    let words = Words { domain, perception, rules, objects };
    let none = Bindings::new();
    report.goal_in_simulator =
        goal.and_then(|goal| words.really_holds(&goal.goal, &none, &history.now));
    let objects = &every_object(words, history, diary);
    let words = Words { objects, ..words };
    let confirm_s = prepared.config.perception.belief.confirm_s;
    let audit = Audit { words, history, diary, confirm_s, rate_hz: prepared.config.camera.rate_hz };
    let mut dispatches = audit.dispatches();
    if prepared.config.executive == ExecutiveMode::OpenLoop {
        dispatches.without_evidence();
    }
    report.dispatches = Some(dispatches);
    audit.follow(&mut report.faults);
}

/// The run's description of itself for whoever joins; it stays as long as this does.
pub(super) struct Description {
    publisher: Publisher<DeviceHeader, u8>,
    n_told: u64,
}

impl Description {
    /// Opens the topic; a second run of the name is refused.
    pub(super) fn open(bus: &Bus) -> Result<Self, RunError> {
        bus.refuse_second::<DeviceHeader, u8>(&RUN)?;
        Ok(Self { publisher: bus.publisher(&RUN)?, n_told: 0 })
    }

    /// Describes the run, by its name and identity.
    pub(super) fn tell(
        &mut self,
        prepared: &PreparedRun,
        (run, run_id): (&str, u64),
        takes_tasks: bool,
    ) -> Result<(), RunError> {
        let folder = &prepared.folder;
        let description = RunDescriptor {
            run_id,
            run: run.to_owned(),
            domain: folder.domain.name.to_string(),
            domain_text: folder.domain_text.clone(),
            domain_hash: folder.hash,
            config: prepared.config.resolved.clone(),
            seed: prepared.config.seed,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            wire_schema: SCHEMA,
            takes_tasks,
        };
        let written = run_to_wire(&description);
        let (header, text) = written.map_err(|e| Fatal::BadInput { message: e.to_string() })?;
        let sequence = self.n_told;
        self.n_told += 1;
        Ok(self.publisher.publish(DeviceHeader { sequence, ..header }, &text)?)
    }
}

fn report(
    seed: u64,
    end: &EpisodeResult,
    health: &[ActorHealth],
    [wall_seconds, cpu_seconds]: [f64; 2],
) -> EpisodeReport {
    let unanswered: u64 = health.iter().map(|actor| actor.n_missed + actor.n_rejected).sum();
    let frames = end.counts.cycles + unanswered;
    let confirmed = end.scene.as_ref().map(Scene::confirmed).unwrap_or_default();
    EpisodeReport {
        verdict: end.verdict.word(),
        reason: end.verdict.reason(),
        seed,
        cycles: end.counts.cycles,
        frames,
        replans: end.counts.replans,
        skills_done: end.counts.skills_done,
        skills_failed: end.counts.skills_failed,
        sim_seconds: end.tally.run_seconds(),
        wall_seconds,
        cpu_ms_per_frame: cpu_seconds * 1000.0 / (frames.max(1) as f64),
        rungs: end.tally.rungs.clone(),
        decision_hash: end.tally.decision_hash(),
        latency_us: Latencies::of(end),
        plan: end.remaining.iter().map(ToString::to_string).collect(),
        goal: String::new(),
        goal_in_simulator: None,
        facts: confirmed.known.iter().map(ToString::to_string).collect(),
        faults: Vec::new(),
        dispatches: None,
    }
}
