//! Draws what was understood onto the frame it was understood from: boxes, names, the recognised
//! graph, and beside them the goal and the plan. Pure and deterministic.

mod area;
mod canvas;
mod edges;
mod labels;
mod palette;
mod panel;
mod text;

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use image::{RgbImage, imageops};
use thiserror::Error;

use crate::geometry::PixelBox;
use crate::logic::Truth;
use crate::pddl::Name;
use crate::scene::Visibility;
use area::Area;
use canvas::{Canvas, Line};
use text::Fonts;

/// The frame is scaled to fit this, in pixels of the picture.
const FRAME_SIZE_MAX: (u32, u32) = (1280, 960);
/// The frame's part of the picture has at least this size.
const FRAME_SIZE_MIN: (u32, u32) = (640, 720);
/// Most enlargement of a frame.
const SCALE_MAX: f64 = 4.0;

/// One object to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectMark {
    /// The object's name, which stands at its box.
    pub name: Name,
    /// Where it is in the frame, in the frame's pixels; an object without a box is not drawn.
    pub pixel_box: Option<PixelBox>,
    /// Its colour as sRGB, where it has one.
    pub colour: Option<[u8; 3]>,
    /// Hidden objects are dashed, held ones stand out.
    pub visibility: Visibility,
    /// Unary facts, shown small below the name.
    pub facts: Vec<String>,
}

/// One edge of the scene graph, from the first argument to the second.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EdgeMark {
    /// The label.
    pub predicate: Name,
    /// The first argument.
    pub from: Name,
    /// The second argument.
    pub to: Name,
    /// What it stands for.
    pub kind: EdgeKind,
}

/// What an edge stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeKind {
    /// A fact that was recognised; drawn in its predicate's colour.
    Seen,
    /// A fact that was recognised and does not hold; red.
    Wrong,
    /// A fact that holds and was not recognised; grey and dashed.
    Missing,
}

/// One line about what was not recognised as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// The fact or the anomaly as text.
    pub text: String,
    /// What is the matter with it.
    pub kind: RemarkKind,
}

/// What is the matter with a fact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RemarkKind {
    /// It was recognised and does not hold.
    Wrong,
    /// It holds and was not recognised.
    Missing,
    /// It is not known, or cannot be explained.
    Anomaly,
}

/// One part of the goal and whether it holds now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoalMark {
    /// The condition as text.
    pub text: String,
    /// Its truth in the state that is drawn.
    pub holds: Truth,
}

/// Everything that is drawn. Edges whose ends have no box are left out; which predicates are shown
/// is the caller's choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureInput<'a> {
    /// The part of the frame to show, in the frame's pixels; `None` for all of it.
    /// [`view_around`] zooms in on the objects.
    pub view: Option<PixelBox>,
    /// Headline of the panel, for example the domain.
    pub title: &'a str,
    /// The instruction in the user's words; may be empty.
    pub instruction: &'a str,
    /// Short facts about the moment: ("cycle", "12"), ("time", "3.4 s"), ("status", "running").
    pub caption: &'a [(String, String)],
    /// The goal, part by part.
    pub goal: &'a [GoalMark],
    /// The plan's steps.
    pub plan: &'a [String],
    /// The step that runs now; those before it are done.
    pub step_idx: Option<usize>,
    /// Where the true state is known: what differs from it.
    pub remarks: &'a [Remark],
    /// The vertices of the graph.
    pub objects: &'a [ObjectMark],
    /// The edges of the graph.
    pub edges: &'a [EdgeMark],
}

/// A picture cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PictureError {
    /// The font that is built in does not load.
    #[error("the built-in font {font} cannot be read")]
    Font {
        /// The object's name, which stands at its box.
        font: &'static str,
    },
    /// There is no memory for the picture.
    #[error("no picture of {width} x {height} pixels can be made")]
    Size {
        /// Its columns.
        width: u32,
        /// Its rows.
        height: u32,
    },
}

/// Draws the frame with everything in `input`; the frame comes first, the panel to its right.
///
/// The frame keeps its shape and is scaled to fit 1280 by 960 pixels, so that text has the same
/// size in every picture. Boxes outside the frame are cut at its edge.
///
/// # Errors
/// [`PictureError`] when the built-in font is broken or there is no memory for the picture.
pub fn draw(frame: &RgbImage, input: &PictureInput<'_>) -> Result<RgbImage, PictureError> {
    let fonts = Fonts::load()?;
    let (shown, origin) = cut_to(frame, input.view);
    let (scaled, scale) = fit(&shown);
    let (frame_width, frame_height) =
        (scaled.width().max(FRAME_SIZE_MIN.0), scaled.height().max(FRAME_SIZE_MIN.1));
    let left = (frame_width - scaled.width()) / 2;
    let top = (frame_height - scaled.height()) / 2;
    let mut canvas = Canvas::new(frame_width + panel::WIDTH, frame_height, palette::BACKDROP)?;
    canvas.paste(&scaled, left, top);

    let shown = Area::new(0.0, 0.0, frame_width as f32, frame_height as f32);
    let visible = Area::new(left as f32, top as f32, scaled.width() as f32, scaled.height() as f32);
    let items: Vec<Item<'_>> = input
        .objects
        .iter()
        .filter_map(|mark| {
            Some(Item { mark, area: to_canvas(mark.pixel_box?, origin, scale, &visible)? })
        })
        .collect();
    let curves = edges::layout(&items, input.edges);
    let labels = labels::layout(&items, &curves, &fonts, &shown);

    for item in &items {
        draw_box(&mut canvas, item);
    }
    labels::draw_leaders(&mut canvas, &items, &labels);
    let taken = labels.iter().map(|label| label.area).collect();
    edges::draw(&mut canvas, &curves, taken, &fonts);
    labels::draw(&mut canvas, &items, &labels, &fonts);
    panel::draw(&mut canvas, input, &fonts, frame_width as f32);
    Ok(canvas.finish())
}

