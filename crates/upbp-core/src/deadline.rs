//! Cancellation, deadlines, and the part of a render that its preparation may take.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{RenderError, SettingsError};

/// Stops a render from any thread, its preparation included: within the time of a few sub-paths, or of trees
/// over photons or an estimate of the error that are being made. Of the iteration in hand the sets of pixels
/// that are done stay on the film.
///
/// It is given to the render at its [start](crate::Start::canceller); all copies stop the same renders.
#[derive(Clone, Debug, Default)]
pub struct Canceller(Arc<AtomicBool>);

impl Canceller {
    /// Stops the render, for good.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the render was stopped by [`cancel`](Self::cancel).
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// End of work, asked for between sub-paths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halt<'a> {
    pub(crate) canceller: &'a Canceller,
    pub(crate) deadline: Option<Instant>,
}

impl Halt<'_> {
    /// Time until the deadline, if there is one.
    pub(crate) fn time_left(&self) -> Option<Duration> {
        Some(self.deadline?.saturating_duration_since(Instant::now()))
    }

    /// Whether work has to stop now.
    pub(crate) fn now(&self) -> bool {
        self.canceller.is_cancelled() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// Rules by which a render stops: as soon as one holds. Without rules a render goes on until it is
/// cancelled. Limits are numbers of at least 0:
/// [`Renderer::start`](crate::Renderer::start) refuses others. [`Renderer::render`](crate::Renderer::render)
/// stops after the first iteration if seconds are no number, and never reaches an error that is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Number of iterations on the film.
    pub iterations: Option<u64>,
    /// Seconds of rendering, those before a resumption and those of the preparation included. The last
    /// iteration ends in its middle if it is not done a hundredth after the limit; one of which little more
    /// than its light sub-paths could be done is not begun. The first iteration has half a second, or a
    /// fortieth of the limit, in any case, and its light sub-paths are traced to the end, since without them
    /// there is no picture: a [count](crate::LightPaths::Count) that is given may take any time.
    pub seconds: Option<f64>,
    /// Largest upper end of [`Film::estimated_error`](crate::Film::estimated_error). Asked for after 8, 10,
    /// 12, 14, 16, 20, 24, 28, 32, 40 iterations and so on: who asks after each stops at the luckiest answer.
    pub error: Option<f64>,
}

impl Stop {
    /// Refuses limits that are negative or no numbers.
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        for (name, limit) in [("stop.seconds", self.seconds), ("stop.error", self.error)] {
            if let Some(limit) = limit
                && !(limit >= 0.0)
            {
                return Err(SettingsError { name, expected: "at least 0", found: limit.to_string() });
            }
        }
        Ok(())
    }
}

/// A step of the preparation of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Preparing {
    /// Name of the step.
    pub step: &'static str,
    /// Part of the steps that are done, in `[0, 1)`.
    pub fraction: f64,
}

/// Progress, cancellation and limits of a preparation.
///
/// A preparation takes samples of the scene, and any number of samples will do: so they are made to fit.
pub(crate) struct Budget<'a> {
    /// The beginning of the preparation.
    pub(crate) start: Instant,
    pub(crate) canceller: Canceller,
    /// The rules by which the render is going to end.
    pub(crate) stop: Stop,
    pub(crate) progress: Option<&'a mut (dyn FnMut(Preparing) + Send)>,
}

/// Part of the render's time that its preparation may take.
const PREPARATION: f64 = 0.05;
/// Seconds that it may take of a short render, since a choice needs some samples, and the most that these may
/// be of it.
const LEAST_PREPARATION: (f64, f64) = (0.5, 1.0 / 6.0);

impl Budget<'_> {
    /// Says what comes next.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`], when it is time to end.
    pub(crate) fn step(&mut self, step: &'static str, fraction: f64) -> Result<(), RenderError> {
        if let Some(progress) = &mut self.progress {
            progress(Preparing { step, fraction });
        }
        if self.canceller.is_cancelled() { Err(RenderError::Cancelled) } else { Ok(()) }
    }

    /// A part of the time for the preparation. Unlimited if the render's time is.
    pub(crate) fn part(&self, part: f64) -> Allowance<'_> {
        let seconds = self.stop.seconds.map(|seconds| part * preparation_of(seconds));
        Allowance::new(&self.canceller, seconds)
    }

    /// Time that the steps so far have left of that for the preparation, less the part that those to come may
    /// take; at least the part `least`, and unlimited if the render's time is.
    pub(crate) fn rest(&self, to_come: f64, least: f64) -> Allowance<'_> {
        let spent = self.start.elapsed().as_secs_f64();
        let seconds =
            self.stop.seconds.map(|seconds| rest_of(preparation_of(seconds), spent, to_come, least));
        Allowance::new(&self.canceller, seconds)
    }
}

/// Time left of `all` after `spent`, less the part `to_come` of all, but at least the part `least`.
fn rest_of(all: f64, spent: f64, to_come: f64, least: f64) -> f64 {
    ((1.0 - to_come) * all - spent).max(least * all)
}

/// Seconds of a render that its preparation may take.
fn preparation_of(seconds: f64) -> f64 {
    let (least, largest_part) = LEAST_PREPARATION;
    (PREPARATION * seconds).max(least.min(largest_part * seconds))
}

