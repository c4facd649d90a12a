//! The scheduler: iterations, each a plan and three passes, until a rule says stop.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use upbp_estimators::scene::{Camera, EmitterId, Scene};
use upbp_estimators::walk::Context;
use upbp_estimators::{LightMap, Plan, StreamKind, Technique, TechniqueSet, World};

use crate::adapt;
use crate::census::Census;
use crate::choices::{self, everything, stage};
use crate::emitters::{self, EmitterChoices};
use crate::error::{RenderError, StateError};
use crate::film::{Film, Pixel};
use crate::iterations::MAX_ITERATIONS;
use crate::memory::LightCounts;
use crate::passes::{BLACK, Lists, add_splats, camera_pass, light_pass};
use crate::pilot::{self, Pilot};
use crate::planner::Planner;
use crate::report::{ErrorPoint, PassTimes, Report};
use crate::settings::CheckedSettings;
use crate::stage::{RenderPlan, Stage};
use crate::state::{Identity, Record, State, fingerprint};
use crate::stop::{Canceller, Outcome, Progress, Stop, StopReason};
use crate::techniques::Techniques;

/// A render of one scene.
///
/// Iterations are independent given their index, and the same for any number of threads: the pool that is current when the
/// methods are called does the work.
pub struct Renderer<'a, S: Scene> {
    world: World<'a, S>,
    /// None if there is no choice.
    emitters: Option<EmitterChoices>,
    pilot: Pilot,
    /// Chooses the plan, unless it is given.
    planner: Option<Planner>,
    state: State,
    /// The iterations that are rendered.
    range: Range<u64>,
    pixels: Vec<Pixel>,
    lists: Lists<S::Bsdf>,
    cancelled: Arc<AtomicBool>,
}

impl<'a, S: Scene> Renderer<'a, S> {
    /// Takes the census, runs the pilot, and makes a plan.
    ///
    /// # Errors
    /// A scene whose bounds, powers or crop make no sense, or a film that exceeds the memory budget.
    pub fn new(scene: &'a S, settings: CheckedSettings) -> Result<Self, RenderError> {
        Self::prepare(scene, settings, None)
    }

    /// As [`new`](Self::new), but with a plan that was made before, perhaps on another machine, and does not change.
    ///
    /// # Errors
    /// As `new`; or the plan has techniques that the settings or the scene rule out.
    pub fn with_plan(scene: &'a S, settings: CheckedSettings, plan: RenderPlan) -> Result<Self, RenderError> {
        Self::prepare(scene, settings, Some(plan))
    }

