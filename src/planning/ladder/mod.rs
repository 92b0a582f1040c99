//! The replanning ladder: what is already known answers before anything is searched.

mod rung;

pub use rung::{Reuse, Rung};
