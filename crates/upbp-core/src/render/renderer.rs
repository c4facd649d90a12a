//! The scheduler: iterations of three passes each, until a rule says stop.

use std::fmt;
use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};

use upbp_estimators::scene::Scene;
use upbp_estimators::{Counters, Features, IterationPlan};

use super::engine::Engine;
use super::passes::Buffers;
use super::prepare::{Start, prepare};
use super::stop::{Progress, StopReason};
use crate::auto::technique_support::TechniqueSupport;
use crate::deadline::{Canceller, Clock, Halt, Stop};
use crate::error::{RenderError, StateError};
use crate::film::pixel_sets::SETS;
use crate::film::{ErrorEstimate, Film, Image, MAX_ITERATIONS, Pixel};
use crate::report::Report;
use crate::settings::CheckedSettings;
use crate::state::{Identity, PassSeconds, PassTimes, State, fingerprint};

/// The callback that is told of the progress of a render.
type Watcher<'w> = dyn FnMut(&Progress<'_>) -> ControlFlow<()> + 'w;

/// A render of one scene.
///
/// Iterations are independent given their index, and the same for any number of threads: the pool that is
/// current when the methods are called does the work.
pub struct Renderer<'a> {
    engine: Box<dyn Engine + 'a>,
    state: State,
    /// The iterations that are rendered.
    range: Range<u64>,
    pixels: Vec<Pixel>,
    /// One per pixel, or none if the film keeps none.
    features: Vec<Features>,
    /// Pixel sets per portion; adapts to `set_time`.
    portion: u32,
    /// Time that the camera sub-paths of a set of pixels took there.
    set_time: Duration,
    /// Time that adding an iteration to the film takes.
    film_time: Duration,
    /// Estimate of the error when it was last due.
    estimated_error: ErrorEstimate,
    reference: Option<Image>,
    canceller: Canceller,
}

impl fmt::Debug for Renderer<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let State { identity, film, .. } = &self.state;
        f.debug_struct("Renderer")
            .field("scene", &identity.scene)
            .field("crop", &identity.crop)
            .field("plan", &identity.plan)
            .field("range", &self.range)
            .field("iterations", film.iteration_set())
            .finish_non_exhaustive()
    }
}

/// A renderer may go to another thread.
const _: () = {
    const fn check<T: Send + Sync>() {}
    check::<Renderer<'static>>();
};

impl<'a> Renderer<'a> {
    /// Looks at the scene and chooses a plan, in the time that this takes: with [`start`](Self::start) the
    /// choice knows how much there is.
    ///
    /// The walks are compiled for the type of scene, where this is called.
    ///
    /// # Errors
    /// A scene whose bounds, powers or crop make no sense, or that nothing lights; a film that exceeds the
    /// memory budget.
    pub fn new<S: Scene>(scene: &'a S, settings: CheckedSettings) -> Result<Self, RenderError> {
        Self::start(scene, settings, Start::default())
    }

    /// Begins a render with a plan that was made before, with limits that the preparation has to know, or
    /// with a handle that stops it.
    ///
    /// # Errors
    /// Those of [`new`](Self::new); or the plan has techniques that the settings or the scene rule out, or
    /// exceeds the memory budget, or it or the stop rules have a value out of its range; or the reference is
    /// of another size, or not finite; or it was cancelled.
    pub fn start<S: Scene>(
        scene: &'a S,
        settings: CheckedSettings,
        start: Start<'_>,
    ) -> Result<Self, RenderError> {
        prepare(scene, settings, start)
    }

    /// A render that is prepared, before its first iteration.
    pub(super) fn begin(
        engine: Box<dyn Engine + 'a>,
        state: State,
        reference: Option<Image>,
        canceller: Canceller,
    ) -> Self {
        /// Nanoseconds per sum of a pixel, where its memory is used for the first time.
        const SUM: u64 = 60;
        let sums = state.film.rect().pixels() * (state.film.layers().len() as u64 + 3);
        Self {
            engine,
            state,
            range: 0..MAX_ITERATIONS,
            pixels: Vec::new(),
            features: Vec::new(),
            portion: 0,
            set_time: Duration::ZERO,
            film_time: Duration::from_nanos(SUM.saturating_mul(sums)),
            estimated_error: ErrorEstimate::UNKNOWN,
            reference,
            canceller,
        }
    }

