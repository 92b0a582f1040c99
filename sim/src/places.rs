//! Free places on the table: where an object can be set down, seen and grasped.

use crate::random::Random;
use crate::shape::Shape;

/// Room kept between an object that a fault sets down and anything else, in metres.
pub(crate) const CLEARANCE_M: f64 = 0.015;
/// Tangent of the steepest view that is assumed: an object hides what is behind it on the table
/// for its height divided by this.
const VIEW_SLOPE: f64 = 0.3;
const RANDOM_TRIES: usize = 400;
const SPIRAL_RINGS: usize = 70;
const SPIRAL_STEP_M: f64 = 0.01;
const SPIRAL_ANGLES: usize = 24;

/// Something on the table as seen from above, with the height of its top.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "a unit is part of a name")]
pub(crate) struct Obstacle {
    pub(crate) at_m: [f64; 2],
    /// Half the extents of a rectangle along x and y around which `radius_m` is kept.
    pub(crate) half_m: [f64; 2],
    pub(crate) radius_m: f64,
    pub(crate) top_m: f64,
}

/// The object that needs a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    pub(crate) radius_m: f64,
    pub(crate) height_m: f64,
}

/// A search for a place within an area (lowest and highest x and y) between obstacles.
pub(crate) struct Places<'a> {
    pub(crate) area_m: [[f64; 2]; 2],
    pub(crate) obstacles: &'a [Obstacle],
    pub(crate) object: Footprint,
    /// Room kept between the object and anything else, in metres.
    pub(crate) clearance_m: f64,
}

impl Obstacle {
    /// An upright body at a place.
    pub(crate) fn of(shape: &Shape, at_m: [f64; 2], top_m: f64) -> Self {
        let size = shape.size_m();
        match shape {
            Shape::Board { .. } | Shape::Compound { .. } => {
                Self { at_m, half_m: [0.5 * size.x, 0.5 * size.y], radius_m: 0.0, top_m }
            }
            Shape::Block { .. }
            | Shape::Disk { .. }
            | Shape::Peg { .. }
            | Shape::Box { .. }
            | Shape::Cylinder { .. }
            | Shape::Tube { .. } => {
                Self { at_m, half_m: [0.0; 2], radius_m: shape.footprint_radius_m(), top_m }
            }
        }
    }

    /// Distance from a point to the obstacle's outline, negative inside.
    fn distance_m(&self, at_m: [f64; 2]) -> f64 {
        let dx = ((at_m[0] - self.at_m[0]).abs() - self.half_m[0]).max(0.0);
        let dy = ((at_m[1] - self.at_m[1]).abs() - self.half_m[1]).max(0.0);
        dx.hypot(dy) - self.radius_m
    }
}

impl Places<'_> {
    /// The free place nearest to `near_m`; where nothing is hidden, if there is such a place.
    pub(crate) fn near(&self, near_m: [f64; 2]) -> Option<[f64; 2]> {
        let ring = |ring: usize| {
            let n_angles = if ring == 0 { 1 } else { SPIRAL_ANGLES };
            (0..n_angles).map(move |k| {
                let angle = std::f64::consts::TAU * k as f64 / SPIRAL_ANGLES as f64;
                let radius = SPIRAL_STEP_M * ring as f64;
                [near_m[0] + radius * angle.cos(), near_m[1] + radius * angle.sin()]
            })
        };
        let candidates: Vec<[f64; 2]> = (0..SPIRAL_RINGS).flat_map(ring).collect();
        self.first_of(&candidates)
    }

    /// A random free place; where nothing is hidden, if one is found.
    pub(crate) fn random(&self, random: &mut Random) -> Option<[f64; 2]> {
        let [low, high] = self.area_m;
        let mut draw = |_| [random.between(low[0], high[0]), random.between(low[1], high[1])];
        let candidates: Vec<[f64; 2]> = (0..RANDOM_TRIES).map(&mut draw).collect();
        self.first_of(&candidates)
    }

    /// How much room there is around a place, in metres; negative outside the area.
    pub(crate) fn room_m(&self, at_m: [f64; 2]) -> f64 {
        let [low, high] = self.area_m;
        let inside = (0..2).map(|k| (at_m[k] - low[k]).min(high[k] - at_m[k])).fold(1.0, f64::min);
        let distances = self.obstacles.iter().map(|obstacle| obstacle.distance_m(at_m));
        distances.map(|distance| distance - self.object.radius_m).fold(inside, f64::min)
    }

    /// The first candidate that is free; where nothing is hidden, if there is such a one.
    pub(crate) fn first_of(&self, candidates: &[[f64; 2]]) -> Option<[f64; 2]> {
        let free = || candidates.iter().copied().filter(|&at_m| self.is_free(at_m));
        free().find(|&at_m| self.hides_nothing(at_m)).or_else(|| free().next())
    }

    fn is_free(&self, at_m: [f64; 2]) -> bool {
        let [low, high] = self.area_m;
        let inside = (0..2).all(|k| at_m[k] >= low[k] && at_m[k] <= high[k]);
        let reach = self.object.radius_m + self.clearance_m;
        inside && self.obstacles.iter().all(|obstacle| obstacle.distance_m(at_m) >= reach)
    }

    /// Whether the object neither hides something behind it nor is hidden, for a viewer at low y.
    fn hides_nothing(&self, at_m: [f64; 2]) -> bool {
        self.obstacles.iter().all(|other| {
            let reach_x = other.half_m[0] + other.radius_m + self.object.radius_m + 0.005;
            let gap_y = (at_m[1] - other.at_m[1]).abs()
                - (other.half_m[1] + other.radius_m + self.object.radius_m);
            let front_top =
                if at_m[1] < other.at_m[1] { self.object.height_m } else { other.top_m };
            (at_m[0] - other.at_m[0]).abs() > reach_x || gap_y > 0.5 * front_top / VIEW_SLOPE
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(obstacles: &[Obstacle]) -> Places<'_> {
        let object = Footprint { radius_m: 0.035, height_m: 0.05 };
        let area_m = [[-0.3, -0.2], [0.3, 0.2]];
        Places { area_m, obstacles, object, clearance_m: CLEARANCE_M }
    }

    #[test]
    fn a_free_point_is_taken_as_it_is_and_a_taken_one_moves_aside() {
        let block = Shape::Block { size_m: 0.05 };
        let obstacles = [Obstacle::of(&block, [0.0, 0.0], 0.05)];
        let places = places(&obstacles);
        assert_eq!(places.near([0.2, 0.0]), Some([0.2, 0.0]));
        let aside = places.near([0.01, 0.0]).unwrap();
        assert!(aside[0].hypot(aside[1]) > 0.07 + CLEARANCE_M - 1e-9, "{aside:?}");
        assert_eq!(places.near([5.0, 5.0]), None);
    }

    #[test]
    fn a_full_area_has_no_place() {
        let board = Shape::Board { size_m: [1.0, 1.0, 0.01] };
        let obstacles = [Obstacle::of(&board, [0.0, 0.0], 0.01)];
        let places = places(&obstacles);
        assert_eq!(places.random(&mut Random::new(1, 0)), None);
    }
}
