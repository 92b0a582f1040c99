//! What cameras and robots are made from.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

use super::FaultConfig;
use crate::clock::ClockKind;
use crate::files::{FileRef, Folder};
use crate::parts::PartError;
use crate::pddl::Domain;

/// The name of the camera and of the robot that another process plays.
pub const EXTERNAL: &str = "external";

/// What cameras and robots are made from, besides their options.
#[derive(Debug, Clone, Copy)]
pub struct HardwareInputs<'a> {
    /// Which clock drives the loop.
    pub clock: ClockKind,
    /// The camera that is made: "main", or the name of a `[cameras.NAME]`.
    pub camera: &'a str,
    /// Frames per second.
    pub rate_hz: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// The domain's folder.
    pub folder: &'a Folder,
    /// The run file, for messages.
    pub origin: &'a FileRef,
    /// Whose types the scene's objects have.
    pub domain: &'a Domain,
    /// `[sim]` of the run file.
    pub sim: Option<&'a toml::Table>,
    /// What disturbs the simulated world.
    pub faults: &'a [FaultConfig],
    /// What camera and robot of one run share.
    pub world: &'a SharedWorld,
}

/// What the camera and the robot of one run share, such as a simulated world. Whichever needs it
/// first makes it.
#[derive(Debug, Default)]
pub struct SharedWorld(Mutex<Option<Arc<dyn Any + Send + Sync>>>);

impl SharedWorld {
    /// The world, made by `make` if there is none yet.
    ///
    /// # Errors
    /// What `make` says, or that camera and robot are not of one world.
    pub fn get_or_make<W: Any + Send + Sync>(
        &self,
        make: impl FnOnce() -> Result<W, PartError>,
    ) -> Result<Arc<W>, PartError> {
        let mut shared = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let world = match &*shared {
            Some(world) => Arc::clone(world),
            None => Arc::clone(shared.insert(Arc::new(make()?))),
        };
        let Ok(world) = world.downcast::<W>() else {
            let reason = "camera.kind and robot.kind are of different worlds".to_owned();
            return Err(PartError::Inputs { reason });
        };
        Ok(world)
    }
}
