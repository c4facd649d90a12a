//! The scheduler: iterations, each a plan and three passes, until a rule says stop.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use upbp_estimators::scene::{Camera, PixelRect, Scene};
use upbp_estimators::walk::{Context, LightVertex, PhotonBeam, Splat};
use upbp_estimators::{
    Counters, LightMap, PathLengths, Plan, PlanChoices, StreamKind, Technique, TechniqueSet, World,
};

use crate::census::Census;
use crate::emitters;
use crate::error::RenderError;
use crate::film::{Film, Pixel};
use crate::passes::{add_splats, black, camera_pass, light_pass};
use crate::pilot::{self, Neighbours, Pilot};
use crate::radius::{Radius, RadiusSchedule};
use crate::report::{ErrorPoint, PassSeconds, Report};
use crate::settings::{CheckedSettings, LightPaths};

/// The largest first radius of photon beams, relative to the scene's.
const LARGEST_BEAM_RADIUS: f32 = 3e-3;

/// When to stop: as soon as any of the rules holds. Without rules a render goes on until it is cancelled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// After this many iterations in all.
    pub iterations: Option<u64>,
    /// After this many seconds of rendering: at the end of the iteration that comes closest.
    pub seconds: Option<f64>,
    /// When [`Film::estimated_error`] is below this, after at least four iterations.
    pub error: Option<f64>,
}

/// Why a render stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The number of iterations.
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
pub struct Canceller(Arc<AtomicBool>);

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
}

/// A render of one scene.
///
/// Iterations are independent given their index, and the same for any number of threads: the pool that is current when the
/// methods are called does the work.
pub struct Renderer<'a, S: Scene> {
    world: World<'a, S>,
    settings: CheckedSettings,
    census: Census,
    pilot: Pilot,
    radii: RadiusSchedule,
    light_paths: u32,
    beam_paths: u32,
    rect: PixelRect,
    film: Film,
    pixels: Vec<Pixel>,
    seconds: PassSeconds,
    counters: Counters,
    map_bytes: u64,
    cancelled: Arc<AtomicBool>,
    series: Vec<ErrorPoint>,
}

