//! What an iteration of a plan costs.
//!
//! A model counts what sub-paths do, as the trial saw it, and takes nanoseconds per count from a table that was set by hand after
//! measurements on one machine. That is enough for a decision that everybody repeats to the last bit. If time may be measured, each part of the
//! model is corrected by the ratio of the time that the trial took for it; ratios are between parts of one run, side by side, so that
//! a busy machine slows all of them.

use upbp_estimators::{Technique, TechniqueSet};

use super::pilot_render::recorder::TECHNIQUES;
use super::pilot_render::roulette::TRIAL;
use super::pilot_render::watch::WALK;
use super::pilot_render::{Trial, Work};
use super::search::Candidate;
use crate::auto::choices::BEAMS;

/// Nanoseconds of one edge of a camera sub-path, and of a light sub-path.
const EDGE: [f64; 2] = [300.0, 300.0];
/// Part of a camera edge's time if no query beam has to know what is beyond the end of the edge.
const SHORT: f64 = 0.85;
/// Nanoseconds of every turn to a technique, and of every sample that it finds then.
const TURN: [f64; TECHNIQUES] = [0.0, 220.0, 330.0, 150.0, 110.0, 110.0, 220.0, 200.0, 420.0];
const SAMPLE: [f64; TECHNIQUES] = [0.0, 0.0, 0.0, 0.0, 70.0, 90.0, 130.0, 200.0, 330.0];
/// Nanoseconds of storing a light vertex, of building it into a tree, and of the same for a photon beam.
const STORE: f64 = 25.0;
const BUILD_POINT: f64 = 90.0;
const BUILD_BEAM: f64 = 600.0;
/// Nanoseconds of adding a pixel to the film.
const PIXEL: f64 = 40.0;

const LIGHT_TRACING: TechniqueSet = TechniqueSet::EMPTY.with(Technique::LightTracing);
/// Techniques that look photon points up.
const PHOTON_POINTS: TechniqueSet =
    TechniqueSet::EMPTY.with(Technique::Surf).with(Technique::Pp3d).with(Technique::Pb2d);
/// Techniques whose query is a camera edge, to its very end.
const ALONG_QUERY_BEAMS: TechniqueSet = TechniqueSet::EMPTY.with(Technique::Pb2d).with(Technique::Bb1d);

/// How many times as long as in the model the parts of an iteration take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Costs {
    work: Work,
    pixels: f64,
    /// Light sub-paths of the plan, and of them those with beams.
    planned: [f64; 2],
    camera_walk: f64,
    light_walk: f64,
    techniques: [f64; TECHNIQUES],
}

impl Costs {
    /// As in the model, or as the trial measured it.
    pub(crate) fn of(trial: &Trial) -> Self {
        /// Counts per sub-path below which there is nothing to measure.
        const LEAST: f64 = 0.01;
        let work = &trial.work;
        let mut costs = Self {
            work: *work,
            pixels: trial.pixels,
            planned: trial.planned,
            camera_walk: 1.0,
            light_walk: 1.0,
            techniques: [1.0; TECHNIQUES],
        };
        let ratio = |measured: f64, model: f64| (measured / model).clamp(0.1, 10.0);
        if let Some(time) = work.camera_time {
            costs.camera_walk = ratio(time[WALK], work.camera_edges[TRIAL] * EDGE[0]);
            for technique in Technique::ALL {
                let i = technique as usize;
                // The trial has fewer photons than the plan.
                let calls = work.calls[i][TRIAL];
                let seen = work.samples[i][TRIAL] * trial.thinning(technique);
                if technique != Technique::LightTracing && calls > LEAST && TURN[i] > 0.0 {
                    let turns = calls * TURN[i] * costs.depth(technique, trial.thinning(technique));
                    costs.techniques[i] = ratio(time[i], turns + seen * SAMPLE[i]);
                }
            }
        }
        if let Some([walk, splats]) = work.light_time
            && work.light_edges > LEAST
        {
            costs.light_walk = ratio(walk, work.light_edges * EDGE[1] + work.vertices * STORE);
            let i = Technique::LightTracing as usize;
            let calls = work.calls[i][TRIAL];
            if calls > LEAST {
                costs.techniques[i] = ratio(splats, calls * TURN[i]);
            }
        }
        costs
    }

    /// How many times as long a turn to a technique takes if there are so many photons or beams, relative to the plan: by the
    /// depth of their tree.
    fn depth(&self, technique: Technique, photons: f64) -> f64 {
        let elements = match technique {
            Technique::Hit | Technique::Nee | Technique::Connect | Technique::LightTracing => return 1.0,
            Technique::Surf | Technique::Pp3d | Technique::Pb2d => self.planned[0] * self.work.vertices,
            Technique::Bp2d | Technique::Bb1d => self.planned[1] * self.work.beams,
        };
        let levels = |elements: f64| (2.0 + elements).ln();
        levels(elements * photons) / levels(elements)
    }

    /// Nanoseconds of an iteration, on one thread.
    pub(crate) fn iteration(&self, candidate: &Candidate) -> f64 {
        let work = &self.work;
        let has = |technique| candidate.techniques.has(technique);
        // What part of the iterations run any of some techniques.
        let any = |techniques: TechniqueSet| {
            let run = candidate.techniques.intersection(techniques);
            1.0 - run.iter().map(|technique| 1.0 - candidate.look_up(technique)).product::<f64>()
        };
        let roulette = candidate.roulette;
        let beyond = SHORT + (1.0 - SHORT) * any(ALONG_QUERY_BEAMS);
        let walk = work.camera_edges[roulette] * EDGE[0] * self.camera_walk * beyond;
        let mut camera = PIXEL + walk;
        for technique in candidate.techniques.without(LIGHT_TRACING).iter() {
            let i = technique as usize;
            let per_vertex = if technique == Technique::Connect { candidate.connections } else { 1.0 };
            let calls = per_vertex * work.calls[i][roulette];
            let turns = calls * TURN[i] * self.depth(technique, candidate.paths(technique));
            let each = turns + candidate.photons(technique) * work.samples[i][roulette] * SAMPLE[i];
            camera += self.techniques[i] * candidate.look_up(technique) * each;
        }
        let mut light = work.light_edges * EDGE[1] * self.light_walk;
        if has(Technique::LightTracing) {
            let i = Technique::LightTracing as usize;
            light += work.calls[i][roulette] * TURN[i] * self.techniques[i];
        }
        let stored = any(PHOTON_POINTS.with(Technique::Connect)) * STORE + any(PHOTON_POINTS) * BUILD_POINT;
        light = any(TechniqueSet::ALL.without(TechniqueSet::PT)) * light + work.vertices * stored;
        let beams = any(BEAMS) * candidate.beam_paths * self.planned[1] * work.beams * BUILD_BEAM;
        self.pixels * camera + candidate.light_paths * self.planned[0] * light + beams
    }
}
