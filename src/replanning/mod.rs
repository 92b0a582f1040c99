//! The replanning ladder: what is already known answers before anything is searched.
//!
//! The goal of an episode is constant and most cycles change little, so most questions have been
//! answered before. Each rung either answers, rightly, or passes:
//!
//! 1. *goal*: it holds; 2. *unchanged*: the same question as last time;
//! 3. *trajectory*: the state is one that the followed plan passes;
//! 4. *suffix*: a rest of the followed plan leads from the state to the goal;
//! 5. *table*: the goal-rooted distance table knows the state; 6. *search*, by whoever owns the
//!    ladder; 7. *improve*: the plan that the search found is made cheaper.
//!
//! [`Ladder::observe`] packs facts, [`Ladder::climb`] asks the rungs, [`Ladder::take`] hears what a
//! search has found, [`Ladder::prepare`] makes the next climb fast. All are pure: no clock, no
//! thread. Tables are built by [`TableJob::run`], wherever and whenever the owner likes.

mod index;
mod ground;
mod followed;
mod table;
mod reply;
mod place;
mod climb;
mod replanner;
mod background;
#[cfg(test)]
mod tests;

pub use background::TableBuilder;
pub use climb::{Ladder, LadderSettings};
pub use ground::Ground;
pub use replanner::{Adoption, Decided, Patience, Replan, Replanner, TableRequest};
pub use reply::{Climbed, Counters, End as LadderEnd, Reply, Rest};
pub use table::{Distance, Table, TableEnd, TableJob, TableLimits};