    /// Says which scene this is, so that states of different scenes are told apart: a name for people, and a
    /// fingerprint of all that the scene's content depends on. To be called before a state is
    /// [resumed](Self::resume).
    pub fn identify_scene(&mut self, name: &str, content: &[u8]) {
        name.clone_into(&mut self.state.identity.scene);
        self.state.identity.fingerprint = fingerprint(content);
    }

    /// Renders only iterations of `range`, which may be a share of a render that many machines work on.
    /// Indices from [`MAX_ITERATIONS`] on are never rendered.
    pub fn set_range(&mut self, range: Range<u64>) {
        self.range = range.start..range.end.min(MAX_ITERATIONS);
    }

    /// Goes on where a state was left, or adds what others have rendered: what the state holds is not
    /// rendered again. For a moment there are two films in memory.
    ///
    /// The state has to be of the same plan: give it to [`start`](Self::start), where it is not chosen anew.
    ///
    /// # Errors
    /// Those of [`State::merge`]: then nothing has changed.
    pub fn resume(&mut self, state: State) -> Result<(), StateError> {
        let identity = self.state.identity.clone();
        let merged = self.state.merge(state);
        // The settings of this render, where they do not matter.
        self.state.identity = identity;
        merged
    }

    /// The state of the render, to be saved or merged.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// The plan of one iteration.
    #[must_use]
    pub fn iteration_plan(&self, iteration: u64) -> IterationPlan {
        let Identity { settings, plan, .. } = &self.state.identity;
        self.engine.iteration_plan(settings, plan, iteration)
    }

    /// Renders the next iteration: the first of the [range](Self::set_range) that is not on the film yet, or
    /// what is missing of it. `false` if there is none, or if it was cancelled: then some of it may be on the
    /// film.
    pub fn iterate(&mut self) -> bool {
        self.iterate_until(&Stop::default(), &mut |_| ControlFlow::Continue(())).is_ok()
    }

    /// Renders the next iteration and shows now and then what is done of it, but ends when the time of `stop`
    /// is up. An error is why it was not done.
    fn iterate_until(&mut self, stop: &Stop, progress: &mut Watcher<'_>) -> Result<(), StopReason> {
        /// Sets of pixels that are traced together take at most about so long: what is lost when a render is
        /// stopped.
        const PORTION: Duration = Duration::from_millis(200);
        let iteration = self.next_iteration().ok_or(StopReason::Iterations)?;
        if self.canceller.is_cancelled() {
            return Err(StopReason::Cancelled);
        }
        // Before the deadline is set: memory for a large picture is not had in no time.
        self.pixels.resize(self.state.film.len(), Pixel::BLACK);
        if self.state.identity.settings.features {
            self.features.resize(self.state.film.len(), Features::NONE);
        }
        let plan = self.iteration_plan(iteration);
        let canceller = self.canceller.clone();
        let mut halt = Halt { canceller: &canceller, deadline: self.deadline(stop) };
        let film = &self.state.film;
        let (rect, missing, is_first) = (film.rect(), film.missing(iteration), film.is_empty());
        // There is always a picture, however late.
        let unlimited = Halt { deadline: None, ..halt };
        let start = Instant::now();
        let light_halt = if is_first { &unlimited } else { &halt };
        let light = self.engine.trace_light(&plan, rect, &mut self.pixels, light_halt);
        let Some(light) = light else {
            self.state.record.times.add(&PassTimes { light: start.elapsed(), ..PassTimes::default() });
            return Err(self.interruption());
        };
        let (mut counters, mut times) = (light.counters, light.times);
        if missing.start > 0 {
            // Counted when the iteration was begun.
            counters = Counters::default();
        }
        self.state.record.map_bytes = self.state.record.map_bytes.max(light.map_bytes);
        let mut clock = Clock::start();
        let (mut added, mut done) = (missing.start, missing.start);
        let mut shown = start;
        while done < missing.end {
            // Half of what is left: a portion that does not end in time is lost.
            let portion = halt.time_left().map_or(PORTION, |left| PORTION.min(left / 2));
            let fit = (portion.as_secs_f64() / self.set_time.as_secs_f64().max(1e-9)) as u32;
            // What one set took tells little of others, which may have more pixels, and dearer ones.
            self.portion = fit.clamp(1, (2 * self.portion).clamp(1, SETS));
            let sets = done..(done + self.portion).min(missing.end);
            let camera_halt = if is_first && done == 0 { &unlimited } else { &halt };
            let buffers = Buffers { pixels: &mut self.pixels, features: &mut self.features };
            let traced = self.engine.trace_camera(&plan, rect, &sets, buffers, camera_halt);
            let time = clock.lap();
            times.camera += time;
            let Some(own) = traced else { break };
            counters.add(&own);
            self.set_time = time / sets.len() as u32;
            done = sets.end;
            if done < missing.end && self.is_to_be_shown(shown) {
                self.add_part(
                    iteration,
                    added..done,
                    std::mem::take(&mut counters),
                    std::mem::take(&mut times),
                );
                added = done;
                let _ = clock.lap();
                if progress(&self.progress(stop)).is_break() {
                    return Err(StopReason::Cancelled);
                }
                // Time in `progress` extends the deadline.
                let spent = clock.lap();
                halt.deadline = halt.deadline.and_then(|deadline| deadline.checked_add(spent));
                shown = Instant::now();
            }
        }
        if done > added {
            self.add_part(iteration, added..done, counters, times);
        } else {
            self.state.record.times.add(&times);
        }
        if done == missing.end { Ok(()) } else { Err(self.interruption()) }
    }

