//! Actors that fail on purpose: `[[panic]]` of a run file.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use schemars::JsonSchema;
use serde::Deserialize;

/// `[[panic]]`: an actor that fails on purpose, once.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PanicConfig {
    /// Its name.
    #[schemars(extend("enum" = ["camera", "goal_parser", "planner", "robot", "scene_parser", "skill_executor"]))]
    pub actor: String,
    /// The message at which it panics, counted from 1.
    pub at_message: u64,
}

/// Makes actors panic, each entry once per episode. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Chaos(Arc<Vec<Bomb>>);

#[derive(Debug)]
struct Bomb {
    actor: String,
    at_message: u64,
    messages: AtomicU64,
    has_fired: AtomicBool,
}

impl Chaos {
    /// The panics of a run file.
    pub(super) fn new(panics: &[PanicConfig]) -> Self {
        let bombs = panics.iter().map(|panic| Bomb {
            actor: panic.actor.clone(),
            at_message: panic.at_message,
            messages: AtomicU64::new(0),
            has_fired: AtomicBool::new(false),
        });
        Self(Arc::new(bombs.collect()))
    }

    /// Counts one message of an actor, and panics when its time has come.
    ///
    /// # Panics
    /// When the run file says so.
    pub(super) fn message(&self, actor: &str) {
        for bomb in self.0.iter().filter(|bomb| bomb.actor == actor) {
            let n = bomb.messages.fetch_add(1, Ordering::Relaxed) + 1;
            let fires = n >= bomb.at_message && !bomb.has_fired.swap(true, Ordering::Relaxed);
            assert!(!fires, "{actor} panics at message {n}, as the run file says");
        }
    }

    /// How many panics have happened.
    pub(super) fn n_fired(&self) -> usize {
        self.0.iter().filter(|bomb| bomb.has_fired.load(Ordering::Relaxed)).count()
    }
}
