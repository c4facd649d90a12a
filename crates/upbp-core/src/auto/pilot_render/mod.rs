//! A trial: a few thousand sub-paths with all techniques, written down so that any plan can be judged by them.
//!
//! The walks carry the densities of every technique for itself, so that a sample comes with the part of each in its weight.

pub(crate) mod grid;
pub(crate) mod recorder;
pub(crate) mod roulette;
mod trace;
pub(crate) mod watch;

use upbp_estimators::observer::Observer;
use upbp_estimators::scene::Scene;
use upbp_estimators::{Counters, Plan, Technique, World};

use crate::budget::Halt;
use grid::Grid;
use recorder::{ByRoulette, MOST_SAMPLES, Recorder, Sample, TECHNIQUES, add, reach};
use trace::{CHUNK, Pass, Piece, Room};
use watch::{PARTS, WALK, Watch};

/// Looks at each cell: enough to tell what they have in common.
pub(crate) const PASSES: u32 = 2;
/// How often the time of the same pass is taken.
const TIMINGS: usize = 2;

/// What was seen. The picture is divided into cells, of each of which one pixel is looked at, several times.
pub(crate) struct Trial {
    /// Looks at each cell.
    pub(crate) passes: usize,
    pub(crate) cells: usize,
    /// Samples of camera sub-paths, by cell, then by pass, then by the light sub-path that was merged;
    /// `ends[cell * passes + pass]` is behind the last one of each.
    pub(crate) samples: Vec<Sample>,
    pub(crate) ends: Vec<u32>,
    /// Splats by cell. Light sub-paths fill the whole picture.
    pub(crate) splats: Vec<(u32, Sample)>,
    /// Light sub-paths per pass over those that the plan has, and the same of those with beams.
    pub(crate) thinning: [f64; 2],
    /// Light sub-paths of the plan, and of them those with beams.
    pub(crate) planned: [f64; 2],
    pub(crate) pixels: f64,
    pub(crate) work: Work,
}

/// What sub-paths had to do, on average.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Work {
    /// Edges per camera sub-path, by roulette.
    pub(crate) camera_edges: ByRoulette,
    /// Turns to each technique per camera sub-path; of light tracing per light sub-path.
    pub(crate) calls: [ByRoulette; TECHNIQUES],
    /// Samples, likewise; of merges for as many photons as the plan has.
    pub(crate) samples: [ByRoulette; TECHNIQUES],
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

/// Runs a trial of `plan`, with `paths` of its light sub-paths per pass. `first_pass` numbers the passes of all trials of a render;
/// `timed` says whether to measure time. `None` if there were [too many samples](MOST_SAMPLES), or if it was halted.
pub(crate) fn run<S: Scene>(
    world: &World<'_, S>,
    plan: &Plan,
    grid: &Grid,
    paths: u32,
    first_pass: u32,
    timed: bool,
    halt: &Halt<'_>,
) -> Option<Trial> {
    let cells = grid.cells() as usize;
    let part = |traced: u32, planned: u32| f64::from(traced) / f64::from(planned.max(1));
    let paths = paths.min(plan.light_paths);
    let beam_paths = plan.beam_paths.min(paths);
    let mut trial = Trial {
        passes: PASSES as usize,
        cells,
        samples: Vec::new(),
        ends: Vec::new(),
        splats: Vec::new(),
        thinning: [part(paths, plan.light_paths), part(beam_paths, plan.beam_paths)],
        planned: [plan.light_paths, plan.beam_paths].map(f64::from),
        pixels: grid.pixels(),
        work: Work::default(),
    };
    let mut plan = plan.clone();
    // Fewer light sub-paths, each of which counts for more; weights as in the plan.
    (plan.light_paths, plan.beam_paths) = (paths, beam_paths);
    let room = Room::new(MOST_SAMPLES, halt);
    let mut passes = (first_pass..first_pass + PASSES)
        .map(|pass| {
            // Not the iterations of other pilots.
            plan.iteration = u64::from(pass) + 1;
            Pass::<Recorder>::trace(world, &plan, grid, pass, &room)
        })
        .collect::<Option<Vec<_>>>()?;
    for pass in &passes {
        for (recorder, splats) in &pass.light {
            // A splat goes with each sample.
            let cells = splats.iter().map(|splat| grid.cell(splat.pixel));
            trial.splats.extend(cells.zip(recorder.samples.iter().copied()));
        }
    }
    let per_path = |pass_paths: u32| f64::from(pass_paths * PASSES);
    trial.work = work(&passes, (cells * PASSES as usize) as f64, [paths, beam_paths].map(per_path), &trial);
    for chunk in 0..cells.div_ceil(CHUNK) {
        // Taken, so that all samples are not there twice.
        let pieces: Vec<_> = passes.iter_mut().map(|pass| std::mem::take(&mut pass.camera[chunk])).collect();
        for path in 0..CHUNK.min(cells - chunk * CHUNK) {
            for piece in &pieces {
                let start = trial.samples.len();
                trial.samples.extend_from_slice(piece.of_path(path));
                trial.samples[start..].sort_by_key(|sample| sample.merged);
                trial.ends.push(trial.samples.len() as u32);
            }
        }
    }
    if timed {
        // The first pass again, with weights as the render has them.
        plan.iteration = u64::from(first_pass) + 1;
        let passes = (0..TIMINGS)
            .map(|_| Pass::<Watch>::trace(world, &plan, grid, first_pass, &room))
            .collect::<Option<Vec<_>>>()?;
        let camera = undisturbed(passes.iter().map(|pass| pass.camera.iter().map(Watch::net)));
        trial.work.camera_time = Some(camera.map(|time| time / cells as f64));
        let light = undisturbed(passes.iter().map(|pass| pass.light.iter().map(|(watch, _)| watch.net())));
        let of = |part: usize| light[part] / f64::from(paths.max(1));
        trial.work.light_time = Some([of(WALK), of(Technique::LightTracing as usize)]);
    }
    Some(trial)
}

