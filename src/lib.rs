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
//! Modules stand in reading order: a pure core, parts behind traits, and a thin shell that moves
//! messages. See `ARCHITECTURE.md`.

// Core: values in, values out; no clock, no I/O.
pub mod mismatch;
pub mod geometry;
pub mod pddl;
pub mod logic;
pub mod scene;
pub mod messages;
pub mod planning;
pub mod picture;

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
pub mod eval;
pub mod stress;
pub mod cli;
