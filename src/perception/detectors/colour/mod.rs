//! The colour detector: objects are patches of the colours that their type is known to have.
//!
//! Each pixel is looked up in a table of colour classes; each class is cleaned as a binary image;
//! what remains falls into connected regions, and those with the outline and size that the type
//! declares are objects. Lighting is met in the colour space (see [`lab`]) and by shades and
//! sizes learnt from the labelled image of the camera in use.

mod bitmask;
mod regions;
mod outline;
mod blob_filters;

use std::collections::BTreeMap;

use super::colour_namer::used_colours;
use super::palette::{NONE, Palette, cell};
use super::{Detector, DetectorError};
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::Name;
use crate::perception::model::{ObjectBox, Perception, TypeSpec};
use crate::perception::naming::{label_of, name_detections};
use crate::perception::phrases::answer;
use crate::perception::{Detection, Detections, ImageView};
use bitmask::BitMask;
use blob_filters::{is_seam, stands_out};
use outline::{SizeLimits, Sizes, find};
use regions::Region;

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

    /// Every object of one type in the image that was classified last.
    fn detect_type(&self, spec: &TypeSpec, image: &ImageView<'_>) -> Vec<Detection> {
        let Some(appearance) = &spec.appearance else { return Vec::new() };
        let labelled = self.sizes.get(&spec.name).copied();
        let limits = SizeLimits::new(appearance, labelled, image.height());
        let mut found: Vec<(u8, &Name, Region)> = Vec::new();
        for colour in &spec.colours {
            let Some(class) = self.palette.class(colour) else { continue };
            let regions = find(&self.masks[usize::from(class)], appearance, &limits).into_iter();
            let distinct = regions.filter(|region| stands_out(image, region));
            found.extend(distinct.map(|region| (class, colour, region)));
        }
        let heights = found.iter().map(|(_, _, r)| r.pixel_box().height()).collect();
        let usual = usual_height(heights).min(limits.lowest().unwrap_or(f64::INFINITY));
        let bodies = found.into_iter().filter(|(class, _, region)| {
            !is_seam(region, usual, |xy| self.class_at(image, xy).is_some_and(|c| c != *class))
        });
        bodies.map(|(_, colour, region)| detection(spec, colour, region)).collect()
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

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        self.classify(image);
        let mut objects = Vec::new();
        for spec in &self.perception.types {
            objects.extend(self.detect_type(spec, image));
        }
        let phrases = if phrases.is_empty() {
            Vec::new()
        } else {
            let names = name_detections(&self.perception, &objects);
            answer(&self.perception, (&names, &objects), phrases)
        };
        Ok(Detections { objects, phrases })
    }
}

