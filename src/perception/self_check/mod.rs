//! Labelled examples tried on themselves: what the taught parts do not find, name or read there.
//!
//! What is wrong with an example shows up much later and far away: as an object that no frame shows,
//! or a fact that never holds. Here every labelled picture is read by the detector that has learnt
//! from all of them, and compared with its labels:
//!
//! 1. `matching`: which detection is which labelled object, by type and overlap;
//! 2. `colours`: why an object is not found, as far as colours, outlines and sizes say;
//! 3. `facts`: the labelled state against what is read off labelled and off detected boxes, and
//!    predicates that the examples do not teach.

mod finding;
mod matching;
mod colours;
mod facts;
#[cfg(test)]
mod tests;

pub use facts::{TaughtPredicate, taught};
pub use finding::{BoxOrigin, ExemplarFinding, FindingKind, Label, NotFoundReason};

use super::detectors::Detector;
use super::model::{Exemplar, ObjectBox, TypeSpec};
use super::{Detection, Detections, ImageView, OutsideReason, Pipeline, StillError, label_of};
use colours::ColourProbe;
use matching::{Matched, matched};

/// A labelled example with its picture.
#[derive(Debug, Clone, Copy)]
pub struct LabelledImage<'a> {
    /// The picture.
    pub image: ImageView<'a>,
    /// Its labels.
    pub exemplar: &'a Exemplar,
}

/// What reads the examples.
#[expect(missing_debug_implementations, reason = "parts are known by their names only")]
pub struct SelfCheck<'a> {
    /// From boxes to facts; its grounder is made from the examples.
    pub pipeline: Pipeline<'a>,
    /// Taught by the examples; `None` for one that does not look at pictures: objects are not compared.
    pub detector: Option<&'a mut dyn Detector>,
    /// Whether it is the colours, outlines and sizes of `perception.toml` that it goes by: then they
    /// say why an object is not found.
    pub goes_by_colours: bool,
    /// Whether facts will be judged from volumes, where the examples have them.
    pub has_depth: bool,
}

