//! Requests to the loop, from whatever process.

use super::Stop;

/// What the loop is asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// End the episode; the robot holds.
    Stop(Stop),
    /// Answer no further frame. A simulated world in lockstep stands still; a robot in real time is
    /// told to hold.
    Pause,
    /// Go on.
    Resume,
    /// Answer one frame, then pause.
    Step,
}
