//! What skills look at: perceived objects, the robot, and its limits.

use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::SkillError;
use crate::geometry::Aabb;
use crate::messages::{Expect, RobotState, Waypoint};
use crate::pddl::Name;
use crate::scene::{SceneObject, Visibility};

/// How the robot moves. Lengths in metres, in the world frame.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionConfig {
    /// Height of the tool between skills: above everything, and outside the picture.
    pub travel_z_m: f64,
    /// Speed of free motion, metres per second.
    pub speed_m_s: f64,
    /// Speed near objects, metres per second.
    pub approach_speed_m_s: f64,
    /// How far before its goal a motion slows down.
    pub approach_m: f64,
    /// How much wider than the object the jaws open.
    pub jaw_clearance_m: f64,
    /// How far the jaws can open.
    pub opening_m_max: f64,
    /// How far below an object's upper face the tool centre grips, or at its middle if that is
    /// higher.
    pub grip_depth_m: f64,
    /// How far above its goal an object is let go.
    pub release_gap_m: f64,
    /// Free space wanted around an object that is put on the table.
    pub table_clearance_m: f64,
    /// Height of the table.
    pub table_z_m: f64,
    /// Where objects are put on the table: least and greatest x, in full view.
    pub place_x_m: [f64; 2],
    /// The row in which objects are put on the table: y. Where it is full, as near to it as there is room within
    /// reach.
    pub place_y_m: f64,
    /// Reach along x: least and greatest.
    pub reach_x_m: [f64; 2],
    /// Reach along y: least and greatest.
    pub reach_y_m: [f64; 2],
    /// Tool positions [x, y, z] that free the camera's view, or show another one; tried in order while
    /// something is not known.
    pub view_poses: Vec<[f64; 3]>,
}

impl MotionConfig {
    /// Whether the tool may go to a position.
    pub fn reaches(&self, [x, y, z]: [f64; 3]) -> bool {
        self.bound_beyond([x, y]).is_none() && z > self.table_z_m && z.is_finite()
    }

    /// The bound of the workspace that a place is beyond, with its key.
    pub fn bound_beyond(&self, [x, y]: [f64; 2]) -> Option<(&'static str, [f64; 2])> {
        let bounds = [("reach_x_m", self.reach_x_m, x), ("reach_y_m", self.reach_y_m, y)];
        let beyond = bounds.iter().find(|(_, [low, high], v)| !(low <= v && v <= high));
        beyond.map(|(key, span_m, _)| (*key, *span_m))
    }
}

/// What is in the gripper, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Its name in the scene.
    pub object: Name,
    /// Height of the object's middle above the tool centre (negative = below).
    pub centre_above_tool_m: f64,
    /// Its edge lengths.
    pub extent: [f64; 3],
}

impl Held {
    /// What the scene says is in the gripper, gripped as this robot grips: for an episode that
    /// begins with a full hand.
    pub fn found(objects: &[SceneObject], config: &MotionConfig) -> Option<Self> {
        let object = objects.iter().find(|object| object.visibility == Visibility::Held)?;
        let extent = object.volume?.extent;
        let centre_above_tool_m = config.grip_depth_m.min(extent[2] / 2.0) - extent[2] / 2.0;
        Some(Self { object: object.name.clone(), centre_above_tool_m, extent })
    }
}

/// What a skill sees; skills of one action run through it one after the other.
#[derive(Debug, Clone)]
pub struct SkillContext<'a> {
    /// The perceived objects.
    pub objects: &'a [SceneObject],
    /// The robot's limits.
    pub config: &'a MotionConfig,
    /// What is in the gripper at this point of the motion.
    pub held: Option<Held>,
    /// Where the tool is at this point of the motion.
    pub tool: Point3<f64>,
    /// The jaws at this point of the motion, metres.
    pub opening_m: f64,
}

impl<'a> SkillContext<'a> {
    /// The context in which an action begins.
    pub fn new(
        objects: &'a [SceneObject],
        config: &'a MotionConfig,
        robot: &RobotState,
        held: Option<Held>,
    ) -> Self {
        let (tool, opening_m) = (robot.position, robot.opening_m);
        Self { objects, config, held, tool, opening_m }
    }

    /// Where an object was last seen in the world.
    ///
    /// # Errors
    /// [`SkillError::Unseen`], [`SkillError::NoVolume`], [`SkillError::OutOfReach`].
    pub fn volume(&self, name: &Name) -> Result<Aabb, SkillError> {
        let object = self.objects.iter().find(|o| o.name == *name);
        let object = object.ok_or_else(|| SkillError::Unseen { object: name.clone() })?;
        let volume = object.volume.ok_or_else(|| SkillError::NoVolume { object: name.clone() })?;
        let (x, y) = (volume.centre.x, volume.centre.y);
        if let Some((key, span_m)) = self.config.bound_beyond([x, y]) {
            return Err(SkillError::OutOfReach { object: name.clone(), key, span_m, x, y });
        }
        Ok(volume)
    }

    /// Volumes of everything that stands somewhere, except the named ones and what is held.
    pub fn others<'b>(
        &'b self,
        except: &'b [&'b Name],
    ) -> impl Iterator<Item = (&'b SceneObject, Aabb)> {
        self.objects.iter().filter_map(move |object| {
            let stands = object.visibility != Visibility::Held
                && !except.contains(&&object.name)
                && self.held.as_ref().is_none_or(|held| held.object != object.name);
            object.volume.filter(|_| stands).map(|volume| (object, volume))
        })
    }

    /// A waypoint at `position`, keeping the jaws as they are.
    pub fn waypoint(&mut self, position: Point3<f64>, speed_m_s: f64, expect: Expect) -> Waypoint {
        self.tool = position;
        let opening_m = self.opening_m;
        Waypoint { position, yaw_rad: 0.0, opening_m, speed_m_s, expect, retractable: false }
    }

    /// The waypoints from here to `goal`: up, across, down, and the last bit slowly.
    pub fn approach(&mut self, goal: Point3<f64>, expect: Expect) -> [Waypoint; 4] {
        let config = self.config;
        let up = config.travel_z_m.max(goal.z + config.approach_m);
        let points = [
            (Point3::new(self.tool.x, self.tool.y, up), config.speed_m_s),
            (Point3::new(goal.x, goal.y, up), config.speed_m_s),
            (Point3::new(goal.x, goal.y, goal.z + config.approach_m), config.speed_m_s),
            (goal, config.approach_speed_m_s),
        ];
        points.map(|(point, speed)| {
            let waypoint = self.waypoint(point, speed, expect);
            Waypoint { retractable: true, ..waypoint }
        })
    }

    /// The waypoint that goes straight up to travel height.
    pub fn retreat(&mut self, expect: Expect) -> Waypoint {
        let (x, y) = (self.tool.x, self.tool.y);
        let up = Point3::new(x, y, self.config.travel_z_m.max(self.tool.z));
        self.waypoint(up, self.config.speed_m_s, expect)
    }
}
