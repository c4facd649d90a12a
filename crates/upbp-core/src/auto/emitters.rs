//! Which emitters are worth samples: measured before the first iteration.
//!
//! By power, a sky takes most of the light sub-paths and next events of a room with a window, and most of them are lost:
//! the light goes past the scene, or emission hits find it anyway. So a small run counts the weighted contributions that
//! come from each emitter, by next events and by light sub-paths, as far as no other technique would find them, and emitters
//! are then chosen in proportion (`docs/theory.md`, section 6(h)). Weights are exact for any choice, and the choice is
//! fixed before any sample of the image.

use rayon::prelude::*;
use upbp_estimators::observer::{DynObserver, Joint, LightEnd, ObservedSample, Observer};
use upbp_estimators::path::{Context, LightChunk, Scratch};
use upbp_estimators::scene::{Camera, EmitterId, PixelRect, Scene};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{Counters, EmitterShares, LightMap, Plan, StreamKind, World};

use crate::budget::Budget;
use crate::budget::Halt;

/// Camera sub-paths, if there are many emitters.
const CAMERA_PATHS: u64 = 2048;
/// Light sub-paths, unless they are long or emitters are few.
const LIGHT_PATHS: u32 = 4096;
/// So many emitters are many; of less, less is to be told.
const MANY: usize = 8;
/// Light vertices that are enough.
const LIGHT_VERTICES: f64 = 2e5;
/// Sub-paths per piece of work.
const CHUNK: u32 = 256;
/// Steps towards probabilities that reproduce themselves.
const ROUNDS: u32 = 16;

/// The number of light sub-paths for sub-paths of `vertices` vertices.
pub(crate) fn light_paths(vertices: f64) -> u32 {
    (LIGHT_VERTICES / vertices.max(1.0)).clamp(64.0, f64::from(LIGHT_PATHS)) as u32
}

/// Light sub-paths of `vertices` vertices that tell enough of so many emitters.
pub(crate) fn light_paths_for(emitters: usize, vertices: f64) -> u32 {
    (enough(emitters) * f64::from(light_paths(vertices))) as u32
}

/// The part of all sub-paths that tells enough of so many emitters.
fn enough(emitters: usize) -> f64 {
    emitters.clamp(2, MANY) as f64 / MANY as f64
}

/// How emitters are chosen in the iterations of a render.
pub(crate) struct EmitterChoices {
    by_light_paths: EmitterShares,
    next_event: EmitterShares,
    /// Of stages without light sub-paths: next events have to find what those would have found.
    next_event_alone: EmitterShares,
}

impl EmitterChoices {
    /// Measured under a plan, and under one without light sub-paths if there may be such stages. `None` if it was cancelled.
    pub(crate) fn measure<S: Scene>(
        world: &World<'_, S>,
        plan: &Plan,
        alone: Option<&Plan>,
        budget: &Budget<'_>,
    ) -> Option<Self> {
        let budget = if alone.is_some() { budget.part(0.5) } else { *budget };
        let measure = |plan| budget.largest(true, |part, halt| measure(world, plan, part, halt));
        let (by_light_paths, next_event) = measure(plan)?;
        let next_event_alone = match alone {
            Some(plan) => measure(plan)?.1,
            None => next_event.clone(),
        };
        Some(Self { by_light_paths, next_event, next_event_alone })
    }

    /// Chooses emitters as a stage with or without light sub-paths does.
    pub(crate) fn apply<S: Scene>(&self, world: &mut World<'_, S>, has_light_paths: bool) {
        let next_event = if has_light_paths { &self.next_event } else { &self.next_event_alone };
        world.choose_emitters_by(&self.by_light_paths, next_event);
    }
}