    fn prepare(
        scene: &'a S,
        settings: CheckedSettings,
        frozen: Option<RenderPlan>,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        let mut world = World::new(scene)?;
        let census = Census::take(&world, settings.techniques.candidates(), settings.max_length);
        let techniques = census.techniques;
        if let Some(stage) =
            frozen.iter().flat_map(RenderPlan::stages).find(|s| !s.techniques.without(techniques).is_empty())
        {
            return Err(RenderError::Plan {
                from: stage.from,
                extra: stage.techniques.without(techniques),
                techniques,
            });
        }
        let rect = scene.camera().crop();
        let budget = u64::from(settings.memory) << 20;
        let film_bytes = Film::memory_bytes(rect, techniques);
        // Light vertices have gone when an image is written.
        let output_bytes = Film::output_bytes(rect, techniques);
        if film_bytes + output_bytes > budget {
            return Err(RenderError::Memory {
                width: rect.width,
                height: rect.height,
                needed: (film_bytes + output_bytes).div_ceil(1 << 20),
                budget: u64::from(settings.memory),
            });
        }
        let without_pilot: TechniqueSet =
            [Technique::Hit, Technique::Nee, Technique::LightTracing].into_iter().collect();
        let look = |world: &World<'_, S>, light_paths| {
            if techniques.without(without_pilot).is_empty() {
                Pilot::default()
            } else {
                pilot::run(world, &settings, techniques, light_paths)
            }
        };
        let [few, many] = pilot::LIGHT_PATHS;
        let emitters = (scene.emitters().len() > 1).then(|| {
            let pilot = look(&world, few);
            let light_paths = emitters::light_paths_for(scene.emitters().len(), pilot.vertices_per_path);
            let plan = |techniques| {
                let stage = stage(&world, &settings, techniques, &pilot, [light_paths, light_paths / 8]);
                choices::plan(&world, &settings, &stage, 0)
            };
            let camera = techniques.intersection(TechniqueSet::PT);
            let may_be_alone = matches!(settings.techniques, Techniques::Auto) && camera != techniques;
            let alone = may_be_alone.then(|| plan(camera));
            EmitterChoices::measure(&world, &plan(techniques), alone.as_ref())
        });
        let mut probabilities = Vec::new();
        // With light sub-paths last: the pilot and trials have some.
        for has_light_paths in [false, true] {
            if let Some(emitters) = &emitters {
                emitters.apply(&mut world, has_light_paths);
            }
            for emitter in (0..scene.emitters().len() as u32).map(EmitterId) {
                let chosen = [world.emission_probability(emitter), world.next_event_probability(emitter)];
                probabilities.extend(chosen.map(f32::to_le_bytes).as_flattened());
            }
        }
        let pilot = look(&world, many);
        let pixels = rect.width.saturating_mul(rect.height);
        for stage in frozen.iter().flat_map(RenderPlan::stages) {
            let counts = LightCounts::expected(&pilot, stage.light_paths, stage.beam_paths);
            let needed = film_bytes + counts.peak_bytes::<S::Bsdf>() as u64;
            if needed > budget {
                return Err(RenderError::PlanMemory {
                    from: stage.from,
                    needed: needed.div_ceil(1 << 20),
                    budget: u64::from(settings.memory),
                });
            }
        }
        let everything = everything(&world, &settings, techniques, &pilot, pixels, budget - film_bytes);
        let planner = Planner { settings: settings.clone(), everything, bytes: budget - film_bytes };
        let (plan, planner) = match (frozen, settings.techniques) {
            (Some(plan), _) => (plan, None),
            (None, Techniques::Auto) => {
                (RenderPlan::new(planner.stage(&world, &census, &pilot, 0)), Some(planner))
            }
            (None, Techniques::Set(_)) => (RenderPlan::new(planner.everything), None),
        };
        let identity = Identity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: String::new(),
            fingerprint: String::new(),
            film: scene.camera().resolution(),
            part: (rect.x, rect.y, rect.width, rect.height),
            settings: settings.into_inner(),
            census,
            emitters: fingerprint(&probabilities),
            plan,
        };
        let film = Film::new(rect, techniques);
        let pixels = vec![BLACK; rect.width as usize * rect.height as usize];
        let mut record = Record {
            times: PassTimes { pilot: start.elapsed(), ..PassTimes::default() },
            ..Record::default()
        };
        let first = identity.plan.stage(0);
        let counts = LightCounts::expected(&pilot, first.light_paths, first.beam_paths);
        record.expected_bytes = film_bytes + output_bytes.max(counts.peak_bytes::<S::Bsdf>() as u64);
        Ok(Self {
            world,
            emitters,
            pilot,
            planner,
            state: State { identity, record, film },
            range: 0..MAX_ITERATIONS,
            pixels,
            lists: Lists::default(),
            cancelled: Arc::default(),
        })
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
        choices::plan(&self.world, settings, stages.stage(iteration), iteration)
    }

    /// Makes the plan for all iterations up to this one.
    fn plan_up_to(&mut self, iteration: u64) {
        let Some(planner) = &self.planner else { return };
        let Identity { census, plan, .. } = &mut self.state.identity;
        let start = Instant::now();
        while let Some(from) = adapt::REVIEWS.get(plan.stages().len()).filter(|from| **from <= iteration) {
            if let Some(emitters) = &self.emitters {
                emitters.apply(&mut self.world, true);
            }
            let review = plan.stages().len() as u32;
            plan.push(Stage { from: *from, ..planner.stage(&self.world, census, &self.pilot, review) });
        }
        self.state.record.times.pilot += start.elapsed();
    }

    /// Renders the next iteration: the first of the [range](Self::set_range) that is not on the film yet. `false` if there
    /// is none, or if it was cancelled: then it is as if it had not begun.
    pub fn iterate(&mut self) -> bool {
        let Some(iteration) = self.next_iteration() else { return false };
        self.plan_up_to(iteration);
        let plan = self.plan(iteration);
        if let Some(emitters) = &self.emitters {
            emitters.apply(&mut self.world, plan.light_paths > 0);
        }
        let context = Context { world: &self.world, plan: &plan };
        let (rect, pixels) = (self.state.film.rect(), &mut self.pixels);
        let mut times = PassTimes::default();
        let mut clock = Clock::start();
        pixels.fill(BLACK);
        let stores = plan.stores_vertices() || plan.stores_beams();
        let expected = LightCounts::expected(&self.pilot, plan.light_paths, plan.beam_paths);
        let expected = if stores { expected } else { LightCounts::default() };
        let lists = &mut self.lists;
        let light = light_pass(&context, StreamKind::Light, &expected, lists, &self.cancelled, |splats| {
            add_splats(rect, splats, pixels);
        });
        times.light = clock.lap();
        if self.cancelled.load(Ordering::Relaxed) {
            return false;
        }
        let map = if plan.stores_vertices() || plan.stores_beams() {
            LightMap::build(&plan, std::mem::take(&mut lists.vertices), std::mem::take(&mut lists.beams))
        } else {
            LightMap::empty()
        };
        times.build = clock.lap();
        let counters = camera_pass(&context, &map, rect, pixels, &self.cancelled);
        times.camera = clock.lap();
        if self.cancelled.load(Ordering::Relaxed) {
            return false;
        }
        let State { record, film, .. } = &mut self.state;
        record.counters.dropped += film.add(iteration, pixels);
        record.counters.add(&light);
        record.counters.add(&counters);
        record.map_bytes = record.map_bytes.max(map.memory_bytes() as u64);
        *lists = Lists { vertices: map.vertices, beams: map.beams };
        times.film = clock.lap();
        record.times.add(&times);
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
        self.lists = Lists::default();
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

    /// The scene, made ready.
    #[must_use]
    pub const fn world(&self) -> &World<'a, S> {
        &self.world
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

/// A stop watch.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the last call.
    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        let time = now.duration_since(self.0);
        self.0 = now;
        time
    }
}
