//! The repository itself: layers, files, schemas, parts, and what the program prints.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "sim")]
mod cli;
mod configuration;
#[cfg(feature = "sim")]
mod doctor;
mod layers;
mod messages;
#[cfg(feature = "sim")]
mod numbers;
mod parts;
mod plan_limits;
mod schemas;
#[cfg(feature = "sim")]
mod tidy;
