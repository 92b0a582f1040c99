//! What the colour detector goes by, asked of one labelled object that it does not find.

use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::detectors::{ColourDetector, Detector as _, DetectorError};
use crate::perception::model::{Appearance, ObjectBox, Perception, Shape, TypeSpec};
use crate::perception::{Detection, ImageView, label_of};

use super::finding::NotFoundReason;

/// A colour that fewer of the middle's pixels have, as a share, is not shown.
const SHOWN_MIN: f64 = 0.05;
/// Boxes are drawn by hand: sides that are off a limit by less than this share are not told.
const SLACK: f64 = 0.1;

/// A detector of all patches, whatever their outline and size.
pub(super) struct ColourProbe(ColourDetector);

/// A side, share or ratio that `perception.toml` does not allow.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OffLimit {
    /// The key below `type.NAME.appearance`.
    key: &'static str,
    value: f64,
    limits: [f64; 2],
}

impl OffLimit {
    fn reason(self, type_name: &Name, patch: Option<(Name, PixelBox)>) -> NotFoundReason {
        let Self { key, value, limits } = self;
        NotFoundReason::OffLimit {
            key: format!("type.{type_name}.appearance.{key}"),
            value,
            limits,
            patch,
        }
    }

    /// As the reason why a labelled box is no object.
    pub(super) fn of_label(self, type_name: &Name) -> NotFoundReason {
        self.reason(type_name, None)
    }
}

/// The first limit of a type's outline that a box is off, by more than a hand's slack; `height` is
/// the image's, in pixels.
pub(super) fn off_limit(spec: &Appearance, b: &PixelBox, height: f64) -> Option<OffLimit> {
    let values = [
        ("width", b.width() / height, spec.width),
        ("height", b.height() / height, spec.height),
        ("aspect", b.width() / b.height(), spec.aspect),
    ];
    let is_off = |value: f64, [low, high]: [f64; 2]| {
        value < low * (1.0 - SLACK) || value > high * (1.0 + SLACK)
    };
    let off = values.into_iter().find(|(_, value, limits)| is_off(*value, *limits));
    off.map(|(key, value, limits)| OffLimit { key, value, limits })
}

impl ColourProbe {
    pub(super) fn new(perception: &Perception) -> Result<Self, DetectorError> {
        let mut unlimited = perception.clone();
        for spec in &mut unlimited.types {
            spec.naming.list.clear();
            spec.appearance = spec.appearance.take().map(|_| Appearance {
                shape: Shape::Patch { split_waists: false },
                width: [0.0, f64::MAX],
                height: [0.0, f64::MAX],
                aspect: [0.0, f64::MAX],
                fill_min: 0.0,
                open: [0.0; 2],
                close: [0.0; 2],
            });
        }
        ColourDetector::new(&unlimited).map(Self)
    }

    /// Why nothing is found where an object is labelled.
    pub(super) fn reason(
        &mut self,
        image: &ImageView<'_>,
        spec: &TypeSpec,
        object: &ObjectBox,
    ) -> Result<NotFoundReason, DetectorError> {
        let mut patches = self.0.detect(image, &[])?.objects;
        patches.retain(|patch| patch.type_name == spec.name);
        let named = label_of(spec, &object.name);
        let shown = shown(&patches, object);
        let is_wanted = |(colour, _): &&(Name, f64)| named.is_none_or(|named| named == colour);
        let Some((colour, _)) = shown.iter().find(is_wanted) else {
            return Ok(NotFoundReason::NoColour {
                wanted: named.cloned(),
                shown: shown.first().cloned(),
                middle: middle_colour(image, &object.pixel_box),
            });
        };
        let common = |patch: &&Detection| patch.pixel_box.intersection(&object.pixel_box).area();
        let of_colour = patches.iter().filter(|patch| patch.label == *colour);
        let patch = of_colour.max_by(|a, b| common(a).total_cmp(&common(b)));
        let limits = spec.appearance.as_ref();
        Ok(match (patch, limits) {
            (Some(patch), Some(limits)) => patch_reason(spec, limits, patch, image.height() as f64),
            (None, _) | (_, None) => NotFoundReason::Unknown,
        })
    }
}

/// Why a patch of the right colour is no object.
fn patch_reason(
    spec: &TypeSpec,
    limits: &Appearance,
    patch: &Detection,
    height: f64,
) -> NotFoundReason {
    let b = patch.pixel_box;
    let fill = patch.mask_area() as f64 / b.area();
    let fill = (fill < limits.fill_min).then_some(OffLimit {
        key: "fill_min",
        value: fill,
        limits: [limits.fill_min, 1.0],
    });
    let shown = (patch.label.clone(), b);
    match off_limit(limits, &b, height).or(fill) {
        Some(off) => off.reason(&spec.name, Some(shown)),
        None => NotFoundReason::Patch { colour: shown.0, patch: shown.1 },
    }
}

/// The colours that the middle of a labelled box shows, with the shares of its pixels that have them,
/// the greatest share first.
fn shown(patches: &[Detection], object: &ObjectBox) -> Vec<(Name, f64)> {
    let middle = middle(&object.pixel_box);
    let mut shown: Vec<(Name, f64)> = Vec::new();
    for patch in patches {
        let rows = patch.mask.iter().filter(|run| {
            let y = f64::from(run.y) + 0.5;
            middle.y1 <= y && y <= middle.y2
        });
        let common =
            |x_start: f64, x_end: f64| (x_end.min(middle.x2) - x_start.max(middle.x1)).max(0.0);
        let area: f64 = rows.map(|run| common(f64::from(run.x_start), f64::from(run.x_end))).sum();
        match shown.iter_mut().find(|(colour, _)| *colour == patch.label) {
            Some((_, share)) => *share += area / middle.area(),
            None => shown.push((patch.label.clone(), area / middle.area())),
        }
    }
    shown.retain(|(_, share)| *share >= SHOWN_MIN);
    shown.sort_by(|a, b| b.1.total_cmp(&a.1));
    shown
}

/// The central half of a box, which leaves out its neighbours.
fn middle(b: &PixelBox) -> PixelBox {
    let (w, h) = (b.width() / 4.0, b.height() / 4.0);
    PixelBox { x1: b.x1 + w, y1: b.y1 + h, x2: b.x2 - w, y2: b.y2 - h }
}

/// The channel-wise median of the middle's pixels; black for a box without any.
fn middle_colour(image: &ImageView<'_>, b: &PixelBox) -> [u8; 3] {
    let b = middle(b);
    let (columns, rows) =
        (b.x1 as usize..b.x2.ceil() as usize, b.y1 as usize..b.y2.ceil() as usize);
    let pixels = rows.flat_map(|y| columns.clone().filter_map(move |x| image.pixel(x, y)));
    let pixels: Vec<[u8; 3]> = pixels.collect();
    [0, 1, 2].map(|channel| {
        let mut values: Vec<u8> = pixels.iter().map(|pixel| pixel[channel]).collect();
        values.sort_unstable();
        values.get(values.len() / 2).copied().unwrap_or_default()
    })
}
