//! Triangles to pixels: clipping at the near plane, exact coverage, nearest surface.

use nalgebra::{Isometry3, Vector3};

use crate::camera::Intrinsics;

/// Nothing nearer to the camera than this is drawn, in metres.
pub(crate) const NEAR_M: f64 = 0.02;

/// A corner of a triangle in the camera frame, with three values to interpolate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vertex {
    pub(crate) position: Vector3<f64>,
    pub(crate) values: [f64; 3],
}

/// A linear function of the pixel: `dx * column + dy * row + at_origin`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) dx: f32,
    pub(crate) dy: f32,
    pub(crate) at_origin: f32,
}

/// One drawn triangle: what is needed to shade its pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    /// The three interpolated values divided by depth, as functions of the pixel.
    pub(crate) values: [Plane; 3],
    /// Index of what it is part of.
    pub(crate) drawable: u16,
}

/// The nearest surface of every pixel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Target {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// 1 / depth for a camera, height towards the light for a shadow map; larger is nearer.
    pub(crate) nearness: Vec<f32>,
    /// 1 + index of the visible face; 0 where there is none.
    pub(crate) face: Vec<u32>,
}

/// A triangle corner on the image plane: column, row, nearness.
pub(crate) type ScreenPoint = [f64; 3];

impl Target {
    /// An empty target.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self { width, height, nearness: vec![0.0; n], face: vec![0; n] }
    }

    /// Draws one triangle in the camera frame; back faces are left out.
    pub(crate) fn draw(
        &mut self,
        intrinsics: &Intrinsics,
        triangle: &[Vertex; 3],
        drawable: u16,
        faces: &mut Vec<Face>,
    ) {
        let [a, b, c] = triangle;
        let normal = (b.position - a.position).cross(&(c.position - a.position));
        if normal.dot(&a.position) >= 0.0 {
            return;
        }
        let (polygon, n) = clip(triangle);
        let project = |vertex: &Vertex| {
            let nearness = 1.0 / vertex.position.z;
            [
                intrinsics.fx * vertex.position.x * nearness + intrinsics.cx,
                intrinsics.fy * vertex.position.y * nearness + intrinsics.cy,
                nearness,
            ]
        };
        for k in 2..n {
            let part = [polygon[0], polygon[k - 1], polygon[k]];
            let screen = [project(&part[0]), project(&part[1]), project(&part[2])];
            let over_depth = |value: usize| {
                let at = |corner: usize| part[corner].values[value] * screen[corner][2];
                plane(&screen, [at(0), at(1), at(2)])
            };
            let nearness = plane(&screen, screen.map(|point| point[2]));
            let (Some(nearness), Some(v0), Some(v1), Some(v2)) =
                (nearness, over_depth(0), over_depth(1), over_depth(2))
            else {
                continue;
            };
            faces.push(Face { values: [v0, v1, v2], drawable });
            self.fill(&screen, &nearness, faces.len() as u32);
        }
    }

    /// Marks the pixels whose centre a triangle covers, where it is the nearest so far.
    ///
    /// A row's pixels go from the first centre on or right of the left edge to the last one left
    /// of the right edge, and an edge is computed the same way for both of its triangles: so
    /// neighbours leave no gap and share no pixel.
    pub(crate) fn fill(&mut self, screen: &[ScreenPoint; 3], nearness: &Plane, face: u32) {
        let mut points = *screen;
        points.sort_by(|a, b| a[1].total_cmp(&b[1]));
        let [top, middle, bottom] = points;
        let first = top[1].ceil().max(0.0);
        let end = bottom[1].ceil().min(self.height as f64);
        if first >= end {
            return;
        }
        let along = |a: &ScreenPoint, b: &ScreenPoint, row: f64| {
            a[0] + (b[0] - a[0]) * ((row - a[1]) / (b[1] - a[1]))
        };
        for row in first as usize..end as usize {
            let y = row as f64;
            let long = along(&top, &bottom, y);
            let short =
                if y < middle[1] { along(&top, &middle, y) } else { along(&middle, &bottom, y) };
            let left = long.min(short).ceil().max(0.0) as usize;
            let right = (long.max(short).ceil().max(0.0) as usize).min(self.width);
            if left >= right {
                continue;
            }
            let start = row * self.width;
            let base = nearness.dy * y as f32 + nearness.at_origin;
            let pixels = self.nearness[start + left..start + right]
                .iter_mut()
                .zip(&mut self.face[start + left..start + right]);
            // Columns fit 16 bits, which turn into floats fast.
            for (column, (nearest, visible)) in (left as u16..).zip(pixels) {
                let here = nearness.dx * f32::from(column) + base;
                if here > *nearest {
                    *nearest = here;
                    *visible = face;
                }
            }
        }
    }
}