impl SelfCheck<'_> {
    /// Reads every example and says what differs from its labels, in the order of the examples;
    /// predicates that they do not teach come last.
    ///
    /// # Errors
    /// What detector or grounder says.
    pub fn findings(
        &mut self,
        examples: &[LabelledImage<'_>],
    ) -> Result<Vec<ExemplarFinding>, StillError> {
        let mut findings = Vec::new();
        let mut probe = None;
        for example in examples {
            let mut kinds = Vec::new();
            if let Some(detector) = &mut self.detector {
                let detections = detector.detect(&example.image, &[])?;
                let labels = &example.exemplar.objects;
                let matched = matched(&self.pipeline.domain.types, labels, &detections.objects);
                self.compare_objects((example, &detections, &matched), &mut probe, &mut kinds)?;
                let seen = seen(labels, &detections.objects, &matched);
                kinds.extend(self.compare_facts(example, Some((&detections, &seen)))?);
            } else {
                kinds.extend(self.compare_facts(example, None)?);
            }
            let name = &example.exemplar.name;
            let of_example = |kind| ExemplarFinding { exemplar: Some(name.clone()), kind };
            findings.extend(kinds.into_iter().map(of_example));
        }
        let exemplars: Vec<&Exemplar> = examples.iter().map(|example| example.exemplar).collect();
        let untaught = facts::untaught(&self.pipeline, &exemplars);
        findings.extend(untaught.into_iter().map(|kind| ExemplarFinding { exemplar: None, kind }));
        Ok(findings)
    }

    /// Objects that are not found as labelled, and such as are not labelled.
    fn compare_objects(
        &self,
        (example, detections, matched): (&LabelledImage<'_>, &Detections, &Matched),
        probe: &mut Option<ColourProbe>,
        kinds: &mut Vec<FindingKind>,
    ) -> Result<(), StillError> {
        let perception = self.pipeline.perception;
        for (at, object) in example.exemplar.objects.iter().enumerate() {
            let spec = perception.type_spec(&object.type_name);
            let Some(found) = matched.detection_of(at) else {
                let reason = match matched.merged_with(at) {
                    Some(other) => NotFoundReason::Merged {
                        with: example.exemplar.objects[other].name.clone(),
                    },
                    None => self.reason((example, detections), object, probe)?,
                };
                let label = label(object);
                kinds.push(FindingKind::NotFound { label, reason });
                continue;
            };
            let found = &detections.objects[found];
            if !matched.fits(at) {
                let found = found.pixel_box;
                kinds.push(FindingKind::OtherBox { label: label(object), found });
            }
            kinds.extend(spec.and_then(|spec| other_colour(spec, object, found)));
        }
        let unlabelled = matched.unlabelled(detections.objects.len());
        kinds.extend(unlabelled.map(|at| {
            let Detection { type_name, label, pixel_box, .. } = &detections.objects[at];
            let (type_name, colour) = (type_name.clone(), label.clone());
            FindingKind::Unlabelled { type_name, colour, found: *pixel_box }
        }));
        Ok(())
    }

    /// Why nothing is found where an object is labelled.
    fn reason(
        &self,
        (example, detections): (&LabelledImage<'_>, &Detections),
        object: &ObjectBox,
        probe: &mut Option<ColourProbe>,
    ) -> Result<NotFoundReason, StillError> {
        let overlaps =
            |b: &crate::geometry::PixelBox| b.iou(&object.pixel_box) >= matching::IOU_SAME_MIN;
        let mut outside = detections.outside.iter();
        if let Some(thing) = outside.find(|thing| overlaps(&thing.detection.pixel_box)) {
            return Ok(match thing.reason {
                OutsideReason::Region => NotFoundReason::OutsideRegion,
                OutsideReason::Elsewhere | OutsideReason::BesideFixtures => NotFoundReason::Outside,
            });
        }
        let spec = self.pipeline.perception.type_spec(&object.type_name);
        let Some(spec) = spec else { return Ok(NotFoundReason::NoLook) };
        if !self.goes_by_colours {
            return Ok(NotFoundReason::Unknown);
        }
        let Some(appearance) = &spec.appearance else { return Ok(NotFoundReason::NoLook) };
        let share = object.mask.as_ref().map(|mask| mask.area() / object.pixel_box.area());
        if let Some(share) = share.filter(|share| *share < appearance.fill_min) {
            return Ok(NotFoundReason::PartlyHidden { share });
        }
        let height = example.image.height() as f64;
        if let Some(limit) = colours::off_limit(appearance, &object.pixel_box, height) {
            return Ok(limit.of_label(&spec.name));
        }
        let probe = match probe {
            Some(probe) => probe,
            None => probe.insert(ColourProbe::new(self.pipeline.perception)?),
        };
        Ok(probe.reason(&example.image, spec, object)?)
    }
}

/// A labelled object, for a finding.
fn label(object: &ObjectBox) -> Label {
    Label { object: object.name.clone(), labelled: object.pixel_box }
}

/// The colour that the detector sees, where it is not the one that the label's name speaks of.
fn other_colour(spec: &TypeSpec, object: &ObjectBox, found: &Detection) -> Option<FindingKind> {
    let named = label_of(spec, &object.name)?;
    let differs =
        found.name.is_none() && found.label != *named && spec.colours.contains(&found.label);
    differs.then(|| FindingKind::OtherColour {
        object: object.name.clone(),
        named: named.clone(),
        seen: found.label.clone(),
    })
}

/// The labelled objects as they are seen: with the boxes and pixels that were found for them.
fn seen(labels: &[ObjectBox], found: &[Detection], matched: &Matched) -> Vec<ObjectBox> {
    let seen = |(at, object): (usize, &ObjectBox)| match matched.detection_of(at) {
        Some(i) => {
            let mask = found[i].pixels().or_else(|| object.mask.clone());
            ObjectBox { pixel_box: found[i].pixel_box, mask, ..object.clone() }
        }
        None => object.clone(),
    };
    labels.iter().enumerate().map(seen).collect()
}
