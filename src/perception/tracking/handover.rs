//! What the next episode of a robot that lives on must know of the one before: what is in its gripper, which no
//! camera may see there. All else is looked at anew.

use super::gripper::held;
use super::parse::SceneParser;
use crate::perception::GripperContent;

impl SceneParser {
    /// The memory of the next episode: empty, but for what the gripper holds, or was about to take.
    #[must_use]
    pub fn handed_over(&self) -> Self {
        let carried = self.running.as_ref().and_then(|running| running.carried.as_ref());
        let name = held(&self.gripper).or(carried);
        let mut next = Self::default();
        let track = self.tracker.tracks.iter().find(|track| Some(&track.object.name) == name);
        next.tracker.tracks.extend(track.cloned());
        if held(&self.gripper).is_some() && track.is_some() {
            next.gripper = self.gripper.clone();
        } else if self.gripper != GripperContent::Empty {
            next.gripper = GripperContent::HoldsSomething;
        }
        next
    }
}
