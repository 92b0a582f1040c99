//! What the labelled examples show beside their objects: the colours of ground and background, and
//! the rows in which objects stand on the ground.

use super::bitmask::BitMask;
use super::lab::{Lab, Shade};
use super::light::{Light, Normalised, likeness};
use super::median::{median, median_colour};
use super::palette::middle;
use super::regions::regions;
use crate::geometry::{MaskRun, PixelBox};
use crate::perception::model::ObjectBox;
use crate::perception::{ImageView, Unexplained};

/// Bits kept of each channel.
const BITS: u32 = 5;
/// The number of colours that are told apart.
const CELLS: usize = 1 << (3 * BITS);
/// Two rows or columns are the same when they differ by at most this share of an object's side.
const TOUCH_SHARE: f64 = 0.35;
/// Around objects there are shadows, reflections and blurred edges: this share of their short side.
const RIM_SHARE: f64 = 0.2;
/// What is thinner than this share of a usual object's short side is no thing.
const THICKNESS_SHARE: f64 = 0.3;
/// And so are specks whose longer side is below this share.
const LENGTH_SHARE: f64 = 0.7;
/// An object can be behind what has at least this share of its width and of its height.
const HIDDEN_SHARE: f64 = 0.6;
/// A colour that fewer pixels have, as a share, is no colour of a thing.
const COUNT_SHARE_MIN: f64 = 5e-5;
/// About how many grid cells the least thickness has.
const CELLS_PER_THICKNESS: f64 = 3.0;
/// A frame is at most so many times as bright or as dark as the example for its ground to be the same.
const BRIGHTNESS_RATIO_MAX: f64 = 2.5;
/// Within this of 1, a frame is as bright as the example.
const SAME_BRIGHTNESS_MAX: f64 = 0.1;
/// Bright and dark parts of a picture may have changed by factors this far apart.
const GAIN_SPREAD: f64 = 0.15;
/// Shadows leave so much of a value.
const SHADOWS: [f64; 3] = [0.8, 0.63, 0.5];
/// Values from this on may be cut off,
const CUT_OFF: u8 = 250;
/// and were up to so many times as bright.
const CUT_OFF_BY: f64 = 1.5;
/// Objects whose lower edge is farther from the ground's rows than so many times their height, and
/// that rest on nothing, are outside.
const OUTSIDE_HEIGHTS_MIN: f64 = 2.0;

/// A thing goes on in an object of its own colour (in Lab units),
const SAME_COLOUR_MAX: f32 = 12.0;
/// if it is at least so many times as large.
const SAME_AREA_MIN: f64 = 1.0;

/// What labelled pictures show beside their objects.
#[derive(Debug, Clone, Default)]
pub(super) struct Scenery {
    lights: Vec<Light>,
    /// Colours beside the objects.
    beside: Colours,
    /// Shades of the objects.
    shades: Vec<Shade>,
    /// Width and height of the objects, as shares of their image's height.
    sizes: Vec<[f64; 2]>,
    /// Where lower edges of objects that rest on no other lie, likewise.
    ground_rows: Option<[f64; 2]>,
}

