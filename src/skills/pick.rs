//! `pick object`: over it, down, close, up.

use std::collections::BTreeMap;

use nalgebra::Point3;
use schemars::{Schema, SchemaGenerator, json_schema};

use super::{Held, Skill, SkillContext, SkillError};
use crate::messages::{Expect, Motion, Waypoint};
use crate::parts::Part;
use crate::pddl::Name;

/// The entry of the table of skills.
pub(super) const PART: Part<dyn Skill> = Part {
    name: "pick",
    help: "takes an object from above, by its width",
    options: params,
    build: |_| Ok(Box::new(Pick)),
};

fn params(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": "object",
        "properties": {
            "object": { "type": "string", "description": "what is taken" },
        },
        "required": ["object"],
        "additionalProperties": false,
    })
}

/// Takes one object from above, by its width.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pick;

impl Skill for Pick {
    fn extend(
        &self,
        args: &BTreeMap<&str, Name>,
        context: &mut SkillContext<'_>,
        motion: &mut Motion,
    ) -> Result<(), SkillError> {
        let Some(object) = args.get("object") else { return Ok(()) };
        if context.held.is_some() {
            return Err(SkillError::HandFull { object: object.clone() });
        }
        let volume = context.volume(object)?;
        let width_m = volume.extent[0];
        let opening_m_max = context.config.opening_m_max;
        if width_m > opening_m_max {
            return Err(SkillError::TooWide { object: object.clone(), width_m, opening_m_max });
        }
        let below_top = context.config.grip_depth_m.min(volume.extent[2] / 2.0);
        let grip = Point3::new(volume.centre.x, volume.centre.y, volume.top_z() - below_top);
        context.opening_m = (width_m + context.config.jaw_clearance_m).min(opening_m_max);
        motion.waypoints.extend(context.approach(grip, Expect::Empty));
        context.opening_m = 0.0;
        let close = context.waypoint(grip, context.config.approach_speed_m_s, Expect::Holding);
        motion.waypoints.push(Waypoint { retractable: true, ..close });
        context.held = Some(Held {
            object: object.clone(),
            centre_above_tool_m: volume.centre.z - grip.z,
            extent: volume.extent,
        });
        motion.waypoints.push(context.retreat(Expect::Holding));
        Ok(())
    }
}