/// Part of the full work that a first run does where nothing else is known of it: see [`Allowance::largest`].
pub(crate) const FIRST_RUN: f64 = 1.0 / 128.0;

/// The time that one step of a preparation may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Allowance<'a> {
    canceller: &'a Canceller,
    start: Instant,
    /// None: as long as it takes.
    time: Option<Duration>,
}

impl<'a> Allowance<'a> {
    fn new(canceller: &'a Canceller, seconds: Option<f64>) -> Self {
        // What is longer than a clock can tell is no limit.
        let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Self { canceller, start: Instant::now(), time }
    }

    /// Whether there is a limit of time.
    pub(crate) const fn is_limited(&self) -> bool {
        self.time.is_some()
    }

    /// The end of work that takes longer than it was expected to.
    pub(crate) fn halt(&self) -> Halt<'a> {
        /// Factor by which work may take longer than there is time for.
        const PATIENCE: u32 = 2;
        let time = self.time.and_then(|time| time.checked_mul(PATIENCE));
        let deadline = time.and_then(|time| self.start.checked_add(time));
        Halt { canceller: self.canceller, deadline }
    }

    /// Ratio of the time that is left to the time that `work` took; infinite without a limit.
    pub(crate) fn time_ratio(&self, work: Duration) -> f64 {
        self.time.map_or(f64::INFINITY, |time| {
            time.saturating_sub(self.start.elapsed()).as_secs_f64() / work.as_secs_f64().max(1e-9)
        })
    }

    /// The largest run that there is time for: `run` is given the part of the full work that it is to do, and
    /// may end with `None` when it is halted. Small runs come first, each of which tells what there is time
    /// for. The result of the last one that has ended; `None` only if it was cancelled.
    ///
    /// Without a limit it is the full work, at once. Else the run of the part `first` is the least that is
    /// done.
    pub(crate) fn largest<T>(
        &self,
        first: f64,
        mut run: impl FnMut(f64, &Halt<'_>) -> Option<T>,
    ) -> Option<T> {
        let unlimited = Halt { canceller: self.canceller, deadline: None };
        if !self.is_limited() {
            return run(1.0, &unlimited);
        }
        let (mut part, mut best) = (first, None);
        loop {
            let halt = if best.is_none() { unlimited } else { self.halt() };
            let began = Instant::now();
            let Some(result) = run(part, &halt) else { return best };
            best = Some(result);
            let next = (part * self.time_ratio(began.elapsed())).min(1.0);
            if part >= 1.0 || next < 2.0 * part {
                return best;
            }
            part = next;
        }
    }
}

/// A stop watch.
pub(crate) struct Clock(Instant);

impl Clock {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the last call.
    pub(crate) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let time = now.duration_since(self.0);
        self.0 = now;
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_limit_all_is_done_at_once() {
        let mut parts = Vec::new();
        let canceller = Canceller::default();
        let result = Allowance::new(&canceller, None).largest(FIRST_RUN, |part, halt| {
            parts.push(part);
            assert!(!halt.now());
            Some(part)
        });
        assert_eq!((result, parts.as_slice()), (Some(1.0), [1.0].as_slice()));
        assert_eq!(Allowance::new(&canceller, Some(f64::INFINITY)).time, None);
        // Twice as much is no time that a clock can tell.
        assert_eq!(Allowance::new(&canceller, Some(1.2e19)).halt().deadline, None);
    }

    #[test]
    fn no_time_is_enough_for_something() {
        let canceller = Canceller::default();
        let mut runs = 0;
        let result = Allowance::new(&canceller, Some(0.0)).largest(FIRST_RUN, |part, _| {
            runs += 1;
            Some(part)
        });
        assert_eq!((result, runs), (Some(FIRST_RUN), 1));
    }

    #[test]
    fn what_costs_nothing_is_done_in_full() {
        let canceller = Canceller::default();
        let result = Allowance::new(&canceller, Some(1e9)).largest(FIRST_RUN, |part, _| Some(part));
        assert_eq!(result, Some(1.0));
    }

    #[test]
    fn more_is_done_as_long_as_there_is_time() {
        let canceller = Canceller::default();
        let second = Duration::from_secs(1);
        assert_eq!(Allowance::new(&canceller, None).time_ratio(second), f64::INFINITY);
        let left = Allowance::new(&canceller, Some(1e6)).time_ratio(second);
        assert!(left > 0.9e6 && left <= 1e6, "{left}");
        let none = Allowance::new(&canceller, Some(0.0));
        assert!(none.halt().now() && none.is_limited());
        assert_eq!(none.time_ratio(second), 0.0);
    }

    #[test]
    fn the_last_steps_have_what_the_others_leave() {
        for (spent, left) in [(0.0, 40.0), (10.0, 30.0), (45.0, 20.0), (100.0, 20.0)] {
            assert_eq!(rest_of(50.0, spent, 0.2, 0.4), left);
        }
    }

    #[test]
    fn an_end_at_once_leaves_what_there_is() {
        let canceller = Canceller::default();
        let result = Allowance::new(&canceller, Some(1e9)).largest(FIRST_RUN, |part, halt| {
            let ended = !halt.now();
            canceller.cancel();
            ended.then_some(part)
        });
        assert_eq!(result, Some(FIRST_RUN));
    }
}
