//! Faults that push: they take a while, and go on as the world does.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::FaultError;
use crate::places::{CLEARANCE_M, Obstacle, Places};
use crate::push::{Push, Shift};
use crate::shape::Shape;
use crate::world::World;

/// How much harder the top of a tower is pushed than its second block.
const TOPPLE_GROWTH: f64 = 1.4;
/// How far apart a shift is looked at for what is in its way, in metres.
const SHIFT_CHECK_M: f64 = 0.01;

impl World {
    /// Carries on what faults have begun, by one step.
    pub(crate) fn carry_on(&mut self) {
        self.push_on();
        self.shift_on();
        self.give_back();
    }

    /// Repeats pushes that are due.
    fn push_on(&mut self) {
        let mut pushes = std::mem::take(&mut self.under_way.pushes);
        for push in pushes.iter_mut().filter_map(|push| push.step().then_some(push)) {
            if push.renew(&|idx| self.support(idx).on) {
                self.kick_group(push);
            }
        }
        pushes.retain(|push| !push.is_done());
        self.under_way.pushes = pushes;
    }

    /// Moves what is being shifted, at rest in itself: nothing slides or falls off.
    fn shift_on(&mut self) {
        let mut shifts = std::mem::take(&mut self.under_way.shifts);
        for shift in &mut shifts {
            let way = Translation3::from(shift.next());
            for &idx in &shift.group {
                let view = self.view(idx);
                if !view.held && !view.is_out {
                    self.put(idx, &(way * view.world_from_body));
                }
            }
        }
        shifts.retain(|shift| !shift.is_done());
        self.under_way.shifts = shifts;
    }

    /// Gives a push to all its bodies.
    fn kick_group(&mut self, push: &Push) {
        for (idx, change_m_s) in push.changes_m_s() {
            self.kick(idx, &change_m_s);
        }
    }

    pub(super) fn knock_over(&mut self, object: &str) -> Result<String, FaultError> {
        let idx = self.present(object)?;
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
        let mut off = Some(from);
        let pushed = group.iter().map(|&idx| (idx, off.take(), 1.0)).collect();
        let push = Push::new(pushed, direction, size_m);
        self.kick_group(&push);
        let names: Vec<&str> = push.bodies().map(|idx| self.name(idx)).collect();
        let what = format!("knocked {} off {}", names.join(" and "), self.name(from));
        self.under_way.pushes.push(push);
        Ok(what)
    }

    pub(super) fn topple(&mut self, object: &str) -> Result<String, FaultError> {
        let named = self.present(object)?;
        let object = object.to_owned();
        if self.view(named).held {
            return Err(FaultError::Held { object });
        }
        let mut base = named;
        while let Some(below) = self.support(base).on.filter(|&idx| self.is_movable(idx)) {
            base = below;
        }
        if self.support(named).peg.is_some() {
            return Err(FaultError::AroundPeg { object });
        }
        let tower = self.with_all_above(base);
        let upper = tower.get(1..).unwrap_or_default();
        if upper.is_empty() {
            return Err(FaultError::NotStacked { object });
        }
        let direction = self.roomiest_direction(base, &tower);
        let n_levels = upper.len().max(2) - 1;
        let harder = (TOPPLE_GROWTH - 1.0) / n_levels as f64;
        let pushed = upper.iter().enumerate().filter_map(|(level, &idx)| {
            let from = self.support(idx).on?;
            Some((idx, Some(from), 1.0 + harder * level as f64))
        });
        let size_m = self.bodies[base].spec.shape.size_m().x;
        let push = Push::new(pushed.collect(), direction, size_m);
        self.kick_group(&push);
        let what = format!("toppled the tower of {} blocks on {}", tower.len(), self.name(base));
        self.under_way.pushes.push(push);
        Ok(what)
    }

    pub(super) fn shift(&mut self, object: &str, by_m: [f64; 2]) -> Result<String, FaultError> {
        let group = self.shifted_with(object)?;
        let by = Vector3::new(by_m[0], by_m[1], 0.0);
        let [low, high] = self.config.free_area_m;
        let is_inside = |at: &Vector3<f64>| (0..2).all(|k| at[k] >= low[k] && at[k] <= high[k]);
        let reached = |idx: &&usize| !matches!(self.bodies[**idx].spec.shape, Shape::Board { .. });
        for &idx in group.iter().filter(reached) {
            if !is_inside(&(self.pose(idx).translation.vector + by)) {
                let reason = "it would leave sim.world.free_area_m".to_owned();
                return Err(FaultError::NoRoom { object: self.name(idx).to_owned(), reason });
            }
        }
        let n_checks = (by.norm() / SHIFT_CHECK_M).ceil();
        for k in 1..=n_checks as usize {
            let way = Translation3::from(by * (k as f64 / n_checks));
            let moved: Vec<(usize, Isometry3<f64>)> =
                group.iter().map(|&idx| (idx, way * self.pose(idx))).collect();
            self.check_room(&moved)?;
        }
        let names: Vec<&str> = group.iter().map(|&idx| self.name(idx)).collect();
        let [x, y] = by_m;
        let what = format!("pushed {} by ({x:.2}, {y:.2}) m", names.join(", "));
        self.under_way.shifts.push(Shift::new(group, by));
        Ok(what)
    }

    /// What moves when an object on the table is shifted: it, and all that is on it. A peg moves with
    /// the board below it.
    fn shifted_with(&self, object: &str) -> Result<Vec<usize>, FaultError> {
        let unknown = || FaultError::UnknownObject { object: object.to_owned() };
        let named = self.index_of(object).ok_or_else(unknown)?;
        if self.bodies[named].is_out {
            return Err(FaultError::Out { object: object.to_owned() });
        }
        let object = object.to_owned();
        if self.view(named).held {
            return Err(FaultError::Held { object });
        }
        if let Some(below) = self.support(named).on {
            return Err(FaultError::NotAtBottom { object, below: self.name(below).to_owned() });
        }
        let base = (0..self.bodies.len()).find(|&idx| self.is_peg_on(named, idx)).unwrap_or(named);
        let pegs = (0..self.bodies.len()).filter(|&idx| self.is_peg_on(idx, base));
        let mut group = self.with_all_above(base);
        for peg in pegs {
            let above = self.with_all_above(peg);
            group.extend(above.into_iter().filter(|idx| !group.contains(idx)).collect::<Vec<_>>());
        }
        Ok(group)
    }

    /// Whether a body is a peg and another one the board that it stands on.
    fn is_peg_on(&self, peg: usize, board: usize) -> bool {
        let (Shape::Peg { .. }, Shape::Board { size_m }) =
            (&self.bodies[peg].spec.shape, &self.bodies[board].spec.shape)
        else {
            return false;
        };
        let offset = self.pose(peg).translation.vector - self.pose(board).translation.vector;
        offset.x.abs() < 0.5 * size_m[0] && offset.y.abs() < 0.5 * size_m[1]
    }

    fn is_movable(&self, idx: usize) -> bool {
        !self.bodies[idx].spec.is_fixed()
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
        let places = Places {
            area_m: self.config.free_area_m,
            obstacles: &others,
            object,
            clearance_m: CLEARANCE_M,
        };
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
