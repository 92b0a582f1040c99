//! Fingers that collide: two bodies that close until both pads press.

use nalgebra::{Isometry3, Translation3};
use rapier3d::prelude::{
    CoefficientCombineRule, Collider, ColliderBuilder, ColliderHandle, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle,
};

use crate::bodies;
use crate::config::STEPS_PER_SECOND;
use crate::convert;
use crate::gripper::{FINGER_DEPTH_M, FINGER_LENGTH_M, PAD_WIDTH_M, TIP_BELOW_M};

/// The jaws stop when one pad alone presses so hard: something blocks the way.
const BLOCKED_N: f32 = 40.0;
/// Less than this on either pad holds nothing, in newtons.
const TOUCH_N: f32 = 0.05;
/// Coulomb friction of rubber pads, whatever they touch.
const PAD_FRICTION: f32 = 1.0;

/// How the pads are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pads {
    /// As they should be.
    Rubber,
    /// Without friction.
    Slippery,
    /// Without force: they meet nothing.
    Limp,
}

/// What the pads felt in the last step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Felt {
    /// Force on each pad, in newtons.
    force_n: [f32; 2],
    /// The body that both pads press, where there is one.
    pub(crate) between: Option<RigidBodyHandle>,
}

impl Felt {
    /// Force with which the pads press what is between them, in newtons.
    pub(crate) fn grip_n(&self) -> f32 {
        self.force_n[0].min(self.force_n[1])
    }

    /// Whether one pad presses so hard that the jaws cannot close.
    pub(crate) fn is_blocked(&self) -> bool {
        self.force_n.iter().any(|force_n| *force_n >= BLOCKED_N)
    }
}

/// The two fingers as bodies of the physics. They go where the gripper carries them.
#[derive(Debug, Clone)]
pub(crate) struct Fingers {
    bodies: [RigidBodyHandle; 2],
    pads: [ColliderHandle; 2],
}

impl Fingers {
    pub(crate) fn insert(
        physics: &mut PhysicsWorld,
        world_from_gripper: &Isometry3<f64>,
        opening_m: f64,
    ) -> Self {
        let half_z = 0.5 * (FINGER_LENGTH_M + TIP_BELOW_M);
        let half = [0.5 * FINGER_DEPTH_M, 0.5 * PAD_WIDTH_M, half_z].map(|half| half as f32);
        let both = [-1.0, 1.0].map(|side| {
            let pose = convert::pose(&(world_from_gripper * finger_pose(side, opening_m)));
            let body = physics.insert_body(RigidBodyBuilder::kinematic_position_based().pose(pose));
            let finger = ColliderBuilder::cuboid(half[0], half[1], half[2])
                .friction_combine_rule(CoefficientCombineRule::Max)
                .restitution(0.0)
                .collision_groups(bodies::finger_groups());
            (body, physics.insert_collider(finger, Some(body)))
        });
        Self { bodies: both.map(|(body, _)| body), pads: both.map(|(_, pad)| pad) }
    }

    /// Moves both to where the gripper has them at the end of this step.
    pub(crate) fn drive(
        &self,
        physics: &mut PhysicsWorld,
        world_from_gripper: &Isometry3<f64>,
        opening_m: f64,
        pads: Pads,
    ) {
        let (friction, rule) = match pads {
            Pads::Rubber => (PAD_FRICTION, CoefficientCombineRule::Max),
            Pads::Slippery | Pads::Limp => (0.0, CoefficientCombineRule::Multiply),
        };
        for (side, (body, pad)) in [-1.0, 1.0].into_iter().zip(self.bodies.iter().zip(&self.pads)) {
            if let Some(body) = physics.bodies.get_mut(*body) {
                let pose = world_from_gripper * finger_pose(side, opening_m);
                body.set_next_kinematic_position(convert::pose(&pose));
            }
            let Some(pad) = physics.colliders.get_mut(*pad) else { continue };
            if pad.friction() != friction {
                pad.set_friction(friction);
                pad.set_friction_combine_rule(rule);
            }
            if pad.is_enabled() == (pads == Pads::Limp) {
                pad.set_enabled(pads != Pads::Limp);
            }
        }
    }

    /// Wakes what the fingers are about to touch: a sleeping body yields nothing and is felt late.
    pub(crate) fn wake_neighbours(&self, physics: &mut PhysicsWorld) {
        for pad in self.pads {
            let bodies: Vec<_> = physics
                .contact_pairs_with(pad)
                .map(|pair| if pair.collider1 == pad { pair.collider2 } else { pair.collider1 })
                .filter_map(|other| physics.colliders.get(other)?.parent())
                .collect();
            for body in bodies {
                physics.wake_up(body, true);
            }
        }
    }

    /// What the pads felt in the step that has just been simulated.
    pub(crate) fn feel(&self, physics: &PhysicsWorld) -> Felt {
        let pressed = self.pads.map(|pad| {
            let mut all = Vec::new();
            for pair in physics.contact_pairs_with(pad) {
                let other = if pair.collider1 == pad { pair.collider2 } else { pair.collider1 };
                let body = physics.colliders.get(other).and_then(Collider::parent);
                let force_n = pair.total_impulse_magnitude() * STEPS_PER_SECOND as f32;
                if let Some(body) = body.filter(|_| force_n > TOUCH_N) {
                    all.push((body, force_n));
                }
            }
            all
        });
        let force_n = pressed.each_ref().map(|all| all.iter().map(|(_, force_n)| force_n).sum());
        let both = |(body, _): &&(RigidBodyHandle, f32)| pressed[1].iter().any(|(b, _)| b == body);
        let hardest = pressed[0].iter().filter(both).max_by(|a, b| a.1.total_cmp(&b.1));
        Felt { force_n, between: hardest.map(|(body, _)| *body) }
    }
}

/// Gripper from finger: its middle, with the pad's face at half the opening.
fn finger_pose(side: f64, opening_m: f64) -> Isometry3<f64> {
    let x = side * 0.5 * (opening_m + FINGER_DEPTH_M);
    Translation3::new(x, 0.0, 0.5 * (FINGER_LENGTH_M - TIP_BELOW_M)).into()
}
