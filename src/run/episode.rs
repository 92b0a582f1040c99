//! One episode: start the actors, wait for the end, report.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Mutex;

use super::DomainFolder;
use super::audit::{Audit, every_object};
use super::diary::Diary;
use super::observer::{Observed, Observer};
use super::scoring::{Words, with_unseen};
use super::wiring::{PreparedRun, Shared};
use super::{RunError, new_run_id};
use crate::actors::{
    ActorSpec, CommandLine, Fatal, HealthReport, Monitor, SnapshotRequest, Supervision,
    SystemFaults, snapshot, supervise,
};
use crate::clock::{monotonic_ns, process_cpu_ns};
use crate::executive::ExecutiveMode;
use crate::hardware::TrueHistory;
use crate::logic::Bindings;
use crate::messages::{ActorHealth, GoalMessage, RunDescriptor};
use crate::metrics::{EpisodeReport, EpisodeResult, Latencies};
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
}

/// Runs one episode to its verdict.
///
/// # Errors
/// [`RunError`] when it ends without one.
pub async fn run_episode(
    prepared: &PreparedRun,
    options: EpisodeOptions,
) -> Result<Episode, RunError> {
    let (started_ns, cpu_ns) = (monotonic_ns(), process_cpu_ns());
    let bus = options.bus;
    let run_id = new_run_id();
    let folder = &prepared.folder;
    let context = Arc::new(WireContext::new(run_id, folder.hash, folder.domain.clone()));
    prepared.check_room()?;
    let _description = describe(prepared, &bus, run_id)?;
    let hardware = prepared.hardware()?;
    let mut observer = Observer::open(&bus, Arc::clone(&context))?;
    if hardware.camera.history.is_some() {
        observer = observer.with_diary();
    }
    let config = &prepared.config;
    let faults = config.faults_at_rate();
    let faults = (faults.as_slice(), config.seed);
    let faults = SystemFaults::open(faults, &config.loop_shape(&config.used_cameras()), &bus)?;
    let monitor = Monitor::new(faults.clone());
    let bus = bus.disturbed(Arc::new(faults.clone()));
    let commands = Arc::new(CommandLine::open(&bus)?);
    let shared = Shared {
        context: Arc::clone(&context),
        monitor: monitor.clone(),
        commands: Arc::clone(&commands),
    };
    let mut actors = prepared.core_actors(&bus, &shared, &hardware)?;
    let drawing = Arc::new(Mutex::new(()));
    actors.extend(options.snapshot.map(|request| {
        let args = snapshot::SnapshotArgs {
            bus: bus.clone(),
            context: Arc::clone(&shared.context),
            perception: folder.perception.clone(),
            instruction: prepared.config.goal.text.clone(),
            request,
            drawing: Arc::clone(&drawing),
        };
        let args = Arc::new(args);
        ActorSpec::new("snapshot", move || snapshot::serve(Arc::clone(&args)))
    }));
    actors.extend(hardware.actors(&bus, &monitor));
    let health = HealthReport::open(&bus, context, monitor.clone())?;
    let mut supervision = supervise(actors, prepared.config.supervisor.clone(), health).await?;
    let ended = tokio::select! {
        ended = observer.watch() => ended.map_err(RunError::from),
        failed = supervision.fatal.wait_for(Option::is_some) => {
            Err(failed.ok().and_then(|fatal| fatal.clone()).unwrap_or_else(gone).into())
        }
    };
    let line = (ended.is_err() && hardware.robot.acts).then_some(&*commands);
    stop_all(supervision, line).await;
    drop(drawing.lock().await);
    ended?;
    let Observed { result, goal, diary, health } = observer.finish()?.ok_or_else(gone)?;
    let seconds = |ns: u64| ns as f64 / 1e9;
    let (wall_ns, cpu_ns) = (monotonic_ns() - started_ns, process_cpu_ns() - cpu_ns);
    let mut report = report(prepared.config.seed, &result, &health, [wall_ns, cpu_ns].map(seconds));
    report.goal = goal.as_ref().map(|goal| goal.goal.to_string()).unwrap_or_default();
    report.faults = hardware.robot.faults.map(|faults| faults()).unwrap_or_default();
    report.faults.extend(faults.records());
    report.faults.sort_by_key(|record| (record.at_ns, record.fault));
    if let Some(history) = hardware.camera.history {
        judge(prepared, &history(), (&diary, &result, goal.as_ref()), &mut report);
    }
    Ok(Episode { report, end: result })
}

/// Stops all actors; on a line to the robot it is told to hold: at once, and after the last actor has
/// said its last word.
async fn stop_all(supervision: Supervision, line: Option<&CommandLine>) {
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

fn gone() -> Fatal {
    Fatal::Restarts {
        actor: "supervisor",
        failures: 1,
        reason: "it has stopped by itself".to_owned(),
    }
}

/// Describes the run for whoever joins; the description stays as long as what is returned.
fn describe(
    prepared: &PreparedRun,
    bus: &Bus,
    run_id: u64,
) -> Result<Publisher<DeviceHeader, u8>, RunError> {
    let folder = &prepared.folder;
    let description = RunDescriptor {
        run_id,
        run: bus.run().to_owned(),
        domain: folder.domain.name.to_string(),
        domain_text: folder.domain_text.clone(),
        domain_hash: folder.hash,
        config: prepared.config.resolved.clone(),
        seed: prepared.config.seed,
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        wire_schema: SCHEMA,
    };
    bus.refuse_second::<DeviceHeader, u8>(&RUN)?;
    let publisher = bus.publisher(&RUN)?;
    let written = run_to_wire(&description);
    let (header, text) = written.map_err(|e| Fatal::BadInput { message: e.to_string() })?;
    publisher.publish(header, &text)?;
    Ok(publisher)
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
