//! A deterministic table-top simulator: rigid bodies, a floating gripper, a software RGB-D camera
//! and faults on demand.
//!
//! ```text
//!  SceneSpec + WorldConfig + seed
//!               │
//!               ▼          GripperCommand ──▶ command      advance_to(time_ns)
//!             World ◀───── WorldFault ─────▶ apply_fault
//!               │
//!               ├──▶ gripper()   what the gripper's own sensors tell
//!               ├──▶ Renderer::render(camera, seed)   colour, depth and ids: a Frame
//!               └──▶ truth()     what stands on what, for scoring and labels only
//! ```
//!
//! The world frame has its origin on the table top, x to the right as the camera sees it, y away
//! from the camera, z up. Lengths are metres, angles radians unless a name says otherwise, times
//! nanoseconds of simulated time.
//!
//! Nothing here reads a clock, a file or the environment. Scene, config, seed and the sequence of
//! calls determine every bit of every pose, and world, camera and seed every byte of a frame. A
//! clone of a [`World`] is a snapshot: it has the same future as its original.
//!
//! ```
//! use groundloop_sim::{CameraSpec, GripperCommand, Renderer, SceneSpec, World, WorldConfig};
//! use nalgebra::Point3;
//!
//! let spec: SceneSpec = toml::from_str(r##"
//!     [[bodies]]
//!     name = "red_block"
//!     shape = { kind = "block", size_m = 0.05 }
//!     colour = "#d0282c"
//!
//!     [arrangement]
//!     kind = "fixed"
//!     stacks = [{ at_m = [0.1, 0.0], bodies = ["red_block"] }]
//! "##)?;
//! let tabletop: toml::Table = include_str!("../tests/data/tabletop.toml").parse()?;
//! let world: WorldConfig = tabletop["world"].clone().try_into()?;
//! let camera: CameraSpec = tabletop["camera"].clone().try_into()?;
//! let mut world = World::new(&spec, &world, 1)?;
//! let at_block = GripperCommand {
//!     position: Point3::new(0.1, 0.0, 0.025),
//!     yaw_rad: 0.0,
//!     opening_m: 0.07,
//!     speed_m_s: 1.0,
//! };
//! world.command(&at_block)?;
//! world.advance_to(1_500_000_000);
//! world.command(&GripperCommand { opening_m: 0.0, ..at_block })?;
//! world.advance_to(1_700_000_000);
//! assert!(world.gripper().holding);
//!
//! let frame = Renderer::new().render(&world, &camera, 1)?;
//! assert_eq!(frame.rgb.len(), 640 * 480 * 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod random;
mod convert;
mod solid;
mod shape;
mod scene_error;
mod material;
mod body_spec;
mod scene;
mod places;
mod layout;
mod config;
mod gripper;
mod grasp;
mod bodies;
mod push;
mod fingers;
mod hold;
mod world;
mod grip;
mod state;
mod truth;
mod faults;
mod camera;
mod mesh;
mod light;
mod raster;
mod shadow;
mod noise;
mod drawables;
mod view;
mod backdrop;
mod render;

pub use body_spec::{BodySpec, SCENERY};
pub use camera::{CameraError, CameraSpec, Intrinsics, LightSpec, Mount, NoiseSpec};
pub use config::{Grasp, STEPS_PER_SECOND, WorldConfig};
pub use drawables::GRIPPER_ID;
pub use faults::{FaultError, WorldFault};
pub use gripper::{
    ACCELERATION_MAX_M_S2, CommandError, GripperCommand, GripperState, OPENING_MAX_M,
    SPEED_MAX_M_S, WORKSPACE_M,
};
pub use material::{MATERIALS, Material};
pub use random::Random;
pub use render::{Frame, Renderer};
pub use scene::{Arrangement, FixedStack, FixedTower, SceneSpec};
pub use scene_error::{BODIES_MAX, SceneError};
pub use shape::{Colour, Shape};
pub use solid::ShapePart;
pub use truth::{BodyTruth, Truth};
pub use world::{BodyView, World};