impl<'a, S: Scene> Renderer<'a, S> {
    /// Takes the census and runs the pilot.
    ///
    /// # Errors
    /// A scene whose bounds, powers or crop make no sense, or a film that exceeds the memory budget.
    pub fn new(scene: &'a S, settings: CheckedSettings) -> Result<Self, RenderError> {
        let start = Instant::now();
        let mut world = World::new(scene)?;
        let census = Census::take(&world, settings.techniques, settings.max_length);
        let techniques = census.techniques;
        let rect = scene.camera().crop();
        let budget = u64::from(settings.memory) << 20;
        let film_bytes = Film::memory_bytes(rect, techniques);
        if film_bytes > budget {
            return Err(RenderError::Memory {
                width: rect.width,
                height: rect.height,
                needed: film_bytes.div_ceil(1 << 20),
                budget: u64::from(settings.memory),
            });
        }
        let without_pilot: TechniqueSet =
            [Technique::Hit, Technique::Nee, Technique::LightTracing].into_iter().collect();
        let look = |world: &World<'_, S>| {
            if techniques.without(without_pilot).is_empty() {
                Pilot::default()
            } else {
                pilot::run(world, &settings, techniques)
            }
        };
        let mut pilot = look(&world);
        if scene.emitters().len() > 1 {
            let light_paths = emitters::light_paths(pilot.vertices_per_path);
            let radii = first_radii(&world, &settings, techniques, &pilot, light_paths, light_paths / 8);
            let plan = plan(&world, &settings, techniques, &pilot, &radii, [light_paths, light_paths / 8], 0);
            let (emission, next_event) = emitters::measure(&world, &plan);
            world.choose_emitters_by(&emission, &next_event);
            // Other light sub-paths than before.
            pilot = look(&world);
        }
        let pixel_count = rect.width.saturating_mul(rect.height);
        let wanted = match settings.light_paths {
            LightPaths::Auto => pixel_count,
            LightPaths::Count(count) => count,
        };
        let beam_paths = settings
            .beams
            .unwrap_or_else(|| enough_beams(&world, &settings, &pilot).min(wanted / 10).max(1))
            .min(wanted);
        let (light_paths, beam_paths) =
            affordable::<S>(&pilot, budget - film_bytes, [wanted, beam_paths], techniques);
        let radii = first_radii(&world, &settings, techniques, &pilot, light_paths, beam_paths);
        let mut renderer = Self {
            film: Film::new(rect, techniques),
            pixels: black(rect),
            world,
            settings,
            census,
            pilot,
            radii,
            light_paths,
            beam_paths,
            rect,
            seconds: PassSeconds::default(),
            counters: Counters::default(),
            map_bytes: 0,
            cancelled: Arc::default(),
            series: Vec::new(),
        };
        renderer.seconds.pilot = start.elapsed().as_secs_f64();
        Ok(renderer)
    }

    /// The plan of an iteration.
    #[must_use]
    pub fn plan(&self, iteration: u64) -> Plan {
        let paths = [self.light_paths, self.beam_paths];
        plan(&self.world, &self.settings, self.census.techniques, &self.pilot, &self.radii, paths, iteration)
    }

    /// Renders one more iteration. `false` if it was cancelled: then it is as if it had not begun.
    pub fn iterate(&mut self) -> bool {
        let plan = self.plan(self.film.iterations());
        let context = Context { world: &self.world, plan: &plan };
        let mut clock = Clock::start();
        let mut light = light_pass(&context, StreamKind::Light, &self.cancelled);
        let light_seconds = clock.lap();
        let map = if plan.stores_vertices() || plan.stores_beams() {
            LightMap::build(&plan, std::mem::take(&mut light.vertices), std::mem::take(&mut light.beams))
        } else {
            LightMap::empty()
        };
        let build_seconds = clock.lap();
        let counters = camera_pass(&context, &map, self.rect, &mut self.pixels, &self.cancelled);
        let camera_seconds = clock.lap();
        if self.cancelled.load(Ordering::Relaxed) {
            return false;
        }
        add_splats(self.rect, &light.splats, &mut self.pixels);
        self.film.add(&self.pixels);
        self.counters.add(&light.counters);
        self.counters.add(&counters);
        self.map_bytes = self.map_bytes.max(map.memory_bytes() as u64);
        self.seconds.light += light_seconds;
        self.seconds.build += build_seconds;
        self.seconds.camera += camera_seconds;
        self.seconds.film += clock.lap();
        true
    }

    /// Renders until a rule of `stop` holds or `progress`, which is called after every iteration, breaks. Time spent in
    /// `progress` does not count.
    pub fn render(
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
            let now = Progress {
                iterations: self.film.iterations(),
                seconds: self.seconds.total(),
                fraction: self.fraction(stop),
                estimated_error: self.film.estimated_error(),
                film: &self.film,
            };
            if progress(&now).is_break() {
                return Outcome { reason: StopReason::Cancelled };
            }
        }
    }

    fn reason_to_stop(&self, stop: &Stop) -> Option<StopReason> {
        let done = self.film.iterations();
        if stop.iterations.is_some_and(|limit| done >= limit) {
            return Some(StopReason::Iterations);
        }
        if let Some(limit) = stop.seconds
            && done > 0
        {
            let elapsed = self.seconds.total();
            let one = (elapsed - self.seconds.pilot) / done as f64;
            if elapsed + 0.5 * one > limit {
                return Some(StopReason::Time);
            }
        }
        // The estimate of the error is itself noisy: a few iterations first.
        if done >= 4 && stop.error.is_some_and(|limit| self.film.estimated_error() <= limit) {
            return Some(StopReason::Error);
        }
        None
    }

    fn fraction(&self, stop: &Stop) -> f64 {
        let done = self.film.iterations() as f64;
        let by_iterations = stop.iterations.map_or(0.0, |limit| done / limit.max(1) as f64);
        let by_time = stop.seconds.map_or(0.0, |limit| self.seconds.total() / limit);
        // The relMSE falls with the number of iterations.
        let by_error = stop.error.map_or(0.0, |limit| limit / self.film.estimated_error());
        by_iterations.max(by_time).max(by_error).clamp(0.0, 1.0)
    }

    /// A handle that stops the render from any thread.
    #[must_use]
    pub fn canceller(&self) -> Canceller {
        Canceller(Arc::clone(&self.cancelled))
    }

    /// Adds a point to the report's series of errors.
    pub fn record_error(&mut self, point: ErrorPoint) {
        self.series.push(point);
    }

    /// The film.
    #[must_use]
    pub const fn film(&self) -> &Film {
        &self.film
    }

    /// The scene, made ready.
    #[must_use]
    pub const fn world(&self) -> &World<'a, S> {
        &self.world
    }

    /// What the scene can use.
    #[must_use]
    pub const fn census(&self) -> &Census {
        &self.census
    }

    /// What was done so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let last = self.radii.kernels(self.film.iterations().saturating_sub(1));
        let error = self.film.estimated_error();
        Report {
            version: env!("CARGO_PKG_VERSION"),
            census: self.census.clone(),
            resolution: [self.rect.width, self.rect.height],
            seed: self.settings.seed,
            iterations: self.film.iterations(),
            seconds: self.seconds,
            light_paths: self.light_paths,
            beam_paths: self.beam_paths,
            first_radii: self.radii,
            last_radii: [
                last.surf.radius(),
                last.pp3d.radius(),
                last.pb2d.radius(),
                last.bp2d.radius(),
                last.bb1d.radius(),
            ],
            counters: self.counters,
            shares: self.film.shares().into_iter().map(|(layer, share)| (layer.name(), share)).collect(),
            map_bytes: self.map_bytes,
            estimated_error: error.is_finite().then_some(error),
            series: self.series.clone(),
        }
    }
}