    /// Adds sets of pixels of an iteration to the film, and to the record what was done for them.
    fn add_part(&mut self, iteration: u64, sets: Range<u32>, mut counters: Counters, mut times: PassTimes) {
        let start = Instant::now();
        let (part, State { record, film, .. }) = (sets.len(), &mut self.state);
        counters.dropped += film.add_part(iteration, sets, &self.pixels, &self.features);
        times.film = start.elapsed();
        self.film_time = film_time(self.film_time, times.film, part as u32);
        // What a state file says may be of any size: sums that saturate.
        record.counters.add(&counters);
        record.times.add(&times);
    }

    /// Whether what is done of an iteration is to be shown, if something last was at this moment: once a
    /// second, or less often if adding it to the film would take much of the time.
    fn is_to_be_shown(&self, last: Instant) -> bool {
        last.elapsed() >= (20 * self.film_time).clamp(Duration::from_secs(1), Duration::from_secs(30))
    }

    /// The reason for an iteration that is not done.
    fn interruption(&self) -> StopReason {
        if self.canceller.is_cancelled() { StopReason::Cancelled } else { StopReason::Time }
    }

    fn next_iteration(&self) -> Option<u64> {
        self.state.film.iteration_set().first_missing(&self.range)
    }

    /// Seconds of rendering so far.
    fn seconds(&self) -> f64 {
        self.state.seconds().total()
    }

    /// Renders until a rule of `stop` holds or `progress` breaks, and says why it ends.
    ///
    /// `progress` is called after every whole iteration, and about once a second within those that take
    /// longer, with what is done of them on the [film](Progress::film); so there is on that of an iteration
    /// that ends in its middle. Time spent in `progress`, and in comparing with the
    /// [reference](Start::reference), does not count.
    pub fn render(
        &mut self,
        stop: &Stop,
        mut progress: impl FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> StopReason {
        let reason = self.render_until(stop, &mut progress);
        // Room for what is done with the picture.
        self.engine.shrink();
        reason
    }

    fn render_until(&mut self, stop: &Stop, progress: &mut Watcher<'_>) -> StopReason {
        self.estimated_error = self.state.film.estimated_error();
        loop {
            if let Some(reason) = self.reason_to_stop(stop) {
                return reason;
            }
            let before = self.seconds();
            if let Err(reason) = self.iterate_until(stop, progress) {
                // With what is done of the iteration, if anything.
                if self.seconds() > before {
                    self.compare();
                }
                return reason;
            }
            self.estimate_error();
            self.compare();
            if progress(&self.progress(stop)).is_break() {
                return StopReason::Cancelled;
            }
        }
    }

    fn progress(&self, stop: &Stop) -> Progress<'_> {
        let film = &self.state.film;
        Progress {
            iterations: film.iterations(),
            seconds: self.seconds(),
            fraction: self.fraction(stop),
            estimated_error: self.estimated_error,
            state: &self.state,
            film,
        }
    }

