//! Detectors that are made and taught before an episode, which takes them.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::perception::detectors::Detector;

/// Detectors by the name of their camera. A clone shares them: each is taken once.
#[derive(Clone, Default)]
pub(super) struct ReadyDetectors(Arc<Mutex<BTreeMap<String, Box<dyn Detector>>>>);

impl ReadyDetectors {
    pub(super) fn put(&self, camera: &str, detector: Box<dyn Detector>) {
        self.lock().insert(camera.to_owned(), detector);
    }

    pub(super) fn has(&self, camera: &str) -> bool {
        self.lock().contains_key(camera)
    }

    pub(super) fn take(&self, camera: &str) -> Option<Box<dyn Detector>> {
        self.lock().remove(camera)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Box<dyn Detector>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for ReadyDetectors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.lock().keys()).finish()
    }
}
