//! groundloop: a closed-loop task executive for robots.
//!
//! It looks through a camera, writes what it sees as a symbolic state in the vocabulary of a PDDL
//! domain, plans from there to a goal that stays constant, dispatches the next skill, and looks
//! again, every cycle.
//!
//! ```text
//!  instruction ─► goal parser ──goal (once per episode: constant)──┐
//!                                                                  ▼
//!  camera ─frame─► scene parser ─scene────────────────────────► planner ─plan─► skill executor ─command─► robot
//!    ┆                                                                                 ◄──status, state──   ┆
//!    └┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄ the world (hardware or sim) ┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┄┘
//! ```
//!
//! The three things that most programs want are one call each:
//!
//! - [`plan_text`]: a plan from the texts of a PDDL domain and a problem;
//! - [`read_image`]: the facts that one image shows, in the vocabulary of a domain;
//! - [`run_file`]: one closed-loop episode of a run file.
//!
//! `examples/` has more: a detector, a planner and a skill of your own, a camera and a robot in another
//! process, and a viewer of the bus.
//!
//! Modules stand in reading order: a pure core, parts behind traits, and a thin shell that moves
//! messages. Each uses only those that stand before it. See `ARCHITECTURE.md`.

// Core: values in, values out; no clock, no I/O.
pub mod mismatch;
pub mod draws;
pub mod files;
pub mod geometry;
pub mod pddl;
pub mod settings;
pub mod logic;
pub mod scene;
pub mod messages;
pub mod planning;
pub mod picture;
pub mod plots;

// The one clock, and the one way to services on the network.
pub mod clock;
pub mod http;

// Parts: a trait, a table, one file per choice; and the core that uses them.
pub mod parts;
pub mod planners;
pub mod replanning;
pub mod skills;
pub mod perception;
pub mod goals;
pub mod executive;
pub mod metrics;

// Shell: topics, hardware, actors, files.
pub mod transport;
pub mod hardware;
pub mod actors;
pub mod run;
pub mod facade;
#[cfg(feature = "sim")]
pub mod dataset;
pub mod domain_check;
pub mod new_domain;
pub mod eval;
pub mod sweep;
pub mod stress;
pub mod doctor;
pub mod cli;

pub use facade::{plan_text, read_image, run_file};
