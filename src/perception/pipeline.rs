//! The one way from an image to facts.
//!
//! ```text
//!  detector ─► measure ──────► place ────────────► name ─► judge ───────► complete ─► facts
//!              box in the      phrase of the goal          the grounder   robot's own facts,
//!              world, stacks                                              completion rules
//! ```
//!
//! A still image goes straight through ([`super::still`]). The loop takes the same stages with its
//! memory in between ([`super::tracking`]): tracks name the objects, and the belief decides which
//! judgements count before they are completed. An evaluation that brings its own boxes starts at
//! [`Pipeline::state`].

use super::completion::{facts_of, merged};
use super::grounders::{Grounder, GrounderError, Grounding};
use super::model::Perception;
use super::stacked::part_stacks;
use super::{
    Detection, Detections, FrameView, GripperContent, MergeRule, Merged, Observation, complete,
    doubt_completed, doubts, merge, missing_fixtures, proprioception, volume_of, weaken,
};
use crate::logic::Facts;
use crate::pddl::{Axiom, Domain, Name, Typed};

/// Gives detections their boxes in the world, where the frame has depth and the camera's pose. Sides
/// that something hides are where the usual size of the type puts them.
pub fn lift_detections(
    perception: &Perception,
    frame: &FrameView<'_>,
    detections: &mut [Detection],
) {
    let (Some(depth), Some(camera)) = (&frame.depth, frame.camera) else { return };
    for detection in detections {
        let spec = perception.type_spec(&detection.type_name);
        detection.measured = spec.and_then(|spec| volume_of(detection, depth, camera, spec.depth));
        if let Some((measured, extent)) = detection.measured.as_mut().zip(detection.usual_extent) {
            measured.complete_cut_sides(extent);
        }
    }
}

/// What turns images of one domain into facts: all that does not change from image to image.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a grounder is known by its name only")]
pub struct Pipeline<'a> {
    /// Types, predicates and constants.
    pub domain: &'a Domain,
    /// The domain's perception file.
    pub perception: &'a Perception,
    /// The domain's completion rules.
    pub rules: &'a [Axiom],
    /// Made from the exemplars of the camera in use.
    pub grounder: &'a dyn Grounder,
}

/// The symbolic state that objects are in.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Every object of the state: the seen ones, then the implied ones. The domain's constants,
    /// which a problem does not declare, are left out.
    pub objects: Vec<Typed>,
    /// Every judged tuple, and what the facts cannot explain.
    pub grounding: Grounding,
    /// Observed, proprioceptive and completed facts.
    pub facts: Facts,
}

impl Pipeline<'_> {
    /// Gives detections their boxes in the world, where the frame has depth and the camera's pose, and
    /// parts those that are as high as several objects of their type.
    pub fn measure(&self, frame: &FrameView<'_>, detections: &mut Vec<Detection>) {
        lift_detections(self.perception, frame, detections);
        let Some(camera) = frame.camera else { return };
        let n_before = detections.len();
        part_stacks(camera, detections);
        if detections.len() > n_before {
            lift_detections(self.perception, frame, detections);
        }
    }

    /// Gives detections the phrases of the goal that single them out. `names` says what each is called
    /// so far.
    pub fn place(&self, detections: &mut Detections, names: &[Name]) -> Merged {
        let Detections { objects, phrases, .. } = detections;
        let merged = merge(names, objects, phrases, MergeRule::Fitting);
        for placed in &merged.placed {
            objects[placed.detection_idx].phrase = Some(placed.name.clone());
        }
        merged
    }

    /// Judges every tuple of the observed predicates, and doubts what may be hidden.
    ///
    /// # Errors
    /// What the grounder says; [`GrounderError::Missing`] when it needs an image and there is none.
    pub fn judge(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        if self.grounder.needs_image() && observation.frame.image.is_none() {
            return Err(GrounderError::Missing {
                what: "the image that the grounder looks at".to_owned(),
                how: "take a grounder that judges boxes, such as s2s, or give the image".to_owned(),
            });
        }
        let mut grounding = self.grounder.ground(observation)?;
        grounding.anomalies.extend(doubts(observation.unexplained, observation.objects));
        weaken(&mut grounding);
        let missing = missing_fixtures(self.perception, observation.objects);
        grounding.anomalies.extend(missing.map(|(_, anomaly)| anomaly));
        Ok(grounding)
    }

    /// Objects that are there without being seen: those that the perception file implies.
    pub fn implied(&self) -> impl Iterator<Item = Typed> {
        self.perception.implied.iter().map(|i| Typed::new(i.name.clone(), i.type_name.clone()))
    }

    /// What the robot knows of itself. `objects` are all there are, constants included.
    pub fn own_facts(&self, objects: &[Typed], gripper: &GripperContent) -> Facts {
        proprioception(self.domain, self.perception, objects, gripper)
    }

    /// Adds what the completion rules derive from `base`. `objects` are all there are, constants
    /// included.
    pub fn completed(&self, objects: &[Typed], base: &Facts) -> Facts {
        complete(self.rules, &self.domain.types, objects, base)
    }

    /// The state of named objects: judged, with what the robot knows of itself, completed.
    ///
    /// # Errors
    /// As [`Self::judge`].
    pub fn state(
        &self,
        observation: &Observation<'_>,
        gripper: &GripperContent,
    ) -> Result<State, GrounderError> {
        let grounding = self.judge(observation)?;
        let seen = observation.objects.iter();
        let seen = seen.map(|o| Typed::new(o.name.clone(), o.type_name.clone()));
        let objects: Vec<Typed> = seen.chain(self.implied()).collect();
        let all: Vec<Typed> = objects.iter().chain(&self.domain.constants).cloned().collect();
        let base = merged(facts_of(&grounding.judged), self.own_facts(&all, gripper));
        let mut facts = self.completed(&all, &base);
        doubt_completed(self.perception, &grounding.anomalies, &mut facts);
        Ok(State { objects, grounding, facts })
    }
}
