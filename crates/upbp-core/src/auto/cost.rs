//! The cost of an iteration of a plan, by a model.
//!
//! The model counts steps of sub-paths, as the pilot render saw them, and takes nanoseconds per step from a
//! table that was set by hand after measurements on one machine. So a choice without a limit of time repeats
//! to the last bit, on any machine and beside any other work. With one it depends on the number of threads,
//! which tells how many iterations there will be, and on the clock, by which the preparation sizes its runs.

use upbp_estimators::{PerTechnique, Technique, TechniqueSet};

use super::pilot_render::{PilotRender, Work};
use crate::deadline::Stop;
use crate::plan::Plan;

/// Nanoseconds of a camera sub-path without its edges: the lens, the points of its sequences, the film.
const NS_PER_CAMERA_PATH: f64 = 345.0;
/// Nanoseconds of a light sub-path without its edges.
const NS_PER_LIGHT_PATH: f64 = 30.0;
/// Nanoseconds of an edge of a camera sub-path or a light sub-path.
const NS_PER_EDGE: f64 = 245.0;
/// Part of a camera edge's time if no query beam has to know what is beyond the end of the edge.
const SHORT: f64 = 0.92;
/// Nanoseconds of a call of each technique; of a query, without what it looks at.
const NS_PER_CALL: PerTechnique<f64> = [0.0, 370.0, 270.0, 270.0, 45.0, 85.0, 30.0, 110.0, 50.0];
/// Nanoseconds of a node, a leaf or a block that a query of each technique looks at.
const NS_PER_TEST: PerTechnique<f64> = [0.0, 0.0, 0.0, 0.0, 9.0, 20.0, 20.0, 9.0, 14.5];
/// Nanoseconds of a sample that a query of each technique finds.
const NS_PER_SAMPLE: PerTechnique<f64> = [0.0, 0.0, 0.0, 0.0, 110.0, 95.0, 130.0, 130.0, 235.0];
/// Nanoseconds of storing a light vertex.
const NS_PER_VERTEX: f64 = 20.0;
/// Nanoseconds of building a photon point into a tree.
const NS_PER_TREE_POINT: f64 = 65.0;
/// Nanoseconds of storing a photon beam and building it into a tree.
const NS_PER_TREE_BEAM: f64 = 380.0;
/// Time of a pilot render and of the search in its samples, over that of as much of an iteration.
const RECORDING: f64 = 4.0;

/// Techniques that query photon points in media.
const MEDIUM_POINTS: TechniqueSet = TechniqueSet::EMPTY.with(Technique::Pp3d).with(Technique::Pb2d);
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
        let plan = pilot.plan_as_run();
        let camera = (pilot.cells * (pilot.passes + 1)) as f64 * self.camera_path(&plan);
        let light = pilot.passes as f64 * self.light_paths(&plan);
        RECORDING * (camera + light)
    }

    /// Iterations of a render by a plan that ends by `stop`, as far as that can be told.
    pub(super) fn iterations(self, plan: &Plan, stop: &Stop) -> f64 {
        /// Iterations of a render without limits.
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
        let light_tracing = TechniqueSet::only(Technique::LightTracing);
        let roulette = self.0.roulette(plan);
        let beyond = SHORT + (1.0 - SHORT) * any(ALONG_QUERY_BEAMS);
        let mut camera = NS_PER_CAMERA_PATH + work.camera_edges[roulette] * NS_PER_EDGE * beyond;
        for technique in plan.techniques.without(light_tracing).iter() {
            let i = technique as usize;
            let samples = self.0.found_photons(technique, plan) * work.samples[i][roulette];
            camera += plan.active_part(technique)
                * (work.calls[i][roulette] * NS_PER_CALL[i]
                    + self.tests(technique, plan) * self.ns_per_test(technique, plan)
                    + samples * NS_PER_SAMPLE[i]);
        }
        camera
    }

    /// Processor nanoseconds of all light sub-paths of an iteration, and of what is built of them.
    fn light_paths(self, plan: &Plan) -> f64 {
        let work = &self.0.work;
        let mut light = NS_PER_LIGHT_PATH + work.light_edges * NS_PER_EDGE;
        if plan.techniques.has(Technique::LightTracing) {
            let i = Technique::LightTracing as usize;
            light += work.calls[i][self.0.roulette(plan)] * NS_PER_CALL[i];
        }
        let trees = [TechniqueSet::only(Technique::Surf), MEDIUM_POINTS];
        let queried = trees.map(|queries| plan.techniques.intersects(queries));
        if plan.techniques.has(Technique::Connect) || queried.contains(&true) {
            light += work.vertices * NS_PER_VERTEX;
        }
        for (points, queried) in work.points.into_iter().zip(queried) {
            light += if queried { points * NS_PER_TREE_POINT } else { 0.0 };
        }
        let light_paths = if plan.uses_light_paths() { f64::from(plan.light_paths) } else { 0.0 };
        let beam_paths =
            if plan.techniques.intersects(TechniqueSet::BEAMS) { f64::from(plan.beam_paths) } else { 0.0 };
        light_paths * light + beam_paths * work.beams * NS_PER_TREE_BEAM
    }

    /// Nanoseconds of a node, a leaf or a block. Lines through many photon points wait for memory: each pass
    /// other parts of the tree, which no cache holds any more.
    fn ns_per_test(self, technique: Technique, plan: &Plan) -> f64 {
        /// Photon points up to which the table holds.
        const CACHED: f64 = 65_536.0;
        let points = f64::from(plan.light_paths) * self.0.work.points[1];
        let wait =
            if technique == Technique::Pb2d { (points / CACHED).max(1.0).powf(1.0 / 6.0) } else { 1.0 };
        wait * NS_PER_TEST[technique as usize]
    }

    /// Nodes, leaves and blocks that the queries of a camera sub-path by a technique look at among a plan's
    /// photons, with the radii of the pilot render.
    ///
    /// Among photon points they grow as the depth of the tree for queries around a point, and as the number
    /// of boxes that a line meets for those around a query beam. Among beams they grow by a power of the
    /// number within the kernel, measured as 0.4 to 0.75: of more and narrower ones a query looks at as many.
    fn tests(self, technique: Technique, plan: &Plan) -> f64 {
        /// Tests of a query that finds nothing near, whatever there is: the root and a leaf.
        const LEAST: f64 = 2.0;
        let Work { calls, tests, points, .. } = &self.0.work;
        let (i, roulette) = (technique as usize, self.0.roulette(plan));
        let paths = [&self.0.plan_as_run(), plan].map(|plan| f64::from(plan.paths_of(technique)));
        let [own, other] = paths.map(|paths| paths.max(1.0));
        let levels = |per_path: f64| (2.0 + other * per_path).ln() / (2.0 + own * per_path).ln();
        let growth = match technique {
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => 1.0,
            Technique::Surf => levels(points[0]),
            Technique::Pp3d => levels(points[1]),
            Technique::Pb2d => (other / own).cbrt(),
            Technique::Bp2d | Technique::Bb1d => {
                (self.0.kernel(technique, plan) * other / own).powf(2.0 / 3.0)
            }
        };
        let least = tests[i][roulette].min(LEAST * calls[i][roulette]);
        least + growth * (tests[i][roulette] - least)
    }
}

