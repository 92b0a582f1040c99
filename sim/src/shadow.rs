//! The shadow map: what the key light sees of the objects.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::camera::Intrinsics;
use crate::mesh::Mesh;
use crate::raster::{self, ScreenPoint, Target};

/// The part of the world that throws shadows: lowest and highest corner, in metres.
const CASTERS_M: [[f64; 3]; 2] = [[-0.5, -0.35, 0.0], [0.5, 0.3, 0.42]];
/// A surface this little behind another is still lit, in metres. Only surfaces that face away from
/// the light are drawn into the map, so lit ones are well in front of their own body's.
const BIAS_M: f32 = 0.0008;

/// A parallel projection along the key light.
#[derive(Debug, Clone)]
pub(crate) struct ShadowMap {
    size: usize,
    target: Target,
    /// Column, row and height towards the light of a world point: rows of an affine map.
    rows: [Vector3<f64>; 3],
    offsets: [f64; 3],
}

/// Column, row and height in the shadow map for pixels of one camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadowView {
    /// For each of the three: change with the pixel's column, with its row, and the rest, all
    /// times depth; then what is added.
    maps: [[f32; 4]; 3],
}

impl ShadowMap {
    /// An empty map of `size` x `size` for a light from the direction `to_light`.
    pub(crate) fn new(size: usize, to_light: &Vector3<f64>) -> Self {
        let u = Vector3::z().cross(to_light).try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let v = to_light.cross(&u);
        let mut map = Self {
            size,
            target: Target::new(size, size),
            rows: [u, v, *to_light],
            offsets: [0.0; 3],
        };
        let corner = |k: usize| {
            Vector3::new(CASTERS_M[k & 1][0], CASTERS_M[k >> 1 & 1][1], CASTERS_M[k >> 2][2])
        };
        for axis in 0..2 {
            let along = |k: usize| map.rows[axis].dot(&corner(k));
            let low = (0..8).map(along).fold(f64::MAX, f64::min);
            let high = (0..8).map(along).fold(f64::MIN, f64::max);
            let scale = (size as f64 - 5.0) / (high - low);
            map.rows[axis] *= scale;
            map.offsets[axis] = 2.0 - low * scale;
        }
        map.clear();
        map
    }

    fn clear(&mut self) {
        self.target.nearness.fill(f32::MIN);
    }

    /// Starts again from what another map of the same size and light shows.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.target.nearness.copy_from_slice(&other.target.nearness);
    }

    /// Adds a body.
    pub(crate) fn draw(&mut self, mesh: &Mesh, world_from_body: &Isometry3<f64>) {
        let project = |position: &Vector3<f64>| -> ScreenPoint {
            let point = world_from_body.transform_point(&Point3::from(*position));
            std::array::from_fn(|axis| self.rows[axis].dot(&point.coords) + self.offsets[axis])
        };
        let points: Vec<ScreenPoint> = mesh.corners.iter().map(|c| project(&c.position)).collect();
        for triangle in &mesh.triangles {
            let screen = triangle.map(|k| points[k]);
            let [a, b, c] = screen;
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if area >= 0.0 {
                continue; // It faces the light.
            }
            if let Some(nearness) = raster::plane(&screen, screen.map(|point| point[2])) {
                self.target.fill(&screen, &nearness, 1);
            }
        }
    }

    /// How pixels of a camera map to this shadow map.
    pub(crate) fn view(
        &self,
        world_from_camera: &Isometry3<f64>,
        intrinsics: &Intrinsics,
    ) -> ShadowView {
        let eye = world_from_camera.translation.vector;
        let rotation = &world_from_camera.rotation;
        let dx = rotation * Vector3::new(1.0 / intrinsics.fx, 0.0, 0.0);
        let dy = rotation * Vector3::new(0.0, 1.0 / intrinsics.fy, 0.0);
        let first = rotation
            * Vector3::new(-intrinsics.cx / intrinsics.fx, -intrinsics.cy / intrinsics.fy, 1.0);
        let map = |axis: usize| {
            let row = &self.rows[axis];
            let added = row.dot(&eye) + self.offsets[axis];
            [row.dot(&dx), row.dot(&dy), row.dot(&first), added].map(|value| value as f32)
        };
        ShadowView { maps: [map(0), map(1), map(2)] }
    }

    /// The share of the key light, 0 to 1, that reaches a point of the map: the mean over 3 x 3
    /// texels around it.
    pub(crate) fn lit_share(&self, [column, row, height]: [f32; 3]) -> f32 {
        let limit = (self.size - 3) as f32;
        if !(column >= 1.0 && row >= 1.0 && column < limit && row < limit) {
            return 1.0;
        }
        let (x, y) = (column as usize, row as usize);
        let (fx, fy) = (column - x as f32, row - y as f32);
        let limit = height + BIAS_M;
        let lit = |texel: f32| if texel > limit { 0.0 } else { 1.0 };
        let line = |dy: usize| {
            let start = (y + dy - 1) * self.size + x - 1;
            let texels = &self.target.nearness[start..start + 4];
            (1.0 - fx) * lit(texels[0]) + lit(texels[1]) + lit(texels[2]) + fx * lit(texels[3])
        };
        ((1.0 - fy) * line(0) + line(1) + line(2) + fy * line(3)) * (1.0 / 9.0)
    }
}

impl ShadowView {
    /// Where the surface at a pixel and a depth (metres) is in the shadow map.
    pub(crate) fn at(&self, column: f32, row: f32, depth: f32) -> [f32; 3] {
        self.maps.map(|[dx, dy, first, added]| (dx * column + dy * row + first) * depth + added)
    }
}