impl Plane {
    /// The value at a pixel.
    pub(crate) fn at(&self, column: f32, row: f32) -> f32 {
        self.dx * column + self.dy * row + self.at_origin
    }
}

/// The linear function with the given values at the corners; none for a triangle without area.
pub(crate) fn plane(screen: &[ScreenPoint; 3], values: [f64; 3]) -> Option<Plane> {
    let [a, b, c] = screen;
    let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    let area = bx * cy - by * cx;
    if area.abs() < 1e-9 {
        return None;
    }
    let (vb, vc) = (values[1] - values[0], values[2] - values[0]);
    let dx = (vb * cy - vc * by) / area;
    let dy = (vc * bx - vb * cx) / area;
    let at_origin = values[0] - dx * a[0] - dy * a[1];
    Some(Plane { dx: dx as f32, dy: dy as f32, at_origin: at_origin as f32 })
}

/// Cuts off what is nearer than the near plane: a polygon of 0, 3 or 4 corners.
fn clip(triangle: &[Vertex; 3]) -> ([Vertex; 4], usize) {
    let mut polygon = [triangle[0]; 4];
    let mut n = 0;
    let mut add = |vertex: Vertex| {
        polygon[n] = vertex;
        n += 1;
    };
    for k in 0..3 {
        let (here, next) = (&triangle[k], &triangle[(k + 1) % 3]);
        let (d_here, d_next) = (here.position.z - NEAR_M, next.position.z - NEAR_M);
        if d_here >= 0.0 {
            add(*here);
        }
        if (d_here >= 0.0) != (d_next >= 0.0) {
            let t = d_here / (d_here - d_next);
            let mix = |a: f64, b: f64| a + (b - a) * t;
            add(Vertex {
                position: here.position.lerp(&next.position, t),
                values: std::array::from_fn(|v| mix(here.values[v], next.values[v])),
            });
        }
    }
    (polygon, n)
}

/// The smallest box of pixels that holds all points in front of the camera, cut to the image:
/// first and one past the last column and row. The whole image when a point is behind.
pub(crate) fn bounds(
    camera_from_world: &Isometry3<f64>,
    intrinsics: &Intrinsics,
    size: [usize; 2],
    points: impl Iterator<Item = Vector3<f64>>,
) -> PixelBox {
    let mut low = [f64::MAX; 2];
    let mut high = [f64::MIN; 2];
    for point in points {
        let seen = camera_from_world.transform_point(&point.into());
        if seen.z < NEAR_M {
            return PixelBox { columns: [0, size[0]], rows: [0, size[1]] };
        }
        let at = [
            intrinsics.fx * seen.x / seen.z + intrinsics.cx,
            intrinsics.fy * seen.y / seen.z + intrinsics.cy,
        ];
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    let cut = |axis: usize| {
        let n = size[axis] as f64;
        [low[axis].floor().clamp(0.0, n) as usize, (high[axis].ceil() + 1.0).clamp(0.0, n) as usize]
    };
    PixelBox { columns: cut(0), rows: cut(1) }
}

/// A box of pixels: first and one past the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelBox {
    pub(crate) columns: [usize; 2],
    pub(crate) rows: [usize; 2],
}

impl PixelBox {
    /// The box with `margin` pixels more on each side, cut to the image.
    pub(crate) fn widened(&self, margin: usize, size: [usize; 2]) -> Self {
        let widen = |[low, high]: [usize; 2], n: usize| {
            if low < high {
                [low.saturating_sub(margin), (high + margin).min(n)]
            } else {
                [low, high]
            }
        };
        Self { columns: widen(self.columns, size[0]), rows: widen(self.rows, size[1]) }
    }
}

