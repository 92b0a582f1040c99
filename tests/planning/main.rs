//! Problems and words: PDDL, goals, plans, and domain folders.

#[path = "../common/mod.rs"]
mod common;

mod corpus;
mod differential;
mod differential_tasks;
mod domain_check;
mod domain_files;
#[cfg(feature = "sim")]
mod domains;
mod front_end;
mod goal_phrasings;
mod goal_sentences;
mod goals;
mod language_model;
mod llama_server;
