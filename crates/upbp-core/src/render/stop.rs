//! Progress of a render, and the reason why it stopped.

use std::fmt;

use crate::film::{ErrorEstimate, Film};
use crate::state::State;

/// The reason for which a render stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The number of iterations is reached, or nothing is left of the range.
    Iterations,
    /// The time is up.
    Time,
    /// The estimated error is small enough.
    Error,
    /// The caller has cancelled the render.
    Cancelled,
}

/// Progress of a render, after an iteration or in the middle of a long one.
#[non_exhaustive]
pub struct Progress<'a> {
    /// Whole iterations done.
    pub iterations: u64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Part of the work done, `[0, 1]`, as far as the stop rules tell.
    pub fraction: f64,
    /// Estimated relMSE, as of the last iteration after which it was asked for: each time that their number
    /// is a power of two, and every now and then later.
    pub estimated_error: ErrorEstimate,
    /// The film.
    pub film: &'a Film,
    /// The state of the render, to be saved.
    pub state: &'a State,
}

impl fmt::Debug for Progress<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Progress")
            .field("iterations", &self.iterations)
            .field("seconds", &self.seconds)
            .field("fraction", &self.fraction)
            .field("estimated_error", &self.estimated_error)
            .finish_non_exhaustive()
    }
}
