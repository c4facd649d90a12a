//! What a render asks of its scene, behind a trait without the scene's types.
//!
//! What touches the scene is compiled for each type of scene; the scheduler, which gets here a few times per iteration, films and files
//! are compiled once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use upbp_estimators::mis::{Densities, MergesApart};
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::walk::Context;
use upbp_estimators::{Counters, LightMap, Plan, StreamKind, World};

use crate::census::Census;
use crate::choices;
use crate::emitters::EmitterChoices;
use crate::film::Pixel;
use crate::memory::LightCounts;
use crate::passes::{BLACK, Lists, add_splats, camera_pass, light_pass};
use crate::pilot::Pilot;
use crate::planner::Planner;
use crate::report::PassTimes;
use crate::settings::Settings;
use crate::stage::Stage;

/// A scene at work.
pub(crate) trait Engine: Send + Sync {
    /// The stage that follows from a review. Emitters are chosen as in stages with light sub-paths from then on.
    fn stage(&mut self, planner: &Planner, census: &Census, review: u32) -> Stage;

    /// What an iteration of a stage does.
    fn plan(&self, settings: &Settings, stage: &Stage, iteration: u64) -> Plan;

    /// One iteration, into `pixels` of `rect`. `None` if it was cancelled: then the pixels mean nothing.
    fn iterate(
        &mut self,
        plan: &Plan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        cancelled: &AtomicBool,
    ) -> Option<Done>;

    /// Gives back memory that is kept from one iteration to the next.
    fn shrink(&mut self);
}

/// What an iteration did.
pub(crate) struct Done {
    pub(crate) counters: Counters,
    /// Of the look-up structures.
    pub(crate) map_bytes: u64,
    pub(crate) times: PassTimes,
}

/// The engine of a type of scenes.
pub(crate) struct SceneEngine<'a, S: Scene> {
    pub(crate) world: World<'a, S>,
    /// None if there is no choice.
    pub(crate) emitters: Option<EmitterChoices>,
    pub(crate) pilot: Pilot,
    /// Of iterations without correlation, and with it.
    pub(crate) lists: Lists<S::Bsdf>,
    pub(crate) lists_apart: Lists<S::Bsdf, MergesApart>,
}

impl<S: Scene> SceneEngine<'_, S> {
    fn choose_emitters(&mut self, has_light_paths: bool) {
        if let Some(emitters) = &self.emitters {
            emitters.apply(&mut self.world, has_light_paths);
        }
    }
}

impl<S: Scene> Engine for SceneEngine<'_, S> {
    fn stage(&mut self, planner: &Planner, census: &Census, review: u32) -> Stage {
        self.choose_emitters(true);
        planner.stage(&self.world, census, &self.pilot, review)
    }

    fn plan(&self, settings: &Settings, stage: &Stage, iteration: u64) -> Plan {
        choices::plan(&self.world, settings, stage, iteration)
    }

    fn iterate(
        &mut self,
        plan: &Plan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        cancelled: &AtomicBool,
    ) -> Option<Done> {
        self.choose_emitters(plan.light_paths > 0);
        let context = Context { world: &self.world, plan };
        // A stage of the other kind may have left its lists.
        if plan.mis.correlation.is_some() {
            self.lists = Lists::default();
            iterate(&context, &self.pilot, &mut self.lists_apart, rect, pixels, cancelled)
        } else {
            self.lists_apart = Lists::default();
            iterate(&context, &self.pilot, &mut self.lists, rect, pixels, cancelled)
        }
    }

    fn shrink(&mut self) {
        self.lists = Lists::default();
        self.lists_apart = Lists::default();
    }
}

fn iterate<S: Scene, D: Densities>(
    context: &Context<'_, S>,
    pilot: &Pilot,
    lists: &mut Lists<S::Bsdf, D>,
    rect: PixelRect,
    pixels: &mut [Pixel],
    cancelled: &AtomicBool,
) -> Option<Done> {
    let plan = context.plan;
    let mut times = PassTimes::default();
    let mut clock = Clock::start();
    pixels.fill(BLACK);
    let stores = plan.stores_vertices() || plan.stores_beams();
    let expected = LightCounts::expected(pilot, plan.light_paths, plan.beam_paths);
    let expected = if stores { expected } else { LightCounts::default() };
    let mut counters = light_pass(context, StreamKind::Light, &expected, lists, cancelled, |splats| {
        add_splats(rect, splats, pixels);
    });
    times.light = clock.lap();
    if cancelled.load(Ordering::Relaxed) {
        return None;
    }
    let map = if stores {
        LightMap::build(plan, std::mem::take(&mut lists.vertices), std::mem::take(&mut lists.beams))
    } else {
        LightMap::empty()
    };
    times.build = clock.lap();
    counters.add(&camera_pass(context, &map, rect, pixels, cancelled));
    times.camera = clock.lap();
    if cancelled.load(Ordering::Relaxed) {
        return None;
    }
    let map_bytes = map.memory_bytes() as u64;
    *lists = Lists { vertices: map.vertices, beams: map.beams };
    Some(Done { counters, map_bytes, times })
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
