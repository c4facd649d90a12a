//! The pilot render: a few hundred pixels or more with all techniques, written down so that any plan can be
//! judged by it.
//!
//! The walks carry the densities of every technique for itself, so that a sample comes with the weights of
//! all.

mod blocks;
pub(super) mod grid;
pub(super) mod recorder;

use std::ops::Range;

use upbp_estimators::mis;
use upbp_estimators::path::{Context, LightChunk, LightVertex, Splat};
use upbp_estimators::scene::{Camera, Scene};
use upbp_estimators::{
    Counters, IterationPlan, LightMap, PerTechnique, PreparedScene, Technique, TechniqueSet,
};
use upbp_media::Lanes;

use super::full_plan::pilot_plan;
use super::memory_limit;
use super::parallel_walks::{PIECE, PilotRun, SampleRoom, camera_path, in_pieces, light_path};
use super::roulette;
use crate::deadline::Halt;
use crate::plan::Plan;
use crate::settings::CheckedSettings;
use grid::Grid;
use recorder::{ByRoulette, Recorder, Sample, add, passed};

/// Times that a pilot render samples each of its pixels: products of two samples tell what they have in
/// common, as iterations that are stratified do.
pub(super) const PASSES: u32 = 2;
/// Splats that are paired with another one of their light sub-path, about, to tell what neighbouring pixels
/// have in common.
const ASKED_SPLATS: usize = 1 << 16;
/// Samples, at most, of 64 bytes each.
const MOST_SAMPLES: u64 = 1 << 20;
/// Light vertices of a pass, at most.
const MOST_LIGHT_VERTICES: f64 = 5e5;

/// Samples and light vertices that a pilot render may have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Samples of all passes.
    samples: usize,
    /// Light vertices of a pass.
    vertices: f64,
}

impl Limits {
    /// No more than useful, and than there is room for.
    pub(super) fn of<S: Scene, L: Lanes>(room: &memory_limit::Room) -> Self {
        Self {
            samples: room.items::<Sample>().min(MOST_SAMPLES) as usize,
            vertices: (room.items::<LightVertex<S::Bsdf, mis::ByTechnique, L>>() as f64)
                .min(MOST_LIGHT_VERTICES),
        }
    }
}

/// The size of a pilot render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    /// Pixels that it renders.
    pub(super) pixels: u32,
    /// Light sub-paths for each of them. Some plans differ in rare bright photons only, as a few in front of
    /// the camera are.
    pub(super) light_paths: u32,
}

impl Size {
    /// With less nothing can be told.
    pub(super) const LEAST: Self = Self { pixels: 25, light_paths: 8 };

    /// Pixels beyond which too little would be learnt.
    pub(super) fn most_pixels<S: Scene>(scene: &PreparedScene<'_, S>) -> u32 {
        scene.scene.camera().crop().pixels().min(16_384) as u32
    }

    /// Pixels from which on a choice is trusted: more where no media make them slow.
    pub(super) fn enough_pixels<S: Scene>(scene: &PreparedScene<'_, S>, techniques: TechniqueSet) -> u32 {
        let media = techniques.intersects(TechniqueSet::VOLUME_MERGES);
        let part = if media { 12 } else { 4 };
        (scene.scene.camera().crop().pixels() / part).clamp(400, 2048) as u32
    }
}

/// Samples and work of a pilot render. The picture is divided into cells, of each of which one pixel is
/// rendered, in several passes.
pub(super) struct PilotRender {
    /// The plan that it is of, which it ran with [fewer light sub-paths](Self::plan_as_run).
    pub(super) plan: Plan,
    /// Pixels of the picture.
    pub(super) pixels: f64,
    pub(super) cells: usize,
    /// Cells in a row.
    pub(super) columns: usize,
    /// Camera sub-paths of each cell.
    pub(super) passes: usize,
    /// Samples of camera sub-paths, by cell, then by pass, then by the light sub-path that was merged.
    pub(super) samples: Vec<Sample>,
    /// Ends of samples: `ends[cell * passes + pass]` is behind the last one of each.
    pub(super) ends: Vec<u32>,
    /// Contributions of light sub-paths to two pixels of a block, by merges or by splats.
    pub(super) pairs: Vec<PixelPair>,
    /// Splats by cell. Light sub-paths fill the whole picture.
    pub(super) splats: Vec<(u32, Sample)>,
    /// Light sub-paths per pass over those of the plan, and the same of those with beams.
    pub(super) thinning: [f64; 2],
    pub(super) work: Work,
    /// Part of the room for samples that these take.
    pub(super) room_taken: f64,
    /// Light sub-paths that there might be over those that there are.
    pub(super) more_light_paths: f64,
    /// Iterations that plans are judged for; the pilot render has the radii of the first one.
    pub(super) iterations: f64,
}

