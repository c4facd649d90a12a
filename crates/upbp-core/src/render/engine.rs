//! What a render asks of its scene, behind a trait without the scene's types.
//!
//! What touches the scene is compiled for each type of scene; the scheduler, which gets here a few times per iteration, films and files
//! are compiled once.

use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use upbp_estimators::path::Context;
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::{Counters, LightMap, Plan, StreamKind, World};

use crate::auto::choices;
use crate::auto::emitters::EmitterChoices;
use crate::auto::memory::LightCounts;
use crate::auto::planner::Planner;
use crate::auto::statistics::Pilot;
use crate::auto::support::Census;
use crate::budget::Budget;
use crate::budget::{Canceller, Halt};
use crate::film::Pixel;
use crate::plan::Stage;
use crate::render::passes::{Lists, add_splats, camera_pass, light_pass};
use crate::report::PassTimes;
use crate::settings::Settings;

/// A scene at work.
pub(crate) trait Engine: Send + Sync {
    /// The stage that follows from a review, which may take so many seconds. Emitters are chosen as in stages with light sub-paths from
    /// then on.
    fn stage(
        &mut self,
        planner: &Planner,
        census: &Census,
        review: u32,
        canceller: &Canceller,
        seconds: Option<f64>,
    ) -> Stage;

    /// What an iteration of a stage does.
    fn plan(&self, settings: &Settings, stage: &Stage, iteration: u64) -> Plan;

    /// The light sub-paths of an iteration, which are kept for its camera sub-paths; `pixels` of `rect` become what is splatted there.
    /// `None` if it was halted: then the pixels mean nothing.
    fn trace_light(
        &mut self,
        plan: &Plan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<LightDone>;

    /// The camera sub-paths of the pixels of some sets, added to `pixels`. Light sub-paths come first. `None` if it was halted: then the
    /// pixels of these sets mean nothing.
    fn trace_camera(
        &self,
        plan: &Plan,
        rect: PixelRect,
        sets: &Range<u32>,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<Counters>;

    /// Gives back memory that is kept from one iteration to the next.
    fn shrink(&mut self);
}

/// What the light sub-paths of an iteration did.
pub(crate) struct LightDone {
    pub(crate) counters: Counters,
    /// Of the look-up structures.
    pub(crate) map_bytes: u64,
    /// Of tracing, and of building the look-up structures.
    pub(crate) times: PassTimes,
}

/// The engine of a type of scenes.
pub(crate) struct SceneEngine<'a, S: Scene> {
    pub(crate) world: World<'a, S>,
    /// None if there is no choice.
    pub(crate) emitters: Option<EmitterChoices>,
    pub(crate) pilot: Pilot,
    /// What the light sub-paths of an iteration left.
    pub(crate) map: LightMap<S::Bsdf>,
}

impl<S: Scene> SceneEngine<'_, S> {
    fn choose_emitters(&mut self, has_light_paths: bool) {
        if let Some(emitters) = &self.emitters {
            emitters.apply(&mut self.world, has_light_paths);
        }
    }
}

impl<S: Scene> Engine for SceneEngine<'_, S> {
    fn stage(
        &mut self,
        planner: &Planner,
        census: &Census,
        review: u32,
        canceller: &Canceller,
        seconds: Option<f64>,
    ) -> Stage {
        self.choose_emitters(true);
        planner.stage(&self.world, census, &self.pilot, review, &Budget::new(canceller, seconds))
    }

    fn plan(&self, settings: &Settings, stage: &Stage, iteration: u64) -> Plan {
        choices::plan(&self.world, settings, stage, iteration)
    }

    fn trace_light(
        &mut self,
        plan: &Plan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<LightDone> {
        self.choose_emitters(plan.light_paths > 0);
        let context = Context { world: &self.world, plan };
        // The lists of the iteration before are used again.
        let lists = Lists::of(std::mem::replace(&mut self.map, LightMap::empty()));
        let (map, done) = trace_light(&context, &self.pilot, lists, rect, pixels, halt)?;
        self.map = map;
        Some(done)
    }

    fn trace_camera(
        &self,
        plan: &Plan,
        rect: PixelRect,
        sets: &Range<u32>,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<Counters> {
        let context = Context { world: &self.world, plan };
        camera_pass(&context, &self.map, rect, sets, pixels, halt)
    }

    fn shrink(&mut self) {
        self.map = LightMap::empty();
    }
}

fn trace_light<S: Scene>(
    context: &Context<'_, S>,
    pilot: &Pilot,
    mut lists: Lists<S::Bsdf>,
    rect: PixelRect,
    pixels: &mut [Pixel],
    halt: &Halt<'_>,
) -> Option<(LightMap<S::Bsdf>, LightDone)> {
    let plan = context.plan;
    let mut times = PassTimes::default();
    let mut clock = Clock::start();
    pixels.par_iter_mut().with_min_len(1024).for_each(|pixel| *pixel = Pixel::BLACK);
    let stores = plan.stores_vertices() || plan.stores_beams();
    let expected = LightCounts::expected(pilot, plan.light_paths, plan.beam_paths);
    let expected = if stores { expected } else { LightCounts::default() };
    let counters = light_pass(context, StreamKind::Light, &expected, &mut lists, halt, |splats| {
        add_splats(rect, splats, pixels);
    })?;
    times.light = clock.lap();
    let map = if stores { LightMap::build(plan, lists.vertices, lists.beams) } else { LightMap::empty() };
    times.build = clock.lap();
    let map_bytes = map.memory_bytes() as u64;
    Some((map, LightDone { counters, map_bytes, times }))
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
