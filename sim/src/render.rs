//! From a world to camera frames: colour, depth and ids in one pass.
//!
//! The camera and everything fixed stand still, so their part of the image, with its own shadows,
//! is computed once and kept. A frame then costs: drawing what moves over it, shading those pixels
//! and the fixed ones their shadows can reach, and noise. What is kept never changes the result: a
//! frame is a pure function of world, camera and seed.

use crate::backdrop::Backdrop;
use crate::camera::{CameraError, CameraSpec};
use crate::drawables::{self, Drawable};
use crate::light::Gamma;
use crate::mesh::{Mesh, Meshes};
use crate::noise::Noise;
use crate::raster::{self, Face, PixelBox, Target, Vertex};
use crate::shadow::{ShadowMap, ShadowView};
use crate::view::{Tools, View};
use crate::world::World;

/// A shadow's soft edge reaches this many pixels beyond its outline.
const SHADOW_MARGIN: usize = 8;

/// One image of the camera. Rows go from the top, pixels of a row from the left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue of each pixel, sRGB.
    pub rgb: Vec<u8>,
    /// Distance along the optical axis of each pixel, in metres; 0 where nothing is seen.
    pub depth_m: Vec<f32>,
    /// What each pixel shows: 1 + the body's place in the scene, [`crate::GRIPPER_ID`], or 0 for
    /// the table and the backdrop. For tests and labels: no real camera has it.
    pub ids: Vec<u16>,
}

/// Draws frames. It keeps what does not change between frames of one camera and scene.
#[derive(Debug, Clone)]
pub struct Renderer {
    gamma: Gamma,
    meshes: Meshes,
    coarse: Stage,
    fine: Stage,
    fine_frame: Frame,
    noise: Option<Noise>,
}

impl Renderer {
    /// A renderer that has seen nothing yet.
    pub fn new() -> Self {
        Self {
            gamma: Gamma::new(),
            meshes: Meshes::default(),
            coarse: Stage::default(),
            fine: Stage::default(),
            fine_frame: Frame::default(),
            noise: None,
        }
    }

    /// Draws one frame. `frame_seed` seeds the sensor noise.
    ///
    /// # Errors
    /// [`CameraError`] when the camera is not sound.
    pub fn render(
        &mut self,
        world: &World,
        camera: &CameraSpec,
        frame_seed: u64,
    ) -> Result<Frame, CameraError> {
        let mut frame = Frame::default();
        self.render_into(world, camera, frame_seed, &mut frame)?;
        Ok(frame)
    }

    /// Draws one frame into a used one, which saves the cost of new memory.
    ///
    /// # Errors
    /// [`CameraError`] when the camera is not sound; the frame is unchanged then.
    pub fn render_into(
        &mut self,
        world: &World,
        camera: &CameraSpec,
        frame_seed: u64,
        frame: &mut Frame,
    ) -> Result<(), CameraError> {
        camera.check()?;
        let [fixed, moving] = drawables::of(world);
        let mut tools = Tools { gamma: &self.gamma, meshes: &mut self.meshes };
        self.coarse.draw(&View::of(camera, 1), &fixed, &moving, &mut tools, frame);
        if camera.samples > 1 {
            let view = View::of(camera, camera.samples);
            self.fine.draw(&view, &fixed, &moving, &mut tools, &mut self.fine_frame);
            shrink(&self.fine_frame, camera.samples as usize, frame);
        }
        if self.noise.as_ref().is_none_or(|noise| !noise.is_for(&camera.noise)) {
            self.noise = Some(Noise::new(&camera.noise));
        }
        if let Some(noise) = &self.noise {
            noise.add(frame_seed, frame.width as usize, &mut frame.rgb, &mut frame.depth_m);
        }
        Ok(())
    }
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

/// Drawing at one resolution.
#[derive(Debug, Clone, Default)]
struct Stage {
    backdrop: Option<Backdrop>,
    shadow: Option<ShadowMap>,
    target: Target,
    faces: Vec<Face>,
}

impl Stage {
    /// Draws without noise.
    fn draw(
        &mut self,
        view: &View,
        fixed: &[Drawable],
        moving: &[Drawable],
        tools: &mut Tools<'_>,
        frame: &mut Frame,
    ) {
        let backdrop = match self.backdrop.take() {
            Some(kept) if kept.is_for(view, fixed) => kept,
            _ => {
                self.shadow = None;
                self.target = Target::new(view.width, view.height);
                Backdrop::new(view, fixed, tools)
            }
        };
        let shadow = self.shadow.get_or_insert_with(|| backdrop.shadow.clone());
        shadow.copy_from(&backdrop.shadow);
        self.target.nearness.copy_from_slice(&backdrop.nearness);
        self.target.face.fill(0);
        self.faces.clear();
        for (idx, drawable) in (0_u16..).zip(moving) {
            let mesh = tools.meshes.get(&drawable.geometry);
            if drawable.casts {
                shadow.draw(mesh, &drawable.world_from_body);
            }
            draw_lit(&mut self.target, &mut self.faces, view, mesh, (idx, drawable));
        }
        frame.width = view.width as u32;
        frame.height = view.height as u32;
        frame.rgb.clone_from(&backdrop.rgb);
        frame.depth_m.clone_from(&backdrop.depth_m);
        frame.ids.clone_from(&backdrop.ids);
        let shading = Shading {
            target: &self.target,
            faces: &self.faces,
            moving,
            backdrop: &backdrop,
            shadow_view: shadow.view(&view.world_from_camera, &view.intrinsics),
            shadow,
            gamma: tools.gamma,
        };
        shading.shade_moving(&seen_boxes(view, moving), frame);
        shading.shade_fixed(&shadow_boxes(view, moving, backdrop.top_m), frame);
        self.backdrop = Some(backdrop);
    }
}

/// Draws a mesh with light at its corners: ambient, direct and highlight.
fn draw_lit(
    target: &mut Target,
    faces: &mut Vec<Face>,
    view: &View,
    mesh: &Mesh,
    (idx, drawable): (u16, &Drawable),
) {
    let camera_from_world = view.world_from_camera.inverse();
    let eye = view.world_from_camera.translation.vector.into();
    let light = |corner: &crate::mesh::Corner| {
        let point = drawable.world_from_body.transform_point(&corner.position.into());
        let normal = drawable.world_from_body.rotation * corner.normal;
        let values = [
            view.light.ambient(&normal),
            view.light.direct(&point, &normal),
            view.light.highlight(&point, &normal, &eye, drawable.finish),
        ];
        Vertex { position: (camera_from_world * point).coords, values }
    };
    let corners: Vec<Vertex> = mesh.corners.iter().map(light).collect();
    for triangle in &mesh.triangles {
        target.draw(&view.intrinsics, &triangle.map(|k| corners[k]), idx, faces);
    }
}

/// Where moving things can be seen.
fn seen_boxes(view: &View, moving: &[Drawable]) -> Vec<PixelBox> {
    let camera_from_world = view.world_from_camera.inverse();
    let size = [view.width, view.height];
    let seen = |drawable: &Drawable| {
        raster::bounds(&camera_from_world, &view.intrinsics, size, drawable.box_corners())
    };
    moving.iter().map(seen).collect()
}

/// Where shadows of moving things can fall on fixed ones, which are up to `top_m` high.
fn shadow_boxes(view: &View, moving: &[Drawable], top_m: f64) -> Vec<PixelBox> {
    let camera_from_world = view.world_from_camera.inverse();
    let size = [view.width, view.height];
    let down = view.light.to_key / view.light.to_key.z;
    let thrown = |drawable: &Drawable| {
        let points = drawable.box_corners().flat_map(|corner| {
            [0.0, top_m.min(corner.z)].map(|height| corner - down * (corner.z - height))
        });
        let tight = raster::bounds(&camera_from_world, &view.intrinsics, size, points);
        tight.widened(SHADOW_MARGIN, size)
    };
    moving.iter().filter(|drawable| drawable.casts).map(thrown).collect()
}

/// Everything that is needed to colour pixels.
struct Shading<'a> {
    target: &'a Target,
    faces: &'a [Face],
    moving: &'a [Drawable],
    backdrop: &'a Backdrop,
    shadow: &'a ShadowMap,
    shadow_view: ShadowView,
    gamma: &'a Gamma,
}

