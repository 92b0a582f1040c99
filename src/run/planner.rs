//! From `[planner]` of a file to the planner actor: for an episode and for the stress test.

use std::sync::Arc;
use std::time::Duration;

use super::{ConfigError, environment};
use crate::actors::{ActorSpec, Checkpoint, Monitor, planner};
use crate::clock::{ClockKind, monotonic_ns};
use crate::files::FileRef;
use crate::logic::Facts;
use crate::pddl::Domain;
use crate::planners::PlannerConfig;
use crate::replanning::{Adoption, Replanner};
use crate::transport::Bus;
use crate::transport::convert::WireContext;

/// What a planner actor is made from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlannerSetup<'a> {
    pub(crate) domain: &'a Domain,
    pub(crate) config: &'a PlannerConfig,
    /// The file that `config` was read from: for messages and relative paths.
    pub(crate) origin: &'a FileRef,
    /// In lockstep no decision may depend on how fast the machine is.
    pub(crate) clock: ClockKind,
}

impl PlannerSetup<'_> {
    /// A replanner without a plan; `reference_states` are states that are known to be right.
    ///
    /// # Errors
    /// [`ConfigError`] for a planner that is not registered, or options that it refuses.
    pub(crate) fn replanner(
        &self,
        reference_states: impl Iterator<Item = Facts>,
    ) -> Result<Replanner, ConfigError> {
        let config = self.config;
        let planner = config.planner(&self.origin.path(), environment)?;
        let domain = Arc::new(self.domain.clone());
        let replanner = Replanner::new(domain, planner.into(), config, reference_states.collect());
        Ok(match self.clock {
            ClockKind::Lockstep => replanner,
            ClockKind::Realtime => replanner.adopting(Adoption::WhenReady),
        })
    }

    /// The actor, with a replanner of its own.
    ///
    /// # Errors
    /// See [`Self::replanner`].
    pub(crate) fn actor(
        &self,
        (bus, context): (&Bus, &Arc<WireContext>),
        monitor: Monitor,
        reference_states: impl Iterator<Item = Facts>,
    ) -> Result<ActorSpec, ConfigError> {
        let args = Arc::new(planner::PlannerArgs {
            bus: bus.clone(),
            context: Arc::clone(context),
            deadline: match self.clock {
                ClockKind::Lockstep => None,
                ClockKind::Realtime => Some(Duration::from_millis(self.config.deadline_ms)),
            },
            checkpoint: Checkpoint::new(planner::PlannerMemory::new(
                self.replanner(reference_states)?,
            )),
            monitor,
        });
        Ok(ActorSpec::new("planner", move || planner::serve(Arc::clone(&args))))
    }
}

/// A number that no other run on this machine has.
pub(crate) fn new_run_id() -> u64 {
    monotonic_ns() ^ (u64::from(std::process::id()) << 48)
}
