//! From an arrangement to the starting pose of every body.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::random::Random;
use crate::scene::{Arrangement, BodySpec, FixedStack, FixedTower, SceneError, SceneSpec};
use crate::shape::Shape;

/// Gap left between bodies that are put on each other, so that nothing starts in contact.
const GAP_M: f64 = 0.0001;

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
                if matches!(body.shape, Shape::Peg { .. }) { self.board_top(x, y) } else { 0.0 };
            let z = below + 0.5 * body.shape.size_m().z;
            self.poses[idx].push(Isometry3::translation(x, y, z));
        }
    }

    /// Height of the board below a point, 0 where there is none.
    fn board_top(&self, x: f64, y: f64) -> f64 {
        let top_below = |body: &BodySpec| match (body.shape, body.at_m) {
            (Shape::Board { size_m: [sx, sy, height] }, Some([bx, by]))
                if (x - bx).abs() < 0.5 * sx && (y - by).abs() < 0.5 * sy =>
            {
                height
            }
            _ => 0.0,
        };
        self.spec.bodies.iter().map(top_below).fold(0.0, f64::max)
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
        let mut blocks = self.all(|shape| matches!(shape, Shape::Block { .. }));
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
        for ([x, y], stack) in slots.into_iter().zip(stacks) {
            let y = y + self.random.between(-1.0, 1.0) * y_jitter_m;
            self.stack([x, y], 0.0, &stack, &jitter);
        }
        Ok(())
    }

    fn random_towers(&mut self) -> Result<(), SceneError> {
        let pegs: Vec<String> = self
            .all(|shape| matches!(shape, Shape::Peg { .. }))
            .into_iter()
            .map(|idx| self.spec.bodies[idx].name.clone())
            .collect();
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
            let bodies = self.named("stacks.bodies", "block or disk", &stack.bodies, |shape| {
                !shape.is_fixed()
            })?;
            self.stack(stack.at_m, stack.yaw_deg.to_radians(), &bodies, &still);
        }
        for tower in towers {
            let disks = self.named("towers.disks", "disk", &tower.disks, |shape| {
                matches!(shape, Shape::Disk { .. })
            })?;
            self.tower("towers.peg", &tower.peg, &disks)?;
        }
        Ok(())
    }

    /// Puts bodies on each other, the first on the table or on a board.
    fn stack(&mut self, at_m: [f64; 2], yaw_rad: f64, bodies: &[usize], jitter: &Jitter) {
        let mut top = self.board_top(at_m[0], at_m[1]);
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
        let is_peg = |shape: &Shape| matches!(shape, Shape::Peg { .. });
        let peg = self.named(field, "peg", &[peg.to_owned()], is_peg)?;
        let at_m = peg.first().and_then(|&idx| self.spec.bodies[idx].at_m).unwrap_or_default();
        self.stack(at_m, 0.0, disks, &Jitter { xy_m: 0.001, yaw_rad: PI });
        Ok(())
    }

    fn all(&self, wanted: impl Fn(&Shape) -> bool) -> Vec<usize> {
        (0..self.spec.bodies.len()).filter(|&idx| wanted(&self.spec.bodies[idx].shape)).collect()
    }

    fn disks_largest_first(&self) -> Vec<usize> {
        let mut disks = self.all(|shape| matches!(shape, Shape::Disk { .. }));
        let width = |idx: &usize| self.spec.bodies[*idx].shape.size_m().x;
        disks.sort_by(|a, b| width(b).total_cmp(&width(a)));
        disks
    }

    fn named(
        &self,
        field: &'static str,
        expected: &'static str,
        names: &[String],
        wanted: impl Fn(&Shape) -> bool,
    ) -> Result<Vec<usize>, SceneError> {
        let find = |name: &String| {
            self.spec
                .index_of(name)
                .filter(|&idx| wanted(&self.spec.bodies[idx].shape))
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