#[cfg(test)]
mod tests {
    use super::super::roulette::{COUNT, OF_PILOT};
    use super::super::variance::tests::{pilot, planned};
    use super::*;

    /// The cost of camera sub-paths and of light sub-paths by a plan after a pilot render that saw `work`.
    fn costs(work: &Work, thinning: [f64; 2], plan: Plan) -> [f64; 2] {
        let pilot = PilotRender { work: *work, thinning, plan: planned(1600), ..pilot() };
        [Cost(&pilot).camera_path(&plan), Cost(&pilot).light_paths(&plan)]
    }

    fn only(technique: Technique, paths: u32) -> Plan {
        Plan { techniques: TechniqueSet::only(technique), roulette: OF_PILOT, ..planned(paths) }
    }

    #[test]
    fn queries_cost_what_they_look_at() {
        let everywhere = |count: f64| [[count; COUNT]; Technique::COUNT];
        let work =
            Work { calls: everywhere(1.0), tests: everywhere(10.0), points: [4.0, 16.0], ..Work::default() };
        // A quarter of the light sub-paths were traced.
        let cost = |technique, paths| costs(&work, [0.25; 2], only(technique, paths))[0];
        for technique in Technique::MERGES {
            let call = NS_PER_CAMERA_PATH + NS_PER_CALL[technique as usize];
            let test = NS_PER_TEST[technique as usize];
            let [as_run, more] = [400, 3200].map(|paths| (cost(technique, paths) - call) / test);
            assert!((as_run - 10.0).abs() < 1e-9, "{technique:?}: {as_run}");
            let expected = 2.0
                + 8.0
                    * match technique {
                        Technique::Surf => (2.0 + 12_800.0_f64).ln() / (2.0 + 1600.0_f64).ln(),
                        Technique::Pp3d => (2.0 + 51_200.0_f64).ln() / (2.0 + 6400.0_f64).ln(),
                        Technique::Pb2d => 2.0,
                        _ => 4.0,
                    };
            assert!((more - expected).abs() < 1e-9, "{technique:?}: {more}, expected {expected}");
        }
        // As many photon points as a cache holds, and 64 times as many.
        let work = Work { points: [0.0, 1024.0], ..work };
        let cost = |paths| {
            let call = NS_PER_CAMERA_PATH + NS_PER_CALL[Technique::Pb2d as usize];
            costs(&work, [1.0; 2], only(Technique::Pb2d, paths))[0] - call
        };
        let tests = |paths: f64| 2.0 + 8.0 * (paths / 1600.0).cbrt();
        let [found, expected] = [cost(4096) / cost(64), 2.0 * tests(4096.0) / tests(64.0)];
        assert!((found / expected - 1.0).abs() < 1e-9, "{found}, expected {expected}");
    }

    #[test]
    fn plans_pay_for_the_trees_that_they_query() {
        let work = Work { points: [1.0, 10.0], beams: 100.0, ..Work::default() };
        for (technique, trees) in [
            (Technique::Surf, NS_PER_TREE_POINT),
            (Technique::Pp3d, 10.0 * NS_PER_TREE_POINT),
            (Technique::Pb2d, 10.0 * NS_PER_TREE_POINT),
            (Technique::Bb1d, 100.0 * NS_PER_TREE_BEAM),
            (Technique::LightTracing, 0.0),
        ] {
            let found = costs(&work, [1.0; 2], only(technique, 16))[1];
            assert!((found - 16.0 * (NS_PER_LIGHT_PATH + trees)).abs() < 1e-6, "{technique:?}: {found}");
        }
        // None traced, none planned.
        let pilot = PilotRender { work, thinning: [0.0; 2], plan: planned(0), ..pilot() };
        assert!(Cost(&pilot).of_pilot().is_finite() && Cost(&pilot).iteration(&planned(0)).is_finite());
    }
}
