//! Pictures: what is read off them, and data sets.

#[path = "../common/mod.rs"]
mod common;

mod answers;
mod dataset;
mod eval;
mod eval_recorded;
mod exemplar_check;
mod http_detectors;
mod image_size;
mod onnx_detector;
mod photos;
mod region;
mod robustness;
mod sim_grounding;
mod volumes;
