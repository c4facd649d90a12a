//! A trial: a few thousand sub-paths with all techniques, written down so that any plan can be judged by them.
//!
//! Which part each technique has in the weight of a sample is found by tracing the same sub-paths again, with the same random
//! numbers, under weights that count one technique twice: the weight `w = q_t / S` becomes `q_t / (S + S_c)`.

use glam::Vec3;
use rayon::prelude::*;
use upbp_estimators::mis::{Heuristic, MisPlan};
use upbp_estimators::scene::{PixelRect, Scene};
use upbp_estimators::walk::{Context, LightChunk, LightVertex, PhotonBeam, Scratch};
use upbp_estimators::walk::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, LightMap, Plan, StreamKind, Technique, TechniqueSet, World};

use super::recorder::{PARTS, Recorder, Seen, TECHNIQUES, WALK};

/// Parts below this are rounding.
const ROUNDING: f64 = 1e-12;
/// Looks at each cell: enough to tell what they have in common.
pub(crate) const PASSES: u32 = 2;
/// Sub-paths per piece of work.
const CHUNK: usize = 16;

/// A sample, weighted as when everything runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) technique: Technique,
    pub(crate) value: Vec3,
    /// Parts of all techniques in the weights of its path; they sum to one.
    pub(crate) shares: [f32; TECHNIQUES],
}

/// What was seen. The picture is divided into cells, of each of which one pixel is looked at, several times.
pub(crate) struct Trial {
    /// Looks at each cell.
    pub(crate) passes: usize,
    pub(crate) cells: usize,
    /// Samples of camera sub-paths, by cell, then by pass; `ends[cell * passes + pass]` is behind the last one of each.
    pub(crate) samples: Vec<Sample>,
    pub(crate) ends: Vec<u32>,
    /// Splats by cell. Light sub-paths fill the whole picture.
    pub(crate) splats: Vec<(u32, Sample)>,
    /// Behind the last one of each pass.
    pub(crate) splat_passes: Vec<usize>,
    /// Light sub-paths per pass over those that the plan has, and the same of those with beams.
    pub(crate) thinning: [f64; 2],
    /// Light sub-paths of the plan, and of them those with beams.
    pub(crate) planned: [f64; 2],
    pub(crate) pixels: f64,
    pub(crate) work: Work,
}

/// What sub-paths had to do, on average.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    pub(crate) camera_edges: f64,
    /// Turns to each technique per camera sub-path; of light tracing per light sub-path.
    pub(crate) calls: [f64; TECHNIQUES],
    /// Samples, likewise; of merges for as many photons as the plan has.
    pub(crate) samples: [f64; TECHNIQUES],
    pub(crate) light_edges: f64,
    /// Light vertices and beams per light sub-path (with beams).
    pub(crate) vertices: f64,
    pub(crate) beams: f64,
    /// Nanoseconds that were measured, per camera sub-path.
    pub(crate) camera_time: Option<[f64; PARTS]>,
    /// And per light sub-path: light tracing and the walk.
    pub(crate) light_time: Option<[f64; 2]>,
}

impl Trial {
    /// Samples that the trial has of what the plan has one of.
    pub(crate) const fn thinning(&self, technique: Technique) -> f64 {
        match technique {
            Technique::Hit | Technique::Nee | Technique::Connect => 1.0,
            Technique::LightTracing | Technique::Surf | Technique::Pp3d | Technique::Pb2d => self.thinning[0],
            Technique::Bp2d | Technique::Bb1d => self.thinning[1],
        }
    }
}

/// The part of the picture that a trial looks at.
pub(crate) struct Grid {
    rect: PixelRect,
    side: f64,
    columns: u32,
    rows: u32,
}

impl Grid {
    /// About so many cells, or one per pixel.
    pub(crate) fn new(rect: PixelRect, cells: u32) -> Self {
        let [width, height] = [rect.width, rect.height].map(f64::from);
        let side = (width * height / f64::from(cells)).sqrt().max(1.0);
        let [columns, rows] = [width, height].map(|length| (length / side).ceil() as u32);
        Self { rect, side, columns, rows }
    }

