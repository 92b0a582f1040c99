//! The colour detector: objects are patches of the colours that their type is known to have.
//!
//! Each pixel is looked up in a table of colour classes; each class is cleaned as a binary image;
//! what remains falls into connected regions, and those with the outline and size that the type
//! declares are objects. Lighting is met in the colour space (see [`super::lab`]) and by shades and
//! sizes learnt from the labelled image of the camera in use.

use std::collections::BTreeMap;

use super::appearance::{is_seam, stands_out};
use super::bitmask::BitMask;
use super::naming::label_of;
use super::outline::{SizeLimits, Sizes, find};
use super::palette::{NONE, Palette, cell};
use super::regions::Region;
use super::{Detection, Detector, DetectorError, ImageView};
use crate::grounding::{ObjectBox, Perception, TypeSpec};
use crate::pddl::Name;

/// Finds patches of declared colours.
#[derive(Debug, Clone)]
pub struct ColourDetector {
    perception: Perception,
    palette: Palette,
    /// Sizes of labelled objects by type, as shares of their image's height.
    sizes: BTreeMap<Name, Sizes>,
    /// One mask per class, kept between frames so that nothing is allocated anew.
    masks: Vec<BitMask>,
}

/// The entry for the table of detectors.
pub(super) fn build(perception: &Perception) -> Result<Box<dyn Detector>, DetectorError> {
    Ok(Box::new(ColourDetector::new(perception)?))
}

impl ColourDetector {
    /// Makes a detector from general knowledge of colours.
    ///
    /// # Errors
    /// [`DetectorError::TooManyColours`].
    pub fn new(perception: &Perception) -> Result<Self, DetectorError> {
        let used = |name: &Name| perception.types.iter().any(|t| t.colours.contains(name));
        let mut colours = perception.colours.clone();
        colours.retain(|name, _| used(name));
        Ok(Self {
            perception: perception.clone(),
            palette: Palette::new(&colours)?,
            sizes: BTreeMap::new(),
            masks: Vec::new(),
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
        let table = self.palette.prepared();
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

    /// The colour class of a pixel; `None` outside the image and where it has none.
    fn class_at(&self, image: &ImageView<'_>, (x, y): (i64, i64)) -> Option<u8> {
        let rgb = image.pixel(usize::try_from(x).ok()?, usize::try_from(y).ok()?)?;
        self.palette.look_up(rgb)
    }
}

impl Detector for ColourDetector {
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError> {
        let (width, height) = (image.width(), image.height());
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
                self.palette.learn(colour, image, &b);
            }
            let [w, h] = [b.width(), b.height()].map(|v| v / height as f64);
            let new = Sizes { width: [w, w], height: [h, h] };
            let known = self.sizes.entry(object.type_name.clone()).or_insert(new);
            *known = known.widened(new);
        }
        Ok(())
    }

    fn detect(&mut self, image: &ImageView<'_>) -> Result<Vec<Detection>, DetectorError> {
        self.classify(image);
        let mut detections = Vec::new();
        for spec in &self.perception.types {
            let labelled = self.sizes.get(&spec.name).copied();
            let limits = SizeLimits::new(spec, labelled, image.height());
            let lowest = labelled.map(|l| l.height[0] * image.height() as f64);
            for colour in &spec.colours {
                let Some(class) = self.palette.class(colour) else { continue };
                let mask = &self.masks[usize::from(class)];
                let other_colour = |xy| self.class_at(image, xy).is_some_and(|c| c != class);
                let bodies = find(mask, spec, &limits).into_iter().filter(|region| {
                    stands_out(image, region) && !is_seam(region, lowest, other_colour)
                });
                detections.extend(bodies.map(|region| detection(spec, colour, region)));
            }
        }
        Ok(detections)
    }
}

fn detection(spec: &TypeSpec, colour: &Name, region: Region) -> Detection {
    let pixel_box = region.pixel_box();
    Detection {
        type_name: spec.name.clone(),
        label: colour.clone(),
        pixel_box,
        score: (region.area() as f64 / pixel_box.area()).clamp(0.0, 1.0) as f32,
        mask: region.runs,
    }
}