    /// Moment at which an iteration that begins now has to end.
    fn deadline(&self, stop: &Stop) -> Option<Instant> {
        let film_time = self.film_time.as_secs_f64();
        let left = seconds_left(stop.seconds?, self.seconds(), film_time, self.state.film.is_empty());
        // What is longer than a clock can tell is no limit.
        Instant::now().checked_add(Duration::try_from_secs_f64(left).ok()?)
    }

    fn reason_to_stop(&self, stop: &Stop) -> Option<StopReason> {
        let done = self.state.film.iterations();
        if self.next_iteration().is_none() || stop.iterations.is_some_and(|limit| done >= limit) {
            return Some(StopReason::Iterations);
        }
        if let Some(limit) = stop.seconds
            && !self.state.film.is_empty()
            && self.seconds() + seconds_until_it_pays(&self.state.seconds(), done) > limit
        {
            return Some(StopReason::Time);
        }
        let reached = |target| ErrorEstimate::is_due(done) && self.estimated_error.reached(target);
        stop.error.is_some_and(reached).then_some(StopReason::Error)
    }

    /// Estimates the error when a stop rule asks for it, and now and then before, for those who watch.
    fn estimate_error(&mut self) {
        let done = self.state.film.iterations();
        if done.is_power_of_two() || ErrorEstimate::is_due(done) {
            let start = Instant::now();
            self.estimated_error = self.state.film.estimated_error();
            self.state.record.times.add(&PassTimes { film: start.elapsed(), ..PassTimes::default() });
        }
    }

    /// Adds the error against the reference, if there is one, to the series of the record.
    fn compare(&mut self) {
        if let Some(reference) = &self.reference
            && !self.state.film.is_empty()
        {
            let point = self.state.error_against(reference);
            self.state.record.series.push(point);
        }
    }

    fn fraction(&self, stop: &Stop) -> f64 {
        let by_iterations = fraction_of_iterations(&self.state.film, &self.range, stop.iterations);
        let by_time = stop.seconds.map_or(0.0, |limit| self.seconds() / limit);
        // The relMSE falls with the number of iterations.
        let by_error = stop.error.map_or(0.0, |limit| limit / self.estimated_error.high);
        by_iterations.max(by_time).max(by_error).clamp(0.0, 1.0)
    }

    /// The film.
    #[must_use]
    pub const fn film(&self) -> &Film {
        &self.state.film
    }

    /// Techniques that the scene can use.
    #[must_use]
    pub const fn support(&self) -> &TechniqueSupport {
        &self.state.identity.support
    }

    /// A summary of all that was done so far.
    #[must_use]
    pub fn report(&self) -> Report {
        self.state.report()
    }
}

/// Time that adding an iteration to the film takes, if it was taken for `known`, and a part of so many sets
/// has taken `time`: the whole takes no less than the part, and no more than as many parts as make a whole.
fn film_time(known: Duration, time: Duration, sets: u32) -> Duration {
    known.clamp(time, time * SETS / sets.clamp(1, SETS))
}

/// Part that is done of the iterations in `range`, or of the `limit` of those on the film if it is nearer. An
/// iteration out of the range that another render has begun stays as it is.
fn fraction_of_iterations(film: &Film, range: &Range<u64>, limit: Option<u64>) -> f64 {
    let begun = film.begun().into_iter().filter(|(iteration, _)| range.contains(iteration));
    let begun: f64 = begun.map(|(_, share)| share).sum();
    let in_range = film.iteration_set().count_in(range) as f64 + begun;
    let by_range = in_range / range.end.saturating_sub(range.start).max(1) as f64;
    let by_limit = limit.map_or(0.0, |limit| (film.iterations() as f64 + begun) / limit.max(1) as f64);
    by_range.max(by_limit)
}

