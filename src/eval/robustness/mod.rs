//! Grounding from pixels under other conditions than those of the labelled example.
//!
//! Every test picture is disturbed in every way of [`TRANSFORMS`], and what is read off it is
//! compared with what is there: right, unknown, wrong but doubted, or wrong and silent. Detector
//! and grounder learn from the example as it is.

mod draw;
mod photographs;
#[cfg(feature = "sim")]
mod rendered;
mod report;
mod plot;
mod transform;
mod verdict;

pub use photographs::on_photographs;
pub use plot::plot;
#[cfg(feature = "sim")]
pub use rendered::on_rendered_scenes;
pub use report::{RobustnessFault, RobustnessReport, RobustnessRow};
pub use transform::{LabelledPicture, TRANSFORMS, Transform};
pub use verdict::{StateJudgement, Worth, judge};

use std::collections::BTreeSet;

use image::RgbImage;

use crate::parts::PartChoice;
use crate::pddl::{Atom, Name};
use crate::perception::detectors::Detector;
use crate::perception::{GripperContent, GroundedImage, ImageView, Pipeline, ground_image};
use crate::run::ConfigError;

/// What is measured.
#[derive(Debug, Clone, Copy)]
pub struct Conditions<'a> {
    /// Finds the objects.
    pub detector: &'a PartChoice,
    /// Judges the facts.
    pub grounder: &'a PartChoice,
    /// The disturbances.
    pub transforms: &'a [Transform],
    /// Where the disturbances' seeds begin.
    pub seed: u64,
}

/// One disturbed picture and what was read off it.
#[derive(Debug)]
pub struct Tried<'a> {
    /// The disturbance.
    pub transform: &'a Transform,
    /// Which picture it is, and which example it was read by: "problem 3 by example 1".
    pub case: &'a str,
    /// The disturbed picture with its true objects.
    pub picture: &'a LabelledPicture,
    /// What was read.
    pub read: &'a GroundedImage,
    /// What that is worth.
    pub judgement: &'a StateJudgement,
}

/// Parts that have learnt from one example, or from those of one camera.
struct Taught<'a> {
    pipeline: Pipeline<'a>,
    detector: Box<dyn Detector>,
}

/// One picture with its true facts.
struct Test<'a> {
    case: &'a str,
    picture: &'a LabelledPicture,
    facts: &'a BTreeSet<Atom>,
}

impl Taught<'_> {
    /// Tries one picture under every condition.
    fn try_all(
        &mut self,
        conditions: &Conditions<'_>,
        test: &Test<'_>,
        seed: u64,
        tried: &mut dyn FnMut(&Tried<'_>),
    ) -> Result<(), ConfigError> {
        for transform in conditions.transforms {
            let disturbed = transform.of(test.picture, conditions.seed.wrapping_add(seed));
            let view = view_of(&disturbed.image)?;
            let empty = GripperContent::Empty;
            let read = ground_image(&self.pipeline, &mut *self.detector, &view, &[], &empty)?;
            let is_there = |name: &Name| disturbed.objects.iter().any(|o| o.name == *name);
            let visible = test.facts.iter().filter(|atom| atom.args.iter().all(is_there));
            let facts: BTreeSet<Atom> = visible.cloned().collect();
            let perception = self.pipeline.perception;
            let judgement = judge(&read, &disturbed.objects, &facts, perception);
            tried(&Tried {
                transform,
                case: test.case,
                picture: &disturbed,
                read: &read,
                judgement: &judgement,
            });
        }
        Ok(())
    }
}

fn view_of(image: &RgbImage) -> Result<ImageView<'_>, ConfigError> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    ImageView::new(width, height, image.as_raw())
        .map_err(|source| ConfigError::Image { path: "disturbed picture".to_owned(), source })
}
