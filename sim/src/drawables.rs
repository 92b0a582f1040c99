//! What the camera sees of a world, split into what never moves and what does.

use nalgebra::{Isometry3, Translation3, Vector3};

use crate::gripper;
use crate::light::{self, Finish};
use crate::mesh::Geometry;
use crate::world::World;

/// Image id of the gripper.
pub const GRIPPER_ID: u16 = u16::MAX;

/// Parts of the gripper higher than this throw no shadow, as under a lamp as large as they are.
const SHADOW_HEIGHT_MAX_M: f64 = 0.4;

/// One thing to draw.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drawable {
    pub(crate) geometry: Geometry,
    pub(crate) world_from_body: Isometry3<f64>,
    /// Linear surface colour.
    pub(crate) colour: [f32; 3],
    /// How it reflects the key light.
    pub(crate) finish: Finish,
    /// Image id.
    pub(crate) id: u16,
    /// Whether it throws a shadow.
    pub(crate) casts: bool,
}

impl Drawable {
    /// The corners of a box around it: metres, world frame.
    pub(crate) fn box_corners(&self) -> impl Iterator<Item = Vector3<f64>> {
        let size = match &self.geometry {
            Geometry::Body(shape) => shape.size_m(),
            Geometry::Link(size) => *size,
        };
        let pose = self.world_from_body;
        (0..8).map(move |k: u32| {
            let sign = |axis: u32| if k >> axis & 1 == 1 { 0.5 } else { -0.5 };
            let corner = size.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
            pose * corner + pose.translation.vector
        })
    }
}

/// The fixed and the moving things of a world. Ids of bodies are 1 + their place in the scene.
pub(crate) fn of(world: &World) -> [Vec<Drawable>; 2] {
    let (mut fixed, mut moving) = (Vec::new(), Vec::new());
    let bodies = (1_u16..).zip(world.bodies()).zip(&world.bodies);
    for ((id, body), made) in bodies.filter(|((_, body), _)| !body.is_out) {
        let drawable = Drawable {
            geometry: Geometry::Body(body.spec.shape.clone()),
            world_from_body: body.world_from_body,
            colour: body.spec.colour.0.map(light::linear),
            finish: Finish::of(made.material.as_ref()),
            id,
            casts: true,
        };
        let list = if body.spec.is_fixed() { &mut fixed } else { &mut moving };
        list.push(drawable);
    }
    let world_from_gripper = world.gripper.pose();
    for link in gripper::links(world.gripper.opening_m) {
        let grey = if link.dark { [0.035, 0.038, 0.045] } else { [0.42, 0.44, 0.47] };
        let world_from_body = world_from_gripper * Translation3::from(link.middle);
        moving.push(Drawable {
            geometry: Geometry::Link(link.size),
            world_from_body,
            colour: grey,
            finish: Finish::of(None),
            id: GRIPPER_ID,
            casts: world_from_body.translation.z < SHADOW_HEIGHT_MAX_M,
        });
    }
    [fixed, moving]
}
