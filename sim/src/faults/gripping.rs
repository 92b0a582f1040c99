//! What goes wrong between the fingers. A robot's own faults are made of it.

use crate::world::World;

/// Room for rounding where fingers touch, in metres.
const TOUCH_M: f64 = 1e-6;

impl World {
    /// Name of what the gripper holds. No gripper can know it: for faults, scoring and tests.
    pub fn held(&self) -> Option<&str> {
        self.grip.as_ref().map(|grip| self.name(grip.body))
    }

    /// Lets the pads slide off whatever they close on, until the jaws open again.
    pub fn make_slippery(&mut self) {
        self.slippery = true;
    }

    /// Lets what is held fall, and says its name. The jaws take hold of nothing until they have opened.
    pub fn let_fall(&mut self) -> Option<String> {
        let name = self.held()?.to_owned();
        self.release();
        self.slippery = true;
        self.jaws.iter_mut().for_each(|jaws| jaws.is_limp = true);
        Some(name)
    }

    /// Lets what is held slide down between the fingers by `down_m` metres.
    pub fn slide_held(&mut self, down_m: f64) {
        self.slide_grip(-down_m);
    }

    /// The opening at which the fingers touch what is between them, in metres; 0 without anything.
    pub(crate) fn met_m(&self) -> f64 {
        let spans = (0..self.bodies.len()).filter_map(|idx| self.span(idx));
        let met = spans.map(|span| span.touching_opening_m());
        let opening_m = self.gripper.opening_m;
        met.filter(|met_m| *met_m <= opening_m + TOUCH_M).fold(0.0, f64::max).min(opening_m)
    }
}
