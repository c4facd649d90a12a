//! A render with all that goes on beside it: progress, the state on the disk.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use upbp_core::{Progress, Renderer, State, Stop, StopReason, describe};

use super::bar::Bar;
use crate::exit::complain;

/// Work to be done after each iteration, and about once a second within long ones.
pub(crate) struct Beside<'a> {
    /// File for the state, and the time between two savings.
    pub(crate) state: Option<(&'a Path, Duration)>,
    pub(crate) bar: Bar,
}

/// Renders until a rule of `stop` holds, and says which.
pub(crate) fn render(renderer: &mut Renderer<'_>, stop: &Stop, beside: Beside<'_>) -> StopReason {
    let Beside { state, bar } = beside;
    let mut saved = Instant::now();
    let reason = renderer.render(stop, |now: &Progress<'_>| {
        bar.show(now.iterations, now.fraction, status(now));
        if let Some((path, every)) = state
            && saved.elapsed() >= every
        {
            save(now.state, path);
            saved = Instant::now();
        }
        ControlFlow::Continue(())
    });
    bar.end(reason != StopReason::Cancelled);
    reason
}

/// Saves the state, or warns: a disk that is full now need not be so at the end.
fn save(state: &State, path: &Path) {
    if let Err(error) = state.save(path) {
        complain(&format!("warning: {}\n  the render goes on", describe(&error)));
    }
}

/// The message of the progress bar: iterations, time left, and the error so far.
fn status(now: &Progress<'_>) -> String {
    /// Seconds from which on nobody can tell how long it takes.
    const UNKNOWN: f64 = 1e7;
    let left = now.seconds * (1.0 / now.fraction - 1.0);
    let left = if left < UNKNOWN { format!("{left:.0} s left") } else { "time left unknown".to_owned() };
    let (error, doubt) = (now.estimated_error, if now.estimated_error.doubt.is_some() { ">" } else { "" });
    let error = if error.relative_mse.is_finite() {
        format!("relMSE {doubt}{:.1e}", error.relative_mse)
    } else {
        "error unknown".to_owned()
    };
    format!("iteration {}, {left}, {error}", now.iterations)
}