impl<B> Piece<B> for Recorder {
    fn path_ended(&mut self) {
        self.ends.push(self.samples.len() as u32);
    }

    fn written(&self) -> usize {
        self.seen
    }
}

impl Recorder {
    /// The samples of the i-th sub-path.
    fn of_path(&self, i: usize) -> &[Sample] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.samples[start as usize..self.ends[i] as usize]
    }
}

impl<B> Piece<B> for Watch {
    fn path_ended(&mut self) {
        Observer::<B>::turns_to(self, None);
    }

    fn written(&self) -> usize {
        0
    }
}

/// The work of all passes, per camera sub-path, and per light sub-path (with beams) where it is about those.
fn work(
    passes: &[Pass<Recorder>],
    camera_paths: f64,
    [light_paths, beam_paths]: [f64; 2],
    trial: &Trial,
) -> Work {
    let mut counters = Counters::default();
    let mut edges = ByRoulette::default();
    let (mut calls, mut samples) = ([edges; TECHNIQUES], [edges; TECHNIQUES]);
    for pass in passes {
        counters.add(&pass.counters);
        for recorder in pass.camera.iter().chain(pass.light.iter().map(|(recorder, _)| recorder)) {
            add(&mut edges, &recorder.edges);
            for (sum, own) in calls.iter_mut().zip(&recorder.calls) {
                add(sum, own);
            }
            for sample in &recorder.samples {
                add(&mut samples[sample.technique as usize], &reach(sample.albedos));
            }
        }
    }
    let per = |count: f64, paths: f64| if paths > 0.0 { count / paths } else { 0.0 };
    for technique in Technique::ALL {
        let i = technique as usize;
        let paths = if technique == Technique::LightTracing { light_paths } else { camera_paths };
        calls[i] = calls[i].map(|count| per(count, paths));
        let merges = technique.merges();
        let thinning = if merges { trial.thinning(technique) } else { 1.0 };
        samples[i] = samples[i].map(|count| per(count, paths) / thinning);
    }
    Work {
        camera_edges: edges.map(|count| per(count, camera_paths)),
        calls,
        samples,
        light_edges: per(counters.light_edges as f64, light_paths),
        vertices: per(counters.light_vertices as f64, light_paths),
        beams: per(counters.photon_beams as f64, beam_paths),
        camera_time: None,
        light_time: None,
    }
}

/// Nanoseconds by part, of all pieces of a pass whose time was taken several times. Of each piece the least counts: whatever comes
/// in between makes it longer.
fn undisturbed(passes: impl Iterator<Item = impl Iterator<Item = [f64; PARTS]>>) -> [f64; PARTS] {
    let mut least: Vec<[f64; PARTS]> = Vec::new();
    for pass in passes {
        for (piece, time) in pass.enumerate() {
            match least.get_mut(piece) {
                None => least.push(time),
                Some(least) => least.iter_mut().zip(time).for_each(|(least, time)| *least = least.min(time)),
            }
        }
    }
    least.iter().fold([0.0; PARTS], |sum, piece| std::array::from_fn(|part| sum[part] + piece[part]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interruption_does_not_count() {
        // Two pieces, 2 and 3 ns for each part; something came in between in another piece each time.
        let [first, second] = [[2.0, 3.0 + 200.0], [2.0 + 500.0, 3.0]];
        let passes = [first, second].map(|pass| pass.map(|time| [time; PARTS]).into_iter());
        assert_eq!(undisturbed(passes.into_iter()), [5.0; PARTS]);
    }
}
