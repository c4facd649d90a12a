//! The scheduler: iterations, each a plan and three passes, until a rule says stop.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use upbp_estimators::Plan;
use upbp_estimators::scene::Scene;

use crate::adapt;
use crate::census::Census;
use crate::engine::Engine;
use crate::error::{RenderError, StateError};
use crate::film::{Film, Pixel};
use crate::iterations::MAX_ITERATIONS;
use crate::passes::BLACK;
use crate::planner::Planner;
use crate::prepare::{Prepared, prepare};
use crate::report::{ErrorPoint, PassTimes, Report};
use crate::settings::CheckedSettings;
use crate::stage::{RenderPlan, Stage};
use crate::state::{Identity, State, fingerprint};
use crate::stop::{Canceller, Outcome, Progress, Stop, StopReason};

/// A render of one scene.
///
/// Iterations are independent given their index, and the same for any number of threads: the pool that is current when the
/// methods are called does the work.
pub struct Renderer<'a> {
    engine: Box<dyn Engine + 'a>,
    /// Chooses the plan, unless it is given.
    planner: Option<Planner>,
    state: State,
    /// The iterations that are rendered.
    range: Range<u64>,
    pixels: Vec<Pixel>,
    cancelled: Arc<AtomicBool>,
}

/// A renderer may go to another thread.
const _: () = {
    const fn check<T: Send + Sync>() {}
    check::<Renderer<'static>>();
};

impl<'a> Renderer<'a> {
    /// Takes the census, runs the pilot, and makes a plan.
    ///
    /// The walks are compiled for the type of scene, where this is called.
    ///
    /// # Errors
    /// A scene whose bounds, powers or crop make no sense, or a film that exceeds the memory budget.
    pub fn new<S: Scene>(scene: &'a S, settings: CheckedSettings) -> Result<Self, RenderError> {
        Ok(Self::begin(prepare(scene, settings, None)?))
    }

    /// As [`new`](Self::new), but with a plan that was made before, perhaps on another machine, and does not change.
    ///
    /// # Errors
    /// As `new`; or the plan has techniques that the settings or the scene rule out, or exceeds the memory budget.
    pub fn with_plan<S: Scene>(
        scene: &'a S,
        settings: CheckedSettings,
        plan: RenderPlan,
    ) -> Result<Self, RenderError> {
        Ok(Self::begin(prepare(scene, settings, Some(plan))?))
    }

    fn begin(Prepared { engine, planner, state }: Prepared<'a>) -> Self {
        let rect = state.film.rect();
        Self {
            engine,
            planner,
            state,
            range: 0..MAX_ITERATIONS,
            pixels: vec![BLACK; rect.width as usize * rect.height as usize],
            cancelled: Arc::default(),
        }
    }

    /// Says which scene this is, so that states of different scenes are told apart: a name for people, and a fingerprint of
    /// all that the scene's content depends on.
    pub fn identify_scene(&mut self, name: &str, content: &[u8]) {
        name.clone_into(&mut self.state.identity.scene);
        self.state.identity.fingerprint = fingerprint(content);
    }

    /// Renders only iterations of `range`, which may be a share of a render that many machines work on. Indices from
    /// [`MAX_ITERATIONS`] on are never rendered.
    pub fn set_range(&mut self, range: Range<u64>) {
        self.range = range.start..range.end.min(MAX_ITERATIONS);
    }

    /// Goes on where a state was left, or adds what others have rendered: what the state holds is not rendered again. For a
    /// moment there are two films in memory.
    ///
    /// # Errors
    /// As [`State::merge`]: then nothing has changed.
    pub fn resume(&mut self, state: State) -> Result<(), StateError> {
        let mut identity = self.state.identity.clone();
        if self.planner.is_some() && self.state.film.iteration_set().is_empty() {
            // What was chosen then stays chosen, even if time was measured and would now be measured otherwise.
            self.state.identity.plan.clone_from(&state.identity.plan);
        }
        let merged = self.state.merge(state);
        if merged.is_ok() {
            identity.plan.clone_from(&self.state.identity.plan);
        }
        // The settings of this render, where they do not matter.
        self.state.identity = identity;
        merged
    }

    /// All that was done so far, to be saved or merged.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// What an iteration does, as far as it has been decided.
    #[must_use]
    pub fn plan(&self, iteration: u64) -> Plan {
        let Identity { settings, plan: stages, .. } = &self.state.identity;
        self.engine.plan(settings, stages.stage(iteration), iteration)
    }