/// A view of the frame's shape around all boxes, with room for labels; never larger than the frame
/// and never less than half as wide.
pub fn view_around(
    objects: &[ObjectMark],
    frame_width: u32,
    frame_height: u32,
) -> Option<PixelBox> {
    let (width, height) = (f64::from(frame_width), f64::from(frame_height));
    let boxes = objects.iter().filter_map(|mark| mark.pixel_box).filter(PixelBox::is_valid);
    let all = boxes.reduce(|a, b| PixelBox {
        x1: a.x1.min(b.x1),
        y1: a.y1.min(b.y1),
        x2: a.x2.max(b.x2),
        y2: a.y2.max(b.y2),
    })?;
    // Labels need a part of the view at each side.
    let wanted = (all.width() / width).max(all.height() / height) + 0.3;
    let part = wanted.clamp(0.5, 1.0);
    let (cx, cy) = all.centre();
    let x1 = (cx - part * width / 2.0).clamp(0.0, width * (1.0 - part));
    let y1 = (cy - part * height / 2.0).clamp(0.0, height * (1.0 - part));
    Some(PixelBox { x1, y1, x2: x1 + part * width, y2: y1 + part * height })
}

/// The part of the frame inside the view, and the view's origin in the frame.
fn cut_to(frame: &RgbImage, view: Option<PixelBox>) -> (Cow<'_, RgbImage>, (f64, f64)) {
    let whole = [0.0, 0.0, f64::from(frame.width()), f64::from(frame.height())];
    let inside = view.map(|view| view.intersection(&PixelBox::from(whole)));
    let Some(view) = inside.filter(PixelBox::is_valid) else {
        return (Cow::Borrowed(frame), (0.0, 0.0));
    };
    let (x, y) = (view.x1.floor(), view.y1.floor());
    let (width, height) = ((view.x2.ceil() - x) as u32, (view.y2.ceil() - y) as u32);
    let cut = imageops::crop_imm(frame, x as u32, y as u32, width, height).to_image();
    (Cow::Owned(cut), (x, y))
}

/// An object with its box in pixels of the picture.
#[derive(Debug)]
struct Item<'a> {
    mark: &'a ObjectMark,
    area: Area,
}

impl Item<'_> {
    fn colour(&self) -> [u8; 3] {
        self.mark.colour.unwrap_or(palette::NEUTRAL)
    }
}

/// The frame scaled to fit, and the factor.
fn fit(frame: &RgbImage) -> (RgbImage, f64) {
    let (width, height) = frame.dimensions();
    if width == 0 || height == 0 {
        return (RgbImage::new(0, 0), 1.0);
    }
    let scale = (f64::from(FRAME_SIZE_MAX.0) / f64::from(width))
        .min(f64::from(FRAME_SIZE_MAX.1) / f64::from(height))
        .min(SCALE_MAX);
    let scaled = |length: u32| ((f64::from(length) * scale).round() as u32).max(1);
    let filter = imageops::FilterType::CatmullRom;
    (imageops::resize(frame, scaled(width), scaled(height), filter), scale)
}

/// A box in pixels of the picture, cut at the frame's edge; `None` when nothing of it is inside.
fn to_canvas(pixel_box: PixelBox, origin: (f64, f64), scale: f64, frame: &Area) -> Option<Area> {
    if !pixel_box.is_valid() {
        return None;
    }
    let column = |x: f64| (((x - origin.0) * scale) as f32 + frame.x1).clamp(frame.x1, frame.x2);
    let row = |y: f64| (((y - origin.1) * scale) as f32 + frame.y1).clamp(frame.y1, frame.y2);
    let area = Area {
        x1: column(pixel_box.x1),
        y1: row(pixel_box.y1),
        x2: column(pixel_box.x2),
        y2: row(pixel_box.y2),
    };
    (area.width() >= 1.0 && area.height() >= 1.0).then_some(area)
}

fn draw_box(canvas: &mut Canvas, item: &Item<'_>) {
    let colour = palette::lighten(item.colour());
    let (width, dash) = match item.mark.visibility {
        Visibility::Visible | Visibility::Implied => (3.0, None),
        Visibility::Hidden => (3.0, Some([11.0, 9.0])),
        Visibility::Held => (5.0, None),
    };
    let area = item.area.grown(1.5);
    let shade = Line { width: width + 2.5, colour: palette::SHADE, alpha: 0.45, dash };
    canvas.outline(&area, 6.0, &shade);
    // Objects without a colour of their own, such as pegs, stay in the background.
    let alpha = if item.mark.colour.is_some() { 0.95 } else { 0.65 };
    canvas.outline(&area, 6.0, &Line { width, colour, alpha, dash });
}
