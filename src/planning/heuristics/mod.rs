//! Estimates of the cost from a state to the goal.

mod blind;
mod relaxed;
mod ff;
mod max;

pub(super) use blind::Blind;
pub(super) use ff::FastForward;
pub(super) use max::Max;

/// An estimate of the cost to the goal.
pub(super) trait Heuristic {
    /// The estimate for a packed state; `None` proves that the goal cannot be reached from it.
    fn estimate(&mut self, state: &[u64]) -> Option<u64>;

    /// Actions that look useful in the state of the last estimate, in rising order.
    fn preferred(&self) -> &[u32] {
        &[]
    }
}
