//! The physical world: bodies, gripper, time. With `bodies.rs`, `convert.rs`, `fingers.rs`,
//! `hold.rs` and `grip.rs` the only file that names rapier.

use nalgebra::{Isometry3, Vector3};
use rapier3d::prelude::{
    PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, SpringCoefficients, Vector,
};

use crate::bodies;
use crate::body_spec::BodySpec;
use crate::config::{Grasp, STEPS_PER_SECOND, WorldConfig};
use crate::convert;
use crate::fingers::Fingers;
use crate::gripper::{CommandError, Gripper, GripperCommand, GripperState};
use crate::hold::{Grip, Jaws};
use crate::layout;
use crate::material::Material;
use crate::push::UnderWay;
use crate::random::Random;
use crate::scene::SceneSpec;
use crate::scene_error::SceneError;

const DT: f64 = 1.0 / STEPS_PER_SECOND as f64;
const SOLVER_ITERATIONS: usize = 4;
/// The same where the heaviest body that moves is more than [`MASS_RATIO_MAX`] times as heavy as the
/// lightest: with four, a block of 60 mm on one of 30 mm rocks for ever.
const UNEVEN_SOLVER_ITERATIONS: usize = 8;
const MASS_RATIO_MAX: f32 = 5.0;
/// Stiffness of contacts. The default of 30 Hz lets a stack of six cubes sag by 8 mm; this is the
/// stiffest that a quarter of the solver's rate allows, and sags by 0.2 mm.
const CONTACT_FREQUENCY_HZ: f32 = 0.25 * (SOLVER_ITERATIONS as u64 * STEPS_PER_SECOND) as f32;
const CONTACT_DAMPING_RATIO: f32 = 10.0;
/// Size of the objects, which rapier's distances scale with. At 1 m a contact may be kept while a
/// body moves by 50 mm, and a disk that falls over a peg sticks to its tip in mid-air.
const LENGTH_UNIT_M: f32 = 0.05;
/// Loss of turning speed, for the rolling resistance that rigid contacts lack.
const ANGULAR_DAMPING_PER_S: f32 = 1.5;
const SETTLE_SECONDS_MAX: u64 = 4;
/// A body slower than this is at rest (`ManiSkill` uses 0.01 m/s and 0.5 rad/s).
const STILL_M_S: f64 = 0.01;
const STILL_RAD_S: f64 = 0.1;

/// A body and its handle in the physics.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) spec: BodySpec,
    /// What it is made of, where it says so.
    pub(crate) material: Option<Material>,
    /// Taken out of the world: it meets nothing and is not seen.
    pub(crate) is_out: bool,
    pub(crate) handle: RigidBodyHandle,
}

/// The simulated table top.
///
/// Everything that happens is a pure function of scene, config, seed and the sequence of commands
/// and faults. A clone has the same future as its original: clone it to save it, assign to restore.
pub struct World {
    pub(crate) physics: PhysicsWorld,
    pub(crate) bodies: Vec<Body>,
    pub(crate) config: WorldConfig,
    pub(crate) gripper: Gripper,
    pub(crate) gripper_handle: RigidBodyHandle,
    /// Fingers that collide; none where what is grasped is joined to the gripper.
    pub(crate) jaws: Option<Jaws>,
    pub(crate) grip: Option<Grip>,
    pub(crate) random: Random,
    pub(crate) under_way: UnderWay,
    /// Closing jaws take hold of nothing, until they open again.
    pub(crate) slippery: bool,
    n_steps: u64,
    seed: u64,
}

/// One body as it is now.
#[derive(Debug, Clone, Copy)]
pub struct BodyView<'a> {
    /// Name, shape and colour as the scene has them.
    pub spec: &'a BodySpec,
    /// Pose of the body: origin in the middle of the shape, metres, world frame.
    pub world_from_body: Isometry3<f64>,
    /// Speed of the body's centre, in metres per second.
    pub speed_m_s: f64,
    /// Whether the body rests.
    pub still: bool,
    /// Whether the gripper holds it.
    pub held: bool,
    /// Whether a fault has taken it out of the world: it meets nothing and is not seen.
    pub is_out: bool,
}

