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
pub mod geometry;
pub mod pddl;
pub mod scene;
pub mod planning;
pub mod grounding;
pub mod messages;
pub mod picture;

// The one way to services on the network.
pub mod web;

// Parts: a trait, a table, one file per choice.
pub mod detectors;
pub mod goals;
pub mod skills;
pub mod scene_parser;
pub mod executive;
pub mod planners;
pub mod robots;
pub mod cameras;

// Shell: files, topics, actors.
pub mod telemetry;
pub mod config;
pub mod transport;
pub mod eval;
pub mod actors;
pub mod app;
pub mod stress;
pub mod cli;
