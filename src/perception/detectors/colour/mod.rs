//! The colour detector: objects are patches of the colours that their type is known to have.
//!
//! Each pixel is looked up in a table of colour classes; each class is cleaned as a binary image;
//! what remains falls into connected regions, and those with the outline and size that the type
//! declares are objects. Lighting is met in the colour space (see [`lab`]) and by shades and
//! sizes learnt from the labelled image of the camera in use.

mod outline;
mod blob_filters;
mod edges;
mod pieces;

use std::collections::BTreeMap;

use super::bitmask::BitMask;
use super::colour_namer::used_colours;
use super::lab::{Hue, Lab};
use super::light::{Light, Normalised, Normaliser};
use super::median::median;
use super::palette::{NONE, Palette, cell};
use super::regions::Region;
use super::{Detector, DetectorError};
use crate::geometry::PixelBox;
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::Name;
use crate::perception::model::{ObjectBox, Perception, Shape, TypeSpec};
use crate::perception::naming::{label_of, name_detections};
use crate::perception::phrases::answer;
use crate::perception::{Detection, Detections, ImageView};
use blob_filters::{is_seam, middle_colour, stands_out};
use edges::{BySize, InnerSteps, split, usual_ratio};
use outline::{SizeLimits, Sizes, find, find_stubs, fits};
use pieces::{HUE_MAX, Piece, joined, joined_behind, joined_faces};

/// Finds patches of declared colours.
#[derive(Debug, Clone)]
pub struct ColourDetector {
    perception: Perception,
    palette: Palette,
    /// Sizes of labelled objects by type, as shares of their image's height.
    sizes: BTreeMap<Name, Sizes>,
    /// How much the shade steps inside labelled objects, by type.
    inner_steps: BTreeMap<Name, InnerSteps>,
    /// Their heights as shares of their widths, by type.
    ratios: BTreeMap<Name, Vec<f64>>,
    /// One mask per class, kept between frames so that nothing is allocated anew.
    masks: Vec<BitMask>,
    /// Light of the labelled images.
    lights: Vec<Light>,
    /// The frame in their light, kept likewise.
    normaliser: Normaliser,
}

/// The entry of the table of detectors.
pub(super) const PART: Part<dyn Detector> = Part {
    name: "colour",
    help: "patches of the colours that perception.toml declares for each type",
    options: no_options,
    build,
};

fn build(context: &PartContext<'_, dyn Detector>) -> Result<Box<dyn Detector>, PartError> {
    Ok(Box::new(ColourDetector::new(context.inputs.perception)?))
}

impl ColourDetector {
    /// Makes a detector from general knowledge of colours.
    ///
    /// # Errors
    /// [`DetectorError::TooManyColours`].
    pub fn new(perception: &Perception) -> Result<Self, DetectorError> {
        Ok(Self {
            perception: perception.clone(),
            palette: Palette::new(&used_colours(perception))?,
            sizes: BTreeMap::new(),
            inner_steps: BTreeMap::new(),
            ratios: BTreeMap::new(),
            masks: Vec::new(),
            lights: Vec::new(),
            normaliser: Normaliser::default(),
        })
    }

    /// Sorts every pixel into the mask of its class.
    fn classify(&mut self, image: &ImageView<'_>) {
        let (width, height, n) = (image.width(), image.height(), self.palette.n_classes());
        let usable = |m: &BitMask| m.width() == width && m.height() == height;
        if self.masks.len() == n && self.masks.iter().all(usable) {
            self.masks.iter_mut().for_each(BitMask::clear);
        } else {
            self.masks = vec![BitMask::new(width, height); n];
        }
        let table = self.palette.table();
        for y in 0..height {
            for (word, pixels) in image.row(y).chunks(3 * 64).enumerate() {
                let mut classes = [NONE; 64];
                let mut any = NONE;
                for (class, pixel) in classes.iter_mut().zip(pixels.as_chunks().0) {
                    *class = table.get(cell(*pixel)).copied().unwrap_or(NONE);
                    any |= *class;
                }
                if any == NONE {
                    continue;
                }
                for (bit, class) in classes.iter().enumerate().filter(|(_, c)| **c != NONE) {
                    self.masks[usize::from(*class)].row_mut(y)[word] |= 1 << bit;
                }
            }
        }
    }

