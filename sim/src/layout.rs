//! From an arrangement to the starting pose of every body.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::body_spec::BodySpec;
use crate::places::{Footprint, Obstacle, Places};
use crate::random::Random;
use crate::scene::{Arrangement, FixedStack, FixedTower, SceneSpec};
use crate::scene_error::SceneError;
use crate::shape::Shape;
use crate::solid::Solid;

/// Gap left between bodies that are put on each other, so that nothing starts in contact.
const GAP_M: f64 = 0.0001;

/// How many places are tried for a body that is scattered.
const SCATTER_TRIES: usize = 600;

/// Sideways and turning jitter of one placed body.
struct Jitter {
    xy_m: f64,
    yaw_rad: f64,
}

/// The starting pose (world from body) of every body of `spec`, in the order of `spec.bodies`.
///
/// # Errors
/// What [`SceneSpec::check`] reports, unknown names, and bodies placed never or twice.
pub(crate) fn place(spec: &SceneSpec, seed: u64) -> Result<Vec<Isometry3<f64>>, SceneError> {
    spec.check()?;
    let mut layout =
        Layout { spec, random: Random::new(seed, 0), poses: vec![Vec::new(); spec.bodies.len()] };
    layout.place_fixed_bodies();
    match &spec.arrangement {
        Arrangement::RandomStacks { .. } => layout.random_stacks(&spec.arrangement)?,
        Arrangement::Tower { peg } => {
            let disks = layout.disks_largest_first();
            layout.tower("peg", peg, &disks)?;
        }
        Arrangement::RandomTowers {} => layout.random_towers()?,
        Arrangement::Scattered { areas_m, clearance_m, yaw_jitter_deg } => {
            layout.scatter(areas_m, *clearance_m, yaw_jitter_deg.to_radians())?;
        }
        Arrangement::Fixed { stacks, towers } => layout.explicit(stacks, towers)?,
    }
    layout.finish()
}

/// Poses as they are being collected: one list a body, so that double placement is seen.
struct Layout<'a> {
    spec: &'a SceneSpec,
    random: Random,
    poses: Vec<Vec<Isometry3<f64>>>,
}

