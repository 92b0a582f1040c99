//! Triangle meshes of what is drawn, with smooth normals and rounded edges.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use crate::shape::Shape;
use crate::solid::{Form, Solid};

/// Radius of the rounding of blocks and disks, in metres. The physics has sharp edges.
const ROUNDING_M: f64 = 0.0025;
const DISK_SEGMENTS: usize = 40;
const PEG_SEGMENTS: usize = 24;
const TIP_SEGMENTS: usize = 5;
const EDGE_SEGMENTS: usize = 3;

/// What a mesh is made for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Geometry {
    /// A body of a scene.
    Body(Shape),
    /// A box of the gripper with these extents.
    Link(Vector3<f64>),
}

/// A corner of a mesh in the frame of its body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corner {
    pub(crate) position: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
}

/// A closed surface; triangles are counter-clockwise seen from outside.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) corners: Vec<Corner>,
    pub(crate) triangles: Vec<[usize; 3]>,
}

/// A point of the outline that is turned about z, with the direction it faces: both are
/// (distance from the axis, height).
type OutlinePoint = ([f64; 2], [f64; 2]);

impl Mesh {
    /// The mesh of a body or a link.
    pub(crate) fn of(geometry: &Geometry) -> Self {
        match geometry {
            Geometry::Link(size) => cuboid(size, 0.0012),
            Geometry::Body(shape) => match shape {
                Shape::Block { size_m } => {
                    cuboid(&Vector3::repeat(*size_m), ROUNDING_M.min(0.1 * size_m))
                }
                Shape::Board { size_m } => {
                    cuboid(&Vector3::from(*size_m), ROUNDING_M.min(0.2 * size_m[2]))
                }
                Shape::Disk { .. } | Shape::Tube { .. } => {
                    shape.ring().map(|r| ring(r.outer_m, r.hole_m, r.height_m)).unwrap_or_default()
                }
                Shape::Peg { radius_m, height_m } => peg(*radius_m, *height_m),
                Shape::Box { .. } | Shape::Cylinder { .. } | Shape::Compound { .. } => {
                    let mut mesh = Self::default();
                    shape.solids().iter().for_each(|solid| mesh.add(solid));
                    mesh
                }
            },
        }
    }

    /// Adds a solid at its place.
    fn add(&mut self, solid: &Solid) {
        let rounding = ROUNDING_M.min(0.2 * solid.half.min());
        let part = match solid.form {
            Form::Box => cuboid(&(solid.half * 2.0), rounding),
            Form::Cylinder => cylinder(solid.half.x, solid.half.z, rounding),
        };
        let n_before = self.corners.len();
        let moved = |corner: Corner| Corner { position: corner.position + solid.middle, ..corner };
        self.corners.extend(part.corners.into_iter().map(moved));
        self.triangles.extend(part.triangles.into_iter().map(|t| t.map(|k| k + n_before)));
    }

    fn quad(&mut self, corners: [usize; 4]) {
        let [a, b, c, d] = corners;
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }

    /// Turns an outline about z. The outline goes round with the inside on its left.
    fn turned(outline: &[OutlinePoint], closed: bool, n_segments: usize) -> Self {
        let mut mesh = Self::default();
        for segment in 0..n_segments {
            let (sin, cos) = (TAU * segment as f64 / n_segments as f64).sin_cos();
            let at = |[r, z]: [f64; 2]| Vector3::new(r * cos, r * sin, z);
            let corner = |&(p, n): &OutlinePoint| Corner { position: at(p), normal: at(n) };
            mesh.corners.extend(outline.iter().map(corner));
        }
        let n = outline.len();
        let last = if closed { n } else { n - 1 };
        for segment in 0..n_segments {
            let (here, next) = (segment * n, (segment + 1) % n_segments * n);
            for k in 0..last {
                let up = (k + 1) % n;
                mesh.quad([here + k, next + k, next + up, here + up]);
            }
        }
        mesh
    }
}

/// A box with rounded edges: each corner is three points, one on each face.
fn cuboid(size: &Vector3<f64>, rounding: f64) -> Mesh {
    let half = size * 0.5;
    let mut mesh = Mesh::default();
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    for corner in 0..8 {
        for face in 0..3 {
            let inset = |axis: usize| if axis == face { 0.0 } else { rounding };
            let along = |axis: usize| sign(corner, axis) * (half[axis] - inset(axis));
            let mut normal = Vector3::zeros();
            normal[face] = sign(corner, face);
            let position = Vector3::new(along(0), along(1), along(2));
            mesh.corners.push(Corner { position, normal });
        }
    }
    let mut polygon = |indices: &[usize]| {
        // Counter-clockwise seen from outside: the normal points away from the middle.
        let at = |k: usize| mesh.corners[indices[k]].position;
        let outward = (at(1) - at(0)).cross(&(at(2) - at(0))).dot(&at(0)) > 0.0;
        let mut ordered = indices.to_vec();
        if !outward {
            ordered.reverse();
        }
        match *ordered.as_slice() {
            [a, b, c] => mesh.triangles.push([a, b, c]),
            [a, b, c, d] => mesh.quad([a, b, c, d]),
            _ => {}
        }
    };
    let index = |corner: usize, face: usize| 3 * corner + face;
    for face in 0..3 {
        let (u, v) = (1 << ((face + 1) % 3), 1 << ((face + 2) % 3));
        for side in [0, 1 << face] {
            polygon(&[side, side | u, side | u | v, side | v].map(|corner| index(corner, face)));
        }
        // The four edges along this axis, between the other two faces.
        let along = 1 << face;
        let (f, g) = ((face + 1) % 3, (face + 2) % 3);
        for start in [0, u, v, u | v] {
            let end = start | along;
            polygon(&[index(start, f), index(end, f), index(end, g), index(start, g)]);
        }
    }
    for corner in 0..8 {
        polygon(&[index(corner, 0), index(corner, 1), index(corner, 2)]);
    }
    mesh
}

