//! `place object (onto | around) target`: over it, down, open, up. Onto a target: a free place on it.
//! Without a target: a free place on the table.

use std::collections::BTreeMap;

use nalgebra::Point3;
use schemars::{Schema, SchemaGenerator, json_schema};

use super::{Held, Skill, SkillContext, SkillError};
use crate::geometry::Aabb;
use crate::messages::{Expect, Motion};
use crate::parts::Part;
use crate::pddl::Name;

/// Steps of the search for a free place on the table, metres.
const GRID_M: f64 = 0.01;
/// Steps of the search for a free place on an object, metres.
const FINE_GRID_M: f64 = 0.005;
/// Free space beyond an object that is put onto another one, to the other's edge and, where there is
/// little room along y, to what stands there already: metres.
const EDGE_M: f64 = 0.01;

/// The entry of the table of skills.
pub(super) const PART: Part<dyn Skill> = Part {
    name: "place",
    help: "puts down what is held: onto or around an object, or on a free place of the table",
    options: params,
    build: |_| Ok(Box::new(Place)),
};

fn params(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": "object",
        "properties": {
            "object": { "type": "string", "description": "what is put down" },
            "onto": { "type": "string", "description": "what it comes to rest on" },
            "around": { "type": "string", "description": "what goes through it" },
        },
        "required": ["object"],
        "additionalProperties": false,
    })
}

/// Puts down what is held.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place;

impl Skill for Place {
    fn extend(
        &self,
        args: &BTreeMap<&str, Name>,
        context: &mut SkillContext<'_>,
        motion: &mut Motion,
    ) -> Result<(), SkillError> {
        let Some(object) = args.get("object") else { return Ok(()) };
        let held = context.held.clone().filter(|held| held.object == *object);
        let held = held.ok_or_else(|| SkillError::NotHeld { object: object.clone() })?;
        let support = match (args.get("onto"), args.get("around")) {
            (Some(target), _) => onto(target, &held, context)?,
            (None, Some(target)) => around(target, context.volume(target)?, context),
            (None, None) => free_place(&held, context)?,
        };
        let config = context.config;
        let tool_z =
            support.z + config.release_gap_m + held.extent[2] / 2.0 - held.centre_above_tool_m;
        let goal = Point3::new(support.x, support.y, tool_z);
        motion.waypoints.extend(context.approach(goal, Expect::Holding));
        context.opening_m = (held.extent[0] + config.jaw_clearance_m).min(config.opening_m_max);
        context.held = None;
        motion.waypoints.push(context.waypoint(goal, config.approach_speed_m_s, Expect::Empty));
        motion.waypoints.push(context.retreat(Expect::Empty));
        Ok(())
    }
}

/// The free place on a target's upper face that is nearest to its middle: the middle itself, if it is
/// free.
///
/// Beside what stands there is room for the fingers, which open along x. Of places beside the middle
/// those with nothing before or behind them on the target are best, then those with free space there:
/// the camera looks along y.
fn onto(target: &Name, held: &Held, context: &SkillContext<'_>) -> Result<Point3<f64>, SkillError> {
    let config = context.config;
    let volume = context.volume(target)?;
    let middle = [volume.centre.x, volume.centre.y];
    let except = [target];
    let others: Vec<Aabb> = context
        .others(&except)
        .map(|(_, other)| other)
        .filter(|other| stands_on(other, &volume))
        .collect();
    let is_apart = |other: &Aabb, axis: usize, place: [f64; 2], room_m: f64| {
        let apart_m = f64::midpoint(other.extent[axis], held.extent[axis]) + room_m;
        (other.centre[axis] - place[axis]).abs() >= apart_m
    };
    let is_beside =
        |other: &Aabb, place: [f64; 2]| is_apart(other, 0, place, config.jaw_clearance_m);
    let is_in_sight = |place: [f64; 2]| others.iter().all(|other| is_beside(other, place));
    let is_clear = |place: [f64; 2], room_y_m: f64| {
        others.iter().all(|other| is_beside(other, place) || is_apart(other, 1, place, room_y_m))
    };
    let is_free = |place: [f64; 2]| is_clear(place, config.table_clearance_m);
    let away_m = |[x, y]: [f64; 2]| (x - middle[0]).hypot(y - middle[1]);
    let within = |axis: usize| {
        let room = (volume.extent[axis] - held.extent[axis]) / 2.0 - EDGE_M;
        let n_steps = (room / FINE_GRID_M).max(0.0) as i32;
        (-n_steps..=n_steps).map(move |i| middle[axis] + f64::from(i) * FINE_GRID_M)
    };
    let nearest = |is_good: &dyn Fn([f64; 2]) -> bool| {
        let places = within(1).flat_map(|y| within(0).map(move |x| [x, y]));
        places
            .filter(|place| config.bound_beyond(*place).is_none() && is_good(*place))
            .min_by(|a, b| away_m(*a).total_cmp(&away_m(*b)))
    };
    Some(middle)
        .filter(|middle| is_free(*middle))
        .or_else(|| nearest(&is_in_sight))
        .or_else(|| nearest(&is_free))
        .or_else(|| nearest(&|place| is_clear(place, EDGE_M)))
        .map(|[x, y]| Point3::new(x, y, volume.top_z()))
        .ok_or_else(|| SkillError::NoPlaceOn { target: target.clone(), width_m: held.extent[0] })
}

