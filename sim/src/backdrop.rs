//! The fixed part of the image: table, wall, boards and pegs with their own shadows.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::drawables::Drawable;
use crate::light::{self, Gamma};
use crate::raster::{Face, Target, Vertex};
use crate::shadow::ShadowMap;
use crate::view::{Tools, View};

/// Linear surface colour of the table: charcoal.
const TABLE: [f32; 3] = [0.098, 0.103, 0.113];
/// Linear colour of the backdrop at the table's far edge.
const HAZE: [f32; 3] = [0.105, 0.112, 0.126];
/// The table's edges and the wall's foot: x, y near, y far, in metres.
const TABLE_X_M: f64 = 6.0;
const TABLE_Y_M: [f64; 2] = [-8.0, 1.15];
const WALL_TOP_M: f64 = 6.0;
/// The backdrop darkens up to this height, in metres.
const WALL_FADE_M: f64 = 0.55;

/// Light on a fixed pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Lit {
    /// Light that no shadow takes away.
    ambient: f32,
    /// Light of the key light where nothing is in its way.
    direct: f32,
    /// Share of the haze colour.
    haze: f32,
    /// Index of the surface colour.
    surface: u16,
}

/// The image of everything fixed, and what is needed to put shadows on it.
#[derive(Debug, Clone)]
pub(crate) struct Backdrop {
    view: View,
    fixed: Vec<Drawable>,
    /// Height of the highest fixed thing, in metres.
    pub(crate) top_m: f64,
    pub(crate) shadow: ShadowMap,
    pub(crate) nearness: Vec<f32>,
    pub(crate) depth_m: Vec<f32>,
    pub(crate) ids: Vec<u16>,
    pub(crate) rgb: Vec<u8>,
    lit: Vec<Lit>,
    colours: Vec<[f32; 3]>,
}

impl Backdrop {
    /// Whether this is the fixed image of a view.
    pub(crate) fn is_for(&self, view: &View, fixed: &[Drawable]) -> bool {
        self.view == *view && self.fixed == fixed
    }

    /// Draws everything fixed.
    pub(crate) fn new(view: &View, fixed: &[Drawable], tools: &mut Tools<'_>) -> Self {
        let mut target = Target::new(view.width, view.height);
        let mut faces = Vec::new();
        let mut shadow = ShadowMap::new(view.shadow_size, &view.light.to_key);
        let mut colours = vec![TABLE, HAZE];
        let mut ids = vec![0, 0];
        for (k, [a, b, c, d]) in surroundings().into_iter().enumerate() {
            for triangle in [[a, b, c], [a, c, d]] {
                let corners = triangle.map(|(point, normal)| vertex(view, &point, &normal));
                target.draw(&view.intrinsics, &corners, k as u16, &mut faces);
            }
        }
        for drawable in fixed {
            let mesh = tools.meshes.get(&drawable.geometry);
            shadow.draw(mesh, &drawable.world_from_body);
            let pose: &Isometry3<f64> = &drawable.world_from_body;
            for triangle in &mesh.triangles {
                let corners = triangle.map(|k| {
                    let corner = &mesh.corners[k];
                    let point = pose.transform_point(&corner.position.into());
                    vertex(view, &point, &(pose.rotation * corner.normal))
                });
                target.draw(&view.intrinsics, &corners, colours.len() as u16, &mut faces);
            }
            colours.push(drawable.colour);
            ids.push(drawable.id);
        }
        let tops = fixed.iter().flat_map(Drawable::box_corners).map(|corner| corner.z);
        let mut backdrop = Self {
            view: view.clone(),
            fixed: fixed.to_vec(),
            top_m: tops.fold(0.0, f64::max),
            shadow,
            depth_m: vec![0.0; target.face.len()],
            ids: vec![0; target.face.len()],
            rgb: vec![0; 3 * target.face.len()],
            lit: vec![Lit::default(); target.face.len()],
            nearness: Vec::new(),
            colours,
        };
        backdrop.shade(&target, &faces, &ids, tools.gamma);
        backdrop.nearness = target.nearness;
        backdrop
    }

