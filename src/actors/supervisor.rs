//! Restarts: a failed actor starts again after a bounded, doubling pause; too many failures, or one
//! that no restart can help, end the episode.

use std::collections::BTreeMap;
use std::time::Duration;

use ractor::{Actor, ActorCell, ActorProcessingErr, ActorRef, SupervisionEvent};
use serde::Deserialize;
use tokio::sync::watch;

use super::lifecycle::DataLoop;
use super::{ActorError, Fatal, Serve};

/// `[supervisor]`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
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

impl std::fmt::Debug for ActorSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ActorSpec").field("name", &self.name).finish_non_exhaustive()
    }
}

/// A running supervisor.
#[derive(Debug)]
pub struct Supervision {
    supervisor: ActorRef<Restart>,
    handle: ractor::concurrency::JoinHandle<()>,
    /// What ended the episode from within the tree, once something has.
    pub fatal: watch::Receiver<Option<Fatal>>,
}

impl Supervision {
    /// Stops all actors and waits for them.
    pub async fn stop(self) {
        self.supervisor.stop(None);
        if let Err(error) = self.handle.await {
            tracing::warn!(%error, "the supervisor did not stop cleanly");
        }
    }
}

/// Starts all actors under one supervisor.
///
/// # Errors
/// [`Fatal::Restarts`] when an actor cannot even be started.
pub async fn supervise(
    actors: Vec<ActorSpec>,
    config: SupervisorConfig,
) -> Result<Supervision, Fatal> {
    let (escalate, fatal) = watch::channel(None);
    let args = (actors, config, escalate);
    let (supervisor, handle) = Actor::spawn(None, Supervisor, args).await.map_err(|error| {
        Fatal::Restarts { actor: "supervisor", failures: 1, reason: error.to_string() }
    })?;
    Ok(Supervision { supervisor, handle, fatal })
}

struct Supervisor;

/// Start the actor with this index again.
#[derive(Debug)]
struct Restart(usize);

struct Tree {
    actors: Vec<ActorSpec>,
    failures: Vec<u32>,
    running: BTreeMap<ractor::ActorId, usize>,
    cells: BTreeMap<usize, ActorCell>,
    config: SupervisorConfig,
    escalate: watch::Sender<Option<Fatal>>,
}

impl Tree {
    async fn start(
        &mut self,
        idx: usize,
        myself: &ActorRef<Restart>,
    ) -> Result<(), ActorProcessingErr> {
        let Some(spec) = self.actors.get(idx) else { return Ok(()) };
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
    type Msg = Restart;
    type State = Tree;
    type Arguments = (Vec<ActorSpec>, SupervisorConfig, watch::Sender<Option<Fatal>>);

    async fn pre_start(
        &self,
        myself: ActorRef<Restart>,
        (actors, config, escalate): Self::Arguments,
    ) -> Result<Tree, ActorProcessingErr> {
        let failures = vec![0; actors.len()];
        let (running, cells) = (BTreeMap::new(), BTreeMap::new());
        let mut tree = Tree { actors, failures, running, cells, config, escalate };
        for idx in 0..tree.actors.len() {
            tree.start(idx, &myself).await?;
        }
        Ok(tree)
    }

    async fn handle(
        &self,
        myself: ActorRef<Restart>,
        Restart(idx): Restart,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        tree.start(idx, &myself).await
    }

    async fn handle_supervisor_evt(
        &self,
        myself: ActorRef<Restart>,
        event: SupervisionEvent,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        let SupervisionEvent::ActorFailed(actor, error) = event else { return Ok(()) };
        let Some(idx) = tree.running.remove(&actor.get_id()) else { return Ok(()) };
        match tree.judge(idx, &error) {
            Ok(pause) => {
                myself.send_after(pause, move || Restart(idx));
            }
            Err(fatal) => {
                tree.escalate.send_replace(Some(fatal));
            }
        }
        Ok(())
    }

    async fn post_stop(
        &self,
        _: ActorRef<Restart>,
        tree: &mut Tree,
    ) -> Result<(), ActorProcessingErr> {
        for cell in tree.cells.values() {
            if let Err(error) = cell.stop_and_wait(None, None).await {
                tracing::debug!(%error, "an actor had stopped before");
            }
        }
        Ok(())
    }
}
