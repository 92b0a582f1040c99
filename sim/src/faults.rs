//! Faults: what the world does to the robot's plans.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::places::{Footprint, Obstacle, Places};
use crate::push::Push;
use crate::world::World;

/// Gap left below an object that is set down, in metres.
const SET_DOWN_GAP_M: f64 = 0.0002;
/// Distance of the gripper's axis from an object set down while the gripper is low, in metres.
const GRIPPER_RADIUS_M: f64 = 0.09;

/// One thing that goes wrong. Written in run files with the key `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultAction {
    /// An object is taken away and set down on a free place of the table, upright.
    Displace {
        /// Name of a block or a disk.
        object: String,
        /// The place wanted, x and y in metres; the nearest free place is used. A seeded free
        /// place when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to: Option<[f64; 2]>,
    },
    /// A stacked block and whatever stands on it are pushed off what they stand on.
    KnockOver {
        /// Name of a block that stands on another body.
        object: String,
    },
    /// What the gripper holds is taken out of it and set down on a free place of the table.
    TakeFromGripper {},
    /// The top disk of a peg is taken off and laid flat on the table in front of the pegs.
    BesidePeg {
        /// Name of a disk with nothing on it.
        object: String,
    },
}

/// Why a fault could not be applied. Nothing has changed then.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FaultError {
    /// There is no such object, or it is fixed.
    #[error("fault: expected the name of a block or disk, got \"{object}\"")]
    UnknownObject {
        /// The name.
        object: String,
    },
    /// The object is in the gripper.
    #[error("fault: {object} is held by the gripper")]
    Held {
        /// The name.
        object: String,
    },
    /// The gripper is empty.
    #[error("fault: the gripper holds nothing")]
    NothingHeld,
    /// The object does not stand on anything it could be pushed off.
    #[error("fault: {object} does not stand on another object, so it cannot be knocked off")]
    NotStacked {
        /// The name.
        object: String,
    },
    /// The object cannot be pushed off, since a peg goes through it.
    #[error("fault: {object} is around a peg, so it cannot be knocked off")]
    AroundPeg {
        /// The name.
        object: String,
    },
    /// Something lies on the object.
    #[error("fault: {object} has {on_top} on it")]
    NotClear {
        /// The name.
        object: String,
        /// What lies on it.
        on_top: String,
    },
    /// The object is not a disk around a peg.
    #[error("fault: {object} is not a disk around a peg")]
    NotAroundPeg {
        /// The name.
        object: String,
    },
    /// A coordinate is not a finite number.
    #[error("fault: the place of {object} must be finite numbers, got [{x}, {y}]")]
    BadPlace {
        /// The name.
        object: String,
        /// x as given.
        x: f64,
        /// y as given.
        y: f64,
    },
    /// No place is free.
    #[error("fault: no free place on the table for {object}")]
    NoFreePlace {
        /// The name.
        object: String,
    },
}

impl World {
    /// Lets a fault happen now and says what was done, for people.
    ///
    /// A knock is a push: its objects fall in the following second, and are pushed again, harder,
    /// when they did not. Everything else has happened on return.
    ///
    /// # Errors
    /// [`FaultError`] when the fault does not fit the state of the world; nothing changes then.
    pub fn apply_fault(&mut self, fault: &FaultAction) -> Result<String, FaultError> {
        match fault {
            FaultAction::Displace { object, to } => self.displace(object, *to),
            FaultAction::KnockOver { object } => self.knock_over(object),
            FaultAction::TakeFromGripper {} => {
                let Some(grip) = &self.grip else { return Err(FaultError::NothingHeld) };
                let idx = grip.body;
                let at_m = self.free_place(idx, None)?;
                self.set_down(idx, at_m);
                Ok(format!("took {} from the gripper, set down at {}", self.name(idx), text(at_m)))
            }
            FaultAction::BesidePeg { object } => self.beside_peg(object),
        }
    }

    fn displace(&mut self, object: &str, to: Option<[f64; 2]>) -> Result<String, FaultError> {
        let idx = self.movable(object)?;
        if let Some([x, y]) = to.filter(|[x, y]| !(x.is_finite() && y.is_finite())) {
            return Err(FaultError::BadPlace { object: object.to_owned(), x, y });
        }
        let at_m = self.free_place(idx, to)?;
        self.set_down(idx, at_m);
        Ok(format!("moved {object} to {}", text(at_m)))
    }

    fn knock_over(&mut self, object: &str) -> Result<String, FaultError> {
        let idx = self.movable(object)?;
        let object = object.to_owned();
        if self.view(idx).held {
            return Err(FaultError::Held { object });
        }
        let support = self.support(idx);
        if support.peg.is_some() {
            return Err(FaultError::AroundPeg { object });
        }
        let Some(from) = support.on else { return Err(FaultError::NotStacked { object }) };
        let group = self.with_all_above(idx);
        let direction = self.roomiest_direction(idx, &group);
        let size_m = self.bodies[idx].spec.shape.size_m().x;
        let push = Push::new(group, from, direction, size_m);
        self.kick_group(&push);
        let names: Vec<&str> = push.group.iter().map(|&idx| self.name(idx)).collect();
        let what = format!("knocked {} off {}", names.join(" and "), self.name(from));
        self.pushes.push(push);
        Ok(what)
    }

