//! The plan-reuse cascade: what is already known answers before anything is searched.
//!
//! The goal of an episode is constant and most cycles change little, so most questions have been
//! answered before. Each source ([`PlanSource`](crate::messages::PlanSource)) either answers, rightly,
//! or passes:
//!
//! 1. *mutex*: facts that exclude each other are no state to plan from; 2. *goal*: it holds;
//! 3. *unchanged*: the same question as last time;
//! 4. *trajectory*: the state is one that the current plan passes;
//! 5. *suffix*: a suffix of the current plan leads from the state to the goal;
//! 6. *table*: the goal-rooted distance table knows the state; 7. *search*, by whoever owns the
//!    cascade; 8. *improve*: the plan that the search found is made cheaper.
//!
//! [`Replanner`] is what an actor talks to: one call for each scene. It owns a [`Cascade`], asks the
//! planner where no source knows, and keeps the books of the distance table. [`Cascade::observe`]
//! packs facts, [`Cascade::query`] asks the sources, [`Cascade::accept`] hears what a search has found,
//! [`Cascade::prepare`] makes the next query fast. All of it is pure: no clock, no thread. Tables are
//! built by a [`TableBuilder`], wherever and whenever its owner likes.

mod settings;
mod name_index;
mod observed_task;
mod current_plan;
mod distance_table;
mod reply;
mod task_memo;
mod cascade;
mod table_builder;
mod replanner;
#[cfg(test)]
mod tests;

pub use cascade::Cascade;
pub use distance_table::{Distance, DistanceTable, TableEnd, TableJob};
pub use observed_task::ObservedTask;
pub use replanner::{ReplanQuery, Replanner};
pub use reply::{CascadeEnd, CascadeReply, CascadeResult, PlanSuffix, SourceCounts};
pub use settings::{CascadeSettings, TableLimits};
pub use table_builder::{Adoption, BuildInPlace, BuildNever, TableBuilder, TableRequest};
