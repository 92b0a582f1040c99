//! Faults that lift an object and set it down somewhere, or nowhere.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::FaultError;
use crate::bodies;
use crate::config::STEPS_PER_SECOND;
use crate::places::{CLEARANCE_M, Footprint, Obstacle, Places};
use crate::push::InHand;
use crate::world::World;

/// Gap left below an object that is set down, in metres.
const SET_DOWN_GAP_M: f64 = 0.0002;
/// Distance of the gripper's axis from an object set down while the gripper is low, in metres.
const GRIPPER_RADIUS_M: f64 = 0.09;
/// Deepest overlap of an object with others at a new place, in metres.
const OVERLAP_MAX_M: f64 = 0.001;
/// Where objects are that were taken out of the world, along x and y in metres: away from everything.
const OUT_M: f64 = 100.0;
/// Steps until a person looks for a free place again: 0.25 s.
const RETRY_STEPS: u64 = STEPS_PER_SECOND / 4;

impl World {
    pub(super) fn displace(
        &mut self,
        object: &str,
        to: Option<[f64; 2]>,
    ) -> Result<String, FaultError> {
        let idx = self.present(object)?;
        let at_m = self.free_place(idx, to)?;
        self.set_down(idx, at_m);
        Ok(format!("moved {object} to {}", text(at_m)))
    }

    pub(super) fn take_from_gripper(&mut self) -> Result<String, FaultError> {
        let Some(grip) = &self.grip else { return Err(FaultError::NothingHeld) };
        let idx = grip.body;
        let at_m = self.free_place(idx, None)?;
        self.set_down(idx, at_m);
        Ok(format!("took {} from the gripper, set down at {}", self.name(idx), text(at_m)))
    }

    pub(super) fn beside_peg(&mut self, object: &str) -> Result<String, FaultError> {
        let idx = self.present(object)?;
        let object = object.to_owned();
        let (true, Some(peg)) = (!self.view(idx).held, self.support(idx).peg) else {
            return Err(FaultError::NotAroundPeg { object });
        };
        if let Some(&above) = self.with_all_above(idx).get(1) {
            return Err(FaultError::NotClear { object, on_top: self.name(above).to_owned() });
        }
        let front = self
            .bodies()
            .filter(|body| body.spec.is_fixed())
            .map(|body| body.world_from_body.translation.y - 0.5 * body.spec.shape.size_m().y);
        let radius = self.bodies[idx].spec.shape.footprint_radius_m();
        let y = front.fold(0.0, f64::min) - radius - 0.03;
        let at_m = self.free_place(idx, Some([self.pose(peg).translation.x, y]))?;
        self.set_down(idx, at_m);
        Ok(format!("laid {object} beside {} at {}", self.name(peg), text(at_m)))
    }

    pub(super) fn remove(&mut self, object: &str) -> Result<String, FaultError> {
        let idx = self.present(object)?;
        self.take_out(idx);
        Ok(format!("took {object} away"))
    }

    pub(super) fn put_back(
        &mut self,
        object: &str,
        to: Option<[f64; 2]>,
    ) -> Result<String, FaultError> {
        let idx = self.movable(object)?;
        if !self.bodies[idx].is_out {
            return Err(FaultError::NotOut { object: object.to_owned() });
        }
        let at_m = self.free_place(idx, to)?;
        self.bring_in(idx, at_m);
        self.under_way.in_hand.retain(|held| held.body != idx);
        Ok(format!("put {object} back at {}", text(at_m)))
    }

    pub(super) fn hold(&mut self, object: &str, for_s: f64) -> Result<String, FaultError> {
        let idx = self.present(object)?;
        self.take_out(idx);
        let steps_left = (for_s * STEPS_PER_SECOND as f64).ceil() as u64;
        self.under_way.in_hand.push(InHand { body: idx, steps_left });
        Ok(format!("lifted {object} out of the picture for {for_s:.1} s"))
    }

    /// Sets down what people have held for long enough.
    pub(super) fn give_back(&mut self) {
        for mut held in std::mem::take(&mut self.under_way.in_hand) {
            held.steps_left = held.steps_left.saturating_sub(1);
            if held.steps_left == 0 {
                match self.free_place(held.body, None) {
                    Ok(at_m) => {
                        self.bring_in(held.body, at_m);
                        continue;
                    }
                    Err(_) => held.steps_left = RETRY_STEPS,
                }
            }
            self.under_way.in_hand.push(held);
        }
    }

