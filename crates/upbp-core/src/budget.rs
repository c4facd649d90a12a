//! How long the preparation of a render may take.
//!
//! What is looked at before the first iteration is a sample of the scene, and any size of it will do: so it is made to fit. A small run
//! tells what a larger one takes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Stops a render from any thread, its preparation included: within the time of a few sub-paths. Of the iteration in hand the sets of
/// pixels that are done stay on the film.
///
/// It may be made before the render ([`Start`](crate::Start)); all copies stop the same renders.
#[derive(Clone, Debug, Default)]
pub struct Canceller(Arc<AtomicBool>);

impl Canceller {
    /// Stops the render, for good.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was stopped.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// When work has to stop: asked between sub-paths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halt<'a> {
    pub(crate) canceller: &'a Canceller,
    pub(crate) deadline: Option<Instant>,
}

impl Halt<'_> {
    /// Whether work has to stop now.
    pub(crate) fn now(&self) -> bool {
        self.canceller.is_cancelled() || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// A time that preparations may take, and whether they are to end at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget<'a> {
    canceller: &'a Canceller,
    /// None: as long as it takes.
    time: Option<Duration>,
}

impl<'a> Budget<'a> {
    pub(crate) fn new(canceller: &'a Canceller, seconds: Option<f64>) -> Self {
        // What is longer than a clock can tell is no limit.
        Self { canceller, time: seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()) }
    }

    /// A part of the time.
    pub(crate) fn part(&self, part: f64) -> Self {
        Self { time: self.time.map(|time| time.mul_f64(part)), ..*self }
    }

    /// The largest run that fits: `run` is given the part of the full work that it is to do, and may end with `None` when it is halted.
    /// Small runs come first, each of which tells what there is time for. The result of the last one that has ended; `None` if there is
    /// none, which happens to those who `need` something only if they are cancelled.
    ///
    /// Without a limit it is the full work, at once.
    pub(crate) fn largest<T>(
        &self,
        need: bool,
        mut run: impl FnMut(f64, &Halt<'_>) -> Option<T>,
    ) -> Option<T> {
        /// The first part.
        const FIRST: f64 = 1.0 / 128.0;
        /// What takes longer than expected may go on for so many times as long as there was time for.
        const PATIENCE: u32 = 2;
        let canceller = self.canceller;
        let Some(time) = self.time else { return run(1.0, &Halt { canceller, deadline: None }) };
        let start = Instant::now();
        let deadline = start.checked_add(PATIENCE * time);
        let (mut part, mut best) = (FIRST, None);
        loop {
            let unlimited = need && best.is_none();
            let halt = Halt { canceller, deadline: if unlimited { None } else { deadline } };
            let began = Instant::now();
            let Some(result) = run(part, &halt) else { return best };
            best = Some(result);
            let left = time.saturating_sub(start.elapsed()).as_secs_f64();
            let affordable = part * left / began.elapsed().as_secs_f64().max(1e-9);
            let next = affordable.min(1.0);
            if part >= 1.0 || next < 2.0 * part {
                return best;
            }
            part = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_limit_all_is_done_at_once() {
        let mut parts = Vec::new();
        let canceller = Canceller::default();
        let result = Budget::new(&canceller, None).largest(true, |part, halt| {
            parts.push(part);
            assert!(!halt.now());
            Some(part)
        });
        assert_eq!((result, parts.as_slice()), (Some(1.0), [1.0].as_slice()));
        assert_eq!(Budget::new(&canceller, Some(f64::INFINITY)).time, None);
    }

    #[test]
    fn no_time_is_enough_for_something() {
        let canceller = Canceller::default();
        let mut runs = 0;
        let result = Budget::new(&canceller, Some(0.0)).largest(true, |part, _| {
            runs += 1;
            Some(part)
        });
        assert_eq!((result, runs), (Some(1.0 / 128.0), 1));
    }

    #[test]
    fn what_costs_nothing_is_done_in_full() {
        let canceller = Canceller::default();
        let result = Budget::new(&canceller, Some(1e9)).largest(true, |part, _| Some(part));
        assert_eq!(result, Some(1.0));
    }

    #[test]
    fn what_is_not_needed_is_left_when_time_is_up() {
        let canceller = Canceller::default();
        let run = |part, halt: &Halt<'_>| (!halt.now()).then_some(part);
        assert_eq!(Budget::new(&canceller, Some(0.0)).largest(false, run), None);
    }

    #[test]
    fn an_end_at_once_leaves_what_there_is() {
        let canceller = Canceller::default();
        let result = Budget::new(&canceller, Some(1e9)).largest(true, |part, halt| {
            let ended = !halt.now();
            canceller.cancel();
            ended.then_some(part)
        });
        assert_eq!(result, Some(1.0 / 128.0));
    }
}