impl Scenery {
    /// Adds a labelled picture.
    pub(super) fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) {
        self.lights.push(Light::of(image));
        let boxes: Vec<PixelBox> = objects.iter().map(|object| object.pixel_box).collect();
        for y in 0..image.height() {
            for (x, rgb) in image.row(y).as_chunks::<3>().0.iter().enumerate() {
                let at = (x as f64, y as f64);
                if !boxes.iter().any(|b| contains(b, at)) {
                    self.beside.see(*rgb);
                }
            }
        }
        self.beside.settle();
        let shades =
            boxes.iter().filter_map(|b| median_colour(&middle(image, b).collect::<Vec<_>>()));
        self.shades.extend(shades.map(Shade::of));
        let height = image.height() as f64;
        for (i, b) in boxes.iter().enumerate() {
            self.sizes.push([b.width() / height, b.height() / height]);
            let others = boxes.iter().enumerate().filter(|(j, _)| *j != i);
            if !others.clone().any(|(_, other)| rests_on(b, other)) {
                let row = b.y2 / height;
                let [low, high] = self.ground_rows.unwrap_or([row, row]);
                self.ground_rows = Some([low.min(row), high.max(row)]);
            }
        }
    }

    /// The light of the labelled pictures.
    pub(super) fn light(&self) -> Option<Light> {
        Light::mean(&self.lights)
    }

    /// Whether nothing was learnt.
    pub(super) fn is_empty(&self) -> bool {
        self.sizes.is_empty()
    }

    /// How much a colour is like one of the objects', in any brightness: from 0 to 1.
    pub(super) fn likeness(&self, rgb: [u8; 3]) -> f64 {
        likeness(self.shades.iter().copied(), rgb)
    }

    /// The objects that stand elsewhere than the others: on nothing, and far from the rows in which
    /// objects stand. The camera may look up or down a little more than in the example: of all
    /// places for the rows that one counts in which most objects stand, and of those the nearest.
    pub(super) fn outside(&self, boxes: &[PixelBox], image_height: usize) -> Vec<usize> {
        let Some(rows) = self.ground_rows else { return Vec::new() };
        let [first, last] = rows.map(|row| row * image_height as f64);
        let shift = |b: &PixelBox| (b.y2 - last).max(0.0) + (b.y2 - first).min(0.0);
        let shifts = boxes.iter().map(shift).chain([0.0]);
        let standing = |shift: f64| standing(boxes, [first + shift, last + shift]);
        let rated = shifts.map(|shift| (standing(shift), shift.abs()));
        let count = |stand: &[bool]| stand.iter().filter(|stands| **stands).count();
        let best = rated.reduce(|best, next| {
            let (n_best, n_next) = (count(&best.0), count(&next.0));
            let is_better = n_next > n_best || (n_next == n_best && next.1 < best.1);
            if is_better { next } else { best }
        });
        let stand = best.map(|(stand, _)| stand).unwrap_or_default();
        stand.iter().enumerate().filter(|(_, stands)| !**stands).map(|(i, _)| i).collect()
    }

    /// Things in a frame that are neither objects nor of a colour that the labelled pictures show
    /// beside theirs. `explained` are the places of all that is known, the first of them objects.
    pub(super) fn unexplained(
        &self,
        frame: &Normalised<'_>,
        (objects, others): (&[PixelBox], &[PixelBox]),
    ) -> Vec<Unexplained> {
        let (width, height) = (frame.image.width(), frame.image.height());
        let short_sides = self.sizes.iter().map(|[width, height]| width.min(*height)).collect();
        let usual = median(short_sides, f64::total_cmp).unwrap_or(0.0) * height as f64;
        let step = (THICKNESS_SHARE * usual / CELLS_PER_THICKNESS).floor().max(1.0);
        let grid = [width, height].map(|side| (side as f64 / step) as usize);
        let with_rim = |b: &PixelBox| grown(b, RIM_SHARE * b.width().min(b.height()));
        let known: Vec<PixelBox> = objects.iter().chain(others).map(with_rim).collect();
        let mask = self.mask(frame, (grid, step), &known);
        let thickness = ((THICKNESS_SHARE * usual / step).round() as usize).max(1);
        let things = regions(&mask.open(thickness, thickness)).into_iter();
        let is_long = |b: &PixelBox| b.width().max(b.height()) >= LENGTH_SHARE * usual;
        let scaled = |b: PixelBox| PixelBox::from([b.x1, b.y1, b.x2, b.y2].map(|v| v * step));
        let found = things.map(|thing| (scaled(thing.pixel_box()), thing));
        let found = found.filter(|(place, _)| is_long(place)).map(|(place, thing)| {
            let stripe = |run: &MaskRun| {
                let edges = [run.x_start, run.y, run.x_end, run.y + 1].map(f64::from);
                scaled(PixelBox::from(edges))
            };
            let stripes = thing.runs.iter().map(stripe).collect();
            let may_hide = self.may_hide(&place, height as f64);
            Unexplained { place, stripes, may_hide }
        });
        found.collect()
    }

    /// The objects that are parts of unexplained things: next to a larger one of their own colour.
    pub(super) fn parts_of(
        frame: &Normalised<'_>,
        things: &[Unexplained],
        objects: &[PixelBox],
    ) -> Vec<usize> {
        let colours: Vec<(f64, Option<Lab>)> = things
            .iter()
            .map(|thing| {
                let area = thing.stripes.iter().map(PixelBox::area).sum();
                let pixel = |stripe: &PixelBox| {
                    let (x, y) = stripe.centre();
                    frame.image.pixel(x as usize, y as usize)
                };
                let colours: Vec<[u8; 3]> = thing.stripes.iter().filter_map(pixel).collect();
                (area, median_colour(&colours))
            })
            .collect();
        let is_part = |b: &PixelBox| {
            let own: Vec<[u8; 3]> = middle(&frame.image, b).collect();
            let Some(own) = median_colour(&own) else { return false };
            things.iter().zip(&colours).any(|(thing, (area, colour))| {
                thing.is_near(b)
                    && *area >= SAME_AREA_MIN * b.area()
                    && colour.is_some_and(|colour| colour.distance(own) < SAME_COLOUR_MAX)
            })
        };
        objects.iter().enumerate().filter(|(_, b)| is_part(b)).map(|(i, _)| i).collect()
    }

    /// Whether a place is large enough for one of the labelled objects.
    fn may_hide(&self, place: &PixelBox, image_height: f64) -> bool {
        self.sizes.iter().any(|[width, height]| {
            place.width() >= HIDDEN_SHARE * width * image_height
                && place.height() >= HIDDEN_SHARE * height * image_height
        })
    }

    /// The grid cells of unexplained colour.
    fn mask(
        &self,
        frame: &Normalised<'_>,
        ([columns, rows], step): ([usize; 2], f64),
        known: &[PixelBox],
    ) -> BitMask {
        let gain = self.gain(frame);
        let is_ground = frame.ground.is_lit_or_shaded();
        let mut explained: Vec<Option<bool>> = vec![None; CELLS];
        let mut mask = BitMask::new(columns, rows);
        for row in 0..rows {
            let y = row as f64 * step;
            let in_row: Vec<&PixelBox> = known.iter().filter(|b| b.y1 <= y && y < b.y2).collect();
            let pixels = frame.image.row(y as usize).as_chunks::<3>().0;
            for column in 0..columns {
                let x = column as f64 * step;
                let Some(rgb) = pixels.get(x as usize) else { break };
                let is_explained = *explained[cell(*rgb)].get_or_insert_with(|| {
                    is_ground(Lab::of(*rgb))
                        || tones(*rgb, gain).any(|rgb| self.beside.contain(rgb))
                });
                if !is_explained && !in_row.iter().any(|b| b.x1 <= x && x < b.x2) {
                    mask.row_mut(row)[column / 64] |= 1 << (column % 64);
                }
            }
        }
        mask
    }

    /// What brings a frame to the brightness of the labelled pictures; 1 for another ground.
    fn gain(&self, frame: &Normalised<'_>) -> f64 {
        let Some(light) = self.light() else { return 1.0 };
        let sum = |rgb: [f64; 3]| rgb.iter().sum::<f64>() + 1.0;
        let gain = sum(light.ground()) / sum(frame.ground.rgb.map(f64::from));
        let is_same = (1.0 / BRIGHTNESS_RATIO_MAX..=BRIGHTNESS_RATIO_MAX).contains(&gain);
        if is_same { gain } else { 1.0 }
    }
}

