//! Restarts: a failed actor starts again after a bounded, doubling pause; too many failures, or one
//! that no restart can help, end the episode. How the actors fare is told on the topic `health`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use ractor::{Actor, ActorCell, ActorProcessingErr, ActorRef, SupervisionEvent};
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::sync::watch;

use super::lifecycle::DataLoop;
use super::{ActorError, Fatal, Monitor, Serve};
use crate::transport::convert::{WireContext, health_to_wire};
use crate::transport::topics::HEALTH;
use crate::transport::wire::{HealthRecord, StreamHeader};
use crate::transport::{Bus, Publisher, TransportError};

/// How often health is told when nothing happens, milliseconds.
const HEALTH_PERIOD_MS: u64 = 500;

/// `[supervisor]`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupervisorConfig {
    /// Most restarts of one actor in an episode.
    pub restarts_max: u32,
    /// Pause before the first restart, milliseconds; doubles with each one.
    pub backoff_ms_min: u64,
    /// Longest pause before a restart, milliseconds.
    pub backoff_ms_max: u64,
}

/// How to start one actor; called again for every restart.
pub struct ActorSpec {
    /// Its name.
    pub name: &'static str,
    /// Makes its data loop.
    pub serve: Box<dyn Fn() -> Serve + Send + Sync>,
}

impl ActorSpec {
    /// An actor whose data loop is this future, made anew for each incarnation.
    pub fn new<F>(name: &'static str, serve: impl Fn() -> F + Send + Sync + 'static) -> Self
    where
        F: Future<Output = Result<(), ActorError>> + Send + 'static,
    {
        Self { name, serve: Box::new(move || -> Serve { Box::pin(serve()) }) }
    }
}

impl std::fmt::Debug for ActorSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ActorSpec").field("name", &self.name).finish_non_exhaustive()
    }
}

/// Where it is told how the actors fare. A clone tells on the same line.
#[derive(Debug, Clone)]
pub struct HealthReport {
    /// What the actors count.
    pub monitor: Monitor,
    line: Arc<Mutex<HealthLine>>,
}

#[derive(Debug)]
struct HealthLine {
    context: Arc<WireContext>,
    publisher: Publisher<StreamHeader, HealthRecord>,
    n_reports: u64,
}

impl HealthReport {
    /// Opens the topic.
    ///
    /// # Errors
    /// [`TransportError`] naming it.
    pub fn open(
        bus: &Bus,
        context: Arc<WireContext>,
        monitor: Monitor,
    ) -> Result<Self, TransportError> {
        let line = HealthLine { context, publisher: bus.publisher(&HEALTH)?, n_reports: 0 };
        Ok(Self { monitor, line: Arc::new(Mutex::new(line)) })
    }

    /// From now on it is told of another episode, and at once: what the topic keeps is of that one.
    pub fn go_on_in(&self, context: Arc<WireContext>) {
        self.line.lock().unwrap_or_else(PoisonError::into_inner).context = context;
        self.publish();
    }

    fn publish(&self) {
        let line = &mut *self.line.lock().unwrap_or_else(PoisonError::into_inner);
        line.n_reports += 1;
        let actors = self.monitor.health();
        let report = health_to_wire(line.n_reports, &actors, &line.context);
        let sent = report.map_err(|e| e.to_string()).and_then(|(header, records)| {
            line.publisher.publish(header, &records).map_err(|e| e.to_string())
        });
        if let Err(error) = sent {
            tracing::warn!(error, "health is not told");
        }
    }
}

/// A running supervisor.
#[derive(Debug)]
pub struct Supervision {
    supervisor: ActorRef<Order>,
    handle: ractor::concurrency::JoinHandle<()>,
    /// What ended the episode from within the tree, once something has.
    pub fatal: watch::Receiver<Option<Fatal>>,
}

impl Supervision {
    /// Waits until something within the tree has failed that no restart can help. Cancel-safe.
    pub async fn failed(&mut self) -> Fatal {
        let failed = self.fatal.wait_for(Option::is_some).await.ok();
        failed.and_then(|fatal| fatal.clone()).unwrap_or_else(Fatal::gone)
    }

    /// A new episode begins: failures of the ones before count no more.
    pub fn forgive(&self) {
        if self.supervisor.cast(Order::Forgive).is_err() {
            tracing::debug!("the supervisor has ended");
        }
    }

    /// Stops all actors and waits for them.
    pub async fn stop(self) {
        self.supervisor.stop(None);
        if let Err(error) = self.handle.await {
            tracing::warn!(%error, "the supervisor did not stop cleanly");
        }
    }
}

/// Starts all actors under one supervisor, which tells how they fare.
///
/// # Errors
/// [`Fatal::Restarts`] when an actor cannot even be started.
pub async fn supervise(
    actors: Vec<ActorSpec>,
    config: SupervisorConfig,
    health: HealthReport,
) -> Result<Supervision, Fatal> {
    let (escalate, fatal) = watch::channel(None);
    let args = (actors, config, escalate, health);
    let (supervisor, handle) = Actor::spawn(None, Supervisor, args).await.map_err(|error| {
        Fatal::Restarts { actor: "supervisor", failures: 1, reason: error.to_string() }
    })?;
    Ok(Supervision { supervisor, handle, fatal })
}