    /// Makes the plan for all iterations up to this one.
    fn plan_up_to(&mut self, iteration: u64) {
        let Some(planner) = &self.planner else { return };
        let Identity { census, plan, .. } = &mut self.state.identity;
        let start = Instant::now();
        while let Some(from) = adapt::REVIEWS.get(plan.stages().len()).filter(|from| **from <= iteration) {
            let review = plan.stages().len() as u32;
            plan.push(Stage { from: *from, ..self.engine.stage(planner, census, review) });
        }
        let times = PassTimes { pilot: start.elapsed(), ..PassTimes::default() };
        self.state.record.times.add(&times);
    }

    /// Renders the next iteration: the first of the [range](Self::set_range) that is not on the film yet. `false` if there
    /// is none, or if it was cancelled: then it is as if it had not begun.
    pub fn iterate(&mut self) -> bool {
        let Some(iteration) = self.next_iteration() else { return false };
        self.plan_up_to(iteration);
        let plan = self.plan(iteration);
        let State { record, film, .. } = &mut self.state;
        let Some(mut done) = self.engine.iterate(&plan, film.rect(), &mut self.pixels, &self.cancelled)
        else {
            return false;
        };
        let start = Instant::now();
        done.counters.dropped += film.add(iteration, &self.pixels);
        done.times.film = start.elapsed();
        // What a state file says may be of any size: sums that saturate.
        record.counters.add(&done.counters);
        record.times.add(&done.times);
        record.map_bytes = record.map_bytes.max(done.map_bytes);
        true
    }

    fn next_iteration(&self) -> Option<u64> {
        self.state.film.iteration_set().first_missing(&self.range)
    }

    /// Seconds of rendering so far.
    fn seconds(&self) -> f64 {
        self.state.record.times.seconds().total()
    }

    /// Renders until a rule of `stop` holds or `progress`, which is called after every iteration, breaks. Time spent in
    /// `progress` does not count.
    pub fn render(&mut self, stop: &Stop, progress: impl FnMut(&Progress<'_>) -> ControlFlow<()>) -> Outcome {
        let outcome = self.render_until(stop, progress);
        // Room for what is done with the picture.
        self.engine.shrink();
        outcome
    }

    fn render_until(
        &mut self,
        stop: &Stop,
        mut progress: impl FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Outcome {
        loop {
            if let Some(reason) = self.reason_to_stop(stop) {
                return Outcome { reason };
            }
            if !self.iterate() {
                return Outcome { reason: StopReason::Cancelled };
            }
            let film = &self.state.film;
            let now = Progress {
                iterations: film.iterations(),
                seconds: self.seconds(),
                fraction: self.fraction(stop),
                estimated_error: film.estimated_error(),
                state: &self.state,
                film,
            };
            if progress(&now).is_break() {
                return Outcome { reason: StopReason::Cancelled };
            }
        }
    }

    fn reason_to_stop(&self, stop: &Stop) -> Option<StopReason> {
        let done = self.state.film.iterations();
        if self.next_iteration().is_none() || stop.iterations.is_some_and(|limit| done >= limit) {
            return Some(StopReason::Iterations);
        }
        if let Some(limit) = stop.seconds
            && done > 0
        {
            let elapsed = self.seconds();
            let one = (elapsed - self.state.record.times.pilot.as_secs_f64()) / done as f64;
            if elapsed + 0.5 * one > limit {
                return Some(StopReason::Time);
            }
        }
        // The estimate of the error is itself noisy: a few iterations first.
        if done >= 4 && stop.error.is_some_and(|limit| self.state.film.estimated_error() <= limit) {
            return Some(StopReason::Error);
        }
        None
    }

    fn fraction(&self, stop: &Stop) -> f64 {
        let film = &self.state.film;
        let in_range = film.iteration_set().count_in(&self.range);
        let by_range = in_range as f64 / self.range.end.saturating_sub(self.range.start).max(1) as f64;
        let by_iterations =
            stop.iterations.map_or(0.0, |limit| film.iterations() as f64 / limit.max(1) as f64);
        let by_time = stop.seconds.map_or(0.0, |limit| self.seconds() / limit);
        // The relMSE falls with the number of iterations.
        let by_error = stop.error.map_or(0.0, |limit| limit / film.estimated_error());
        by_range.max(by_iterations).max(by_time).max(by_error).clamp(0.0, 1.0)
    }

    /// A handle that stops the render from any thread.
    #[must_use]
    pub fn canceller(&self) -> Canceller {
        Canceller(Arc::clone(&self.cancelled))
    }

    /// Adds a point to the report's series of errors.
    pub fn record_error(&mut self, point: ErrorPoint) {
        self.state.record.series.push(point);
    }

    /// The film.
    #[must_use]
    pub const fn film(&self) -> &Film {
        &self.state.film
    }

    /// What the scene can use.
    #[must_use]
    pub const fn census(&self) -> &Census {
        &self.state.identity.census
    }

    /// What was done so far.
    #[must_use]
    pub fn report(&self) -> Report {
        self.state.report()
    }
}