/// Merges with one light sub-path, or splats of one, at a pixel of a cell and at another one near it.
pub(super) struct PixelPair {
    pub(super) cell: u32,
    /// Number of the light sub-path.
    pub(super) path: u32,
    /// Part of their product in the mean error of blocks.
    pub(super) weight: f64,
    /// Samples of the one pixel and of the other.
    pub(super) samples: [Vec<Sample>; 2],
}

/// Average numbers of steps and samples of a sub-path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Work {
    /// Edges per camera sub-path, by roulette.
    pub(super) camera_edges: ByRoulette,
    /// Calls of each technique per camera sub-path; of light tracing per light sub-path.
    pub(super) calls: PerTechnique<ByRoulette>,
    /// Nodes, leaves and blocks of trees that the queries of each technique looked at, per camera sub-path,
    /// among the photons of the pilot render.
    pub(super) tests: PerTechnique<ByRoulette>,
    /// Samples of each technique per camera sub-path; of merges for as many photons as the plan has.
    pub(super) samples: PerTechnique<ByRoulette>,
    /// Edges per light sub-path.
    pub(super) light_edges: f64,
    /// Light vertices per light sub-path.
    pub(super) vertices: f64,
    /// Photon points on surfaces and in media per light sub-path, where they are queried.
    pub(super) points: [f64; 2],
    /// Beams per light sub-path that leaves beams.
    pub(super) beams: f64,
}

impl PilotRender {
    /// Runs `plan` with fewer light sub-paths. `None` if there were more samples than the limits allow, or if
    /// it was halted.
    pub(super) fn run<S: Scene, L: Lanes>(
        scene: &PreparedScene<'_, S>,
        settings: &CheckedSettings,
        plan: &Plan,
        size: Size,
        limits: Limits,
        halt: &Halt<'_>,
    ) -> Option<Self> {
        let grid = Grid::new(scene.scene.camera().crop(), size.pixels);
        let most_paths = (limits.vertices / plan.vertices_per_light_path.max(1.0)).max(1.0) as u32;
        let most_paths = most_paths.min(plan.light_paths);
        let paths = size.light_paths.saturating_mul(grid.cells()).min(most_paths);
        let beam_paths = plan.beam_paths.min(paths);
        let part = |traced: u32, planned: u32| f64::from(traced) / f64::from(planned.max(1));
        let mut pilot = Self {
            plan: *plan,
            pixels: grid.pixels(),
            cells: grid.cells() as usize,
            columns: grid.columns(),
            passes: PASSES as usize,
            samples: Vec::new(),
            ends: Vec::new(),
            pairs: Vec::new(),
            splats: Vec::new(),
            thinning: [part(paths, plan.light_paths), part(beam_paths, plan.beam_paths)],
            work: Work::default(),
            room_taken: 0.0,
            more_light_paths: f64::from(most_paths) / f64::from(paths.max(1)),
            iterations: 1.0,
        };
        let mut thinned = pilot_plan(scene, settings, plan).thinned(paths, beam_paths);
        let room = SampleRoom::new(limits.samples);
        let mut passes = (0..PASSES)
            .map(|pass| {
                thinned.iteration = PilotRun::Render { pass }.iteration();
                Pass::trace::<S, L>(
                    &Context { prepared: scene, plan: &thinned },
                    &grid,
                    &room,
                    pass == 0,
                    halt,
                )
            })
            .collect::<Option<Vec<_>>>()?;
        for pass in &mut passes {
            pilot.splats.append(&mut pass.splats);
        }
        pilot.room_taken = room.taken();
        let camera_paths = f64::from(grid.cells() * PASSES);
        pilot.work = pilot.work(&passes, camera_paths, [paths, beam_paths].map(|n| f64::from(n * PASSES)));
        let partners = std::mem::take(&mut passes[0].partners);
        pilot.pairs = std::mem::take(&mut passes[0].splat_pairs);
        pilot.sort(passes);
        pilot.pair_partners(&partners, &grid);
        Some(pilot)
    }

    /// The plan with as many light sub-paths as there were.
    pub(super) fn plan_as_run(&self) -> Plan {
        let traced = |planned: u32, part: f64| (part * f64::from(planned)).round() as u32;
        Plan {
            light_paths: traced(self.plan.light_paths, self.thinning[0]),
            beam_paths: traced(self.plan.beam_paths, self.thinning[1]),
            ..self.plan
        }
    }

