//! One image to one symbolic state, without a loop: detect, name, ground, complete.

use super::detectors::{Detector, DetectorError};
use super::grounders::{Grounder, Grounding};
use super::model::{ObjectBox, Perception};
use super::phrases::{MergeRule, merge, name_of_phrase};
use super::{
    Detection, Grip, ImageView, PhraseBox, Sighted, complete, facts_of, merged, name_detections,
    proprioception,
};
use crate::logic::Facts;
use crate::pddl::{Axiom, Domain, Typed};

/// What turns an image of one domain into its state.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a grounder is known by its name only")]
pub struct Pipeline<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// Its perception file.
    pub perception: &'a Perception,
    /// Its completion rules.
    pub rules: &'a [Axiom],
    /// The grounder, made from the labelled examples of the camera in use.
    pub grounder: &'a dyn Grounder,
}

/// The state that one image shows, with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundedImage {
    /// What the detector saw.
    pub detections: Vec<Detection>,
    /// The same objects with their names, in the same order.
    pub boxes: Vec<ObjectBox>,
    /// Every object of the state: the seen ones, then the implied ones.
    pub objects: Vec<Typed>,
    /// Where the goal's phrases were found.
    pub phrases: Vec<PhraseBox>,
    /// Phrases that name none of the objects, with the reason.
    pub unplaced: Vec<String>,
    /// Every judged tuple, and what the facts cannot explain.
    pub grounding: Grounding,
    /// Observed, proprioceptive and completed facts.
    pub facts: Facts,
}

/// Reads the state off one image. Objects that phrases of the goal single out take the phrases as
/// their names (see [`merge`]).
///
/// # Errors
/// What the detector says.
pub fn ground_image(
    pipeline: &Pipeline<'_>,
    detector: &mut dyn Detector,
    image: &ImageView<'_>,
    phrases: &[String],
    grip: &Grip,
) -> Result<GroundedImage, DetectorError> {
    let Pipeline { domain, perception, rules, grounder } = *pipeline;
    let asked = phrases;
    let Sighted { objects: detections, phrases } = detector.detect(image, asked)?;
    let names = name_detections(perception, &detections);
    let mut merged_names = merge(&names, &detections, &phrases, MergeRule::Fitting);
    let unanswered = asked.iter().filter(|asked| phrases.iter().all(|p| p.phrase != **asked));
    let unanswered = unanswered.filter(|asked| !names.contains(&name_of_phrase(asked)));
    let unplaced = unanswered.map(|phrase| format!("{phrase:?}: nothing fits it"));
    merged_names.unplaced.extend(unplaced);
    let boxes: Vec<ObjectBox> = merged_names
        .names
        .into_iter()
        .zip(&detections)
        .map(|(name, d)| ObjectBox {
            name,
            type_name: d.type_name.clone(),
            pixel_box: d.pixel_box,
            volume: None,
            mask: d.pixels(),
        })
        .collect();
    let seen = boxes.iter().map(|b| Typed::new(b.name.clone(), b.type_name.clone()));
    let implied =
        perception.implied.iter().map(|i| Typed::new(i.name.clone(), i.type_name.clone()));
    let objects: Vec<Typed> = seen.chain(implied).collect();
    let grounding = grounder.ground(&boxes);
    let own = proprioception(domain, perception, &objects, grip);
    let base = merged(facts_of(&grounding.judged), own);
    let facts = complete(rules, &domain.types, &objects, &base);
    let unplaced = merged_names.unplaced;
    Ok(GroundedImage { detections, boxes, objects, phrases, unplaced, grounding, facts })
}
