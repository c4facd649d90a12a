//! The render: progress, errors against a reference, the state on the disk.

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use upbp_core::{ErrorPoint, ErrorSeries, Image, Progress, Renderer, State, Stop, StopReason};

use crate::exit::complain;

/// What is done besides rendering.
pub(crate) struct Beside<'a> {
    pub(crate) reference: Option<&'a Image>,
    /// Where the state goes, and how often.
    pub(crate) state: Option<(&'a Path, Duration)>,
    pub(crate) quiet: bool,
}

/// Renders until a rule of `stop` holds.
pub(crate) fn render(renderer: &mut Renderer<'_>, stop: &Stop, beside: &Beside<'_>) -> StopReason {
    let bar = if beside.quiet { ProgressBar::hidden() } else { ProgressBar::new(1000) };
    if let Ok(style) = ProgressStyle::with_template("[{elapsed_precise}] {bar:40} {percent:>3} %  {msg}") {
        bar.set_style(style);
    }
    // Iterations take seconds: the clock moves meanwhile.
    bar.enable_steady_tick(Duration::from_millis(200));
    let terminal = std::io::stderr().is_terminal();
    let mut errors = ErrorSeries::default();
    let mut saved = Instant::now();
    let outcome = renderer.render(stop, |now: &Progress<'_>| {
        if let Some(reference) = beside.reference {
            let image = now.film.image();
            errors.push(ErrorPoint {
                seconds: now.seconds,
                iterations: now.iterations,
                relative_mse: image.relative_mse(reference),
                rmse: image.rmse(reference),
            });
        }
        let message = status(now);
        bar.set_position((1000.0 * now.fraction) as u64);
        bar.set_message(message.clone());
        // Without a terminal a bar is invisible: a line now and then instead.
        if !terminal && !beside.quiet && now.iterations.is_power_of_two() {
            complain(&format!("{:3.0} %  {message}", 100.0 * now.fraction));
        }
        if let Some((path, every)) = beside.state
            && saved.elapsed() >= every
        {
            save(now.state, path);
            saved = Instant::now();
        }
        ControlFlow::Continue(())
    });
    bar.finish();
    for point in errors.points() {
        renderer.record_error(*point);
    }
    outcome.reason
}

/// Saves, or says that it was not possible: a disk that is full now need not be so at the end.
fn save(state: &State, path: &Path) {
    if let Err(error) = state.save(path) {
        let cause = std::error::Error::source(&error).map_or_else(String::new, |cause| format!(": {cause}"));
        complain(&format!("warning: {error}{cause}; the render goes on"));
    }
}

/// Iterations, time left, and the error so far.
fn status(now: &Progress<'_>) -> String {
    let left = if now.fraction > 0.0 { now.seconds * (1.0 / now.fraction - 1.0) } else { f64::INFINITY };
    let error = if now.estimated_error.is_finite() {
        format!("estimated relMSE {:.2e}", now.estimated_error)
    } else {
        "error not known yet".to_owned()
    };
    format!("iteration {}, {left:.0} s left, {error}", now.iterations)
}
