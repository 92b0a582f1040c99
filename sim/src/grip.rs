//! Holding: an object between the closing fingers is joined to the gripper, or stays there by
//! friction alone.

use nalgebra::{Isometry3, Vector3};
use rapier3d::prelude::{
    GenericJoint, GenericJointBuilder, JointAxesMask, SpringCoefficients, Vector,
};

use crate::config::{Grasp, STEPS_PER_SECOND};
use crate::convert;
use crate::fingers::Pads;
use crate::grasp::{self, Span};
use crate::hold::{Grip, Hold, Jaws};
use crate::world::{Body, World};

/// Stiffness of the joint. Compliant, so that a held disk yields to a peg instead of fighting it,
/// and stiff enough that an object hangs by 0.2 mm only.
const GRIP_FREQUENCY_HZ: f32 = 35.0;
/// An object that is pushed out of its place in the grip by more than this slips out, in metres.
const SLIP_M: f64 = 0.012;
/// Opening by more than this beyond a held object's width lets it go, in metres.
const RELEASE_M: f64 = 0.002;
/// How far jaws that collide close in a step, in metres: 0.1 m/s, as parallel grippers do.
const CLOSING_STEP_M: f64 = 0.1 / STEPS_PER_SECOND as f64;
/// Force with which the pads hold, in newtons.
const GRIP_N: f32 = 15.0;
/// From this force on the jaws have something.
const HOLDING_N: f32 = 0.5 * GRIP_N;
/// Speed at which the jaws give way or press on until they hold with that force. Contacts give way
/// like springs that take some 50 ms to build up: faster jaws would overshoot.
const PRESSING_STEP_M: f64 = 0.003 / STEPS_PER_SECOND as f64;
/// An object is lost when the pads have not both touched it for so many steps.
const LOST_STEPS: u32 = 48;

impl World {
    /// Whether the fingers have nothing left to do: open or closed as they should, or stopped by
    /// what is between them.
    pub(crate) fn fingers_rest(&self) -> bool {
        self.jaws.as_ref().is_none_or(|jaws| {
            let is_closed =
                self.gripper.opening_m < self.gripper.command.opening_m + CLOSING_STEP_M;
            jaws.felt.grip_n() > HOLDING_N || jaws.felt.is_blocked() || is_closed
        })
    }

    /// The opening below which the fingers do not go in this step, in metres: the width of what is
    /// held, or of what lies between them and slides out.
    pub(crate) fn opening_min_m(&self) -> f64 {
        match (&self.jaws, &self.grip) {
            (Some(Jaws { stop_m: Some(stop_m), .. }), _) => *stop_m,
            (Some(jaws), _) if jaws.felt.is_blocked() => self.gripper.opening_m,
            (Some(_), _) => (self.gripper.opening_m - CLOSING_STEP_M).max(0.0),
            (None, Some(grip)) => grip.width_m,
            (None, None) if self.slippery => self.met_m(),
            (None, None) => 0.0,
        }
    }

    /// Takes hold of objects and lets them go as the fingers move. Before the physics steps.
    pub(crate) fn move_fingers(&mut self, opening_before_m: f64) {
        let opening_m = self.gripper.opening_m;
        // Jaws that press give way a little without being told to open.
        let is_opening = match self.jaws {
            Some(_) => self.gripper.command.opening_m > opening_before_m,
            None => opening_m > opening_before_m,
        };
        if let Some(jaws) = self.jaws.as_mut().filter(|_| is_opening) {
            (jaws.stop_m, jaws.is_limp) = (None, false);
            self.grip = None;
        }
        if self.grip.is_none() && is_opening {
            self.slippery = false;
        }
        match self.config.grasp {
            Grasp::Weld => self.move_joint(opening_before_m),
            Grasp::Friction => {
                let Some(jaws) = &self.jaws else { return };
                let pads = match self.slippery {
                    _ if jaws.is_limp => Pads::Limp,
                    true => Pads::Slippery,
                    false => Pads::Rubber,
                };
                let is_moving = self.gripper.velocity != Vector3::zeros();
                if is_moving || opening_m != opening_before_m {
                    jaws.fingers.wake_neighbours(&mut self.physics);
                }
                jaws.fingers.drive(&mut self.physics, &self.gripper.pose(), opening_m, pads);
            }
        }
    }

    /// Looks what is held after the physics has stepped.
    pub(crate) fn feel(&mut self) {
        match self.config.grasp {
            Grasp::Weld => self.slip(),
            Grasp::Friction => self.feel_pads(),
        }
    }

    /// Lets go of the held object. From a joint it keeps the gripper's speed and does not turn.
    pub(crate) fn release(&mut self) {
        let Some(grip) = self.grip.take() else { return };
        if let Hold::Joint { handle, .. } = grip.by {
            self.physics.impulse_joints.remove(handle, true);
            if let Some(body) = self.physics.bodies.get_mut(self.bodies[grip.body].handle) {
                body.set_linvel(convert::vector(&self.gripper.velocity), true);
                body.set_angvel(Vector::ZERO, true);
            }
        }
        self.physics.wake_up_all(true);
    }