    /// The number of the roulette of another plan.
    pub(super) fn roulette(&self, plan: &Plan) -> usize {
        roulette::number(plan.roulette, self.plan.roulette)
    }

    /// Samples that the pilot render has over those that an iteration of the plan has.
    pub(super) const fn thinning(&self, technique: Technique) -> f64 {
        if technique.is_per_camera_vertex() { 1.0 } else { self.thinning[technique.uses_beams() as usize] }
    }

    /// Light sub-paths that a technique's samples under another plan come from, relative to the plan of this
    /// render.
    pub(super) fn relative_paths(&self, technique: Technique, plan: &Plan) -> f64 {
        f64::from(plan.paths_of(technique)) / f64::from(self.plan.paths_of(technique).max(1))
    }

    /// Photons or beams within a query's kernel under another plan, mean over its iterations, relative to the
    /// first one of the plan of this render: what queries find.
    pub(super) fn found_photons(&self, technique: Technique, plan: &Plan) -> f64 {
        self.photons(technique, plan) * self.plan.radii.mean_photons(technique, self.iterations)
    }

    /// As many photons or beams within a query's kernel, relative to the first iteration of the plan of this
    /// render, as make the variance of another plan's iterations together.
    pub(super) fn relative_photons(&self, technique: Technique, plan: &Plan) -> f64 {
        self.photons(technique, plan) * self.harmonic_mean_photons(technique)
    }

    /// Photons or beams within a query's kernel in the first iteration of another plan, relative to that of
    /// the plan of this render.
    fn photons(&self, technique: Technique, plan: &Plan) -> f64 {
        self.kernel(technique, plan) * self.relative_paths(technique, plan)
    }

    /// The kernel of another plan's first iteration, relative to that of this render.
    pub(super) fn kernel(&self, technique: Technique, plan: &Plan) -> f64 {
        let [own, other] = [&self.plan, plan].map(|plan| plan.radii);
        match technique {
            Technique::Surf if own.surf > 0.0 => f64::from(other.surf / own.surf).powi(2),
            Technique::Bb1d if own.bb1d > 0.0 => f64::from(other.bb1d / own.bb1d),
            _ => 1.0,
        }
    }

    /// As many photons or beams within a query's kernel, relative to the first iteration, as make the
    /// variance of all iterations together.
    pub(super) fn harmonic_mean_photons(&self, technique: Technique) -> f64 {
        self.plan.radii.harmonic_mean_photons(technique, self.iterations)
    }

    /// The work of all passes per sub-path.
    fn work(&self, passes: &[Pass], camera_paths: f64, [light_paths, beam_paths]: [f64; 2]) -> Work {
        let mut counters = Counters::default();
        let mut edges = ByRoulette::default();
        let [mut calls, mut tests, mut samples] = [[edges; Technique::COUNT]; 3];
        let mut points = [0.0; 2];
        for pass in passes {
            counters.add(&pass.counters);
            for (sum, own) in points.iter_mut().zip(pass.points) {
                *sum += own as f64;
            }
            for recorder in pass.light.iter().chain(&pass.camera) {
                add(&mut edges, &recorder.edges);
                for (sum, own) in calls.iter_mut().zip(&recorder.calls) {
                    add(sum, own);
                }
                for (sum, own) in tests.iter_mut().zip(&recorder.tests) {
                    add(sum, own);
                }
                for sample in &recorder.samples {
                    add(&mut samples[sample.technique as usize], &passed(sample.albedos));
                }
            }
        }
        let per = |count: f64, paths: f64| if paths > 0.0 { count / paths } else { 0.0 };
        for technique in Technique::ALL {
            let i = technique as usize;
            let paths = if technique == Technique::LightTracing { light_paths } else { camera_paths };
            calls[i] = calls[i].map(|count| per(count, paths));
            tests[i] = tests[i].map(|count| per(count, paths));
            let thinning = if technique.merges() { self.thinning(technique) } else { 1.0 };
            samples[i] = samples[i].map(|count| per(count, paths) / thinning);
        }
        Work {
            camera_edges: edges.map(|count| per(count, camera_paths)),
            calls,
            tests,
            samples,
            light_edges: per(counters.light_edges as f64, light_paths),
            vertices: per(counters.light_vertices as f64, light_paths),
            points: points.map(|count| per(count, light_paths)),
            beams: per(counters.photon_beams as f64, beam_paths),
        }
    }

