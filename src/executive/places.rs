//! Where everything stands in a scene, to be compared with another one.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::pddl::Name;
use crate::scene::{Scene, Visibility};

/// What moves by less than this is at rest: more than a measurement differs from the next, in metres.
const AT_REST_M: f64 = 0.01;

/// The middles of all objects that stand somewhere.
#[derive(Debug, Clone)]
pub(super) struct Places(BTreeMap<Name, Point3<f64>>);

impl Places {
    /// Of the objects in sight.
    pub(super) fn in_sight(scene: &Scene) -> Self {
        Self::of(scene, |visibility| visibility == Visibility::Visible)
    }

    /// Of all objects but what is held.
    pub(super) fn known(scene: &Scene) -> Self {
        Self::of(scene, |visibility| visibility != Visibility::Held)
    }

    fn of(scene: &Scene, counts: fn(Visibility) -> bool) -> Self {
        let objects = scene.objects.iter().filter(|o| counts(o.visibility));
        Self(objects.filter_map(|o| Some((o.name.clone(), o.volume?.centre))).collect())
    }

    /// An object that is elsewhere now than it was. One that is in one of the two only has not moved.
    pub(super) fn moved(&self, now: &Self) -> Option<&Name> {
        let mut known = self.0.iter();
        let moved = known.find(|(name, before)| {
            now.0.get(*name).is_some_and(|place| (place - *before).norm() > AT_REST_M)
        });
        moved.map(|(name, _)| name)
    }

    /// Whether the same objects stand in the same places.
    pub(super) fn are_as(&self, before: &Self) -> bool {
        self.0.keys().eq(before.0.keys()) && before.moved(self).is_none()
    }
}
