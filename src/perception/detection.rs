//! One detected object, from the pixels to the name that the goal gives it.

use std::fmt;

use super::model::ObjectBox;
use super::{BoxEstimate, Unexplained};
use crate::geometry::{Mask, MaskRun, PixelBox};
use crate::pddl::Name;

/// Everything that a detector says of one image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Detections {
    /// Objects of the domain's types, in a fixed order.
    pub objects: Vec<Detection>,
    /// Where the phrases that were asked for are; a phrase that nothing fits has no entry, one
    /// that several objects fit may have several.
    pub phrases: Vec<PhraseBox>,
    /// Things that are no objects and that no labelled picture shows, in a fixed order.
    pub unexplained: Vec<Unexplained>,
    /// What looks like an object and is none because of where it is.
    pub outside: Vec<Outside>,
}

/// A detection that is no object because of where it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Outside {
    /// Its place among the objects, were it one.
    pub at: usize,
    /// What it looks like.
    pub detection: Detection,
    /// Why it is no object.
    pub reason: OutsideReason,
}

/// Why something that looks like an object is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutsideReason {
    /// It rests on nothing, far from where the labelled objects stand.
    Elsewhere,
    /// It stands beside all fixtures.
    BesideFixtures,
    /// Its middle is not in the part of the image in which people say that objects can be.
    Region,
}

impl fmt::Display for OutsideReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Elsewhere => "elsewhere than the labelled objects",
            Self::BesideFixtures => "beside all fixtures",
            Self::Region => "outside the region",
        })
    }
}

impl Detections {
    /// Takes what is outside for objects after all, except for what people have left out.
    pub fn take_back_outside(&mut self) {
        for outside in std::mem::take(&mut self.outside) {
            match outside.reason {
                OutsideReason::Region => self.outside.push(outside),
                OutsideReason::Elsewhere | OutsideReason::BesideFixtures => {
                    self.objects.insert(outside.at.min(self.objects.len()), outside.detection);
                }
            }
        }
    }
}

/// One place that a phrase may speak of.
#[derive(Debug, Clone, PartialEq)]
pub struct PhraseBox {
    /// The phrase, as it was asked for.
    pub phrase: String,
    /// The place, in pixels.
    pub pixel_box: PixelBox,
    /// Confidence in 0..=1.
    pub score: f32,
}

/// One detected object. A detector fills in what it sees; the pipeline adds the box in the world
/// and the goal's phrase.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// The name that the detector dictates, such as that of a labelled box; `None`: the rules of
    /// its type give it one.
    pub name: Option<Name>,
    /// One of the domain's types.
    pub type_name: Name,
    /// What tells it from others of its type: a colour, or another detector's class text.
    pub label: Name,
    /// Its box: left and top edge of its first pixels, right and bottom edge of its last.
    pub pixel_box: PixelBox,
    /// Confidence in 0..=1.
    pub score: f32,
    /// Its pixels, top to bottom and left to right; empty from a detector that tells none.
    pub mask: Vec<MaskRun>,
    /// Its box in the world frame; `None` before it is measured, or without depth or camera pose.
    pub measured: Option<BoxEstimate>,
    /// How large objects of its type are, in metres, where the labelled examples agree about it.
    pub usual_extent: Option<[f64; 3]>,
    /// The name that a phrase of the goal gives it; `None` before phrases are merged, or when none
    /// speaks of it.
    pub phrase: Option<Name>,
    /// Whether another camera than the one whose image the box is in sees it, where the robot hides
    /// nothing of it.
    pub is_whole_elsewhere: bool,
    /// What cameras do not agree on; the object's name completes it.
    pub contradiction: Option<String>,
}

impl Detection {
    /// A detection of full confidence, without mask.
    pub fn new(type_name: Name, label: Name, pixel_box: PixelBox) -> Self {
        Self {
            name: None,
            type_name,
            label,
            pixel_box,
            score: 1.0,
            mask: Vec::new(),
            measured: None,
            usual_extent: None,
            phrase: None,
            is_whole_elsewhere: false,
            contradiction: None,
        }
    }

    /// The object as grounding takes it, under a name.
    pub fn object(&self, name: Name) -> ObjectBox {
        ObjectBox {
            name,
            type_name: self.type_name.clone(),
            pixel_box: self.pixel_box,
            volume: self.measured.map(|measured| measured.volume),
            mask: self.pixels(),
        }
    }

    /// The mask as grounding takes it; `None` without one.
    pub fn pixels(&self) -> Option<Mask> {
        (!self.mask.is_empty()).then(|| Mask::from(self.mask.clone()))
    }

    /// The number of pixels in the mask.
    pub fn mask_area(&self) -> usize {
        self.mask.iter().map(|r| (r.x_end - r.x_start) as usize).sum()
    }
}
