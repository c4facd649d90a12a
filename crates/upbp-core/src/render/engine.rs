//! Passes over a scene, behind a trait without the scene's types.
//!
//! Code that touches the scene is compiled for each type of scene; the scheduler, which gets here a few times
//! per iteration, films and files are compiled once.

use std::ops::Range;

use upbp_estimators::path::{Context, LightChunk};
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::{Counters, IterationPlan, LightMap, PreparedScene};
use upbp_media::Lanes;

use super::passes::{Buffers, add_splats, blacken, camera_pass, light_pass};
use crate::auto;
use crate::auto::memory_limit::LightCounts;
use crate::auto::statistics::Statistics;
use crate::deadline::{Clock, Halt};
use crate::film::Pixel;
use crate::plan::Plan;
use crate::settings::Settings;
use crate::state::PassTimes;

/// A scene at work.
pub(crate) trait Engine: Send + Sync {
    /// The plan of one iteration.
    fn iteration_plan(&self, settings: &Settings, plan: &Plan, iteration: u64) -> IterationPlan;

    /// The light sub-paths of an iteration, which are kept for its camera sub-paths; `pixels` of `rect`
    /// become what is splatted there. `None` if it was halted: then the pixels mean nothing.
    fn trace_light(
        &mut self,
        plan: &IterationPlan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<LightDone>;

    /// The camera sub-paths of the pixels of some sets, added to the buffers. Light sub-paths come first.
    /// `None` if it was halted: then the pixels of these sets mean nothing.
    fn trace_camera(
        &self,
        plan: &IterationPlan,
        rect: PixelRect,
        sets: &Range<u32>,
        buffers: Buffers<'_>,
        halt: &Halt<'_>,
    ) -> Option<Counters>;

    /// Gives back memory that is kept from one iteration to the next.
    fn shrink(&mut self);
}

/// Counts and times of the light sub-paths of an iteration.
pub(crate) struct LightDone {
    pub(crate) counters: Counters,
    /// Bytes of vertices, beams and their trees.
    pub(crate) map_bytes: u64,
    /// Times of tracing, and of building the trees.
    pub(crate) times: PassTimes,
}

/// The engine of a type of scenes, with walks in the lanes `L`.
pub(crate) struct SceneEngine<'a, S: Scene, L: Lanes> {
    pub(crate) scene: PreparedScene<'a, S>,
    pub(crate) statistics: Statistics,
    /// Photons and beams of the iteration at hand.
    pub(crate) map: LightMap<S::Bsdf, f64, L>,
}

impl<S: Scene, L: Lanes> Engine for SceneEngine<'_, S, L> {
    fn iteration_plan(&self, settings: &Settings, plan: &Plan, iteration: u64) -> IterationPlan {
        auto::iteration_plan(&self.scene, settings, plan, iteration)
    }

    fn trace_light(
        &mut self,
        plan: &IterationPlan,
        rect: PixelRect,
        pixels: &mut [Pixel],
        halt: &Halt<'_>,
    ) -> Option<LightDone> {
        // The lists of the iteration before are used again: the allocator need not find a use for what was
        // given back to it. The trees have no part in that, and are gone before there is anything new.
        let LightMap { vertices, beams, .. } = std::mem::replace(&mut self.map, LightMap::empty());
        let lists = LightChunk { vertices, beams, ..LightChunk::default() };
        let mut times = PassTimes::default();
        let mut clock = Clock::start();
        blacken(pixels);
        let stores = plan.stores_vertices() || plan.stores_beams();
        let expected = LightCounts::expected(&self.statistics, plan.light_paths, plan.beam_paths);
        let expected = if stores { expected } else { LightCounts::default() };
        let context = Context { prepared: &self.scene, plan };
        let all = light_pass(&context, &expected, lists, halt, |splats| {
            add_splats(rect, splats, pixels);
        })?;
        times.light = clock.lap();
        self.map = LightMap::build(plan, all.vertices, all.beams);
        times.build = clock.lap();
        let map_bytes = self.map.memory_bytes() as u64;
        Some(LightDone { counters: all.counters, map_bytes, times })
    }

    fn trace_camera(
        &self,
        plan: &IterationPlan,
        rect: PixelRect,
        sets: &Range<u32>,
        buffers: Buffers<'_>,
        halt: &Halt<'_>,
    ) -> Option<Counters> {
        let context = Context { prepared: &self.scene, plan };
        camera_pass(&context, &self.map, rect, sets, buffers, halt)
    }

    fn shrink(&mut self) {
        self.map = LightMap::empty();
    }
}