    /// Puts the samples of all passes in order.
    fn sort(&mut self, mut passes: Vec<Pass>) {
        let cells = self.cells;
        for piece in 0..cells.div_ceil(PIECE) {
            // Taken, so that all samples are not there twice.
            let recorders: Vec<_> =
                passes.iter_mut().map(|pass| std::mem::take(&mut pass.camera[piece])).collect();
            for path in 0..PIECE.min(cells - piece * PIECE) {
                for recorder in &recorders {
                    let start = self.samples.len();
                    self.samples.extend_from_slice(recorder.of_path(path));
                    self.samples[start..].sort_by_key(|sample| sample.light_path);
                    self.ends.push(self.samples.len() as u32);
                }
            }
        }
    }

    /// Pairs pixels with their partners by the light sub-paths of the first pass that brought merges to both.
    fn pair_partners(&mut self, partners: &[Recorder], grid: &Grid) {
        for cell in 0..self.cells {
            let Some((_, weight)) = grid.partner(cell as u32) else { continue };
            let Some(recorder) = partners.get(cell / PIECE) else { continue };
            let mut near = recorder.of_path(cell % PIECE).to_vec();
            near.sort_by_key(|sample| sample.light_path);
            let by_path = |a: &Sample, b: &Sample| a.light_path == b.light_path;
            let own = &self.samples[self.range(cell, 0)];
            for group in near.chunk_by(by_path) {
                let Some(path) = group[0].light_path else { continue };
                let start = own.partition_point(|sample| sample.light_path < group[0].light_path);
                let length = own[start..].partition_point(|sample| sample.light_path == group[0].light_path);
                if length > 0 {
                    let samples = [own[start..start + length].to_vec(), group.to_vec()];
                    self.pairs.push(PixelPair { cell: cell as u32, path, weight, samples });
                }
            }
        }
    }

    /// The samples of the camera sub-path of a cell in a pass.
    pub(super) fn samples_of(&self, cell: usize, pass: usize) -> &[Sample] {
        &self.samples[self.range(cell, pass)]
    }

    /// The places of these samples among all.
    pub(super) fn range(&self, cell: usize, pass: usize) -> Range<usize> {
        let path = cell * self.passes + pass;
        let start = if path == 0 { 0 } else { self.ends[path - 1] };
        start as usize..self.ends[path] as usize
    }
}

/// A pass: light sub-paths with their splats, and one camera sub-path for each cell.
struct Pass {
    /// Recorders of light sub-paths, by piece.
    light: Vec<Recorder>,
    /// Recorders of camera sub-paths, by piece.
    camera: Vec<Recorder>,
    /// Recorders of the partners of cells' pixels, in the same order.
    partners: Vec<Recorder>,
    splats: Vec<(u32, Sample)>,
    /// Pairs of splats of one light sub-path, if there are partners.
    splat_pairs: Vec<PixelPair>,
    counters: Counters,
    /// Photon points on surfaces and in media, where they are queried.
    points: [usize; 2],
}

impl Pass {
    /// Traces the sub-paths of a pass, also at the partners of pixels if asked to; `None` if there is not
    /// enough room.
    fn trace<S: Scene, L: Lanes>(
        context: &Context<'_, S>,
        grid: &Grid,
        room: &SampleRoom,
        with_partners: bool,
        halt: &Halt<'_>,
    ) -> Option<Self> {
        let plan: &IterationPlan = context.plan;
        let paths = plan.traced_light_paths();
        let pieces =
            in_pieces(paths, halt, |index, scratch, piece: &mut (Recorder, LightChunk<_, _, L>)| {
                let (recorder, out) = piece;
                recorder.record(room, |recorder| light_path(context, index, scratch, out, recorder))
            })?;
        let mut pass = Self {
            light: Vec::new(),
            camera: Vec::new(),
            partners: Vec::new(),
            splats: Vec::new(),
            splat_pairs: Vec::new(),
            counters: Counters::default(),
            points: [0; 2],
        };
        let splats: usize = pieces.iter().map(|(recorder, _)| recorder.samples.len()).sum();
        let step = splats.div_ceil(ASKED_SPLATS).max(1);
        let (mut vertices, mut beams) = (Vec::new(), Vec::new());
        for (piece, (recorder, out)) in pieces.into_iter().enumerate() {
            vertices.extend(out.vertices);
            beams.extend(out.beams);
            pass.counters.add(&out.counters);
            if with_partners {
                let firsts = [piece * PIECE, pass.splats.len()];
                pass.splat_pairs.extend(splat_pairs(&recorder, &out.splats, firsts, step, grid));
            }
            // A splat goes with each sample.
            let paths = recorder.ranges().enumerate().flat_map(|(path, range)| range.map(move |_| path));
            for ((splat, sample), path) in out.splats.iter().zip(&recorder.samples).zip(paths) {
                let light_path = Some((piece * PIECE + path) as u32);
                pass.splats.push((grid.cell(splat.pixel), Sample { light_path, ..*sample }));
            }
            pass.light.push(recorder);
        }
        let map = LightMap::build(plan, vertices, beams);
        pass.points = map.photon_points();
        let pieces = in_pieces(grid.cells(), halt, |cell, scratch, piece: &mut (Recorder, Counters)| {
            let (recorder, counters) = piece;
            // Passes begin alike: what they differ in is what stratification leaves.
            let (pixel, index) = (grid.pixel(cell), u64::from(cell));
            recorder.record(room, |recorder| {
                camera_path(context, &map, pixel, index, scratch, counters, recorder);
            })
        })?;
        for (recorder, counters) in pieces {
            pass.counters.add(&counters);
            pass.camera.push(recorder);
        }
        if with_partners && Technique::ALL.iter().any(|technique| plan.merges_by(*technique)) {
            pass.partners = in_pieces(grid.cells(), halt, |cell, scratch, recorder: &mut Recorder| {
                let index = u64::from(grid.cells()) + u64::from(cell);
                let mut counters = Counters::default();
                recorder.record(room, |recorder| {
                    if let Some((pixel, _)) = grid.partner(cell) {
                        camera_path(context, &map, pixel, index, scratch, &mut counters, recorder);
                    }
                })
            })?;
        }
        Some(pass)
    }
}

