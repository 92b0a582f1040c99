//! Several cameras, one list of objects: which detections of different views show the same object,
//! and where the views contradict one another.
//!
//! ```text
//!  view of main ─┐ type, label        best estimate     free space
//!  view of back ─┼─► associate ──────► merge ─────────► contradictions ─► detections
//!  …            ─┘ place in the world  box in main's image
//! ```
//!
//! Pure, and free of the order of the cameras: the first view is that of the camera `main`, whose
//! image the boxes of all objects are in; the others are taken in the order of their names.

mod view;
mod associate;
mod contradict;
mod fuse;
#[cfg(test)]
mod tests;

pub use fuse::fuse;
pub use view::CameraView;