/// What every emitter brings under `plan`: by light sub-paths, by next events. A part of the sub-paths is traced. `None` if it was halted.
fn measure<S: Scene>(
    world: &World<'_, S>,
    plan: &Plan,
    part: f64,
    halt: &Halt<'_>,
) -> Option<(EmitterShares, EmitterShares)> {
    let mut plan = plan.clone();
    // Fewer light sub-paths, each of which counts for more; weights as in the plan.
    let fewer = |count: u32| (part * f64::from(count)).ceil() as u32;
    (plan.light_paths, plan.beam_paths) = (fewer(plan.light_paths), fewer(plan.beam_paths));
    let plan = &plan;
    let context = Context { world, plan };
    // The whole film: a crop shows the same camera samples.
    let (width, height) = world.scene.camera().resolution();
    let film = PixelRect { x: 0, y: 0, width, height };
    let pixels = u64::from(width) * u64::from(height);
    let emitters = world.scene.emitters().len();
    let mut emission = Tally::new(emitters, |emitter| world.emission_probability(emitter));
    let mut next_event = Tally::new(emitters, |emitter| world.next_event_probability(emitter));
    let mut by_path = |seen: &[(u32, Contribution)], starts: &[Option<u32>], scale| {
        for &(path, contribution) in seen {
            if let Some(emitter) = starts[path as usize] {
                emission.add(emitter, contribution, scale);
            }
        }
    };

    let paths = if plan.needs_light_paths() { plan.light_paths } else { 0 };
    let chunks: Vec<_> = (0..paths.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, chunk| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(paths);
            let mut seen = Seen { first: range.start, starts: vec![None; range.len()], ..Seen::default() };
            let mut out = LightChunk::default();
            for index in range {
                if halt.now() {
                    return None;
                }
                let observer: &mut DynObserver<'_, S::Bsdf> = &mut seen;
                trace_light_path(&context, StreamKind::PilotLight, index, scratch, &mut out, observer);
            }
            Some((out, seen))
        })
        .collect::<Option<_>>()?;
    let mut starts = Vec::with_capacity(paths as usize);
    let mut vertices = Vec::new();
    let mut beams = Vec::new();
    for (out, seen) in chunks {
        vertices.extend(out.vertices);
        beams.extend(out.beams);
        starts.extend(seen.starts);
        by_path(&seen.emission, &starts, 1.0);
    }
    let map = if plan.stores_vertices() || plan.stores_beams() {
        LightMap::build(plan, vertices, beams)
    } else {
        LightMap::empty()
    };

    let camera_paths = (part * enough(emitters) * CAMERA_PATHS as f64).ceil() as u64;
    let walks: Vec<_> = (0..camera_paths.div_ceil(u64::from(CHUNK)))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, chunk| {
            let mut seen = Seen::default();
            for index in chunk * u64::from(CHUNK)..((chunk + 1) * u64::from(CHUNK)).min(camera_paths) {
                if halt.now() {
                    return None;
                }
                let (pixel, counters) = (pixel(film, index), &mut Counters::default());
                let kind = StreamKind::PilotCamera;
                let observer: &mut DynObserver<'_, S::Bsdf> = &mut seen;
                trace_camera_path(&context, &map, kind, pixel, index, scratch, counters, observer);
            }
            Some(seen)
        })
        .collect::<Option<_>>()?;
    // Light tracing fills the whole picture, camera sub-paths a part of it.
    let scale = pixels as f64 / camera_paths as f64;
    for seen in walks {
        by_path(&seen.emission, &starts, scale);
        for (emitter, contribution) in seen.next_event {
            next_event.add(emitter, contribution, scale);
        }
    }
    Some((emission.shares(), next_event.shares()))
}

/// A pixel of a sequence that is spread over the picture by a step that is prime to almost every width.
pub(crate) fn pixel(crop: PixelRect, index: u64) -> [u32; 2] {
    let width = u64::from(crop.width);
    let place = (index * 7919) % (width * u64::from(crop.height));
    [crop.x + (place % width) as u32, crop.y + (place / width) as u32]
}

/// Weighted contributions by emitter.
struct Tally {
    /// The probabilities that they were made with.
    chosen: Vec<f64>,
    samples: Vec<Sample>,
}

struct Sample {
    emitter: usize,
    /// Contribution before weighting, for a probability of one.
    value: f64,
    /// All other techniques, relative to this one with a probability of one.
    others: f64,
}

impl Tally {
    fn new(emitters: usize, probability: impl Fn(EmitterId) -> f32) -> Self {
        let chosen = (0..emitters).map(|i| f64::from(probability(EmitterId(i as u32)))).collect();
        Self { chosen, samples: Vec::new() }
    }

    fn add(&mut self, emitter: u32, seen: Contribution, scale: f64) {
        let emitter = emitter as usize;
        let p = self.chosen[emitter];
        let others = p * (1.0 - seen.weight) / seen.weight;
        self.samples.push(Sample { emitter, value: scale * seen.value * p, others });
    }

