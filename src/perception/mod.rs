//! Perception: from an image to facts in the domain's vocabulary.

pub mod model;
mod views;
mod depth_view;
mod box_estimate;
mod observation;
mod detection;
mod image_region;
mod edge_depth;
mod usual_size;
mod lifting;
mod stacked;
mod silhouette;
mod naming;
mod phrases;
pub mod detectors;
pub mod grounders;
mod proprioception;
mod completion;
mod pipeline;
mod unexplained;
mod doubt;
mod still;
pub mod self_check;
pub mod fusion;
pub mod tracking;

pub use box_estimate::{BoxEstimate, TruncatedSides};
pub use completion::{complete, facts_of, merged};
pub use depth_view::{DepthError, DepthView};
pub use detection::{Detection, Detections, Outside, OutsideReason, PhraseBox};
pub use doubt::{doubt_completed, doubts, missing_fixtures, weaken};
pub use image_region::{ImageRegion, NoImageRegion};
pub use lifting::volume_of;
pub use naming::{label_of, name_detections, unused_name};
pub use observation::{FrameView, Observation};
pub use phrases::{
    MergeRule, Merged, PHRASE_IOU_MIN, Placed, merge, name_of_phrase, phrase_of_name,
};
pub use pipeline::{Pipeline, State, lift_detections};
pub use proprioception::{GripperContent, proprioception};
pub use still::{GroundedImage, NamedObjects, StillError, detect_objects, ground_image};
pub use unexplained::Unexplained;
pub use usual_size::UsualSizes;
pub use views::{ImageError, ImageView};
