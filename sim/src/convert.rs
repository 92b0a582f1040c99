//! Between nalgebra in f64, which the public face speaks, and rapier's f32 types.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::prelude::{Pose, Rotation, Vector};

/// A vector for rapier.
pub(crate) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

/// A point for rapier.
pub(crate) fn point(p: &Point3<f64>) -> Vector {
    vector(&p.coords)
}

/// A pose for rapier.
pub(crate) fn pose(isometry: &Isometry3<f64>) -> Pose {
    let q = isometry.rotation.quaternion();
    let rotation = Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32).normalize();
    Pose::from_parts(vector(&isometry.translation.vector), rotation)
}

/// A vector from rapier.
pub(crate) fn from_vector(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

/// A pose from rapier.
pub(crate) fn from_pose(pose: &Pose) -> Isometry3<f64> {
    let q = pose.rotation;
    let quaternion =
        Quaternion::new(f64::from(q.w), f64::from(q.x), f64::from(q.y), f64::from(q.z));
    Isometry3::from_parts(
        Translation3::from(from_vector(pose.translation)),
        UnitQuaternion::from_quaternion(quaternion),
    )
}