    pub(super) fn swap(&mut self, objects: &[String; 2]) -> Result<String, FaultError> {
        let [first, second] = objects;
        if first == second {
            return Err(FaultError::SameObject { object: first.clone() });
        }
        let (a, b) = (self.free_standing(first)?, self.free_standing(second)?);
        let moved = [(a, self.in_place_of(a, b)), (b, self.in_place_of(b, a))];
        self.check_room(&moved)?;
        for (idx, pose) in &moved {
            self.put(*idx, pose);
        }
        Ok(format!("swapped {first} and {second}"))
    }

    /// A body that has nothing on it, and is neither held nor around a peg.
    fn free_standing(&self, object: &str) -> Result<usize, FaultError> {
        let idx = self.present(object)?;
        let object = object.to_owned();
        if self.view(idx).held {
            return Err(FaultError::Held { object });
        }
        if self.support(idx).peg.is_some() {
            return Err(FaultError::AroundPeg { object });
        }
        match self.with_all_above(idx).get(1) {
            Some(&above) => {
                Err(FaultError::NotClear { object, on_top: self.name(above).to_owned() })
            }
            None => Ok(idx),
        }
    }

    /// The pose of a body that stands upright where another one is, turned as the other one.
    fn in_place_of(&self, idx: usize, other: usize) -> Isometry3<f64> {
        let (pose, other) = (self.pose(other), &self.bodies[other].spec.shape);
        let bottom_m = pose.translation.z - other.half_height_at(&pose);
        let half_m = 0.5 * self.bodies[idx].spec.shape.size_m().z;
        let z = bottom_m + half_m + SET_DOWN_GAP_M;
        let (_, _, yaw_rad) = pose.rotation.euler_angles();
        upright([pose.translation.x, pose.translation.y], z, yaw_rad)
    }

    /// Whether bodies at new poses are clear of all others.
    pub(super) fn check_room(&self, moved: &[(usize, Isometry3<f64>)]) -> Result<(), FaultError> {
        let is_other =
            |idx: &usize| !self.bodies[*idx].is_out && moved.iter().all(|(own, _)| own != idx);
        for (idx, pose) in moved {
            let body = &self.bodies[*idx].spec;
            for other in (0..self.bodies.len()).filter(is_other) {
                let (met, at) = (&self.bodies[other].spec, self.pose(other));
                if bodies::overlap_m((body, pose), (met, &at)) > OVERLAP_MAX_M {
                    let reason = format!("{} is in the way", self.name(other));
                    return Err(FaultError::NoRoom { object: self.name(*idx).to_owned(), reason });
                }
            }
        }
        Ok(())
    }

    fn take_out(&mut self, idx: usize) {
        if self.view(idx).held {
            self.release();
        }
        self.put(idx, &Isometry3::translation(OUT_M + idx as f64, OUT_M, 1.0));
        self.set_out(idx, true);
    }

    fn bring_in(&mut self, idx: usize, at_m: [f64; 2]) {
        self.set_out(idx, false);
        self.set_down(idx, at_m);
    }

    pub(super) fn obstacles(&self, without: &[usize]) -> Vec<Obstacle> {
        let bodies = (0..self.bodies.len())
            .filter(|idx| !without.contains(idx) && !self.bodies[*idx].is_out);
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

    pub(super) fn footprint(&self, idx: usize) -> Footprint {
        let shape = &self.bodies[idx].spec.shape;
        Footprint { radius_m: shape.footprint_radius_m(), height_m: shape.size_m().z }
    }

    fn free_place(&mut self, idx: usize, near_m: Option<[f64; 2]>) -> Result<[f64; 2], FaultError> {
        // The object's own place is not free: it would not seem to have moved.
        let held = self.view(idx).held;
        let obstacles = if held { self.obstacles(&[idx]) } else { self.obstacles(&[]) };
        let object = self.footprint(idx);
        let places = Places {
            area_m: self.config.free_area_m,
            obstacles: &obstacles,
            object,
            clearance_m: CLEARANCE_M,
        };
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
        self.put(idx, &upright(at_m, 0.5 * height_m + SET_DOWN_GAP_M, yaw_rad));
    }
}

fn upright(at_m: [f64; 2], z_m: f64, yaw_rad: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad);
    Isometry3::from_parts(Translation3::new(at_m[0], at_m[1], z_m), turn)
}

/// A place for people.
pub(super) fn text(at_m: [f64; 2]) -> String {
    format!("({:.2}, {:.2}) m", at_m[0], at_m[1])
}