/// Pairs of splats of one light sub-path at pixels of one block: every splat in `step` with another one,
/// which is drawn and stands for all others. Light sub-path and splat that come first have these numbers in
/// their pass.
fn splat_pairs<'a>(
    recorder: &'a Recorder,
    splats: &'a [Splat],
    [first_path, first]: [usize; 2],
    step: usize,
    grid: &'a Grid,
) -> impl Iterator<Item = PixelPair> + 'a {
    let per_pixel = f64::from(grid.cells()) / grid.pixels();
    let of_path = move |(path, range): (usize, Range<usize>)| {
        let count = range.len();
        let start = range.start;
        let asked = range.filter(move |own| count > 1 && (first + own).is_multiple_of(step));
        asked.filter_map(move |own| {
            let other = start + blocks::another(first + own, own - start, count);
            let [from, to] = [own, other].map(|i| splats[i].pixel.map(u32::cast_signed));
            let others = ((count - 1) * step) as f64;
            let weight = per_pixel * others * blocks::weight([to[0] - from[0], to[1] - from[1]]);
            (weight > 0.0).then(|| PixelPair {
                cell: grid.cell(splats[own].pixel),
                path: (first_path + path) as u32,
                weight,
                samples: [own, other].map(|i| vec![recorder.samples[i]]),
            })
        })
    };
    recorder.ranges().enumerate().flat_map(of_path)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use upbp_estimators::scene::PixelRect;
    use upbp_media::Spectrum;

    use super::*;

    #[test]
    fn drawn_pairs_of_splats_stand_for_all() {
        let grid = Grid::new(PixelRect { x: 0, y: 0, width: 64, height: 48 }, 192);
        let (mut recorder, mut splats) = (Recorder::default(), Vec::new());
        let mut expected = 0.0;
        for count in [3, 0, 1, 2, 9] {
            let first = splats.len();
            let room = SampleRoom::new(1);
            recorder.record(&room, |recorder| {
                for i in first..first + count {
                    let value = Vec3::splat(1.0 + i as f32);
                    let technique = Technique::LightTracing;
                    recorder.samples.push(Sample {
                        technique,
                        light_path: None,
                        albedos: 1.0,
                        value,
                        weights: [0.0; Technique::COUNT],
                    });
                    let pixel = [(11 * i % 24) as u32, (7 * i % 20) as u32];
                    splats.push(Splat { pixel, value: Spectrum::splat(1.0) });
                }
            });
            for (i, j) in (first..first + count).flat_map(|i| (first..first + count).map(move |j| (i, j))) {
                let [a, b] = [i, j].map(|i| splats[i].pixel.map(u32::cast_signed));
                if i != j {
                    let product = ((i + 1) * (j + 1)) as f64;
                    expected += blocks::weight([a[0] - b[0], a[1] - b[1]]) * product / 16.0;
                }
            }
        }
        for step in [1, 3] {
            let draws = 30_000;
            let mut found = 0.0;
            for first in 0..draws {
                for pair in splat_pairs(&recorder, &splats, [0, first], step, &grid) {
                    let [own, other] = pair.samples.each_ref().map(|samples| f64::from(samples[0].value.x));
                    found += pair.weight * own * other / draws as f64;
                }
            }
            assert!((found / expected - 1.0).abs() < 0.01, "{step}: {found}, expected {expected}");
        }
    }
}