    /// Every object of every type, in the order of the perception file.
    fn detect_all(&mut self, frame: &Normalised<'_>) -> Vec<Detection> {
        self.palette.prepare(frame.ground);
        self.classify(&frame.image);
        let types = self.perception.types.iter();
        types.flat_map(|spec| self.detect_type(spec, frame)).collect()
    }

    /// Every object of one type in the image that was classified last.
    fn detect_type(&self, spec: &TypeSpec, frame: &Normalised<'_>) -> Vec<Detection> {
        let image = &frame.image;
        let Some(appearance) = &spec.appearance else { return Vec::new() };
        let labelled = self.sizes.get(&spec.name).copied();
        let limits = SizeLimits::new(appearance, labelled, image.height());
        let mut found: Vec<Piece<'_>> = Vec::new();
        for colour in &spec.colours {
            let Some(class) = self.palette.class(colour) else { continue };
            let regions = find(&self.masks[usize::from(class)], appearance, &limits).into_iter();
            found.extend(regions.map(|region| (class, colour, region)));
        }
        if let Shape::Patch { split_waists } = appearance.shape {
            // Of round bodies, a waist says more than the size.
            found = self.split(found, (spec, !split_waists), image, &limits);
        }
        let is_body = |class: u8, x: u32, y: u32| {
            let of = self.class_at(image, (i64::from(x), i64::from(y)));
            of.is_some_and(|other| other != class)
        };
        if let Some(sizes) = limits.angular() {
            found = joined_behind(found, [sizes.width[1], sizes.height[1]], &is_body);
        }
        found.retain(|(_, _, region)| limits.may_contain_height(&region.pixel_box()));
        if let Some(width_max) = limits.widest() {
            let scale = scale(&found, &limits);
            found = joined(found, (image, &frame.ground), scale * width_max);
            let is_learnt = |class: u8, lab: Lab| self.palette.is_learnt(class, lab);
            let height_max = scale * limits.highest().unwrap_or(0.0);
            found = joined_faces(found, image, height_max, &is_learnt);
        }
        found.retain(|(class, _, region)| {
            // What has another name and the same hue is the same body in other light.
            let own = middle_colour(image, region).map(Hue::of);
            let is_other = |x, y| {
                let rgb = image.pixel(x as usize, y as usize);
                let hues = own.zip(rgb.map(|rgb| Hue::of(Lab::of(rgb))));
                hues.is_none_or(|(own, other)| own.turn_to(other).abs() > HUE_MAX)
            };
            fits(region, appearance, &limits, &|x, y| is_body(*class, x, y) && is_other(x, y))
        });
        found.retain(|(_, _, region)| stands_out(image, region));
        drop_surplus(spec, &mut found);
        self.add_stubs(spec, &limits, &mut found);
        let heights = found.iter().map(|(_, _, r)| r.pixel_box().height()).collect();
        let usual = median(heights, f64::total_cmp)
            .unwrap_or(0.0)
            .min(limits.lowest().unwrap_or(f64::INFINITY));
        let bodies = found.into_iter().filter(|(class, _, region)| {
            !is_seam(image, region, usual, |xy| {
                self.class_at(image, xy).is_some_and(|c| c != *class)
            })
        });
        bodies.map(|(_, colour, region)| detection(spec, colour, region)).collect()
    }