    pub(crate) const fn cells(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    pub(crate) const fn columns(&self) -> usize {
        self.columns as usize
    }

    /// The pixel that stands for a cell.
    fn pixel(&self, cell: usize) -> [u32; 2] {
        let place =
            |index: usize, size: u32| ((index as f64 + 0.5) * self.side).min(f64::from(size - 1)) as u32;
        let (column, row) = (cell % self.columns(), cell / self.columns());
        [self.rect.x + place(column, self.rect.width), self.rect.y + place(row, self.rect.height)]
    }

    /// The cell of a pixel.
    fn cell(&self, [x, y]: [u32; 2]) -> u32 {
        let index = |offset: u32, count: u32| ((f64::from(offset) / self.side) as u32).min(count - 1);
        index(y - self.rect.y, self.rows) * self.columns + index(x - self.rect.x, self.columns)
    }
}

/// Runs a trial of `plan`, with `paths` of its light sub-paths per pass. `first_pass` numbers the passes of all trials of a render;
/// `timed` says whether to measure time.
pub(crate) fn run<S: Scene>(
    world: &World<'_, S>,
    plan: &Plan,
    grid: &Grid,
    paths: u32,
    first_pass: u32,
    timed: bool,
) -> Trial {
    let passes = PASSES;
    let cells = grid.cells();
    let part = |traced: u32, planned: u32| f64::from(traced) / f64::from(planned.max(1));
    let paths = paths.min(plan.light_paths);
    let beam_paths = plan.beam_paths.min(paths);
    let mut trial = Trial {
        passes: passes as usize,
        cells,
        samples: Vec::new(),
        ends: Vec::new(),
        splats: Vec::new(),
        splat_passes: Vec::new(),
        thinning: [part(paths, plan.light_paths), part(beam_paths, plan.beam_paths)],
        planned: [plan.light_paths, plan.beam_paths].map(f64::from),
        pixels: f64::from(grid.rect.width) * f64::from(grid.rect.height),
        work: Work::default(),
    };
    let mut sums = Sums::default();
    let mut by_pass = Vec::new();
    for pass in first_pass..first_pass + passes {
        let mut plan = plan.clone();
        // Not the iterations of other pilots.
        plan.iteration = u64::from(pass) + 1;
        // Fewer light sub-paths, each of which counts for more; weights as in the plan.
        (plan.light_paths, plan.beam_paths) = (paths, beam_paths);
        let original = Pass::trace(world, &plan, grid, pass, timed);
        sums.add(&original);
        let probed: Vec<Technique> = plan.techniques.without(TechniqueSet::PT).iter().collect();
        let mut camera = original.camera.iter().map(Sharing::new).collect::<Vec<_>>();
        let mut light = original.light.iter().map(Sharing::new).collect::<Vec<_>>();
        let probes: Vec<_> = probed
            .into_par_iter()
            .map(|technique| {
                let mut probe = plan.clone();
                count_twice(&mut probe.mis, technique);
                (technique, Pass::trace(world, &probe, grid, pass, false))
            })
            .collect();
        for (technique, probe) in probes {
            for (sharing, piece) in camera.iter_mut().zip(&probe.camera) {
                sharing.learn(technique, piece, plan.mis.heuristic);
            }
            for (sharing, piece) in light.iter_mut().zip(&probe.light) {
                sharing.learn(technique, piece, plan.mis.heuristic);
            }
        }
        trial.splats.extend(light.iter().flat_map(Sharing::samples));
        trial.splat_passes.push(trial.splats.len());
        by_pass.push(camera.iter().flat_map(Sharing::samples).collect::<Vec<_>>());
    }
    let mut next = vec![0; by_pass.len()];
    for cell in 0..cells as u32 {
        for (pass, next) in by_pass.iter().zip(&mut next) {
            while let Some((path, sample)) = pass.get(*next)
                && *path == cell
            {
                trial.samples.push(*sample);
                *next += 1;
            }
            trial.ends.push(trial.samples.len() as u32);
        }
    }
    let camera_paths = (cells * trial.passes) as f64;
    trial.work = sums.mean(camera_paths, [paths, beam_paths].map(|n| f64::from(n * passes)), &trial);
    trial
}

/// Counts a technique twice in the weights, and changes nothing else.
fn count_twice(mis: &mut MisPlan, technique: Technique) {
    match technique {
        Technique::Hit => mis.hit *= 2.0,
        Technique::Nee => mis.nee *= 2.0,
        Technique::Connect => mis.connect *= 2.0,
        Technique::LightTracing => mis.light_tracing *= 2.0,
        Technique::Surf => mis.surf *= 2.0,
        Technique::Pp3d => mis.volume.iter_mut().for_each(|v| v.pp3d *= 2.0),
        Technique::Pb2d => mis.volume.iter_mut().for_each(|v| v.pb2d *= 2.0),
        Technique::Bp2d => mis.volume.iter_mut().for_each(|v| v.bp2d *= 2.0),
        Technique::Bb1d => mis.volume.iter_mut().for_each(|v| v.bb1d *= 2.0),
    }
}

/// What one pass saw: pieces of light sub-paths (whose `path` is the cell of the splat), and of camera sub-paths (whose `path`
/// is their cell).
struct Pass {
    light: Vec<Recorder>,
    camera: Vec<Recorder>,
    counters: Counters,
}

impl Pass {
    fn trace<S: Scene>(world: &World<'_, S>, plan: &Plan, grid: &Grid, pass: u32, timed: bool) -> Self {
        let context = Context { world, plan };
        let paths = if plan.needs_light_paths() { plan.light_paths } else { 0 };
        let chunks: Vec<_> = (0..paths.div_ceil(CHUNK as u32))
            .into_par_iter()
            .map_init(Scratch::default, |scratch, chunk| {
                let mut recorder = Recorder::new(timed);
                let mut out = LightChunk::default();
                for index in chunk * CHUNK as u32..((chunk + 1) * CHUNK as u32).min(paths) {
                    recorder.begin(index);
                    trace_light_path(
                        &context,
                        StreamKind::PilotLight,
                        index,
                        scratch,
                        &mut out,
                        &mut recorder,
                    );
                }
                // A splat goes with each sample.
                for (seen, splat) in recorder.samples.iter_mut().zip(&out.splats) {
                    seen.path = grid.cell(splat.pixel);
                }
                (out, recorder)
            })
            .collect();
        let mut counters = Counters::default();
        let mut light = Vec::with_capacity(chunks.len());
        let mut vertices: Vec<LightVertex<S::Bsdf>> = Vec::new();
        let mut beams: Vec<PhotonBeam> = Vec::new();
        for (out, recorder) in chunks {
            vertices.extend(out.vertices);
            beams.extend(out.beams);
            counters.add(&out.counters);
            light.push(recorder);
        }
        let map = if plan.stores_vertices() || plan.stores_beams() {
            LightMap::build(plan, vertices, beams)
        } else {
            LightMap::empty()
        };
        let cells = grid.cells();
        let pieces: Vec<_> = (0..cells.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Scratch::default, |scratch, chunk| {
                let mut recorder = Recorder::new(timed);
                let mut counters = Counters::default();
                for cell in chunk * CHUNK..((chunk + 1) * CHUNK).min(cells) {
                    recorder.begin(cell as u32);
                    // A number of its own for every sub-path: those of a pixel are not to be stratified among each other, so
                    // that their variance can be taken.
                    let index = u64::from(pass) << 32 | cell as u64;
                    let kind = StreamKind::PilotCamera;
                    let pixel = grid.pixel(cell);
                    trace_camera_path(
                        &context,
                        &map,
                        kind,
                        pixel,
                        index,
                        scratch,
                        &mut counters,
                        &mut recorder,
                    );
                }
                (recorder, counters)
            })
            .collect();
        let mut camera = Vec::with_capacity(pieces.len());
        for (recorder, own) in pieces {
            counters.add(&own);
            camera.push(recorder);
        }
        Self { light, camera, counters }
    }
}

/// The samples of a piece, and what is known of the parts of techniques in their weights.
struct Sharing<'a> {
    seen: &'a [Seen],
    shares: Vec<[f64; TECHNIQUES]>,
    /// Whether a probe saw other samples: a weight has become zero, or no longer is.
    lost: bool,
}

