//! Who builds distance tables, and when a table that was asked for is used.

use std::sync::Arc;

use super::{TableEnd, TableJob};

/// When a table that was made beside the loop is taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adoption {
    /// So many cycles after it was asked for, and waited for then: decisions do not depend on how
    /// fast the machine is.
    AfterCycles(u64),
    /// As soon as it is ready.
    WhenReady,
}

/// A table that was asked for and has not been taken over yet.
#[derive(Debug, Clone)]
pub struct TableRequest {
    /// Counts the requests of one replanner, from 1; a restarted replanner repeats its last number.
    pub number: u64,
    /// The cycle in which it was made.
    pub cycle: u64,
    /// The work, which may be carried out anywhere.
    pub job: Arc<TableJob>,
}

/// Whether a pending table is taken over in this cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    /// Not yet, even if it is ready.
    No,
    /// If it is ready.
    IfReady,
    /// In any case: it is waited for.
    Now,
}

impl Adoption {
    pub(super) fn due(self, request: &TableRequest, cycle: u64) -> Due {
        match self {
            Self::WhenReady => Due::IfReady,
            Self::AfterCycles(n) if cycle >= request.cycle.saturating_add(n) => Due::Now,
            Self::AfterCycles(_) => Due::No,
        }
    }
}

/// Carries out table requests, one at a time: a thread beside the loop, or the caller itself.
///
/// Every method may be told of a request that the builder has never heard of: a builder does not
/// outlive a restart, the replanner's memory does.
pub trait TableBuilder {
    /// Begins to carry out a request and returns at once; a request of another number is dropped.
    fn start(&mut self, request: &TableRequest);

    /// The result, if it is there.
    fn ready(&mut self, request: &TableRequest) -> Option<TableEnd>;

    /// The result, whenever it comes.
    fn wait(&mut self, request: &TableRequest) -> TableEnd;
}

/// Builds a table while the caller waits for it: for tests and measurements.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuildInPlace;

impl TableBuilder for BuildInPlace {
    fn start(&mut self, _request: &TableRequest) {}

    fn ready(&mut self, request: &TableRequest) -> Option<TableEnd> {
        Some(self.wait(request))
    }

    fn wait(&mut self, request: &TableRequest) -> TableEnd {
        request.job.run(&|| false)
    }
}

/// Builds nothing: every table stays pending for as long as nobody has to wait for it.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuildNever;

impl TableBuilder for BuildNever {
    fn start(&mut self, _request: &TableRequest) {}

    fn ready(&mut self, _request: &TableRequest) -> Option<TableEnd> {
        None
    }

    fn wait(&mut self, _request: &TableRequest) -> TableEnd {
        TableEnd::Interrupted
    }
}
