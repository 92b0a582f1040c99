//! One image to one symbolic state, without a loop: detect, place, name, judge, complete.

use thiserror::Error;

use super::detectors::{Detector, DetectorError};
use super::grounders::GrounderError;
use super::model::ObjectBox;
use super::observation::{FrameView, Observation};
use super::pipeline::{Pipeline, State};
use super::{Detections, GripperContent, ImageView, name_detections, name_of_phrase};

/// The named objects that one image shows.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedObjects {
    /// What the detector saw, with what the pipeline added.
    pub detections: Detections,
    /// The same objects under their names, in the same order.
    pub boxes: Vec<ObjectBox>,
    /// Phrases that name none of the objects, with the reason.
    pub unplaced: Vec<String>,
}

/// The state that one image shows, with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundedImage {
    /// The objects that were found.
    pub named: NamedObjects,
    /// The state that they are in.
    pub state: State,
}

/// Finds and names the objects of one image. Objects that `phrases` of the goal single out take
/// the phrases as their names (see [`super::merge`]).
///
/// # Errors
/// What the detector says.
pub fn detect_objects(
    pipeline: &Pipeline<'_>,
    detector: &mut dyn Detector,
    image: &ImageView<'_>,
    phrases: &[String],
) -> Result<NamedObjects, DetectorError> {
    let mut detections = detector.detect(image, phrases)?;
    let own_names = name_detections(pipeline.perception, &detections.objects);
    let merged = pipeline.place(&mut detections, &own_names);
    let mut unplaced = merged.unplaced;
    let is_answered = |asked: &&String| {
        detections.phrases.iter().any(|p| p.phrase == **asked)
            || own_names.contains(&name_of_phrase(asked))
    };
    let unanswered = phrases.iter().filter(|asked| !is_answered(asked));
    unplaced.extend(unanswered.map(|phrase| format!("\"{phrase}\": nothing fits it")));
    let named = merged.names.into_iter().zip(&detections.objects);
    let boxes = named.map(|(name, detection)| detection.object(name)).collect();
    Ok(NamedObjects { detections, boxes, unplaced })
}

/// An image cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StillError {
    /// Its objects cannot be found.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// Their relations cannot be judged.
    #[error(transparent)]
    Grounder(#[from] GrounderError),
}

/// Reads the state off one image.
///
/// # Errors
/// What detector or grounder says.
pub fn ground_image(
    pipeline: &Pipeline<'_>,
    detector: &mut dyn Detector,
    image: &ImageView<'_>,
    phrases: &[String],
    gripper: &GripperContent,
) -> Result<GroundedImage, StillError> {
    let named = detect_objects(pipeline, detector, image, phrases)?;
    let frame = FrameView { image: Some(*image), ..FrameView::default() };
    let unexplained = &named.detections.unexplained;
    let observation = Observation { frame, objects: &named.boxes, unexplained };
    let state = pipeline.state(&observation, gripper)?;
    Ok(GroundedImage { named, state })
}