impl<'a> Sharing<'a> {
    fn new(piece: &'a Recorder) -> Self {
        let seen = piece.samples.as_slice();
        Self { seen, shares: vec![[0.0; TECHNIQUES]; seen.len()], lost: false }
    }

    /// Compares with the weights in which `counted` counts twice.
    fn learn(&mut self, counted: Technique, probe: &Recorder, heuristic: Heuristic) {
        if probe.samples.len() != self.seen.len() {
            self.lost = true;
            return;
        }
        let factor = match heuristic {
            Heuristic::Balance => 2.0,
            Heuristic::Power => 4.0,
        };
        for ((seen, probed), shares) in self.seen.iter().zip(&probe.samples).zip(&mut self.shares) {
            let own = if seen.technique == counted { factor } else { 1.0 };
            let share = (own * seen.weight / probed.weight - 1.0) / (factor - 1.0);
            shares[counted as usize] = share.clamp(0.0, 1.0);
        }
    }

    /// By sub-path.
    fn samples(&self) -> impl Iterator<Item = (u32, Sample)> {
        let usable = if self.lost { 0 } else { self.seen.len() };
        self.seen[..usable].iter().zip(&self.shares).map(|(seen, shares)| {
            let mut shares = *shares;
            // What is left is that of emission hits and next events, which are never told apart.
            let rest = 1.0 - shares.iter().sum::<f64>();
            shares[Technique::Hit as usize] = if rest > ROUNDING { rest } else { 0.0 };
            let value = Vec3::from((seen.value * seen.weight as f32).to_array());
            (seen.path, Sample { technique: seen.technique, value, shares: shares.map(|share| share as f32) })
        })
    }
}

