//! From shapes to rapier's colliders.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{Isometry3, Point3};
use rapier3d::parry::query;
use rapier3d::prelude::{
    ColliderBuilder, Group, InteractionGroups, InteractionTestMode, Pose, SharedShape, Vector,
};

use crate::body_spec::BodySpec;
use crate::config::WorldConfig;
use crate::convert;
use crate::material::Material;
use crate::scene::SceneSpec;
use crate::scene_error::SceneError;
use crate::shape::Shape;
use crate::solid::{Form, Solid};

/// Half the side of the square table top, in metres: larger than anything can roll.
const TABLE_HALF_M: f32 = 2.0;
/// Corners of the polygon that stands for a peg's girth.
const PEG_CORNERS: usize = 16;
/// Height of a peg's tapered tip and the share of the radius that is left at its top.
const TIP_M: f64 = 0.012;
const TIP_SHARE: f64 = 0.3;

/// Deepest overlap a starting arrangement may have, in metres.
const OVERLAP_MAX_M: f64 = 0.0003;

/// What a part meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// The table, boards and other solids that are fixed: meet solids and rings.
    Ground,
    /// Blocks and other solids that move: meet everything but rings.
    Solid,
    /// The filled outline of a disk or a tube: meets solids and plates.
    Plate,
    /// A disk or a tube with its hole: meets the ground and pegs.
    Ring,
    /// A peg: meets solids and rings.
    Peg,
    /// A finger: meets what it can grasp.
    Finger,
}

impl Role {
    fn groups(self) -> InteractionGroups {
        let (ground, solids, plates) = (Group::GROUP_1, Group::GROUP_2, Group::GROUP_3);
        let (rings, pegs, fingers) = (Group::GROUP_4, Group::GROUP_5, Group::GROUP_6);
        let (member, meets) = match self {
            Self::Ground => (ground, solids | rings),
            Self::Solid => (solids, ground | solids | plates | pegs | fingers),
            Self::Plate => (plates, solids | plates | fingers),
            Self::Ring => (rings, ground | pegs),
            Self::Peg => (pegs, solids | rings),
            Self::Finger => (fingers, solids | plates),
        };
        InteractionGroups::new(member, meets, InteractionTestMode::And)
    }
}

/// The collision parts of a body, in the body's frame.
///
/// A disk has two: the cylinder that it stacks with, and a ring of twelve convex wedges that lies
/// on the table and goes around pegs. Stacked on each other, the wedges of two turned disks would
/// overlap in slivers that are thinner than deep, which pushes the disks sideways and tilts them;
/// and a disk that falls on a round rim would roll off the table. A tube is a higher disk. A peg is
/// a prism with a tapered tip, which leads a disk that comes down off its axis. A hull that cannot
/// be built is left out, which checked sizes rule out.
fn parts(body: &BodySpec) -> Vec<(Role, SharedShape)> {
    let half = body.shape.size_m() * 0.5;
    let role = if body.is_fixed() { Role::Ground } else { Role::Solid };
    match &body.shape {
        Shape::Block { .. } | Shape::Board { .. } | Shape::Box { .. } => {
            vec![(role, SharedShape::cuboid(half.x as f32, half.y as f32, half.z as f32))]
        }
        Shape::Disk { .. } | Shape::Tube { .. } => {
            let wedges = body.shape.wedges().into_iter().filter_map(|wedge| hull(&wedge));
            let ring = SharedShape::compound(wedges.map(|part| (Pose::identity(), part)).collect());
            let plate = SharedShape::cylinder(half.z as f32, half.x as f32);
            vec![(Role::Plate, plate), (Role::Ring, ring)]
        }
        Shape::Peg { .. } => {
            let shoulder = (half.z - TIP_M).max(0.0);
            let girth = [(-half.z, half.x), (shoulder, half.x), (half.z, TIP_SHARE * half.x)];
            let peg = hull(&rings(&girth));
            peg.map(|peg| (Role::Peg, peg)).into_iter().collect()
        }
        Shape::Cylinder { .. } | Shape::Compound { .. } => {
            let solids = body.shape.solids();
            vec![(role, SharedShape::compound(solids.iter().map(solid_part).collect()))]
        }
    }
}

/// A part of a compound with its place in the body: rapier's cylinders stand along y.
fn solid_part(solid: &Solid) -> (Pose, SharedShape) {
    let half = solid.half;
    let at = Vector::new(solid.middle.x as f32, solid.middle.y as f32, solid.middle.z as f32);
    match solid.form {
        Form::Box => {
            let cuboid = SharedShape::cuboid(half.x as f32, half.y as f32, half.z as f32);
            (Pose::from_translation(at), cuboid)
        }
        Form::Cylinder => {
            let turn = frame(Role::Plate).rotation;
            (Pose::from_parts(at, turn), SharedShape::cylinder(half.z as f32, half.x as f32))
        }
    }
}

