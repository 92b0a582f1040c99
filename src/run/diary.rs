//! What was believed and planned in each frame of an episode, for judging it at its end.

use crate::logic::Facts;
use crate::messages::{PlanMessage, PlanVerdict};
use crate::pddl::Typed;
use crate::scene::Scene;

/// Most pages that are kept, the first ones.
const PAGES_MAX: usize = 20_000;

/// The pages of one episode, in order of their frames; only those that differ from the one before.
#[derive(Debug, Clone, Default)]
pub(super) struct Diary(Vec<Page>);

/// What was believed and planned from one frame on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Page {
    /// Number of the first frame with it.
    pub(super) frame: u64,
    /// The objects in the scene.
    pub(super) objects: Vec<Typed>,
    /// What was believed.
    pub(super) belief: Facts,
    /// How many steps led to the goal; `None` without a plan.
    pub(super) steps_left: Option<usize>,
}

impl Diary {
    /// Takes note of one answered frame.
    pub(super) fn write(&mut self, scene: &Scene, plan: &PlanMessage) {
        let steps_left = match &plan.verdict {
            PlanVerdict::Plan { steps, .. } => Some(steps.len()),
            PlanVerdict::Unsolvable { .. }
            | PlanVerdict::OutOfBudget { .. }
            | PlanVerdict::Unsupported { .. }
            | PlanVerdict::Missing { .. }
            | PlanVerdict::Inconsistent { .. } => None,
        };
        let frame = scene.cause.frame_sequence;
        let (objects, belief) = (scene.typed_objects(), scene.confirmed());
        let is_known = self.0.last().is_some_and(|last| {
            last.steps_left == steps_left && last.belief == belief && last.objects == objects
        });
        if !is_known && self.0.len() < PAGES_MAX {
            self.0.push(Page { frame, objects, belief, steps_left });
        }
    }

    /// All pages.
    pub(super) fn pages(&self) -> &[Page] {
        &self.0
    }

    /// The page of a frame.
    pub(super) fn at(&self, frame: u64) -> Option<&Page> {
        let later = self.0.partition_point(|page| page.frame <= frame);
        later.checked_sub(1).map(|idx| &self.0[idx])
    }
}