/// Work of all passes.
#[derive(Default)]
struct Sums {
    counters: Counters,
    calls: [u64; TECHNIQUES],
    samples: [u64; TECHNIQUES],
    camera_time: Option<[f64; PARTS]>,
    light_time: Option<[f64; PARTS]>,
}

impl Sums {
    fn add(&mut self, pass: &Pass) {
        self.counters.add(&pass.counters);
        for recorder in pass.camera.iter().chain(&pass.light) {
            for (sum, calls) in self.calls.iter_mut().zip(recorder.calls) {
                *sum += calls;
            }
            for seen in &recorder.samples {
                self.samples[seen.technique as usize] += 1;
            }
        }
        add_time(&mut self.camera_time, &pass.camera);
        add_time(&mut self.light_time, &pass.light);
    }

    /// Per camera sub-path, and per light sub-path (with beams) where it is about those.
    fn mean(&self, camera_paths: f64, [light_paths, beam_paths]: [f64; 2], trial: &Trial) -> Work {
        let per = |count: u64, paths: f64| if paths > 0.0 { count as f64 / paths } else { 0.0 };
        let by_technique = |counts: &[u64; TECHNIQUES]| {
            Technique::ALL.map(|technique| {
                let splats = technique == Technique::LightTracing;
                per(counts[technique as usize], if splats { light_paths } else { camera_paths })
            })
        };
        let mut samples = by_technique(&self.samples);
        for technique in TechniqueSet::ALL.without(TechniqueSet::BPT).iter() {
            samples[technique as usize] /= trial.thinning(technique);
        }
        let [walk, splats] = [WALK, Technique::LightTracing as usize];
        Work {
            camera_edges: per(self.counters.camera_edges, camera_paths),
            calls: by_technique(&self.calls),
            samples,
            light_edges: per(self.counters.light_edges, light_paths),
            vertices: per(self.counters.light_vertices, light_paths),
            beams: per(self.counters.photon_beams, beam_paths),
            camera_time: self.camera_time.map(|time| time.map(|t| t / camera_paths)),
            light_time: self
                .light_time
                .map(|time| [time[walk], time[splats]].map(|t| t / light_paths.max(1.0))),
        }
    }
}

fn add_time(sum: &mut Option<[f64; PARTS]>, pieces: &[Recorder]) {
    for watch in pieces.iter().filter_map(|recorder| recorder.watch.as_ref()) {
        let sum = sum.get_or_insert_default();
        for (sum, time) in sum.iter_mut().zip(watch.net()) {
            *sum += time;
        }
    }
}
