//! A skill of your own: `tap` touches an object from above. It is planned here for one perceived block, and its
//! waypoints are printed.
//!
//! ```console
//! cargo run --release --example own_skill
//! ```
//!
//! To let a domain use it, move it to `src/skills/tap.rs`, add a `PART` (see `src/skills/pick.rs`) and a line in
//! `SKILLS`; `skills.toml` of the domain then says which action it carries out.

#![expect(clippy::print_stdout, reason = "an example shows what it does")]

use std::collections::BTreeMap;

use groundloop::geometry::Aabb;
use groundloop::messages::{Expect, Motion, RobotState};
use groundloop::pddl::Name;
use groundloop::run::load_run;
use groundloop::scene::{SceneObject, Visibility};
use groundloop::skills::{Skill, SkillContext, SkillError};
use nalgebra::Point3;

/// How far above the object's upper face the tool stops, metres.
const GAP_M: f64 = 0.005;

#[derive(Debug)]
struct Tap;

impl Skill for Tap {
    fn extend(
        &self,
        args: &BTreeMap<&str, Name>,
        context: &mut SkillContext<'_>,
        motion: &mut Motion,
    ) -> Result<(), SkillError> {
        let Some(object) = args.get("object") else { return Ok(()) };
        let volume = context.volume(object)?;
        let above = Point3::new(volume.centre.x, volume.centre.y, volume.top_z() + GAP_M);
        motion.waypoints.extend(context.approach(above, Expect::Empty));
        motion.waypoints.push(context.retreat(Expect::Empty));
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = load_run("configs/blocksworld.toml".as_ref(), &[])?;
    let limits = config.robot.motion.ok_or("the run file has no [robot.motion]")?;
    let block = SceneObject {
        name: Name::new("red_block"),
        type_name: Name::new("block"),
        pixel_box: None,
        volume: Some(Aabb { centre: Point3::new(0.1, 0.0, 0.025), extent: [0.05; 3] }),
        score: 1.0,
        visibility: Visibility::Visible,
        seen_ns: 0,
    };
    let robot = RobotState {
        capture_ns: 0,
        position: Point3::new(0.0, 0.0, limits.travel_z_m),
        yaw_rad: 0.0,
        opening_m: 0.0,
        holding: false,
        command_id: None,
        phase: 0,
        answered: None,
    };
    let objects = [block];
    let mut context = SkillContext::new(&objects, &limits, &robot, None);
    let mut motion = Motion::default();
    Tap.extend(&BTreeMap::from([("object", Name::new("red_block"))]), &mut context, &mut motion)?;
    for waypoint in &motion.waypoints {
        let p = waypoint.position;
        println!("({:.2}, {:.2}, {:.3}) m at {:.1} m/s", p.x, p.y, p.z, waypoint.speed_m_s);
    }
    Ok(())
}
