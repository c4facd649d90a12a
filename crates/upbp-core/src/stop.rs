//! When a render stops, and what it tells meanwhile.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::film::Film;
use crate::state::State;

/// When to stop: as soon as any of the rules holds. Without rules a render goes on until it is cancelled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// When the film holds this many iterations.
    pub iterations: Option<u64>,
    /// After this many seconds of rendering, those before a resumption included: at the end of the iteration that comes closest.
    pub seconds: Option<f64>,
    /// When [`Film::estimated_error`] is below this, after at least four iterations.
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

/// Stops a render from any thread: the iteration in hand ends as soon as possible and leaves no trace.
#[derive(Clone, Debug)]
pub struct Canceller(pub(crate) Arc<AtomicBool>);

impl Canceller {
    /// Stops the render, for good.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Where a render is, after an iteration.
pub struct Progress<'a> {
    /// Iterations done.
    pub iterations: u64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Part of the work done, `[0, 1]`, as far as the stop rules tell.
    pub fraction: f64,
    /// Estimated relMSE; infinite before the second iteration.
    pub estimated_error: f64,
    /// The film.
    pub film: &'a Film,
    /// All that was done so far, to be saved.
    pub state: &'a State,
}