impl World {
    /// Builds a scene and lets it come to rest. Time is 0 afterwards.
    ///
    /// # Errors
    /// [`SceneError`] when the scene is not sound, two bodies overlap or it does not come to rest.
    pub fn new(spec: &SceneSpec, config: &WorldConfig, seed: u64) -> Result<Self, SceneError> {
        let poses = layout::place(spec, seed)?;
        bodies::check_overlaps(spec, &poses)?;
        let mut physics = empty_physics(config);
        let gripper = Gripper::at(config.gripper_home);
        let kinematic = RigidBodyBuilder::kinematic_position_based();
        let gripper_handle = physics.insert_body(kinematic.pose(convert::pose(&gripper.pose())));
        let jaws = (config.grasp == Grasp::Friction).then(|| {
            let fingers = Fingers::insert(&mut physics, &gripper.pose(), gripper.opening_m);
            Jaws::new(fingers)
        });
        let mut insert = |(body, pose): (&BodySpec, &Isometry3<f64>)| {
            let material = spec.material_of(body)?;
            let fixed = body.is_fixed();
            let dynamic = RigidBodyBuilder::dynamic().angular_damping(ANGULAR_DAMPING_PER_S);
            let rigid = if fixed { RigidBodyBuilder::fixed() } else { dynamic };
            let handle = physics.insert_body(rigid.pose(convert::pose(pose)));
            for collider in bodies::colliders(body, material.as_ref(), config) {
                physics.insert_collider(collider, Some(handle));
            }
            Ok(Body { spec: body.clone(), material, is_out: false, handle })
        };
        let bodies = spec.bodies.iter().zip(&poses).map(&mut insert);
        let bodies = bodies.collect::<Result<Vec<_>, SceneError>>()?;
        if mass_ratio(&physics) > MASS_RATIO_MAX {
            physics.integration_parameters.num_solver_iterations = UNEVEN_SOLVER_ITERATIONS;
        }
        let mut world = Self {
            physics,
            bodies,
            config: config.clone(),
            gripper,
            gripper_handle,
            jaws,
            grip: None,
            random: Random::new(seed, 1),
            under_way: UnderWay::default(),
            slippery: false,
            n_steps: 0,
            seed,
        };
        world.settle()?;
        Ok(world)
    }

    /// Simulated time since the scene was at rest, in nanoseconds.
    pub fn time_ns(&self) -> u64 {
        (u128::from(self.n_steps) * 1_000_000_000 / u128::from(STEPS_PER_SECOND)) as u64
    }

    /// The seed the world was built with.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Simulates until the step nearest to `time_ns`; nothing happens when that is in the past.
    /// Time is counted in whole steps, so it does not drift.
    pub fn advance_to(&mut self, time_ns: u64) {
        let scaled = u128::from(time_ns) * u128::from(STEPS_PER_SECOND) + 500_000_000;
        let n_steps = (scaled / 1_000_000_000) as u64;
        while self.n_steps < n_steps {
            self.step();
        }
    }

    /// Gives the gripper a new target. It takes effect with the next step.
    ///
    /// # Errors
    /// [`CommandError`] when a number is not finite or out of range; nothing changes then.
    pub fn command(&mut self, command: &GripperCommand) -> Result<(), CommandError> {
        command.check()?;
        self.gripper.set_target(*command);
        Ok(())
    }

    /// What the gripper's sensors tell.
    pub fn gripper(&self) -> GripperState {
        GripperState {
            position: self.gripper.position,
            yaw_rad: self.gripper.yaw_rad,
            opening_m: self.gripper.opening_m,
            holding: self.grip.is_some(),
            at_target: self.gripper.at_target(self.opening_min_m()) && self.fingers_rest(),
            speed_m_s: self.gripper.velocity.norm(),
        }
    }

