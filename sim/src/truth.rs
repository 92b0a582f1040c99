//! Ground truth for scoring and for labelling examples: which body rests on which.
//!
//! The executive side must never see it.

use nalgebra::{Isometry3, Point3, Vector3};
use serde::Serialize;

use crate::body_spec::BodySpec;
use crate::shape::{self, Shape};
use crate::solid::{Form, Solid};
use crate::world::World;

/// Tolerance of heights and offsets, in metres (`ManiSkill` `StackCube`: 5 mm).
const TOLERANCE_M: f64 = 0.005;

/// The true state of every body, in the order of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// Every body that is in the world.
    pub bodies: Vec<BodyTruth>,
}

/// The true state of one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub struct BodyTruth {
    /// Name in the scene.
    pub name: String,
    /// The shape's kind: `block`, `disk`, `peg`, `board`, `box`, `cylinder`, `tube` or `compound`.
    pub kind: &'static str,
    /// Its type in the domain, as [`BodySpec::type_name`] says.
    pub type_name: String,
    /// Centre: metres, world frame.
    pub position: Point3<f64>,
    /// Turn about z, in radians.
    pub yaw_rad: f64,
    /// Extents in the body's own frame, in metres.
    pub size_m: Vector3<f64>,
    /// The body directly below that carries it. For the lowest disk on a peg it is the peg.
    pub on: Option<String>,
    /// Whether several bodies that can be moved carry it at once, of which `on` is one.
    pub bridges: bool,
    /// Whether it rests on the table itself.
    pub on_table: bool,
    /// The peg through its hole, also while it is held there.
    pub peg: Option<String>,
    /// Whether the gripper holds it.
    pub held: bool,
    /// Whether a face points up: false for a tilted block and a disk that lies aslant.
    pub upright: bool,
    /// Whether it is at rest.
    pub still: bool,
    /// Whether nothing rests on it.
    pub clear: bool,
}

impl Truth {
    /// The truth about the body called `name`.
    pub fn body(&self, name: &str) -> Option<&BodyTruth> {
        self.bodies.iter().find(|body| body.name == name)
    }
}

impl World {
    /// Which body rests on which, by geometry.
    pub fn truth(&self) -> Truth {
        let supports: Vec<Support> = (0..self.bodies.len()).map(|idx| self.support(idx)).collect();
        let name = |idx: usize| self.bodies[idx].spec.name.clone();
        let describe = |(idx, support): (usize, &Support)| {
            let view = self.view(idx);
            let (_, _, yaw_rad) = view.world_from_body.rotation.euler_angles();
            BodyTruth {
                name: name(idx),
                kind: view.spec.shape.kind(),
                type_name: view.spec.type_name().to_owned(),
                position: view.world_from_body.translation.vector.into(),
                yaw_rad,
                size_m: view.spec.shape.size_m(),
                on: support.on.map(name),
                bridges: support.bridges,
                on_table: support.on_table,
                peg: support.peg.map(name),
                held: view.held,
                upright: shape::is_upright(&view.spec.shape, &view.world_from_body),
                still: view.still,
                clear: supports.iter().all(|other| other.on != Some(idx)),
            }
        };
        let there = supports.iter().enumerate().filter(|(idx, _)| !self.bodies[*idx].is_out);
        Truth { bodies: there.map(describe).collect() }
    }

    /// Names of bodies that differ in nothing but name and place, in groups of two and more. What is
    /// fixed is told by its place.
    pub fn look_alikes(&self) -> Vec<Vec<String>> {
        let mut groups: Vec<Vec<&BodySpec>> = Vec::new();
        for spec in self.bodies.iter().map(|body| &body.spec) {
            if spec.is_fixed() {
                continue;
            }
            let is_alike =
                |other: &BodySpec| (&other.shape, other.colour) == (&spec.shape, spec.colour);
            match groups.iter_mut().find(|group| group.first().is_some_and(|s| is_alike(s))) {
                Some(group) => group.push(spec),
                None => groups.push(vec![spec]),
            }
        }
        let several = groups.into_iter().filter(|group| group.len() > 1);
        several.map(|group| group.iter().map(|spec| spec.name.clone()).collect()).collect()
    }