    fn beside_peg(&mut self, object: &str) -> Result<String, FaultError> {
        let idx = self.movable(object)?;
        let object = object.to_owned();
        let (true, Some(peg)) = (!self.view(idx).held, self.support(idx).peg) else {
            return Err(FaultError::NotAroundPeg { object });
        };
        if let Some(&above) = self.with_all_above(idx).get(1) {
            return Err(FaultError::NotClear { object, on_top: self.name(above).to_owned() });
        }
        let front = self
            .bodies()
            .filter(|body| body.spec.shape.is_fixed())
            .map(|body| body.world_from_body.translation.y - 0.5 * body.spec.shape.size_m().y);
        let radius = self.bodies[idx].spec.shape.footprint_radius_m();
        let y = front.fold(0.0, f64::min) - radius - 0.03;
        let at_m = self.free_place(idx, Some([self.pose(peg).translation.x, y]))?;
        self.set_down(idx, at_m);
        Ok(format!("laid {object} beside {} at {}", self.name(peg), text(at_m)))
    }

    fn name(&self, idx: usize) -> &str {
        &self.bodies[idx].spec.name
    }

    fn movable(&self, object: &str) -> Result<usize, FaultError> {
        self.index_of(object)
            .filter(|&idx| !self.bodies[idx].spec.shape.is_fixed())
            .ok_or_else(|| FaultError::UnknownObject { object: object.to_owned() })
    }

    /// A body and everything that directly or indirectly stands on it, the body first.
    fn with_all_above(&self, idx: usize) -> Vec<usize> {
        let on: Vec<Option<usize>> =
            (0..self.bodies.len()).map(|other| self.support(other).on).collect();
        let mut group = vec![idx];
        let mut n_seen = 0;
        while let Some(&below) = group.get(n_seen) {
            n_seen += 1;
            let above = (0..on.len()).filter(|&other| on[other] == Some(below));
            let new: Vec<usize> = above.filter(|other| !group.contains(other)).collect();
            group.extend(new);
        }
        group
    }

    fn obstacles(&self, without: &[usize]) -> Vec<Obstacle> {
        let bodies = (0..self.bodies.len()).filter(|idx| !without.contains(idx));
        let mut obstacles: Vec<Obstacle> = bodies
            .map(|idx| {
                let (shape, pose) = (&self.bodies[idx].spec.shape, self.pose(idx));
                let top_m = pose.translation.z + shape.half_height_at(&pose);
                Obstacle::of(shape, [pose.translation.x, pose.translation.y], top_m)
            })
            .collect();
        if self.gripper.position.z < 0.25 {
            obstacles.push(Obstacle {
                at_m: [self.gripper.position.x, self.gripper.position.y],
                half_m: [0.0; 2],
                radius_m: GRIPPER_RADIUS_M,
                top_m: 0.0,
            });
        }
        obstacles
    }

    fn footprint(&self, idx: usize) -> Footprint {
        let shape = &self.bodies[idx].spec.shape;
        Footprint { radius_m: shape.footprint_radius_m(), height_m: shape.size_m().z }
    }

    fn free_place(&mut self, idx: usize, near_m: Option<[f64; 2]>) -> Result<[f64; 2], FaultError> {
        // The object's own place is not free: it would not seem to have moved.
        let held = self.view(idx).held;
        let obstacles = if held { self.obstacles(&[idx]) } else { self.obstacles(&[]) };
        let object = self.footprint(idx);
        let places = Places { area_m: self.config.free_area_m, obstacles: &obstacles, object };
        let mut random = self.random.clone();
        let found = match near_m {
            Some(near_m) => places.near(near_m),
            None => places.random(&mut random),
        };
        let no_place = || FaultError::NoFreePlace { object: self.name(idx).to_owned() };
        let found = found.ok_or_else(no_place)?;
        self.random = random;
        Ok(found)
    }

    /// Sets an object down on the table, upright, at rest and slightly turned.
    fn set_down(&mut self, idx: usize, at_m: [f64; 2]) {
        if self.view(idx).held {
            self.release();
        }
        let height_m = self.bodies[idx].spec.shape.size_m().z;
        let yaw_rad = self.random.between(-0.15, 0.15);
        let middle = Translation3::new(at_m[0], at_m[1], 0.5 * height_m + SET_DOWN_GAP_M);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
        self.put(idx, &Isometry3::from_parts(middle, turn));
    }

    /// The level direction in which the group would fall with most room around it, more to the
    /// side than along y: a camera at low y then sees what has fallen beside what still stands.
    fn roomiest_direction(&mut self, idx: usize, group: &[usize]) -> Vector3<f64> {
        const N_DIRECTIONS: usize = 16;
        let obstacles = self.obstacles(group);
        let at = self.pose(idx).translation;
        let nearby =
            |obstacle: &Obstacle| (obstacle.at_m[0] - at.x).hypot(obstacle.at_m[1] - at.y) > 0.02;
        let others: Vec<Obstacle> = obstacles.into_iter().filter(nearby).collect();
        let object = self.footprint(idx);
        let places = Places { area_m: self.config.free_area_m, obstacles: &others, object };
        let turn = self.random.unit();
        let direction = |k: usize| {
            let angle = std::f64::consts::TAU * (k as f64 + turn) / N_DIRECTIONS as f64;
            Vector3::new(angle.cos(), angle.sin(), 0.0)
        };
        let room = |direction: &Vector3<f64>| {
            let reach = [0.06, 0.1, 0.14, 0.18];
            let place = |r: f64| [at.x + r * direction.x, at.y + r * direction.y];
            reach.iter().map(|&r| places.room_m(place(r))).fold(f64::MAX, f64::min)
        };
        let sideways = |direction: &Vector3<f64>| direction.x.abs() > 2.0 * direction.y.abs();
        (0..N_DIRECTIONS)
            .map(direction)
            .filter(sideways)
            .max_by(|a, b| room(a).total_cmp(&room(b)))
            .unwrap_or_else(Vector3::x)
    }
}

/// A place for people.
fn text(at_m: [f64; 2]) -> String {
    format!("({:.2}, {:.2}) m", at_m[0], at_m[1])
}