    /// Every body as it is now, in the order of the scene. For drawing, scoring and tests: the
    /// executive side must not look at it.
    pub fn bodies(&self) -> impl ExactSizeIterator<Item = BodyView<'_>> {
        (0..self.bodies.len()).map(|idx| self.view(idx))
    }

    /// One body as it is now.
    pub(crate) fn view(&self, idx: usize) -> BodyView<'_> {
        let body = &self.bodies[idx];
        let (speed, spin) = self.speeds(idx);
        BodyView {
            spec: &body.spec,
            world_from_body: self.pose(idx),
            speed_m_s: speed,
            still: speed < STILL_M_S && spin < STILL_RAD_S,
            held: self.grip.as_ref().is_some_and(|grip| grip.body == idx),
            is_out: body.is_out,
        }
    }

    /// World from body.
    pub(crate) fn pose(&self, idx: usize) -> Isometry3<f64> {
        self.physics
            .bodies
            .get(self.bodies[idx].handle)
            .map_or_else(Isometry3::identity, |body| convert::from_pose(body.position()))
    }

    /// Speed and turning speed of a body, in metres and radians per second.
    fn speeds(&self, idx: usize) -> (f64, f64) {
        self.physics.bodies.get(self.bodies[idx].handle).map_or((0.0, 0.0), |body| {
            (f64::from(body.linvel().length()), f64::from(body.angvel().length()))
        })
    }

    /// Index of the body called `name`.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.spec.name == name)
    }

    /// Puts a body somewhere at rest; whatever rested on it falls.
    pub(crate) fn put(&mut self, idx: usize, world_from_body: &Isometry3<f64>) {
        if let Some(body) = self.physics.bodies.get_mut(self.bodies[idx].handle) {
            body.set_position(convert::pose(world_from_body), true);
            body.set_linvel(Vector::ZERO, true);
            body.set_angvel(Vector::ZERO, true);
        }
        self.physics.wake_up_all(true);
    }

    /// Takes a body out of the world, or lets it be there again.
    pub(crate) fn set_out(&mut self, idx: usize, is_out: bool) {
        self.bodies[idx].is_out = is_out;
        if let Some(body) = self.physics.bodies.get_mut(self.bodies[idx].handle) {
            body.set_enabled(!is_out);
        }
        self.physics.wake_up_all(true);
    }

    /// Gives a body a push that changes its speed by `change_m_s`.
    pub(crate) fn kick(&mut self, idx: usize, change_m_s: &Vector3<f64>) {
        if let Some(body) = self.physics.bodies.get_mut(self.bodies[idx].handle) {
            let impulse = convert::vector(change_m_s) * body.mass();
            body.apply_impulse(impulse, true);
        }
        self.physics.wake_up_all(true);
    }

    fn step(&mut self) {
        let opening_before_m = self.gripper.opening_m;
        self.gripper.advance(DT, self.opening_min_m());
        self.move_fingers(opening_before_m);
        let pose = convert::pose(&self.gripper.pose());
        if let Some(body) = self.physics.bodies.get_mut(self.gripper_handle) {
            body.set_next_kinematic_position(pose);
        }
        self.physics.step();
        self.feel();
        self.n_steps += 1;
        self.carry_on();
    }

    /// Simulates until nothing moves, then sets the time to 0.
    fn settle(&mut self) -> Result<(), SceneError> {
        const STILL_STEPS: usize = 48;
        let mut n_still = 0;
        for _ in 0..SETTLE_SECONDS_MAX * STEPS_PER_SECOND {
            self.step();
            let still = self.bodies().all(|body| body.still && body.speed_m_s < 0.2 * STILL_M_S);
            n_still = if still { n_still + 1 } else { 0 };
            if n_still == STILL_STEPS {
                self.n_steps = 0;
                return Ok(());
            }
        }
        let moving = self.bodies().find(|body| !body.still);
        let name = moving.map_or_else(String::new, |body| body.spec.name.clone());
        Err(SceneError::Unsettled { name, seconds: SETTLE_SECONDS_MAX as f64 })
    }
}

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            physics: clone_physics(&self.physics),
            bodies: self.bodies.clone(),
            config: self.config.clone(),
            gripper: self.gripper.clone(),
            gripper_handle: self.gripper_handle,
            jaws: self.jaws.clone(),
            grip: self.grip.clone(),
            random: self.random.clone(),
            under_way: self.under_way.clone(),
            slippery: self.slippery,
            n_steps: self.n_steps,
            seed: self.seed,
        }
    }
}

impl std::fmt::Debug for World {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("World")
            .field("time_ns", &self.time_ns())
            .field("n_bodies", &self.bodies.len())
            .field("gripper", &self.gripper())
            .finish_non_exhaustive()
    }
}

/// Physics with gravity, the contact rule above and the table.
fn empty_physics(config: &WorldConfig) -> PhysicsWorld {
    let mut physics = PhysicsWorld::new();
    physics.gravity = Vector::new(0.0, 0.0, -9.81);
    let contact = SpringCoefficients::new(CONTACT_FREQUENCY_HZ, CONTACT_DAMPING_RATIO);
    let parameters = &mut physics.integration_parameters;
    parameters.dt = DT as f32;
    parameters.num_solver_iterations = SOLVER_ITERATIONS;
    parameters.contact_softness = contact;
    parameters.static_contact_softness = contact;
    parameters.friction_in_bias_pass = false;
    parameters.length_unit = LENGTH_UNIT_M;
    physics.insert_collider(bodies::table(config), None);
    physics
}

/// How much heavier the heaviest body that moves is than the lightest.
fn mass_ratio(physics: &PhysicsWorld) -> f32 {
    let moving = physics.bodies.iter().map(|(_, body)| body).filter(|body| body.is_dynamic());
    let [lightest, heaviest] = moving
        .map(rapier3d::prelude::RigidBody::mass)
        .fold([f32::INFINITY, 0.0], |[low, high], mass| [low.min(mass), high.max(mass)]);
    heaviest / lightest
}

/// A copy with the same future: what is not copied is scratch space.
fn clone_physics(physics: &PhysicsWorld) -> PhysicsWorld {
    let mut copy = PhysicsWorld::new();
    copy.gravity = physics.gravity;
    copy.integration_parameters = physics.integration_parameters;
    copy.islands = physics.islands.clone();
    copy.broad_phase = physics.broad_phase.clone();
    copy.narrow_phase = physics.narrow_phase.clone();
    copy.bodies = physics.bodies.clone();
    copy.colliders = physics.colliders.clone();
    copy.impulse_joints = physics.impulse_joints.clone();
    copy.multibody_joints = physics.multibody_joints.clone();
    copy.soft_bodies = physics.soft_bodies.clone();
    copy
}