impl Layout<'_> {
    fn place_fixed_bodies(&mut self) {
        for (idx, body) in self.spec.bodies.iter().enumerate() {
            let Some([x, y]) = body.at_m else { continue };
            let below =
                if matches!(body.shape, Shape::Board { .. }) { 0.0 } else { self.board_top(x, y) };
            let z = below + 0.5 * body.shape.size_m().z;
            self.poses[idx].push(Isometry3::translation(x, y, z));
        }
    }

    /// Height of the board below a point, 0 where there is none.
    fn board_top(&self, x: f64, y: f64) -> f64 {
        let top_below = |body: &BodySpec| match (&body.shape, body.at_m) {
            (Shape::Board { size_m: [sx, sy, height] }, Some([bx, by]))
                if (x - bx).abs() < 0.5 * sx && (y - by).abs() < 0.5 * sy =>
            {
                *height
            }
            _ => 0.0,
        };
        self.spec.bodies.iter().map(top_below).fold(0.0, f64::max)
    }

    /// What is fixed, solid by solid: where it is, seen from above, and the height of its top. Rods
    /// that disks go around are told apart: nothing stands on them.
    fn footings(&self) -> impl Iterator<Item = Footing> {
        let fixed = self.spec.bodies.iter().zip(&self.poses).filter(|(body, _)| body.is_fixed());
        fixed.flat_map(|(body, poses)| {
            let is_rod = matches!(body.shape, Shape::Peg { .. });
            let solids = body.shape.solids();
            let placed = poses.first().map(|pose| pose.translation.vector);
            placed.into_iter().flat_map(move |at| {
                let solids = solids.clone().into_iter();
                solids.map(move |solid| {
                    let top_m = at.z + solid.middle.z + solid.half.z;
                    Footing { solid: Solid { middle: solid.middle + at, ..solid }, top_m, is_rod }
                })
            })
        })
    }

    /// Height of what a stack stands on: the table, or the highest of what is fixed there.
    fn support_top(&self, at_m: [f64; 2]) -> f64 {
        let below = self.footings().filter(|f| !f.is_rod && f.solid.distance_xy(at_m) < 0.0);
        below.map(|footing| footing.top_m).fold(0.0, f64::max)
    }

    /// The same for a body with room around it; `None` where what is below is not level.
    fn level_top(&self, at_m: [f64; 2], reach_m: f64) -> Option<f64> {
        let is_below = |f: &Footing| !f.is_rod && f.solid.distance_xy(at_m) <= -reach_m;
        let top_m = self.footings().filter(is_below).map(|f| f.top_m).fold(0.0, f64::max);
        let mut higher = self.footings().filter(|footing| footing.top_m > top_m);
        (!higher.any(|footing| footing.solid.distance_xy(at_m) < reach_m)).then_some(top_m)
    }

    /// Places every body that can move at random, the widest first; where it hides nothing and is not
    /// hidden, if there is such a place.
    fn scatter(
        &mut self,
        areas_m: &[[[f64; 2]; 2]],
        clearance_m: f64,
        yaw_rad: f64,
    ) -> Result<(), SceneError> {
        let mut bodies = self.movable();
        self.random.shuffle(&mut bodies);
        self.widest_first(&mut bodies);
        let everywhere = [[f64::MIN; 2], [f64::MAX; 2]];
        let mut obstacles: Vec<Obstacle> = Vec::new();
        for idx in bodies {
            let shape = &self.spec.bodies[idx].shape;
            let object =
                Footprint { radius_m: shape.footprint_radius_m(), height_m: shape.size_m().z };
            let mut draw = |_| {
                let [low, high] = areas_m[self.random.below(areas_m.len())];
                [0, 1].map(|axis| self.random.between(low[axis], high[axis]))
            };
            let drawn: Vec<[f64; 2]> = (0..SCATTER_TRIES).map(&mut draw).collect();
            let reach_m = object.radius_m + clearance_m;
            let level = drawn.into_iter().filter(|at_m| self.level_top(*at_m, reach_m).is_some());
            let level: Vec<[f64; 2]> = level.collect();
            let places = Places { area_m: everywhere, obstacles: &obstacles, object, clearance_m };
            let no_place = || SceneError::NoFreeArea { name: self.spec.bodies[idx].name.clone() };
            let at_m = places.first_of(&level).ok_or_else(no_place)?;
            self.stack(at_m, 0.0, &[idx], &Jitter { xy_m: 0.0, yaw_rad });
            obstacles.push(Obstacle::of(shape, at_m, self.support_top(at_m) + object.height_m));
        }
        Ok(())
    }

    fn random_stacks(&mut self, arrangement: &Arrangement) -> Result<(), SceneError> {
        let Arrangement::RandomStacks {
            slots_x_m,
            rows_y_m,
            y_m,
            y_jitter_m,
            stack_height_max,
            xy_jitter_m,
            yaw_jitter_deg,
        } = arrangement
        else {
            return Ok(());
        };
        let mut blocks = self.movable();
        let height_max = *stack_height_max;
        let rows = if rows_y_m.is_empty() { std::slice::from_ref(y_m) } else { rows_y_m };
        let slots = rows.iter().flat_map(|y| slots_x_m.iter().map(move |x| [*x, *y]));
        let slots: Vec<[f64; 2]> = slots.collect();
        if blocks.len() > slots.len().saturating_mul(height_max) {
            return Err(SceneError::TooFewSlots {
                n_blocks: blocks.len(),
                n_slots: slots.len(),
                height_max,
            });
        }
        self.random.shuffle(&mut blocks);
        let mut free: Vec<usize> = (0..slots.len()).collect();
        self.random.shuffle(&mut free);
        let mut stacks = vec![Vec::new(); slots.len()];
        for block in blocks {
            // One choice for each stack that is not full, and one for the table.
            let mut choices: Vec<usize> = (0..stacks.len())
                .filter(|&slot| (1..height_max).contains(&stacks[slot].len()))
                .collect();
            choices.extend(free.last());
            let slot = choices[self.random.below(choices.len())];
            free.retain(|&other| other != slot);
            stacks[slot].push(block);
        }
        let jitter = Jitter { xy_m: *xy_jitter_m, yaw_rad: yaw_jitter_deg.to_radians() };
        for ([x, y], mut stack) in slots.into_iter().zip(stacks) {
            let is_block =
                |idx: &usize| matches!(self.spec.bodies[*idx].shape, Shape::Block { .. });
            if !stack.iter().all(is_block) {
                self.widest_first(&mut stack);
            }
            let y = y + self.random.between(-1.0, 1.0) * y_jitter_m;
            self.stack([x, y], 0.0, &stack, &jitter);
        }
        Ok(())
    }

    fn random_towers(&mut self) -> Result<(), SceneError> {
        let pegs: Vec<String> =
            self.all(is_peg).into_iter().map(|idx| self.spec.bodies[idx].name.clone()).collect();
        if pegs.is_empty() {
            return Err(SceneError::NoPeg);
        }
        let mut towers = vec![Vec::new(); pegs.len()];
        for disk in self.disks_largest_first() {
            towers[self.random.below(pegs.len())].push(disk);
        }
        for (peg, disks) in pegs.iter().zip(towers) {
            self.tower("peg", peg, &disks)?;
        }
        Ok(())
    }

    fn explicit(&mut self, stacks: &[FixedStack], towers: &[FixedTower]) -> Result<(), SceneError> {
        let still = Jitter { xy_m: 0.0, yaw_rad: 0.0 };
        for stack in stacks {
            let bodies =
                self.named("stacks.bodies", "body that can move", &stack.bodies, |body| {
                    !body.is_fixed()
                })?;
            self.stack(stack.at_m, stack.yaw_deg.to_radians(), &bodies, &still);
        }
        for tower in towers {
            let disks = self.named("towers.disks", "disk or tube", &tower.disks, is_disk)?;
            self.tower("towers.peg", &tower.peg, &disks)?;
        }
        Ok(())
    }

    /// Puts bodies on each other, the first on the table or on what is fixed there.
    fn stack(&mut self, at_m: [f64; 2], yaw_rad: f64, bodies: &[usize], jitter: &Jitter) {
        let mut top = self.support_top(at_m);
        for &idx in bodies {
            let height = self.spec.bodies[idx].shape.size_m().z;
            let dx = self.random.between(-1.0, 1.0) * jitter.xy_m;
            let dy = self.random.between(-1.0, 1.0) * jitter.xy_m;
            let yaw = yaw_rad + self.random.between(-1.0, 1.0) * jitter.yaw_rad;
            let middle = Translation3::new(at_m[0] + dx, at_m[1] + dy, top + GAP_M + 0.5 * height);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
            self.poses[idx].push(Isometry3::from_parts(middle, turn));
            top += GAP_M + height;
        }
    }

    fn tower(&mut self, field: &'static str, peg: &str, disks: &[usize]) -> Result<(), SceneError> {
        let peg = self.named(field, "peg", &[peg.to_owned()], is_peg)?;
        let at_m = peg.first().and_then(|&idx| self.spec.bodies[idx].at_m).unwrap_or_default();
        self.stack(at_m, 0.0, disks, &Jitter { xy_m: 0.001, yaw_rad: PI });
        Ok(())
    }

    fn all(&self, wanted: impl Fn(&BodySpec) -> bool) -> Vec<usize> {
        (0..self.spec.bodies.len()).filter(|&idx| wanted(&self.spec.bodies[idx])).collect()
    }

    fn movable(&self) -> Vec<usize> {
        self.all(|body| !body.is_fixed())
    }

    fn disks_largest_first(&self) -> Vec<usize> {
        let mut disks = self.all(|body| is_disk(body) && !body.is_fixed());
        self.widest_first(&mut disks);
        disks
    }

    fn widest_first(&self, bodies: &mut [usize]) {
        let width = |idx: &usize| self.spec.bodies[*idx].shape.size_m().x;
        bodies.sort_by(|a, b| width(b).total_cmp(&width(a)));
    }

    fn named(
        &self,
        field: &'static str,
        expected: &'static str,
        names: &[String],
        wanted: impl Fn(&BodySpec) -> bool,
    ) -> Result<Vec<usize>, SceneError> {
        let find = |name: &String| {
            self.spec
                .index_of(name)
                .filter(|&idx| wanted(&self.spec.bodies[idx]))
                .ok_or_else(|| SceneError::UnknownBody { field, expected, name: name.clone() })
        };
        names.iter().map(find).collect()
    }

    fn finish(self) -> Result<Vec<Isometry3<f64>>, SceneError> {
        let once = |(poses, body): (Vec<Isometry3<f64>>, &BodySpec)| match poses.as_slice() {
            [pose] => Ok(*pose),
            _ => Err(SceneError::NotPlacedOnce { name: body.name.clone(), times: poses.len() }),
        };
        self.poses.into_iter().zip(&self.spec.bodies).map(once).collect()
    }
}

/// Something fixed that bodies may stand on.
struct Footing {
    /// In the world frame.
    solid: Solid,
    top_m: f64,
    is_rod: bool,
}

fn is_peg(body: &BodySpec) -> bool {
    matches!(body.shape, Shape::Peg { .. })
}

/// Whether a peg can go through it.
fn is_disk(body: &BodySpec) -> bool {
    matches!(body.shape, Shape::Disk { .. } | Shape::Tube { .. })
}