/// The plan of an iteration with this many light sub-paths, and this many with beams.
fn plan<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    pilot: &Pilot,
    radii: &RadiusSchedule,
    [light_paths, beam_paths]: [u32; 2],
    iteration: u64,
) -> Plan {
    Plan::new(
        world.scene,
        &PlanChoices {
            seed: settings.seed,
            iteration,
            techniques,
            light_paths,
            beam_paths,
            connections: settings.connections,
            vertices_per_light_path: pilot.vertices_per_path,
            lengths: PathLengths { min: settings.min_length, max: settings.max_length },
            roulette: settings.roulette,
            kernels: radii.kernels(iteration),
            heuristic: settings.heuristic,
            photon_beams: settings.photon_beams,
            query_beams: settings.query_beams,
        },
    )
}

/// As many light sub-paths, and as many with beams, as `wanted` and as `bytes` have room for.
fn affordable<S: Scene>(pilot: &Pilot, bytes: u64, wanted: [u32; 2], techniques: TechniqueSet) -> (u32, u32) {
    // Positions and indices in the trees take about 40 bytes per vertex more; a beam has some four pieces in its tree.
    let vertex = size_of::<LightVertex<S::Bsdf>>() as f64 + 40.0;
    let beam = size_of::<PhotonBeam>() as f64 + 300.0;
    let splat = if techniques.has(Technique::LightTracing) { size_of::<Splat>() as f64 } else { 0.0 };
    let [paths, beam_paths] = wanted.map(f64::from);
    let need = paths * pilot.vertices_per_path * (vertex + splat) + beam_paths * pilot.beams_per_path * beam;
    // Passes hold their pieces and the joined list for a moment.
    let part = (bytes as f64 / (2.0 * need.max(1.0))).min(1.0);
    (((paths * part) as u32).max(1), ((beam_paths * part) as u32).max(1))
}

/// Light sub-paths with beams such that a query beam meets a few of them. More cost more than they tell: their look-ups
/// soon take most of an iteration.
fn enough_beams<S: Scene>(world: &World<'_, S>, settings: &CheckedSettings, pilot: &Pilot) -> u32 {
    /// Photon beams within the kernel of a query beam.
    const HITS: f64 = 1.0;
    let largest = LARGEST_BEAM_RADIUS * world.bounds.radius;
    let (found, radius) = match (pilot.bb1d, settings.radii.bb1d) {
        (Some(found), Radius::Auto) => (found, largest),
        (Some(found), Radius::Scene(fraction)) => (found, fraction * world.bounds.radius),
        (Some(found), Radius::Absolute(radius)) => (found, radius),
        (None, _) => return 1024,
    };
    found.paths(HITS, f64::from(radius)).clamp(64.0, 1e6) as u32
}

fn first_radii<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    pilot: &Pilot,
    light_paths: u32,
    beam_paths: u32,
) -> RadiusSchedule {
    let scene = world.bounds.radius;
    let radius = |technique, choice, found: Option<Neighbours>, count: f64, paths: u32, most: f32| {
        if !techniques.has(technique) {
            return 0.0;
        }
        match choice {
            Radius::Absolute(radius) => radius,
            Radius::Scene(fraction) => fraction * scene,
            Radius::Auto => found
                .map_or(most * scene, |n| n.radius(count, f64::from(paths)))
                .clamp(0.1 * most * scene, most * scene),
        }
    };
    let radii = &settings.radii;
    RadiusSchedule {
        surf: radius(Technique::Surf, radii.surf, pilot.surf, 8.0, light_paths, 3e-3),
        pp3d: radius(Technique::Pp3d, radii.pp3d, pilot.pp3d, 8.0, light_paths, 5e-3),
        pb2d: radius(Technique::Pb2d, radii.pb2d, pilot.pb2d, 8.0, light_paths, 3e-3),
        bp2d: radius(Technique::Bp2d, radii.bp2d, pilot.bp2d, 8.0, beam_paths, 3e-3),
        bb1d: radius(Technique::Bb1d, radii.bb1d, pilot.bb1d, 15.0, beam_paths, LARGEST_BEAM_RADIUS),
        progressive: settings.progressive,
        // Positions have a relative precision of 6e-8.
        floor: 1e-6 * scene,
    }
}

/// A stop watch.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    /// Seconds since the last call.
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = now.duration_since(self.0).as_secs_f64();
        self.0 = now;
        seconds
    }
}