/// Seconds that an iteration may take, the adding to the film not included, after so many `seconds` of a
/// render with a limit; `is_first` if there is nothing on the film.
fn seconds_left(limit: f64, seconds: f64, film_time: f64, is_first: bool) -> f64 {
    /// Part of the limit by which an iteration may exceed it, so that short ones stay whole.
    const PATIENCE: f64 = 0.01;
    /// Seconds, and part of the limit, that the first iteration has however long the preparation took: there
    /// is always a picture.
    const FIRST: (f64, f64) = (0.5, 0.025);
    let least = if is_first { FIRST.0.max(FIRST.1 * limit) } else { 0.0 };
    ((1.0 + PATIENCE) * limit - seconds - film_time).max(least)
}

/// Seconds that an iteration takes until its light sub-paths have paid, by the times of some.
fn seconds_until_it_pays(times: &PassSeconds, iterations: u64) -> f64 {
    /// Part of its camera sub-paths from which on they have.
    const LEAST_PART: f64 = 0.1;
    (times.light + times.build + LEAST_PART * times.camera) / iterations.max(1) as f64
}

#[cfg(test)]
mod tests {
    use upbp_estimators::TechniqueSet;
    use upbp_estimators::scene::PixelRect;

    use super::*;

    /// Two iterations of 8 s, a quarter of them light sub-paths, after a preparation of a second.
    const TIMES: PassSeconds =
        PassSeconds { preparation: 1.0, light: 3.0, build: 1.0, camera: 11.0, film: 1.0 };

    #[test]
    fn an_iteration_is_begun_if_some_of_it_fits() {
        let until_it_pays = seconds_until_it_pays(&TIMES, 2);
        assert!((until_it_pays - 2.55).abs() < 1e-12, "{until_it_pays}");
        // After 17 s of 20 it is, although less than half of it fits; after 18 s it is not.
        assert!(TIMES.total() + until_it_pays < 20.0);
        assert!(TIMES.total() + 1.0 + until_it_pays > 20.0);
    }

    #[test]
    fn a_part_tells_the_time_of_a_whole_as_far_as_it_can() {
        let [known, short, long] = [10, 1, 30].map(Duration::from_millis);
        // A few sets do not take what a whole iteration takes.
        assert_eq!(film_time(known, short, 8), known);
        // Half of them do, up to a factor of two.
        assert_eq!(film_time(known, short, SETS / 2), 2 * short);
        assert_eq!(film_time(known, long, 8), long);
        assert_eq!([short, long].map(|time| film_time(known, time, SETS)), [short, long]);
    }

    #[test]
    fn begun_iterations_count_in_the_range_alone() {
        let rect = PixelRect { x: 0, y: 0, width: 2, height: 1 };
        let mut film = Film::new(rect, TechniqueSet::BPT, false);
        let mut add = |iteration, end| film.add_part(iteration, 0..end, &[Pixel::BLACK; 2], &[]);
        add(3, SETS / 2);
        add(10, SETS);
        add(11, SETS / 4);
        assert_eq!(fraction_of_iterations(&film, &(10..20), None), 0.125);
        assert_eq!(fraction_of_iterations(&film, &(0..5), None), 0.1);
        assert_eq!(fraction_of_iterations(&film, &(20..25), None), 0.0);
        assert_eq!(fraction_of_iterations(&film, &(10..20), Some(5)), 0.25);
        // A range without iterations is no error.
        let empty = Range { start: 20, end: 10 };
        assert_eq!(fraction_of_iterations(&film, &empty, None), 0.0);
    }

    #[test]
    fn an_iteration_ends_at_the_limit() {
        assert!((seconds_left(20.0, 17.0, 0.5, false) - 2.7).abs() < 1e-12);
        assert_eq!(seconds_left(20.0, 21.0, 0.5, false), 0.0);
        // There is always a picture.
        assert_eq!(seconds_left(1.0, 3.0, 0.5, true), 0.5);
        assert_eq!(seconds_left(100.0, 120.0, 0.5, true), 2.5);
    }
}