    /// Whether the key light reaches a pixel at all.
    pub(crate) fn takes_shadow(&self, pixel: usize) -> bool {
        self.lit[pixel].direct > 0.0
    }

    /// The colour of a pixel with a share of the key light.
    pub(crate) fn colour(&self, pixel: usize, share: f32, gamma: &Gamma) -> [u8; 3] {
        let lit = &self.lit[pixel];
        let light = lit.ambient + share * lit.direct;
        let surface = &self.colours[usize::from(lit.surface)];
        std::array::from_fn(|k| gamma.encode(surface[k] * light + HAZE[k] * lit.haze))
    }

    fn shade(&mut self, target: &Target, faces: &[Face], ids: &[u16], gamma: &Gamma) {
        let world_from_camera = self.view.world_from_camera;
        let k = self.view.intrinsics;
        let shadow_view = self.shadow.view(&world_from_camera, &k);
        for pixel in 0..target.face.len() {
            let Some(face_idx) = target.face[pixel].checked_sub(1) else { continue };
            let face = &faces[face_idx as usize];
            let (column, row) = (pixel % target.width, pixel / target.width);
            let (x, y) = (column as f32, row as f32);
            let depth = 1.0 / target.nearness[pixel];
            let normal = face.values.map(|plane| f64::from(plane.at(x, y) * depth));
            let ray = Vector3::new((column as f64 - k.cx) / k.fx, (row as f64 - k.cy) / k.fy, 1.0);
            let point = world_from_camera.transform_point(&Point3::from(ray * f64::from(depth)));
            let lit = self.light_on(face.drawable, &point, &Vector3::from(normal).normalize());
            self.lit[pixel] = lit;
            let share = if lit.direct > 0.0 {
                self.shadow.lit_share(shadow_view.at(x, y, depth))
            } else {
                1.0
            };
            let colour = self.colour(pixel, share, gamma);
            self.rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&colour);
            self.depth_m[pixel] = depth;
            self.ids[pixel] = ids[usize::from(face.drawable)];
        }
    }

    fn light_on(&self, surface: u16, point: &Point3<f64>, normal: &Vector3<f64>) -> Lit {
        let light = &self.view.light;
        let (ambient, direct) = (light.ambient(normal), light.direct(point, normal));
        let (keep, haze) = match surface {
            0 => {
                let haze = light::haze(point);
                (1.0 - haze, haze)
            }
            1 => {
                let up = (point.z / WALL_FADE_M).clamp(0.0, 1.0);
                (0.0, 1.0 - 0.72 * up * (2.0 - up))
            }
            _ => (1.0, 0.0),
        };
        Lit {
            ambient: (ambient * keep) as f32,
            direct: (direct * keep) as f32,
            haze: haze as f32,
            surface,
        }
    }
}

type SurfacePoint = (Point3<f64>, Vector3<f64>);

/// Table and wall, corners counter-clockwise as the camera sees them.
fn surroundings() -> [[SurfacePoint; 4]; 2] {
    let [near, far] = TABLE_Y_M;
    let up = |x: f64, y: f64| (Point3::new(x, y, 0.0), Vector3::z());
    let front = |x: f64, z: f64| (Point3::new(x, far, z), -Vector3::y());
    let x = TABLE_X_M;
    [
        [up(-x, near), up(x, near), up(x, far), up(-x, far)],
        [front(-x, 0.0), front(x, 0.0), front(x, WALL_TOP_M), front(-x, WALL_TOP_M)],
    ]
}

/// A corner in the camera frame that carries its world normal.
fn vertex(view: &View, point: &Point3<f64>, normal: &Vector3<f64>) -> Vertex {
    let position = view.world_from_camera.inverse_transform_point(point).coords;
    Vertex { position, values: [normal.x, normal.y, normal.z] }
}
