//! Checkpoints: what an actor knows outlives the actor.

use std::sync::{Arc, Mutex, PoisonError};

/// A value that is stored after each message and found again after a restart.
#[derive(Debug, Default)]
pub struct Checkpoint<T>(Arc<Mutex<T>>);

impl<T> Clone for Checkpoint<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Clone> Checkpoint<T> {
    /// Keeps a first value.
    pub fn new(value: T) -> Self {
        Self(Arc::new(Mutex::new(value)))
    }

    /// The value stored last.
    pub fn load(&self) -> T {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Stores a value.
    pub fn store(&self, value: T) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = value;
    }
}