/// The median height; 0 of none.
fn usual_height(mut heights: Vec<f64>) -> f64 {
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied().unwrap_or(0.0)
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
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::PixelBox;

    /// A picture of filled rectangles on a plain ground.
    struct Canvas {
        width: usize,
        rgb: Vec<u8>,
    }

    impl Canvas {
        fn new(width: usize, height: usize, ground: [u8; 3]) -> Self {
            Self { width, rgb: ground.repeat(width * height) }
        }

        fn fill(&mut self, [x1, y1, x2, y2]: [usize; 4], rgb: [u8; 3]) -> &mut Self {
            for (y, x) in (y1..y2).flat_map(|y| (x1..x2).map(move |x| (y, x))) {
                let at = 3 * (y * self.width + x);
                self.rgb[at..at + 3].copy_from_slice(&rgb);
            }
            self
        }

        /// Adds noise of a few steps to every channel.
        fn noisy(mut self) -> Self {
            let mut state = 1_u32;
            for byte in &mut self.rgb {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = byte.saturating_add((state >> 29) as u8).saturating_sub(4);
            }
            self
        }

        fn view(&self) -> ImageView<'_> {
            ImageView::new(self.width, self.rgb.len() / 3 / self.width, &self.rgb).unwrap()
        }
    }

    const BLOCKS: &str = include_str!("../../../../domains/blocksworld/perception.toml");
    const HANOI: &str = include_str!("../../../../domains/hanoi/perception.toml");

    #[track_caller]
    fn check(domain: &str, canvas: &Canvas, expect: &[(&str, [f64; 4])]) {
        let perception = Perception::parse("perception.toml", domain).unwrap();
        let mut detector = ColourDetector::new(&perception).unwrap();
        let found = detector.detect(&canvas.view(), &[]).unwrap().objects;
        let names = name_detections(&perception, &found);
        let mut seen: Vec<_> = names.iter().map(Name::as_str).zip(&found).collect();
        seen.sort_by_key(|(name, _)| *name);
        let seen: Vec<_> = seen.into_iter().map(|(n, d)| (n, d.pixel_box.into())).collect();
        assert_eq!(seen, expect);
    }

    /// Three faces of one block in different light are one block; its box is exact under noise.
    #[test]
    fn a_shaded_block_is_one_block() {
        let mut canvas = Canvas::new(320, 240, [70, 72, 76]);
        canvas.fill([100, 150, 130, 158], [235, 62, 60]);
        canvas.fill([100, 158, 130, 180], [190, 40, 38]);
        canvas.fill([130, 152, 136, 180], [95, 16, 14]);
        check(BLOCKS, &canvas.noisy(), &[("red_block", [100.0, 150.0, 136.0, 180.0])]);
    }

    #[test]
    fn a_tower_falls_into_its_blocks() {
        let mut canvas = Canvas::new(320, 240, [20, 20, 24]);
        canvas.fill([100, 100, 130, 130], [20, 80, 200]);
        canvas.fill([101, 130, 131, 160], [230, 200, 30]);
        canvas.fill([99, 160, 129, 190], [30, 160, 60]);
        let expect = [
            ("blue_block", [100.0, 100.0, 130.0, 130.0]),
            ("green_block", [99.0, 160.0, 129.0, 190.0]),
            ("yellow_block", [101.0, 130.0, 131.0, 160.0]),
        ];
        check(BLOCKS, &canvas.noisy(), &expect);
    }

    /// A ground whose purple tint slowly grows across the threshold of being called purple.
    #[test]
    fn tinted_cloth_is_no_block() {
        let mut canvas = Canvas::new(320, 240, [30, 30, 30]);
        for x in 0..320 {
            let tint = (x / 16) as u8;
            canvas.fill([x, 0, x + 1, 240], [30 + tint, 30 - tint / 2, 30 + tint]);
        }
        canvas.fill([40, 150, 70, 180], [200, 30, 30]);
        check(BLOCKS, &canvas, &[("red_block", [40.0, 150.0, 70.0, 180.0])]);
    }

    /// A post keeps its identity when something hides its middle, and the board is no post.
    #[test]
    fn posts_stand_on_a_board_of_their_own_wood() {
        let wood = [205, 170, 125];
        let mut canvas = Canvas::new(320, 240, [30, 30, 34]);
        canvas.fill([60, 180, 260, 200], wood);
        for x in [90, 155, 220] {
            canvas.fill([x, 80, x + 8, 180], wood);
        }
        canvas.fill([150, 140, 168, 146], [90, 92, 96]);
        for x in [230, 250] {
            canvas.fill([x, 120, x + 8, 200], [90, 92, 96]); // fingers that cut the board up
        }
        canvas.fill([70, 164, 118, 180], [30, 60, 200]);
        let expect = [
            ("blue_disk", [70.0, 164.0, 118.0, 180.0]),
            ("left_peg", [90.0, 80.0, 98.0, 164.0]),
            ("middle_peg", [155.0, 80.0, 163.0, 178.0]),
            ("right_peg", [220.0, 80.0, 228.0, 178.0]),
        ];
        check(HANOI, &canvas, &expect);
    }

    #[test]
    fn learning_outside_the_image_is_refused() {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let mut detector = ColourDetector::new(&perception).unwrap();
        let canvas = Canvas::new(32, 24, [0, 0, 0]);
        let object = ObjectBox::new(
            "red_block".into(),
            "block".into(),
            PixelBox::from([20.0, 3.0, 33.0, 9.0]),
        );
        let message = detector.learn(&canvas.view(), &[object]).unwrap_err().to_string();
        assert_eq!(message, "red_block: expected a box inside the 32 x 24 image");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Any pixels of any size give boxes inside the image.
        #[test]
        fn any_image_is_survived(width in 1..150_usize, height in 1..40_usize, seed in any::<u32>()) {
            let mut state = seed;
            let mut bytes = Vec::with_capacity(3 * width * height);
            while bytes.len() < 3 * width * height {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Runs of one colour, so that there are regions.
                let run = [(state >> 24) as u8, (state >> 16) as u8, (state >> 8) as u8];
                bytes.extend(run.repeat(1 + (state & 31) as usize));
            }
            bytes.truncate(3 * width * height);
            let image = ImageView::new(width, height, &bytes).unwrap();
            for domain in [BLOCKS, HANOI] {
                let perception = Perception::parse("perception.toml", domain).unwrap();
                let mut detector = ColourDetector::new(&perception).unwrap();
                for found in detector.detect(&image, &[]).unwrap().objects {
                    let b = found.pixel_box;
                    prop_assert!(b.is_valid() && b.x1 >= 0.0 && b.y1 >= 0.0);
                    prop_assert!(b.x2 <= width as f64 && b.y2 <= height as f64);
                    prop_assert!(found.mask_area() as f64 <= b.area());
                }
            }
        }
    }
}
