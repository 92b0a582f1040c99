//! One episode: start the actors, wait for the end, report.

use std::sync::Arc;

use tokio::sync::watch;

use super::wiring::{PreparedRun, Shared};
use super::{DomainFolder, RunError};
use crate::actors::{
    ActorSpec, Chaos, Checkpoint, Fatal, SnapshotRequest, scene_parser, skill_executor, snapshot,
    supervise,
};
use crate::clock::{monotonic_ns, process_cpu_ns};
use crate::logic::{Bindings, Facts, Universe, evaluate};
use crate::messages::{GoalMessage, Stop};
use crate::metrics::{EpisodeReport, EpisodeResult, Latencies};
use crate::perception::complete;
use crate::scene::Scene;
use crate::transport::convert::WireContext;
use crate::transport::{Bus, BusConfig};

/// How an episode is run.
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct EpisodeOptions {
    /// The bus.
    pub bus: BusConfig,
    /// Hears what people should be told.
    pub narrate: skill_executor::Narrate,
    /// Stops the episode from outside.
    pub stop: watch::Receiver<Option<Stop>>,
    /// A picture of one cycle.
    pub snapshot: Option<SnapshotRequest>,
}

/// What an episode came to.
#[derive(Debug, Clone)]
pub struct Episode {
    /// The report.
    pub report: EpisodeReport,
    /// The executor's own account.
    pub end: EpisodeResult,
    /// How many `[[panic]]` entries have fired.
    pub n_panics: usize,
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
    let bus = tokio::task::block_in_place(|| Bus::open(&options.bus))?;
    let (end_sender, mut end_receiver) = watch::channel(None);
    let run_id = started_ns ^ (u64::from(std::process::id()) << 48);
    let folder = &prepared.folder;
    let context = Arc::new(WireContext::new(run_id, folder.hash, folder.domain.clone()));
    let shared = Shared {
        context,
        narrate: options.narrate,
        stop: options.stop,
        end: end_sender,
        goal: Checkpoint::default(),
        scenes: Checkpoint::default(),
        chaos: Chaos::new(&prepared.config.panic),
    };
    let mut actors = prepared.core_actors(&bus, &shared)?;
    actors.extend(options.snapshot.map(|request| {
        let args = snapshot::Args {
            bus: bus.clone(),
            context: Arc::clone(&shared.context),
            perception: folder.perception.clone(),
            instruction: prepared.config.goal.text.clone(),
            request,
        };
        let args = Arc::new(args);
        ActorSpec {
            name: "snapshot",
            serve: Box::new(move || Box::pin(snapshot::serve(Arc::clone(&args)))),
        }
    }));
    let hardware = prepared.hardware(&bus, &shared)?;
    actors.extend(hardware.actors);
    let mut supervision = supervise(actors, prepared.config.supervisor.clone()).await?;
    let ended = wait(&mut end_receiver, &mut supervision.fatal).await;
    supervision.stop().await;
    let end = ended?;
    let seconds = |ns: u64| ns as f64 / 1e9;
    let wall_ns = monotonic_ns() - started_ns;
    let cpu_ns = process_cpu_ns() - cpu_ns;
    let mut report = report(prepared, &shared, &end, (seconds(wall_ns), seconds(cpu_ns)));
    let goal = shared.goal.load();
    report.goal_in_simulator = match (hardware.truth, goal, &end.scene) {
        (Some(truth), Some(goal), Some(scene)) => Some(holds(folder, &goal, scene, &truth())),
        _ => None,
    };
    Ok(Episode { report, end, n_panics: shared.chaos.n_fired() })
}

async fn wait(
    end: &mut watch::Receiver<Option<EpisodeResult>>,
    fatal: &mut watch::Receiver<Option<Fatal>>,
) -> Result<EpisodeResult, RunError> {
    let gone = || Fatal::Restarts {
        actor: "supervisor",
        failures: 1,
        reason: "it has stopped by itself".to_owned(),
    };
    tokio::select! {
        ended = end.wait_for(Option::is_some) => {
            ended.ok().and_then(|end| end.clone()).ok_or_else(|| gone().into())
        }
        failed = fatal.wait_for(Option::is_some) => {
            Err(failed.ok().and_then(|fatal| fatal.clone()).unwrap_or_else(gone).into())
        }
    }
}

fn report(
    prepared: &PreparedRun,
    shared: &Shared,
    end: &EpisodeResult,
    (wall_seconds, cpu_seconds): (f64, f64),
) -> EpisodeReport {
    let scenes: scene_parser::Memory = shared.scenes.load();
    let frames = end.counts.cycles + scenes.missed + scenes.rejected;
    let goal: Option<GoalMessage> = shared.goal.load();
    let confirmed = end.scene.as_ref().map(Scene::confirmed).unwrap_or_default();
    EpisodeReport {
        verdict: end.verdict.word(),
        reason: end.verdict.reason(),
        seed: prepared.config.seed,
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
        goal: goal.map(|goal| goal.goal.to_string()).unwrap_or_default(),
        goal_in_simulator: None,
        facts: confirmed.known.iter().map(ToString::to_string).collect(),
    }
}

/// Whether the goal really holds: the true facts, completed by the domain's rules.
fn holds(folder: &DomainFolder, goal: &GoalMessage, scene: &Scene, facts: &Facts) -> bool {
    let objects = scene.typed_objects();
    let types = &folder.domain.types;
    let facts = complete(&folder.rules, types, &objects, facts);
    let universe = Universe { types, objects: &objects };
    evaluate(&goal.goal, &Bindings::new(), &universe, &|atom| facts.truth(atom)).is_true()
}
