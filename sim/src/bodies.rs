//! From shapes to rapier's colliders.

use nalgebra::Isometry3;
use rapier3d::parry::query;
use rapier3d::prelude::{ColliderBuilder, Pose, SharedShape, Vector};

use crate::config::WorldConfig;
use crate::convert;
use crate::shape::Shape;

/// Half the side of the square table top, in metres: larger than anything can roll.
const TABLE_HALF_M: f32 = 2.0;

/// The collision shape of a body, in the body's frame.
///
/// A peg is a prism with a tapered tip, which leads a disk that comes down off its axis. A disk is twelve convex wedges; a wedge whose hull cannot be built
/// is left out, which checked sizes rule out.
pub(crate) fn collision_shape(shape: &Shape) -> SharedShape {
    let half = shape.size_m() * 0.5;
    match shape {
        Shape::Block { .. } | Shape::Board { .. } => {
            SharedShape::cuboid(half.x as f32, half.y as f32, half.z as f32)
        }
        Shape::Peg { .. } => SharedShape::convex_hull(&peg_corners(shape))
            .unwrap_or_else(|| SharedShape::capsule_z(half.z as f32, half.x as f32)),
        Shape::Disk { .. } => {
            let hull = |corners: [nalgebra::Point3<f64>; 8]| {
                SharedShape::convex_hull(&corners.map(|corner| convert::point(&corner)))
            };
            let parts = shape.wedges().into_iter().filter_map(hull);
            SharedShape::compound(parts.map(|part| (Pose::identity(), part)).collect())
        }
    }
}

/// Corners of a peg's hull.
fn peg_corners(shape: &Shape) -> Vec<Vector> {
    let half = shape.size_m() * 0.5;
    let tip = 0.012_f64.min(half.z);
    let rings = [(-half.z, half.x), (half.z - tip, half.x), (half.z, 0.3 * half.x)];
    let corner = |z: f64, radius: f64, k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 16.0;
        Vector::new((radius * angle.cos()) as f32, (radius * angle.sin()) as f32, z as f32)
    };
    rings.iter().flat_map(|&(z, radius)| (0..16).map(move |k| corner(z, radius, k))).collect()
}

/// The collider of a body.
pub(crate) fn collider(shape: &Shape, config: &WorldConfig) -> ColliderBuilder {
    let friction = match shape {
        Shape::Block { .. } => config.block_friction,
        Shape::Disk { .. } => config.disk_friction,
        Shape::Peg { .. } => config.peg_friction,
        Shape::Board { .. } => config.table_friction,
    };
    ColliderBuilder::new(collision_shape(shape))
        .density(config.density_kg_m3 as f32)
        .friction(friction as f32)
        .restitution(0.0)
}

/// The table: a slab with its top at z = 0.
pub(crate) fn table(config: &WorldConfig) -> ColliderBuilder {
    ColliderBuilder::cuboid(TABLE_HALF_M, TABLE_HALF_M, 0.1)
        .translation(Vector::new(0.0, 0.0, -0.1))
        .friction(config.table_friction as f32)
        .restitution(0.0)
}

/// How deep two bodies are inside each other, in metres; 0 when they are apart.
pub(crate) fn overlap_m(
    first: (&Shape, &Isometry3<f64>),
    second: (&Shape, &Isometry3<f64>),
) -> f64 {
    let (shape_1, pose_1) = (collision_shape(first.0), convert::pose(first.1));
    let (shape_2, pose_2) = (collision_shape(second.0), convert::pose(second.1));
    match query::contact(&pose_1, &*shape_1, &pose_2, &*shape_2, 0.0) {
        Ok(Some(contact)) => f64::from(-contact.dist).max(0.0),
        Ok(None) | Err(_) => 0.0,
    }
}
