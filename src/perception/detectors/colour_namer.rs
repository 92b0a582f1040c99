//! From boxes with types to detections: what a box is called, for detectors that tell no colours.

use std::collections::BTreeMap;

use super::palette::Palette;
use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::detectors::DetectorError;
use crate::perception::model::{ObjectBox, Perception, Srgb, TypeSpec};
use crate::perception::naming::label_of;
use crate::perception::{Detection, ImageView};

/// The colours of the domain's types, so that names and goals can speak of them.
#[derive(Debug, Clone)]
pub(super) struct ColourNamer {
    perception: Perception,
    palette: Palette,
}

impl ColourNamer {
    pub(super) fn new(perception: &Perception) -> Result<Self, DetectorError> {
        let mut palette = Palette::new(&used_colours(perception))?;
        palette.prepared();
        Ok(Self { perception: perception.clone(), palette })
    }

    pub(super) fn perception(&self) -> &Perception {
        &self.perception
    }

    /// Takes over the shades that a labelled image shows.
    pub(super) fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) {
        for object in objects {
            let Some(spec) = self.perception.type_spec(&object.type_name) else { continue };
            if let Some(colour) = label_of(spec, &object.name) {
                self.palette.learn(colour, spec.colours.len() == 1, (image, &object.pixel_box));
            }
        }
        self.palette.prepared();
    }

    /// One object of a type. Its label is the colour name that most of its middle has; the type's
    /// name where the type has no colours or the middle has none of them.
    pub(super) fn detection(
        &self,
        image: &ImageView<'_>,
        spec: &TypeSpec,
        (pixel_box, score): (PixelBox, f32),
    ) -> Detection {
        let label = match spec.colours.as_slice() {
            [] => None,
            [only] => Some(only),
            several => self.palette.name_of(image, &pixel_box, several),
        };
        Detection {
            score,
            ..Detection::new(spec.name.clone(), label.unwrap_or(&spec.name).clone(), pixel_box)
        }
    }

    /// The detections in the order of the types, then from left to right, without doubles: of two
    /// of one type that overlap by more than `iou_max` the one with the higher score stays.
    pub(super) fn sorted(&self, mut found: Vec<Detection>, iou_max: f64) -> Vec<Detection> {
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut kept: Vec<Detection> = Vec::new();
        for detection in found {
            let is_double = kept.iter().any(|k| {
                k.type_name == detection.type_name
                    && k.pixel_box.iou(&detection.pixel_box) > iou_max
            });
            if !is_double {
                kept.push(detection);
            }
        }
        let place =
            |d: &Detection| self.perception.types.iter().position(|spec| spec.name == d.type_name);
        kept.sort_by(|a, b| {
            let (ab, bb) = (&a.pixel_box, &b.pixel_box);
            let by_place = ab.x1.total_cmp(&bb.x1).then(ab.y1.total_cmp(&bb.y1));
            place(a).cmp(&place(b)).then(by_place)
        });
        kept
    }
}

/// What a colour is called by what `perception.toml` says of the colours of its types; `None` for one
/// near grey or unlike all of them.
pub fn colour_name(perception: &Perception, rgb: [u8; 3]) -> Option<Name> {
    let colours = used_colours(perception);
    let palette = Palette::new(&colours).ok()?;
    palette.name_generally(rgb).cloned()
}

/// The colours that some type has.
pub(super) fn used_colours(perception: &Perception) -> BTreeMap<Name, Vec<Srgb>> {
    let used = |name: &Name| perception.types.iter().any(|t| t.colours.contains(name));
    let mut colours = perception.colours.clone();
    colours.retain(|name, _| used(name));
    colours
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::name_detections;

    const BLOCKS: &str = include_str!("../../../domains/blocksworld/perception.toml");

    /// A red and a grey square on black, found twice each.
    #[test]
    fn boxes_are_called_by_the_colour_of_their_middle_and_doubles_go() {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let looks = ColourNamer::new(&perception).unwrap();
        let mut rgb = vec![0; 3 * 64 * 32];
        for (y, x) in (8..24).flat_map(|y| (4..20).map(move |x| (y, x))) {
            rgb[3 * (y * 64 + x)..][..3].copy_from_slice(&[200, 20, 20]);
            rgb[3 * (y * 64 + x + 32)..][..3].copy_from_slice(&[120, 120, 120]);
        }
        let image = ImageView::new(64, 32, &rgb).unwrap();
        let spec = &perception.types[0];
        let at = |x: f64, score| {
            let pixel_box = PixelBox::from([x, 8.0, x + 16.0, 24.0]);
            looks.detection(&image, spec, (pixel_box, score))
        };
        let found = looks.sorted(vec![at(36.0, 0.4), at(5.0, 0.3), at(4.0, 0.9)], 0.8);
        assert_eq!(found.iter().map(|d| d.score).collect::<Vec<_>>(), [0.9, 0.4]);
        assert_eq!(name_detections(&perception, &found), ["red_block", "block"]);
    }
}
