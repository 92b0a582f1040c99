//! Parts that a run file chooses by name: one table for each role, one way to make them.
//!
//! A role is a trait (`dyn Detector`, `dyn Planner`, …) with a [`Registry`] of its parts. Each part is one
//! file with one [`Part`], which says its name, what it is, which options it has and how it is made;
//! and one line in its role's table. What a role's parts are made from, besides their options, is
//! [`Role::Inputs`].

mod context;
mod error;
mod options;
mod registry;
#[cfg(test)]
mod tests;

pub use context::{PartChoice, PartContext};
pub use error::{PartError, read_file};
pub use options::{OptionsSchema, PartOption, no_options, options_of};
pub use registry::{Part, Registry};

/// What parts are for, implemented for the trait object of a kind of part: `dyn Detector`.
pub trait Role: 'static {
    /// What parts of this role are made from, besides their options.
    type Inputs<'a>;

    /// The role as people call it: "detector".
    const NAME: &'static str;

    /// The key of a run file that names the part: `perception.detector`.
    const KEY: &'static str;

    /// The table of a run file with the part's options: `perception.options`.
    const OPTIONS: &'static str;
}