struct Supervisor;

/// What the supervisor is told.
#[derive(Debug)]
enum Order {
    /// Start the actor with this index again.
    Restart(usize),
    /// Tell how the actors fare.
    Report,
    /// Count failures anew.
    Forgive,
}

struct Tree {
    actors: Vec<ActorSpec>,
    failures: Vec<u32>,
    running: BTreeMap<ractor::ActorId, usize>,
    cells: BTreeMap<usize, ActorCell>,
    config: SupervisorConfig,
    escalate: watch::Sender<Option<Fatal>>,
    health: HealthReport,
}

impl Tree {
    async fn start(
        &mut self,
        idx: usize,
        myself: &ActorRef<Order>,
    ) -> Result<(), ActorProcessingErr> {
        let Some(spec) = self.actors.get(idx) else { return Ok(()) };
        let is_restart = self.failures.get(idx).is_some_and(|n| *n > 0);
        self.health.monitor.started(spec.name, is_restart);
        let serve = (spec.serve)();
        let (actor, _) = Actor::spawn_linked(None, DataLoop, serve, myself.get_cell()).await?;
        self.running.insert(actor.get_id(), idx);
        self.cells.insert(idx, actor.get_cell());
        Ok(())
    }

    /// What to do about a failure: a pause before the restart, or the end.
    fn judge(&mut self, idx: usize, error: &ActorProcessingErr) -> Result<Duration, Fatal> {
        let name = self.actors.get(idx).map_or("actor", |spec| spec.name);
        if let Some(ActorError::Fatal(fatal)) = error.downcast_ref::<ActorError>() {
            return Err(fatal.clone());
        }
        let failures = self.failures.get_mut(idx).map_or(0, |n| {
            *n += 1;
            *n
        });
        if failures > self.config.restarts_max {
            let reason = error.to_string();
            return Err(Fatal::Restarts { actor: name, failures, reason });
        }
        let doubled = self.config.backoff_ms_min << (failures - 1).min(16);
        let pause = Duration::from_millis(doubled.min(self.config.backoff_ms_max));
        tracing::warn!(actor = name, %error, failures, ?pause, "restarting");
        Ok(pause)
    }
}

impl Actor for Supervisor {
    type Msg = Order;
    type State = Tree;
    type Arguments = (Vec<ActorSpec>, SupervisorConfig, watch::Sender<Option<Fatal>>, HealthReport);

    async fn pre_start(
        &self,
        myself: ActorRef<Order>,
        (actors, config, escalate, health): Self::Arguments,
    ) -> Result<Tree, ActorProcessingErr> {
        let failures = vec![0; actors.len()];
        let (running, cells) = (BTreeMap::new(), BTreeMap::new());
        let mut tree = Tree { actors, failures, running, cells, config, escalate, health };
        for idx in 0..tree.actors.len() {
            tree.start(idx, &myself).await?;
        }
        tree.health.publish();
        myself.send_interval(Duration::from_millis(HEALTH_PERIOD_MS), || Order::Report);
        Ok(tree)
    }

    async fn handle(
        &self,
        myself: ActorRef<Order>,
        order: Order,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        match order {
            Order::Restart(idx) => tree.start(idx, &myself).await?,
            Order::Report => {}
            Order::Forgive => tree.failures.fill(0),
        }
        tree.health.publish();
        Ok(())
    }

    async fn handle_supervisor_evt(
        &self,
        myself: ActorRef<Order>,
        event: SupervisionEvent,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        let (actor, error) = match event {
            SupervisionEvent::ActorFailed(actor, error) => (actor, Some(error)),
            SupervisionEvent::ActorTerminated(actor, ..) => (actor, None),
            SupervisionEvent::ActorStarted(_) | SupervisionEvent::ProcessGroupChanged(_) => {
                return Ok(());
            }
        };
        let Some(idx) = tree.running.remove(&actor.get_id()) else { return Ok(()) };
        if let Some(spec) = tree.actors.get(idx) {
            tree.health.monitor.ended(spec.name);
        }
        tree.health.publish();
        let Some(error) = error else { return Ok(()) };
        match tree.judge(idx, &error) {
            Ok(pause) => {
                myself.send_after(pause, move || Order::Restart(idx));
            }
            Err(fatal) => {
                tree.escalate.send_replace(Some(fatal));
            }
        }
        Ok(())
    }

    async fn post_stop(
        &self,
        _: ActorRef<Order>,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        for cell in tree.cells.values() {
            if let Err(error) = cell.stop_and_wait(None, None).await {
                tracing::debug!(%error, "an actor had stopped before");
            }
        }
        // The last word: what was counted until the end.
        tree.health.publish();
        Ok(())
    }
}