/// The columns that the boxes cover in a row, as disjoint intervals from left to right.
pub(crate) fn covered(boxes: &[PixelBox], row: usize, out: &mut Vec<[usize; 2]>) {
    out.clear();
    let in_row = boxes.iter().filter(|b| b.rows[0] <= row && row < b.rows[1]);
    out.extend(in_row.map(|b| b.columns).filter(|c| c[0] < c[1]));
    out.sort_unstable();
    let mut n = 0;
    for k in 0..out.len() {
        let next = out[k];
        if n > 0 && next[0] <= out[n - 1][1] {
            out[n - 1][1] = out[n - 1][1].max(next[1]);
        } else {
            out[n] = next;
            n += 1;
        }
    }
    out.truncate(n);
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: Intrinsics = Intrinsics { fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5 };

    fn vertex(x: f64, y: f64, z: f64) -> Vertex {
        Vertex { position: Vector3::new(x, y, z), values: [z, 1.0, 0.0] }
    }

    fn draw(target: &mut Target, corners: [Vertex; 3]) -> Vec<Face> {
        let mut faces = Vec::new();
        target.draw(&K, &corners, 0, &mut faces);
        target.draw(&K, &[corners[0], corners[2], corners[1]], 0, &mut faces);
        faces
    }

    #[test]
    fn two_triangles_of_a_square_cover_every_pixel_once() {
        let mut target = Target::new(64, 48);
        let [a, b, c, d] = [(-0.2, -0.2), (0.3, -0.2), (0.3, 0.2), (-0.2, 0.2)]
            .map(|(x, y)| [K.fx * x + K.cx, K.fy * y + K.cy, 1.0]);
        let mut hits = vec![0; 64 * 48];
        for screen in [[a, b, c], [a, c, d]] {
            target.nearness.fill(0.0);
            target.face.fill(0);
            target.fill(&screen, &plane(&screen, [1.0; 3]).unwrap(), 1);
            hits.iter_mut().zip(&target.face).for_each(|(n, face)| *n += face);
        }
        for row in 0..48 {
            for column in 0..64 {
                let (x, y) = (f64::from(column), f64::from(row));
                let inside = x >= a[0] && x < b[0] && y >= a[1] && y < d[1];
                assert_eq!(hits[row as usize * 64 + column as usize], u32::from(inside));
            }
        }
    }

    #[test]
    fn a_floor_through_the_camera_is_cut_at_the_near_plane_and_has_exact_depth() {
        // The plane y = 0.1 below a camera that looks along it, from far behind to far in front.
        let mut target = Target::new(64, 48);
        let (l, r) = (-40.0, 40.0);
        draw(&mut target, [vertex(l, 0.1, -30.0), vertex(r, 0.1, -30.0), vertex(r, 0.1, 30.0)]);
        draw(&mut target, [vertex(l, 0.1, -30.0), vertex(r, 0.1, 30.0), vertex(l, 0.1, 30.0)]);
        for row in 0..48 {
            let slope = (row as f64 - K.cy) / K.fy;
            for column in 0..64 {
                let nearness = f64::from(target.nearness[row * 64 + column]);
                if slope > 0.1 / 30.0 {
                    assert!((nearness - slope / 0.1).abs() < 1e-4 * nearness, "row {row}");
                } else {
                    assert_eq!(nearness, 0.0, "row {row} is above the horizon");
                }
            }
        }
    }

    #[test]
    fn values_are_interpolated_in_space_not_on_the_image() {
        let mut target = Target::new(64, 48);
        let faces = draw(
            &mut target,
            [vertex(-1.0, 0.5, 1.0), vertex(2.0, 0.5, 4.0), vertex(0.0, -2.0, 2.0)],
        );
        assert_eq!(faces.len(), 1);
        for (pixel, nearness) in target.nearness.iter().enumerate().filter(|(_, n)| **n > 0.0) {
            let (column, row) = ((pixel % 64) as f32, (pixel / 64) as f32);
            let z = faces[0].values[0].at(column, row) / nearness;
            assert!((z * nearness - 1.0).abs() < 1e-4, "the first value is the depth");
        }
    }

    #[test]
    fn intervals_are_merged() {
        let columns = |a, b| PixelBox { columns: [a, b], rows: [0, 1] };
        let mut out = Vec::new();
        covered(&[columns(5, 9), columns(1, 3), columns(2, 4), columns(20, 20)], 0, &mut out);
        assert_eq!(out, [[1, 4], [5, 9]]);
        covered(&[columns(5, 9)], 1, &mut out);
        assert!(out.is_empty());
    }
}