/// A set of colours.
#[derive(Debug, Clone)]
struct Colours {
    /// How many pixels have a colour.
    counts: Vec<u32>,
    /// Colours that are more than what lies between two others at an edge, and their neighbours.
    near: Vec<bool>,
}

impl Default for Colours {
    fn default() -> Self {
        Self { counts: vec![0; CELLS], near: vec![false; CELLS] }
    }
}

impl Colours {
    fn see(&mut self, rgb: [u8; 3]) {
        self.counts[cell(rgb)] += 1;
    }

    /// Takes in what was seen.
    fn settle(&mut self) {
        let n: u32 = self.counts.iter().sum();
        let count_min = (f64::from(n) * COUNT_SHARE_MIN).ceil().max(1.0) as u32;
        let side = (1_usize << BITS) - 1;
        let near = |v: usize| v.saturating_sub(1)..=(v + 1).min(side);
        for at in (0..CELLS).filter(|at| self.counts[*at] >= count_min) {
            let [r, g, b] = [at >> (2 * BITS), at >> BITS & side, at & side].map(near);
            for (r, g) in r.flat_map(|r| g.clone().map(move |g| (r, g))) {
                for b in b.clone() {
                    self.near[r << (2 * BITS) | g << BITS | b] = true;
                }
            }
        }
    }