fn ring(outer: f64, hole: f64, thickness: f64) -> Mesh {
    let half = 0.5 * thickness;
    let b = ROUNDING_M.min(0.2 * thickness);
    let outline = [
        ([outer, b - half], [1.0, 0.0]),
        ([outer, half - b], [1.0, 0.0]),
        ([outer - b, half], [0.0, 1.0]),
        ([hole + b, half], [0.0, 1.0]),
        ([hole, half - b], [-1.0, 0.0]),
        ([hole, b - half], [-1.0, 0.0]),
        ([hole + b, -half], [0.0, -1.0]),
        ([outer - b, -half], [0.0, -1.0]),
    ];
    Mesh::turned(&outline, true, DISK_SEGMENTS)
}

/// A cylinder whose upper and lower edges are round, so that light shines on them.
fn cylinder(radius: f64, half: f64, b: f64) -> Mesh {
    let edge = |k: usize, up: f64| {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / EDGE_SEGMENTS as f64).sin_cos();
        ([radius - b + b * cos, up * (half - b + b * sin)], [cos, up * sin])
    };
    let mut outline = vec![([0.0, -half], [0.0, -1.0])];
    outline.extend((0..=EDGE_SEGMENTS).rev().map(|k| edge(k, -1.0)));
    outline.extend((0..=EDGE_SEGMENTS).map(|k| edge(k, 1.0)));
    outline.push(([0.0, half], [0.0, 1.0]));
    Mesh::turned(&outline, false, DISK_SEGMENTS)
}

fn peg(radius: f64, height: f64) -> Mesh {
    let half = 0.5 * height;
    let mut outline = vec![([radius, -half], [1.0, 0.0])];
    outline.extend((0..=TIP_SEGMENTS).map(|k| {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / TIP_SEGMENTS as f64).sin_cos();
        ([radius * cos, half - radius + radius * sin], [cos, sin])
    }));
    Mesh::turned(&outline, false, PEG_SEGMENTS)
}

/// Meshes that were needed so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Meshes(Vec<(Geometry, Mesh)>);

impl Meshes {
    /// The mesh of a geometry.
    pub(crate) fn get(&mut self, geometry: &Geometry) -> &Mesh {
        let found = self.0.iter().position(|(known, _)| known == geometry);
        let idx = found.unwrap_or_else(|| {
            self.0.push((geometry.clone(), Mesh::of(geometry)));
            self.0.len() - 1
        });
        &self.0[idx].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume enclosed by a mesh; negative when triangles are the wrong way round.
    fn volume(mesh: &Mesh) -> f64 {
        let tetrahedron = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| mesh.corners[k].position);
            a.dot(&b.cross(&c)) / 6.0
        };
        mesh.triangles.iter().map(tetrahedron).sum()
    }

    #[test]
    fn meshes_are_closed_and_turned_outwards() {
        let check = |shape: Shape, expected: f64| {
            let got = volume(&Mesh::of(&Geometry::Body(shape.clone())));
            assert!((got / expected - 1.0).abs() < 0.03, "{shape:?}: {got} not {expected}");
        };
        check(Shape::Block { size_m: 0.05 }, 0.05_f64.powi(3));
        let area = std::f64::consts::PI * (0.05_f64.powi(2) - 0.012_f64.powi(2));
        let disk = Shape::Disk { outer_radius_m: 0.05, hole_radius_m: 0.012, thickness_m: 0.018 };
        check(disk, area * 0.018);
        check(Shape::Board { size_m: [0.4, 0.2, 0.012] }, 0.4 * 0.2 * 0.012);
        check(Shape::Box { size_m: [0.06, 0.04, 0.03] }, 0.06 * 0.04 * 0.03);
        let area = std::f64::consts::PI * 0.02_f64.powi(2);
        check(Shape::Cylinder { radius_m: 0.02, height_m: 0.06 }, area * 0.06);
    }

    #[test]
    fn normals_point_outwards() {
        for shape in [
            Shape::Block { size_m: 0.05 },
            Shape::Disk { outer_radius_m: 0.05, hole_radius_m: 0.012, thickness_m: 0.018 },
            Shape::Peg { radius_m: 0.008, height_m: 0.13 },
            Shape::Cylinder { radius_m: 0.02, height_m: 0.06 },
        ] {
            let mesh = Mesh::of(&Geometry::Body(shape));
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|k| mesh.corners[k]);
                let face = (b.position - a.position).cross(&(c.position - a.position));
                let mean = a.normal + b.normal + c.normal;
                assert!(face.dot(&mean) >= -1e-12, "{triangle:?}");
            }
        }
    }
}