    /// What the emitters bring that nothing else would: contributions times the square of their weights, at the probabilities
    /// that follow from just that. A sky that emission hits find anyway so fades out of the next events.
    fn shares(&self) -> EmitterShares {
        let mut p = self.chosen.clone();
        let mut light = vec![0.0; p.len()];
        for _ in 0..ROUNDS {
            light.fill(0.0);
            for sample in &self.samples {
                let weight = p[sample.emitter] / (p[sample.emitter] + sample.others);
                if weight > 0.0 {
                    // Made with `chosen`, so each stands for one over that many.
                    light[sample.emitter] += sample.value / self.chosen[sample.emitter] * weight * weight;
                }
            }
            let sum: f64 = light.iter().sum();
            if !(sum > 0.0 && sum.is_finite()) {
                break;
            }
            for (p, light) in p.iter_mut().zip(&light) {
                *p = light / sum;
            }
        }
        EmitterShares { light, samples: self.samples.len() as f64 }
    }
}

/// What one piece of work saw.
#[derive(Default)]
struct Seen {
    /// The first light sub-path.
    first: u32,
    /// The emitter of each light sub-path.
    starts: Vec<Option<u32>>,
    /// By light sub-path.
    emission: Vec<(u32, Contribution)>,
    /// By emitter.
    next_event: Vec<(u32, Contribution)>,
}

#[derive(Clone, Copy)]
struct Contribution {
    /// Before weighting.
    value: f64,
    weight: f64,
}

impl<B> Observer<B> for Seen {
    type Densities = f64;

    fn light_end(&mut self, path: u32, end: &LightEnd) {
        self.starts[(path - self.first) as usize] = Some(end.emitter.0);
    }

    fn sample(&mut self, sample: &ObservedSample<B>) {
        let seen = Contribution { value: f64::from(sample.value.mean()), weight: sample.weight.value() };
        match sample.joint {
            Joint::Emission | Joint::Hit(_) => {}
            Joint::Nee { light: end, .. } => self.next_event.push((end.emitter.0, seen)),
            Joint::Connect { path, .. } | Joint::LightTracing { path, .. } | Joint::Merge { path, .. } => {
                self.emission.push((path, seen));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of two emitters that were chosen equally often.
    fn shares(samples: &[(u32, f64, f64)]) -> Vec<f64> {
        let mut tally = Tally::new(2, |_| 0.5);
        for &(emitter, value, weight) in samples {
            tally.add(emitter, Contribution { value, weight }, 1.0);
        }
        let light = tally.shares().light;
        let sum: f64 = light.iter().sum();
        light.iter().map(|l| l / sum).collect()
    }

    #[test]
    fn emitters_that_nothing_else_finds_are_chosen_in_proportion_to_their_light() {
        let [one, other] = shares(&[(0, 1.0, 1.0), (0, 2.0, 1.0), (1, 9.0, 1.0)])[..] else { unreachable!() };
        assert!((one - 0.25).abs() < 1e-12 && (other - 0.75).abs() < 1e-12, "{one}, {other}");
    }

    #[test]
    fn an_emitter_that_others_find_anyway_fades() {
        // Equal light; the first is found by another technique four times out of five.
        let [one, other] = shares(&[(0, 1.0, 0.2), (1, 1.0, 1.0)])[..] else { unreachable!() };
        assert!(one < 0.01, "{one}, {other}");
        // Found elsewhere once in a while it keeps most of its share.
        let [one, other] = shares(&[(0, 1.0, 0.95), (1, 1.0, 1.0)])[..] else { unreachable!() };
        assert!((0.4..0.5).contains(&one), "{one}, {other}");
    }

    #[test]
    fn without_samples_nothing_is_said() {
        let tally = Tally::new(2, |_| 0.5);
        assert_eq!(tally.shares(), EmitterShares { light: vec![0.0; 2], samples: 0.0 });
    }

    #[test]
    fn pixels_lie_on_the_film_and_are_spread() {
        let film = PixelRect { x: 3, y: 5, width: 40, height: 30 };
        let pixels: std::collections::BTreeSet<_> = (0..1200).map(|index| pixel(film, index)).collect();
        assert_eq!(pixels.len(), 1200);
        assert!(pixels.iter().all(|[x, y]| (3..43).contains(x) && (5..35).contains(y)));
    }
}