/// Body from part: rapier's cylinders stand along y.
fn frame(role: Role) -> Pose {
    match role {
        Role::Plate => Pose::rotation(Vector::new(FRAC_PI_2 as f32, 0.0, 0.0)),
        Role::Ground | Role::Solid | Role::Ring | Role::Peg | Role::Finger => Pose::identity(),
    }
}

fn hull(corners: &[Point3<f64>]) -> Option<SharedShape> {
    let corners: Vec<Vector> = corners.iter().map(convert::point).collect();
    SharedShape::convex_hull(&corners)
}

/// Regular polygons around z, each at a height with a radius.
fn rings(heights_and_radii: &[(f64, f64)]) -> Vec<Point3<f64>> {
    let corner = |z: f64, radius: f64, k: usize| {
        let (sin, cos) = (TAU * k as f64 / PEG_CORNERS as f64).sin_cos();
        Point3::new(radius * cos, radius * sin, z)
    };
    let ring = |&(z, radius): &(f64, f64)| (0..PEG_CORNERS).map(move |k| corner(z, radius, k));
    heights_and_radii.iter().flat_map(ring).collect()
}

/// The colliders of a body; without a material of its own it is made of what the world says for its
/// shape.
pub(crate) fn colliders(
    body: &BodySpec,
    material: Option<&Material>,
    config: &WorldConfig,
) -> Vec<ColliderBuilder> {
    let usual_friction = match body.shape {
        Shape::Disk { .. } | Shape::Tube { .. } => config.disk_friction,
        Shape::Peg { .. } => config.peg_friction,
        Shape::Board { .. } => config.table_friction,
        Shape::Block { .. }
        | Shape::Box { .. }
        | Shape::Cylinder { .. }
        | Shape::Compound { .. } => config.block_friction,
    };
    let friction = material.map_or(usual_friction, |material| material.friction);
    let density_kg_m3 = material.map_or(config.density_kg_m3, |material| material.density_kg_m3);
    let collider = |(role, part): (Role, SharedShape)| {
        // A disk's mass is its ring's: the plate fills the hole.
        let density = if role == Role::Plate { 0.0 } else { density_kg_m3 };
        ColliderBuilder::new(part)
            .density(density as f32)
            .friction(friction as f32)
            .restitution(0.0)
            .collision_groups(role.groups())
            .position(frame(role))
    };
    parts(body).into_iter().map(collider).collect()
}

/// What a finger meets.
pub(crate) fn finger_groups() -> InteractionGroups {
    Role::Finger.groups()
}

/// The table: a slab with its top at z = 0.
pub(crate) fn table(config: &WorldConfig) -> ColliderBuilder {
    ColliderBuilder::cuboid(TABLE_HALF_M, TABLE_HALF_M, 0.1)
        .translation(Vector::new(0.0, 0.0, -0.1))
        .friction(config.table_friction as f32)
        .restitution(0.0)
        .collision_groups(Role::Ground.groups())
}

/// How deep two bodies are inside each other, in metres; 0 when they are apart.
pub(crate) fn overlap_m(
    first: (&BodySpec, &Isometry3<f64>),
    second: (&BodySpec, &Isometry3<f64>),
) -> f64 {
    let (pose_1, pose_2) = (convert::pose(first.1), convert::pose(second.1));
    let mut deepest = 0.0_f64;
    for (role_1, part_1) in parts(first.0) {
        for (role_2, part_2) in parts(second.0) {
            if !role_1.groups().test(role_2.groups()) {
                continue;
            }
            let (at_1, at_2) = (pose_1 * frame(role_1), pose_2 * frame(role_2));
            let contact = query::contact(&at_1, &*part_1, &at_2, &*part_2, 0.0);
            if let Ok(Some(contact)) = contact {
                deepest = deepest.max(f64::from(-contact.dist));
            }
        }
    }
    deepest
}

/// Refuses a start with bodies inside each other. Fixed bodies may share space with a board.
pub(crate) fn check_overlaps(spec: &SceneSpec, poses: &[Isometry3<f64>]) -> Result<(), SceneError> {
    let is_board = |idx: usize| spec.bodies[idx].shape.kind() == "board";
    for second in 0..poses.len() {
        for first in 0..second {
            let (a, b) = (&spec.bodies[first], &spec.bodies[second]);
            let both_fixed = a.is_fixed() && b.is_fixed();
            if both_fixed && (is_board(first) || is_board(second)) {
                continue;
            }
            let depth_m = overlap_m((a, &poses[first]), (b, &poses[second]));
            if depth_m > OVERLAP_MAX_M {
                return Err(SceneError::Overlap {
                    first: a.name.clone(),
                    second: b.name.clone(),
                    depth_mm: depth_m * 1000.0,
                });
            }
        }
    }
    Ok(())
}
