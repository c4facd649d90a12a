//! When a render stops, and what it tells meanwhile.

use crate::film::ErrorEstimate;
use crate::film::Film;
use crate::state::State;

/// When to stop: as soon as any of the rules holds. Without rules a render goes on until it is cancelled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// When the film holds this many iterations.
    pub iterations: Option<u64>,
    /// After this many seconds of rendering, those before a resumption and those of the pilot included: at the end of the iteration that
    /// comes closest, or in the middle of one that would take longer than a twentieth more, or than one second more if that is more.
    pub seconds: Option<f64>,
    /// When the upper end of [`Film::estimated_error`] is not above this. Asked after 8, 10, 12, 14, 16, 20, 24, 28, 32, 40 iterations and
    /// so on: who asks after each stops at the luckiest answer.
    pub error: Option<f64>,
}

/// Why a render stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The number of iterations, or nothing is left of the range.
    Iterations,
    /// The time.
    Time,
    /// The estimated error.
    Error,
    /// The caller.
    Cancelled,
}

/// The end of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Why it stopped.
    pub reason: StopReason,
}

/// Where a render is, after an iteration.
pub struct Progress<'a> {
    /// Iterations done.
    pub iterations: u64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Part of the work done, `[0, 1]`, as far as the stop rules tell.
    pub fraction: f64,
    /// Estimated relMSE, as it was when a stop rule last had reason to ask.
    pub estimated_error: ErrorEstimate,
    /// The film.
    pub film: &'a Film,
    /// All that was done so far, to be saved.
    pub state: &'a State,
}
