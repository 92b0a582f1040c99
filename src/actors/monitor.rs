//! What is counted of each actor, for the topic `health`; and faults on purpose.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::system_faults::{Handling, SystemFaults};
use crate::messages::{ActorHealth, FrameFault};

/// Counts what the actors of one run do. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    faults: SystemFaults,
    actors: Arc<Mutex<BTreeMap<String, ActorHealth>>>,
}

impl Monitor {
    /// With the faults of a run file.
    pub fn new(faults: SystemFaults) -> Self {
        Self { faults, actors: Arc::default() }
    }

    /// Counts one message of an actor, and lets happen what the run file says of it.
    ///
    /// # Panics
    /// When the run file says so.
    pub async fn message(&self, actor: &str) -> Handling {
        self.change(actor, |health| health.n_messages += 1);
        self.faults.message(actor).await
    }

    /// Counts a frame that could not be used; `fault` is what is wrong with the frame itself.
    pub fn rejected(&self, actor: &str, fault: Option<FrameFault>, reason: &str) {
        self.change(actor, |health| {
            health.n_rejected += 1;
            if let Some(fault) = fault {
                health.faults.add(fault);
            }
            reason.clone_into(&mut health.last_rejection);
        });
    }

    /// Tells how many frames were overtaken so far.
    pub fn missed(&self, actor: &str, n_missed: u64) {
        self.change(actor, |health| health.n_missed = n_missed);
    }

    /// Tells that an actor has been started; again, where `is_restart`.
    pub(super) fn started(&self, actor: &str, is_restart: bool) {
        self.change(actor, |health| {
            health.is_alive = true;
            health.n_restarts += u32::from(is_restart);
        });
    }

    /// Tells that an actor has ended.
    pub(super) fn ended(&self, actor: &str) {
        self.change(actor, |health| health.is_alive = false);
    }

    /// Forgets what was counted of all actors but these: the others start anew with an episode.
    pub fn keep_only(&self, actors: &[&str]) {
        self.lock().retain(|name, _| actors.contains(&name.as_str()));
    }

    /// How every actor fares.
    pub fn health(&self) -> Vec<ActorHealth> {
        self.lock().values().cloned().collect()
    }

    fn change(&self, actor: &str, change: impl FnOnce(&mut ActorHealth)) {
        let mut actors = self.lock();
        if let Some(health) = actors.get_mut(actor) {
            change(health);
        } else {
            let mut health = ActorHealth { actor: actor.to_owned(), ..ActorHealth::default() };
            change(&mut health);
            actors.insert(actor.to_owned(), health);
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, ActorHealth>> {
        self.actors.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