/// Whether something stands on a target, or in it: above its ground, and not below it.
fn stands_on(other: &Aabb, target: &Aabb) -> bool {
    let is_over =
        |axis: usize| (other.centre[axis] - target.centre[axis]).abs() <= target.extent[axis] / 2.0;
    let bottom_z = other.centre.z - other.extent[2] / 2.0;
    is_over(0) && is_over(1) && bottom_z > target.centre.z - target.extent[2]
}

/// The middle of the highest thing that is around a post, or the post's foot.
fn around(post: &Name, volume: Aabb, context: &SkillContext<'_>) -> Point3<f64> {
    let (x, y) = (volume.centre.x, volume.centre.y);
    let foot_z = volume.centre.z - volume.extent[2] / 2.0;
    let except = [post];
    let is_around = |other: &Aabb| {
        let reach = other.extent[0].max(other.extent[1]) / 2.0;
        (other.centre.x - x).hypot(other.centre.y - y) < reach / 2.0
    };
    let tops = context.others(&except).map(|(_, other)| other).filter(is_around);
    let top_z = tops.map(|other| other.top_z()).fold(f64::NEG_INFINITY, f64::max);
    Point3::new(x, y, if top_z.is_finite() { top_z } else { foot_z })
}

/// The free place on the table nearest to the tool and to the row in which objects are put.
///
/// Best is a place with nothing before or behind it: the camera looks along y, and what stands one
/// behind the other hides one another. Where there is none, any free place will do.
fn free_place(held: &Held, context: &SkillContext<'_>) -> Result<Point3<f64>, SkillError> {
    let config = context.config;
    let width_m = held.extent[0].max(held.extent[1]);
    let others: Vec<Aabb> = context.others(&[]).map(|(_, other)| other).collect();
    let is_apart = |other: &Aabb, axis: usize, place: [f64; 2]| {
        let apart_m = f64::midpoint(other.extent[axis], width_m) + config.table_clearance_m;
        (other.centre[axis] - place[axis]).abs() >= apart_m
    };
    let is_in_sight = |place: [f64; 2]| others.iter().all(|other| is_apart(other, 0, place));
    let is_free = |place: [f64; 2]| {
        others.iter().all(|other| is_apart(other, 0, place) || is_apart(other, 1, place))
    };
    let wanted = [context.tool.x, config.place_y_m];
    let away_m = |[x, y]: [f64; 2]| (x - wanted[0]).hypot(y - wanted[1]);
    let nearest = |is_good: &dyn Fn([f64; 2]) -> bool| {
        let ys = rows(config.place_y_m, config.reach_y_m);
        ys.flat_map(|y| columns(config.place_x_m).map(move |x| [x, y]))
            .filter(|place| config.bound_beyond(*place).is_none() && is_good(*place))
            .min_by(|a, b| away_m(*a).total_cmp(&away_m(*b)))
    };
    nearest(&is_in_sight)
        .or_else(|| nearest(&is_free))
        .map(|[x, y]| Point3::new(x, y, config.table_z_m))
        .ok_or(SkillError::NoFreePlace { width_m })
}

/// The search's steps from the least to the greatest x.
fn columns([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    let n_steps = ((high - low) / GRID_M) as u32;
    (0..=n_steps).map(move |i| low + f64::from(i) * GRID_M)
}

/// The row in which objects are put, then those beside it within reach, the nearest first.
fn rows(y: f64, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    let n_steps = ((high - low) / GRID_M) as u32;
    let beside = (1..=n_steps).flat_map(move |i| {
        let away_m = f64::from(i) * GRID_M;
        [y - away_m, y + away_m]
    });
    std::iter::once(y).chain(beside)
}