    /// Moves what is held by so much along the fingers, downwards where it is negative.
    pub(crate) fn slide_grip(&mut self, up_m: f64) {
        let Some(grip) = &mut self.grip else { return };
        let handle = self.bodies[grip.body].handle;
        match &mut grip.by {
            Hold::Joint { handle, anchor } => {
                anchor.translation.z += up_m;
                if let Some(joint) = self.physics.impulse_joints.get_mut(*handle, true) {
                    joint.data.set_local_frame1(convert::pose(anchor));
                }
            }
            Hold::Friction => {
                if let Some(body) = self.physics.bodies.get_mut(handle) {
                    let at = body.translation() + Vector::new(0.0, 0.0, up_m as f32);
                    body.set_translation(at, true);
                }
            }
        }
        self.physics.wake_up(handle, true);
    }

    /// The body as the fingers see it, when it can be grasped.
    pub(crate) fn span(&self, idx: usize) -> Option<Span> {
        let spec = &self.bodies[idx].spec;
        if spec.is_fixed() {
            return None;
        }
        grasp::span(&spec.shape, &self.gripper.pose(), &self.pose(idx))
    }

    /// What both pads touch stops the jaws and is held; what they have not touched for a while is
    /// lost.
    fn feel_pads(&mut self) {
        let Some(jaws) = &mut self.jaws else { return };
        jaws.felt = jaws.fingers.feel(&self.physics);
        let is_between = jaws.felt.between.is_some();
        jaws.n_apart = if is_between { 0 } else { jaws.n_apart + 1 };
        if jaws.n_apart > LOST_STEPS {
            jaws.stop_m = None;
            self.grip = None;
        }
        let opening_m = self.gripper.opening_m;
        if self.gripper.command.opening_m >= opening_m || (!is_between && jaws.stop_m.is_none()) {
            return;
        }
        // At the first touch the jaws have gone too far by a step at most.
        let stop_m = jaws.stop_m.get_or_insert(opening_m + CLOSING_STEP_M);
        let missing = (1.0 - jaws.felt.grip_n() / GRIP_N).clamp(-1.0, 1.0);
        *stop_m -= f64::from(missing) * PRESSING_STEP_M;
        if self.grip.is_none() && jaws.felt.grip_n() > HOLDING_N && !self.slippery {
            let is = |body: &Body| Some(body.handle) == jaws.felt.between && !body.spec.is_fixed();
            let body = self.bodies.iter().position(is);
            self.grip = body.map(|body| Grip { body, width_m: *stop_m, by: Hold::Friction });
        }
    }

    /// Joins, centres or lets go of an object as the fingers move.
    fn move_joint(&mut self, opening_before_m: f64) {
        let opening_m = self.gripper.opening_m;
        let moving = self.gripper.velocity != Vector3::zeros();
        if let Some(grip) = &mut self.grip {
            if self.gripper.command.opening_m > grip.width_m + RELEASE_M {
                self.release();
                return;
            }
            let Hold::Joint { handle, anchor } = &mut grip.by else { return };
            // The first finger that touches pushes the object until both do.
            let play = 0.5 * (opening_m - grip.width_m).max(0.0);
            let offset = &mut anchor.translation.x;
            let centred = offset.clamp(-play, play);
            if centred != *offset {
                *offset = centred;
                let frame = convert::pose(anchor);
                if let Some(joint) = self.physics.impulse_joints.get_mut(*handle, true) {
                    joint.data.set_local_frame1(frame);
                }
            }
            if moving {
                self.physics.wake_up(self.bodies[grip.body].handle, true);
            }
        } else if opening_m < opening_before_m && !self.slippery {
            let touched = |span: &Span| {
                let opening = span.touching_opening_m();
                opening <= opening_before_m
                    && opening >= opening_m
                    && span.width_m + RELEASE_M > self.gripper.command.opening_m
            };
            let met = (0..self.bodies.len())
                .filter_map(|idx| self.span(idx).filter(touched).map(|span| (idx, span)))
                .min_by(|(_, a), (_, b)| a.distance_m.total_cmp(&b.distance_m));
            if let Some((idx, span)) = met {
                self.join(idx, &span);
            }
        }
    }

    fn join(&mut self, idx: usize, span: &Span) {
        // The physics moves the gripper's body at the step's end: until then it is one step behind.
        let anchor = self.gripper.pose().inv_mul(&self.pose(idx));
        let body = self.bodies[idx].handle;
        let handle =
            self.physics.insert_impulse_joint(self.gripper_handle, body, grip_joint(&anchor));
        let by = Hold::Joint { handle, anchor };
        self.grip = Some(Grip { body: idx, width_m: span.width_m, by });
    }

    /// Lets go of an object that something pushed far out of its place at the joint.
    fn slip(&mut self) {
        let Some(Grip { body, by: Hold::Joint { anchor, .. }, .. }) = &self.grip else { return };
        let wanted = self.gripper.pose() * anchor;
        let is = self.pose(*body);
        if (wanted.translation.vector - is.translation.vector).norm() > SLIP_M {
            self.release();
        }
    }
}

/// A compliant joint in all six directions that pulls the object to `anchor` in the gripper.
fn grip_joint(anchor: &Isometry3<f64>) -> GenericJoint {
    GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES)
        .local_frame1(convert::pose(anchor))
        .softness(SpringCoefficients::new(GRIP_FREQUENCY_HZ, 1.0))
        .build()
}
