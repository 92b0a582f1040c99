//! What a simulated world remembers of itself: the bodies' true state in every frame, and what the
//! cameras showed of them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use groundloop_sim::{BodyTruth, Truth, World};

use crate::pddl::Step;

/// A body is shown well enough by this share of the most pixels that a camera has ever shown of it.
const SEEN_SHARE_MIN: f64 = 0.5;
/// Every so many pixels one is counted: shares are as good, and a frame costs less.
const PIXEL_STEP: usize = 3;
/// Most moments that are remembered, the newest ones.
const MOMENTS_MAX: usize = 20_000;
/// Most dispatches that are remembered, the newest ones.
const DISPATCHES_MAX: usize = 20_000;

/// The true state from one frame on.
#[derive(Debug, Clone)]
pub(super) struct Moment {
    /// The first frame that shows it.
    pub(super) frame: u64,
    pub(super) truth: Truth,
    /// The bodies that a camera shows.
    pub(super) seen: BTreeSet<String>,
}

/// The memory of one world.
#[derive(Debug, Clone, Default)]
pub(super) struct Witness {
    moments: VecDeque<Moment>,
    /// The newest frame: other cameras may add to it.
    newest: Option<Moment>,
    dispatches: VecDeque<(u64, Step)>,
    /// Most pixels of each body that each camera has shown.
    pixels_max: BTreeMap<String, Vec<u32>>,
}

impl Witness {
    /// Takes note of a frame; `ids` says which body each of its pixels shows.
    pub(super) fn see(&mut self, camera: &str, frame: u64, world: &World, ids: &[u16]) {
        let mut pixels = vec![0_u32; world.bodies().len()];
        for id in ids.iter().step_by(PIXEL_STEP).filter(|id| **id != 0) {
            // The gripper has an id beyond all bodies.
            if let Some(n) = pixels.get_mut(usize::from(*id) - 1) {
                *n += 1;
            }
        }
        let most = self.pixels_max.entry(camera.to_owned()).or_default();
        most.resize(pixels.len(), 0);
        let mut seen = BTreeSet::new();
        for ((body, n), most) in world.bodies().zip(pixels).zip(most) {
            *most = n.max(*most);
            if n > 0 && f64::from(n) >= SEEN_SHARE_MIN * f64::from(*most) {
                seen.insert(body.spec.name.clone());
            }
        }
        match &mut self.newest {
            Some(newest) if newest.frame == frame => newest.seen.append(&mut seen),
            Some(newest) if newest.frame > frame => {} // shown again after a restart
            _ => {
                self.keep_newest();
                self.newest = Some(Moment { frame, truth: world.truth(), seen });
            }
        }
    }

    /// Takes note of a step that the robot is told to carry out, in answer to a frame.
    pub(super) fn dispatched(&mut self, frame: u64, step: &Step) {
        self.dispatches.push_back((frame, step.clone()));
        if self.dispatches.len() > DISPATCHES_MAX {
            self.dispatches.pop_front();
        }
    }

    /// Number of the next frame.
    pub(super) fn next_frame(&self) -> u64 {
        self.newest.as_ref().map_or(0, |newest| newest.frame + 1)
    }

    /// All moments that differ from the one before, in order.
    pub(super) fn moments(&self) -> impl Iterator<Item = &Moment> {
        let newest = self.newest.as_ref().filter(|newest| !self.is_known(newest));
        self.moments.iter().chain(newest)
    }

    /// All dispatches, in order, each with the frame that it answered.
    pub(super) fn dispatches(&self) -> impl Iterator<Item = &(u64, Step)> {
        self.dispatches.iter()
    }

    fn keep_newest(&mut self) {
        let Some(newest) = self.newest.take().filter(|newest| !self.is_known(newest)) else {
            return;
        };
        self.moments.push_back(newest);
        if self.moments.len() > MOMENTS_MAX {
            self.moments.pop_front();
        }
    }

    /// Whether the last moment says the same.
    fn is_known(&self, moment: &Moment) -> bool {
        self.moments.back().is_some_and(|last| {
            let (a, b) = (&last.truth.bodies, &moment.truth.bodies);
            last.seen == moment.seen
                && a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| says_the_same(a, b))
        })
    }
}

/// Whether two states of a body differ in nothing that a fact may speak of.
fn says_the_same(a: &BodyTruth, b: &BodyTruth) -> bool {
    (&a.name, &a.on, a.on_table, &a.peg) == (&b.name, &b.on, b.on_table, &b.peg)
        && (a.held, is_settled(a)) == (b.held, is_settled(b))
}

/// Whether it rests, or is held, and stands as it should: on one body, not on several at once, for which domains have
/// no word.
pub(super) fn is_settled(body: &BodyTruth) -> bool {
    body.upright && !body.bridges && (body.still || body.held)
}