    /// What carries a body. The held body and what is fixed are carried by nothing.
    pub(crate) fn support(&self, idx: usize) -> Support {
        let view = self.view(idx);
        let (shape, pose) = (&view.spec.shape, &view.world_from_body);
        if view.spec.is_fixed() || view.is_out {
            return Support::default();
        }
        let peg = (0..self.bodies.len()).find(|&other| self.is_around(shape, pose, other));
        if view.held {
            return Support { peg, ..Support::default() };
        }
        let bottom = pose.translation.z - shape.half_height_at(pose);
        let carriers = (0..self.bodies.len())
            .filter(|&other| other != idx && self.carries(other, shape, pose, bottom));
        let movable = carriers.clone().filter(|&other| !self.bodies[other].spec.is_fixed());
        let bridges = movable.count() > 1;
        let below = carriers
            .max_by(|&a, &b| self.pose(a).translation.z.total_cmp(&self.pose(b).translation.z));
        // What pegs stand on carries the lowest disk no more than the table does.
        let is_base = |other: usize| self.bodies[other].spec.is_fixed();
        let on = match (below, peg) {
            (Some(other), Some(peg)) if is_base(other) => Some(peg),
            (None, Some(peg)) if bottom < TOLERANCE_M => Some(peg),
            (other, _) => other,
        };
        Support { on, bridges, on_table: on.is_none() && bottom < TOLERANCE_M, peg }
    }

    /// Whether a disk or a tube at `pose` has the peg `other` through its hole.
    fn is_around(&self, shape: &Shape, pose: &Isometry3<f64>, other: usize) -> bool {
        let (Some(ring), Shape::Peg { radius_m, height_m }) =
            (shape.ring(), &self.bodies[other].spec.shape)
        else {
            return false;
        };
        let offset = pose.translation.vector - self.pose(other).translation.vector;
        offset.xy().norm() < ring.hole_m - radius_m + 0.002 && offset.z < 0.5 * height_m
    }

    /// Whether the bottom of a body at `pose` is at an upper face of the body `other`, and above it.
    fn carries(&self, other: usize, shape: &Shape, pose: &Isometry3<f64>, bottom: f64) -> bool {
        let below = self.view(other);
        if below.held || matches!(below.spec.shape, Shape::Peg { .. }) {
            return false;
        }
        let below_pose = &below.world_from_body;
        let is_at = |top: f64| (bottom - top).abs() <= TOLERANCE_M;
        let top = below_pose.translation.z + below.spec.shape.half_height_at(below_pose);
        let offset = (pose.translation.vector - below_pose.translation.vector).xy();
        match &below.spec.shape {
            Shape::Board { size_m } => {
                is_at(top) && offset.x.abs() < 0.5 * size_m[0] && offset.y.abs() < 0.5 * size_m[1]
            }
            Shape::Disk { .. } | Shape::Tube { .. } => {
                let radius = 0.5 * below.spec.shape.size_m().x;
                is_at(top) && offset.norm() < radius + 0.5 * shape.size_m().x
            }
            Shape::Block { size_m } => {
                let reach = 0.5 * size_m * std::f64::consts::SQRT_2 + TOLERANCE_M;
                is_at(top) && offset.norm() <= reach
            }
            Shape::Box { .. } | Shape::Cylinder { .. } | Shape::Compound { .. } => {
                let middle = below_pose.inverse_transform_point(&pose.translation.vector.into());
                let solids = below.spec.shape.solids();
                solids.iter().any(|solid| {
                    let face = UpperFace::of(solid, below_pose);
                    is_at(face.top_m) && face.is_below(&middle)
                })
            }
            Shape::Peg { .. } => false,
        }
    }
}

/// The upper face of a solid that stands on any of its faces.
struct UpperFace<'a> {
    solid: &'a Solid,
    /// Its height, metres.
    top_m: f64,
    /// The axis of the body that is most upright.
    up_axis: usize,
}

impl<'a> UpperFace<'a> {
    fn of(solid: &'a Solid, world_from_body: &Isometry3<f64>) -> Self {
        let up = world_from_body.rotation.inverse_transform_vector(&Vector3::z());
        let middle = world_from_body.transform_point(&solid.middle.into());
        Self { solid, top_m: middle.z + solid.half_extent_along(&up), up_axis: up.iamax() }
    }

    /// Whether a point of the body's frame is above or below the face.
    fn is_below(&self, point: &Point3<f64>) -> bool {
        let Solid { form, middle, half } = self.solid;
        if *form == Form::Cylinder && self.up_axis == 2 {
            return self.solid.distance_xy([point.x, point.y]) <= TOLERANCE_M;
        }
        let mut across = (0..3).filter(|axis| *axis != self.up_axis);
        let is_within = |k: usize| (point[k] - middle[k]).abs() <= half[k] + TOLERANCE_M;
        across.all(is_within)
    }
}

/// What carries a body, by index.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Support {
    pub(crate) on: Option<usize>,
    /// Several movable bodies carry it.
    pub(crate) bridges: bool,
    pub(crate) on_table: bool,
    pub(crate) peg: Option<usize>,
}
