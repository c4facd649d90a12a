//! The cost of an iteration of a plan, by a model.
//!
//! The model counts steps of sub-paths, as the pilot render saw them, and takes nanoseconds per step from a
//! table that was set by hand after measurements on one machine. So a choice repeats to the last bit, on any
//! machine and beside any other work.

use upbp_estimators::{Technique, TechniqueSet};

use super::full_plan::BEAMS;
use super::pilot_render::PilotRender;
use super::pilot_render::recorder::ByTechnique;
use crate::deadline::Stop;
use crate::plan::Plan;

/// Nanoseconds of an edge of a camera sub-path or a light sub-path.
const NS_PER_EDGE: f64 = 300.0;
/// Part of a camera edge's time if no query beam has to know what is beyond the end of the edge.
const SHORT: f64 = 0.85;
/// Nanoseconds of a call of each technique; of a query, among as many photons or beams as
/// [`USUAL_PHOTONS`] and [`USUAL_BEAMS`] say.
const NS_PER_CALL: ByTechnique<f64> = [0.0, 220.0, 330.0, 150.0, 110.0, 110.0, 260.0, 200.0, 450.0];
/// Light vertices among which a query takes the time of the table.
const USUAL_PHOTONS: f64 = 65_536.0;
/// The same of beams.
const USUAL_BEAMS: f64 = 4096.0;
/// Nanoseconds of a sample that a call of each technique finds.
const NS_PER_SAMPLE: ByTechnique<f64> = [0.0, 0.0, 0.0, 0.0, 70.0, 90.0, 150.0, 200.0, 215.0];
/// Nanoseconds of storing a light vertex.
const NS_PER_VERTEX: f64 = 25.0;
/// Nanoseconds of building a light vertex into a tree.
const NS_PER_TREE_POINT: f64 = 90.0;
/// Nanoseconds of storing a photon beam and building it into a tree.
const NS_PER_TREE_BEAM: f64 = 600.0;
/// Nanoseconds of adding a pixel to the film.
const NS_PER_PIXEL: f64 = 40.0;
/// Time of a pilot render and of the search in its samples, over that of as much of an iteration.
const RECORDING: f64 = 4.0;

/// Techniques that query photon points.
const PHOTON_POINTS: TechniqueSet =
    TechniqueSet::EMPTY.with(Technique::Surf).with(Technique::Pp3d).with(Technique::Pb2d);
/// Techniques whose query is a camera edge, to its very end.
const ALONG_QUERY_BEAMS: TechniqueSet = TechniqueSet::EMPTY.with(Technique::Pb2d).with(Technique::Bb1d);

/// Costs by the counts of a pilot render.
#[derive(Clone, Copy)]
pub(super) struct Cost<'a>(&'a PilotRender);

impl<'a> Cost<'a> {
    pub(super) const fn of(pilot: &'a PilotRender) -> Self {
        Self(pilot)
    }

    /// Processor nanoseconds of the pilot render and of the search in it.
    pub(super) fn of_pilot(self) -> f64 {
        let pilot = self.0;
        // All passes of each cell's pixel, and its partner.
        let camera = (pilot.cells * (pilot.passes + 1)) as f64 * self.camera_path(&pilot.plan);
        let light = pilot.passes as f64 * pilot.thinning[0] * self.light_paths(&pilot.plan);
        RECORDING * (camera + light)
    }

    /// Iterations of a render by a plan that ends by `stop`, as far as that can be told.
    pub(super) fn iterations(self, plan: &Plan, stop: &Stop) -> f64 {
        /// Of a render without such limits.
        const UNKNOWN: f64 = 64.0;
        let by_number = stop.iterations.map(|iterations| iterations as f64);
        let nanoseconds = |seconds: f64| 1e9 * seconds * rayon::current_num_threads() as f64;
        let by_time = stop.seconds.map(|seconds| nanoseconds(seconds) / self.iteration(plan));
        by_number.into_iter().chain(by_time).reduce(f64::min).unwrap_or(UNKNOWN).max(1.0)
    }

    /// Processor nanoseconds of an iteration.
    pub(super) fn iteration(self, plan: &Plan) -> f64 {
        self.0.pixels * self.camera_path(plan) + self.light_paths(plan)
    }

    /// Processor nanoseconds of a pixel of an iteration.
    fn camera_path(self, plan: &Plan) -> f64 {
        let work = &self.0.work;
        // The part of the camera sub-paths that run any of some techniques.
        let any = |techniques: TechniqueSet| {
            let run = plan.techniques.intersection(techniques);
            1.0 - run.iter().map(|technique| 1.0 - plan.active_part(technique)).product::<f64>()
        };
        let light_tracing = TechniqueSet::EMPTY.with(Technique::LightTracing);
        let roulette = self.0.roulette(plan);
        let beyond = SHORT + (1.0 - SHORT) * any(ALONG_QUERY_BEAMS);
        let mut camera = NS_PER_PIXEL + work.camera_edges[roulette] * NS_PER_EDGE * beyond;
        for technique in plan.techniques.without(light_tracing).iter() {
            let i = technique as usize;
            let calls = work.calls[i][roulette] * NS_PER_CALL[i] * self.growth(technique, plan);
            let samples = self.0.relative_photons(technique, plan) * work.samples[i][roulette];
            camera += plan.active_part(technique) * (calls + samples * NS_PER_SAMPLE[i]);
        }
        camera
    }

    /// Processor nanoseconds of all light sub-paths of an iteration, and of what is built of them.
    fn light_paths(self, plan: &Plan) -> f64 {
        let work = &self.0.work;
        let mut light = work.light_edges * NS_PER_EDGE;
        if plan.techniques.has(Technique::LightTracing) {
            let i = Technique::LightTracing as usize;
            light += work.calls[i][self.0.roulette(plan)] * NS_PER_CALL[i];
        }
        if plan.techniques.intersects(PHOTON_POINTS.with(Technique::Connect)) {
            light += work.vertices * NS_PER_VERTEX;
        }
        if plan.techniques.intersects(PHOTON_POINTS) {
            light += work.vertices * NS_PER_TREE_POINT;
        }
        let light_paths = if plan.uses_light_paths() { f64::from(plan.light_paths) } else { 0.0 };
        let beam_paths = if plan.techniques.intersects(BEAMS) { f64::from(plan.beam_paths) } else { 0.0 };
        light_paths * light + beam_paths * work.beams * NS_PER_TREE_BEAM
    }

    /// Time of a call among the photons or beams of a plan over that of the table: by the depth of their
    /// tree, and for points around a query beam by the number of boxes that a line through the tree meets,
    /// most of which hold nothing that is near; in small trees these are about the same.
    fn growth(self, technique: Technique, plan: &Plan) -> f64 {
        let paths = f64::from(plan.paths_of(technique));
        let (photons, beams) = (paths * self.0.work.vertices, paths * self.0.work.beams);
        let levels = |count: f64, usual: f64| (2.0 + count).ln() / (2.0 + usual).ln();
        match technique {
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => 1.0,
            Technique::Surf | Technique::Pp3d => levels(photons, USUAL_PHOTONS),
            Technique::Pb2d => (photons / USUAL_PHOTONS).cbrt().max(1.0),
            Technique::Bp2d | Technique::Bb1d => levels(beams, USUAL_BEAMS),
        }
    }
}