impl Shading<'_> {
    /// Colours the pixels that show something that moves.
    fn shade_moving(&self, boxes: &[PixelBox], frame: &mut Frame) {
        let mut spans = Vec::new();
        for row in 0..self.target.height {
            raster::covered(boxes, row, &mut spans);
            let start = row * self.target.width;
            for column in spans.iter().flat_map(|span| span[0]..span[1]) {
                let pixel = start + column;
                let Some(face_idx) = self.target.face[pixel].checked_sub(1) else { continue };
                let face = &self.faces[face_idx as usize];
                let drawable = &self.moving[usize::from(face.drawable)];
                let (x, y) = (column as f32, row as f32);
                let depth = 1.0 / self.target.nearness[pixel];
                let [ambient, direct, highlight] =
                    [0, 1, 2].map(|value| face.values[value].at(x, y) * depth);
                let share = if direct > 0.004 {
                    self.shadow.lit_share(self.shadow_view.at(x, y, depth))
                } else {
                    1.0
                };
                let (light, shine) = (ambient + share * direct, share * highlight);
                let colour = drawable.colour.map(|c| self.gamma.encode(c * light + shine));
                frame.rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&colour);
                frame.depth_m[pixel] = depth;
                frame.ids[pixel] = drawable.id;
            }
        }
    }

    /// Colours again the fixed pixels that shadows of moving things may reach.
    fn shade_fixed(&self, boxes: &[PixelBox], frame: &mut Frame) {
        let mut spans = Vec::new();
        for row in 0..self.target.height {
            raster::covered(boxes, row, &mut spans);
            let start = row * self.target.width;
            for column in spans.iter().flat_map(|span| span[0]..span[1]) {
                let pixel = start + column;
                if self.target.face[pixel] != 0 || !self.backdrop.takes_shadow(pixel) {
                    continue;
                }
                let depth = self.backdrop.depth_m[pixel];
                let place = self.shadow_view.at(column as f32, row as f32, depth);
                let colour = self.backdrop.colour(pixel, self.shadow.lit_share(place), self.gamma);
                frame.rgb[3 * pixel..3 * pixel + 3].copy_from_slice(&colour);
            }
        }
    }
}

/// Averages `n` x `n` pixels into one.
fn shrink(fine: &Frame, n: usize, frame: &mut Frame) {
    let width = frame.width as usize;
    let rounding = n * n / 2;
    for (pixel, colour) in frame.rgb.chunks_exact_mut(3).enumerate() {
        let (column, row) = (pixel % width, pixel / width);
        for (channel, value) in colour.iter_mut().enumerate() {
            let line = |dy: usize| {
                let start = ((row * n + dy) * width * n + column * n) * 3 + channel;
                (0..n).map(move |dx| usize::from(fine.rgb[start + 3 * dx])).sum::<usize>()
            };
            *value = (((0..n).map(line).sum::<usize>() + rounding) / (n * n)) as u8;
        }
    }
}