    /// Cuts regions of several bodies.
    fn split<'s>(
        &self,
        pieces: Vec<Piece<'s>>,
        (spec, by_size): (&TypeSpec, bool),
        image: &ImageView<'_>,
        limits: &SizeLimits,
    ) -> Vec<Piece<'s>> {
        let Some(inside) = self.inner_steps.get(&spec.name) else { return pieces };
        let by_size = by_size.then(|| BySize {
            scale: scale(&pieces, limits),
            ratio: self.ratios.get(&spec.name).and_then(|ratios| usual_ratio(ratios)),
        });
        let split = |(class, colour, region)| {
            let bodies = split(region, image, limits, (*inside, by_size)).into_iter();
            bodies.map(move |body| (class, colour, body))
        };
        pieces.into_iter().flat_map(split).collect()
    }

    /// Where the names of a type say how many there are, and some are missing: what may be the rest
    /// of them, if that is as many.
    fn add_stubs<'s>(&self, spec: &'s TypeSpec, limits: &SizeLimits, found: &mut Vec<Piece<'s>>) {
        let n_missing = spec.naming.list.len().saturating_sub(found.len());
        let (Some(appearance), 1..) = (&spec.appearance, n_missing) else { return };
        let known: Vec<PixelBox> = found.iter().map(|(_, _, r)| r.pixel_box()).collect();
        let stubs = spec.colours.iter().flat_map(|colour| {
            let class = self.palette.class(colour).unwrap_or(NONE);
            let stubs = find_stubs(&self.masks[usize::from(class)], appearance, limits, &known);
            stubs.into_iter().map(move |stub| (class, colour, stub))
        });
        let stubs: Vec<_> = stubs.collect();
        if stubs.len() == n_missing {
            found.extend(stubs);
        }
    }

    /// The colour class of a pixel; `None` outside the image and where it has none.
    fn class_at(&self, image: &ImageView<'_>, (x, y): (i64, i64)) -> Option<u8> {
        let rgb = image.pixel(usize::try_from(x).ok()?, usize::try_from(y).ok()?)?;
        self.palette.look_up(rgb)
    }
}

impl Detector for ColourDetector {
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError> {
        let (width, height) = (image.width(), image.height());
        self.lights.push(Light::of(image));
        for object in objects {
            let b = object.pixel_box;
            let inside =
                b.x1 >= 0.0 && b.y1 >= 0.0 && b.x2 <= width as f64 && b.y2 <= height as f64;
            if !b.is_valid() || !inside {
                let object = object.name.to_string();
                return Err(DetectorError::BoxOutside { object, width, height });
            }
            let Some(spec) = self.perception.type_spec(&object.type_name) else { continue };
            if let Some(colour) = label_of(spec, &object.name) {
                self.palette.learn(colour, spec.colours.len() == 1, (image, &b));
            }
            let [w, h] = [b.width(), b.height()].map(|v| v / height as f64);
            let new = Sizes { width: [w, w], height: [h, h] };
            let known = self.sizes.entry(object.type_name.clone()).or_insert(new);
            *known = known.widened(new);
            let steps = self.inner_steps.entry(object.type_name.clone()).or_default();
            *steps = steps.widened(image, &b);
            self.ratios.entry(object.type_name.clone()).or_default().push(b.height() / b.width());
        }
        Ok(())
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        let mut memory = std::mem::take(&mut self.normaliser);
        let example = Light::mean(&self.lights);
        let likeness = |rgb| self.palette.likeness(rgb);
        let frame = memory.view(image, example.as_ref(), &likeness);
        let objects = self.detect_all(&frame);
        self.normaliser = memory;
        let phrases = if phrases.is_empty() {
            Vec::new()
        } else {
            let names = name_detections(&self.perception, &objects);
            answer(&self.perception, (&names, &objects), phrases)
        };
        Ok(Detections { objects, phrases, ..Detections::default() })
    }
}

/// How many times as large as the largest labelled ones objects are in this picture; at least 1.
fn scale(pieces: &[Piece<'_>], limits: &SizeLimits) -> f64 {
    let boxes = pieces.iter().map(|(_, _, r)| r.pixel_box()).filter(|b| limits.contain(b));
    median(boxes.filter_map(|b| limits.scale_of(&b)).collect(), f64::total_cmp)
        .unwrap_or(1.0)
        .max(1.0)
}

/// Where the names of a type say how many there are, and more are found: the highest are those.
fn drop_surplus(spec: &TypeSpec, found: &mut Vec<Piece<'_>>) {
    let n_known = spec.naming.list.len();
    if n_known == 0 || found.len() <= n_known {
        return;
    }
    let height = |piece: &Piece<'_>| piece.2.pixel_box().height();
    let mut heights: Vec<f64> = found.iter().map(height).collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    let least = heights[n_known - 1];
    found.retain(|piece| height(piece) >= least);
    found.truncate(n_known);
}

fn detection(spec: &TypeSpec, colour: &Name, region: Region) -> Detection {
    let pixel_box = region.pixel_box();
    Detection {
        score: (region.area() as f64 / pixel_box.area()).clamp(0.0, 1.0) as f32,
        mask: region.runs,
        ..Detection::new(spec.name.clone(), colour.clone(), pixel_box)
    }
}

#[cfg(test)]
mod tests;
