//! How much of a body a camera sees.

use groundloop_sim::BodyTruth;
use nalgebra::{Point2, Point3, Rotation3, Vector3};

use crate::geometry::{CameraModel, MaskRun};

/// Corners of the polygon that stands for a circle.
const CIRCLE_CORNERS: u32 = 24;

/// The share of a body's outline that its own pixels fill, 0 to 1: the rest is hidden, or out of the image.
///
/// The outline is the convex hull of the upright body, projected: exact for blocks, nearly so for disks and
/// pegs. Bodies of other kinds are taken for their boxes, so a round one never counts as seen whole.
pub(super) fn visible_share(mask: &[MaskRun], body: &BodyTruth, camera: &CameraModel) -> f64 {
    let projected: Option<Vec<Point2<f64>>> =
        corners(body).into_iter().map(|corner| camera.project(corner)).collect();
    let area_px = projected.map_or(0.0, hull_area);
    let seen_px: u32 = mask.iter().map(|run| run.x_end - run.x_start).sum();
    if area_px > 0.0 { (f64::from(seen_px) / area_px).min(1.0) } else { 0.0 }
}

/// Points whose hull is the body: metres, world frame.
fn corners(body: &BodyTruth) -> Vec<Point3<f64>> {
    let half = body.size_m * 0.5;
    let is_round = ["cylinder", "disk", "peg", "tube"].contains(&body.kind);
    let ring: Vec<[f64; 2]> = if is_round {
        let angle = |k| f64::from(k) * std::f64::consts::TAU / f64::from(CIRCLE_CORNERS);
        (0..CIRCLE_CORNERS).map(|k| [half.x * angle(k).cos(), half.y * angle(k).sin()]).collect()
    } else {
        vec![[half.x, half.y], [-half.x, half.y], [-half.x, -half.y], [half.x, -half.y]]
    };
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), body.yaw_rad);
    let at = |[x, y]: [f64; 2], z: f64| body.position + turn * Vector3::new(x, y, z);
    ring.into_iter().flat_map(|xy| [at(xy, half.z), at(xy, -half.z)]).collect()
}

/// The area of the convex hull of points (Andrew's monotone chain, 1979).
fn hull_area(mut points: Vec<Point2<f64>>) -> f64 {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let lower = chain(points.iter());
    let upper = chain(points.iter().rev());
    let hull: Vec<Point2<f64>> = lower.into_iter().chain(upper).collect();
    let next = hull.iter().cycle().skip(1);
    hull.iter().zip(next).map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>().abs() * 0.5
}

/// One half of the hull, without its last point.
fn chain<'a>(points: impl Iterator<Item = &'a Point2<f64>>) -> Vec<Point2<f64>> {
    let mut chain: Vec<Point2<f64>> = Vec::new();
    for point in points {
        while let [.., a, b] = chain.as_slice() {
            if (b - a).perp(&(point - b)) > 0.0 {
                break;
            }
            chain.pop();
        }
        chain.push(*point);
    }
    chain.pop();
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_of_a_hull_leaves_inner_points_out() {
        let square = [[0.0, 0.0], [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0]];
        let points = square.map(|[x, y]| Point2::new(x, y)).to_vec();
        assert!((hull_area(points) - 4.0).abs() < 1e-12);
        assert!(hull_area(Vec::new()).abs() < 1e-12);
    }
}
