//! What is held, and by what.

use nalgebra::Isometry3;
use rapier3d::prelude::ImpulseJointHandle;

use crate::fingers::{Felt, Fingers};

/// What the gripper holds.
#[derive(Debug, Clone)]
pub(crate) struct Grip {
    /// Index of the held body.
    pub(crate) body: usize,
    pub(crate) width_m: f64,
    pub(crate) by: Hold,
}

/// What keeps it there.
#[derive(Debug, Clone)]
pub(crate) enum Hold {
    /// A joint that pulls the object to `anchor`, gripper from body.
    Joint { handle: ImpulseJointHandle, anchor: Isometry3<f64> },
    /// The pads' friction.
    Friction,
}

/// Fingers that collide, and what they felt in the last step.
#[derive(Debug, Clone)]
pub(crate) struct Jaws {
    pub(crate) fingers: Fingers,
    pub(crate) felt: Felt,
    /// The opening at which both pads press what is between them, in metres.
    pub(crate) stop_m: Option<f64>,
    /// For so many steps not both pads have touched it.
    pub(crate) n_apart: u32,
    /// Without force, until they open again.
    pub(crate) is_limp: bool,
}

impl Jaws {
    pub(crate) fn new(fingers: Fingers) -> Self {
        Self { fingers, felt: Felt::default(), stop_m: None, n_apart: 0, is_limp: false }
    }
}