    fn contain(&self, rgb: [u8; 3]) -> bool {
        self.near[cell(rgb)]
    }
}

fn cell(rgb: [u8; 3]) -> usize {
    let [r, g, b] = rgb.map(|v| usize::from(v >> (8 - BITS)));
    r << (2 * BITS) | g << BITS | b
}

/// Whether a place lies in a box.
pub(super) fn contains(b: &PixelBox, (x, y): (f64, f64)) -> bool {
    b.x1 <= x && x < b.x2 && b.y1 <= y && y < b.y2
}

fn grown(b: &PixelBox, by: f64) -> PixelBox {
    PixelBox { x1: b.x1 - by, y1: b.y1 - by, x2: b.x2 + by, y2: b.y2 + by }
}

/// What a colour may be in the example's brightness. Bright and dark parts of a picture need not have
/// changed by the same factor, and what is cut off at white was brighter.
fn tones(rgb: [u8; 3], gain: f64) -> impl Iterator<Item = [u8; 3]> {
    let spread = if (gain - 1.0).abs() < SAME_BRIGHTNESS_MAX { 0.0 } else { GAIN_SPREAD };
    let gains = [1.0, 1.0 - spread, 1.0 + spread].into_iter().chain(SHADOWS.map(|s| 1.0 / s));
    gains.flat_map(move |factor| {
        let channel = |v: u8| {
            let toned = (f64::from(v) * gain * factor).min(255.0);
            let most = if v >= CUT_OFF { toned * CUT_OFF_BY } else { toned };
            (toned as u8..=most.min(255.0) as u8).step_by(1 << (8 - BITS))
        };
        let [r, g, b] = rgb.map(channel);
        let pairs = r.flat_map(move |r| g.clone().map(move |g| (r, g)));
        pairs.flat_map(move |(r, g)| b.clone().map(move |b| [r, g, b]))
    })
}

/// Which of the boxes stand in those rows, or on others that do.
fn standing(boxes: &[PixelBox], [first, last]: [f64; 2]) -> Vec<bool> {
    let on_ground = |b: &PixelBox| {
        let margin = OUTSIDE_HEIGHTS_MIN * b.height();
        (first - margin..=last + margin).contains(&b.y2)
    };
    let mut stand: Vec<bool> = boxes.iter().map(on_ground).collect();
    loop {
        let rests = |i: usize| {
            let mut others = boxes.iter().zip(&stand);
            others.any(|(other, stands)| *stands && rests_on(&boxes[i], other))
        };
        let more: Vec<usize> = (0..boxes.len()).filter(|i| !stand[*i] && rests(*i)).collect();
        if more.is_empty() {
            return stand;
        }
        for i in more {
            stand[i] = true;
        }
    }
}

/// Whether the lower edge of a box is at the upper edge of another, or inside it.
fn rests_on(b: &PixelBox, other: &PixelBox) -> bool {
    let common = b.x2.min(other.x2) - b.x1.max(other.x1);
    let near = TOUCH_SHARE * b.height().min(other.height());
    common > 0.2 * b.width().min(other.width())
        && b.y1 < other.y1
        && other.y1 - near <= b.y2
        && b.y2 < other.y2
}
