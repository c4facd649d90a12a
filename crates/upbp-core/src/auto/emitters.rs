//! Probabilities of emitters, by the samples that they are worth.
//!
//! By power, a sky takes most of the light sub-paths and next events of a room with a window, and most of
//! them are lost: the light goes past the scene, or emission hits find it anyway. So a small run counts the
//! weighted contributions that come from each emitter, by next events and by light sub-paths, as far as no
//! other technique would find them, and emitters are then chosen in proportion (`docs/theory.md`, section
//! 6.6). Weights are exact for any choice, and the choice is fixed before any sample of the image. Further
//! rounds learn where on the emitters light sub-paths should start ([`guides`]).

use glam::Vec3;
use upbp_estimators::observer::{
    Completion, DynObserver, LightEnd, ObservedSample, ObservedVertex, Observer,
};
use upbp_estimators::path::{Context, LightChunk};
use upbp_estimators::scene::{Camera, EmitterId, PixelRect, Scene};
use upbp_estimators::trace::{trace_camera_path, trace_light_path};
use upbp_estimators::{
    Counters, EmitterShares, IterationPlan, LightMap, PreparedScene, StreamKind, TechniqueSet,
};

use super::full_plan::{iteration_plan, plan_with};
use super::guides::{self, Evidence, Starts};
use super::pieces::{in_pieces, pixel};
use super::statistics;
use crate::budget::{Budget, Halt};
use crate::error::RenderError;
use crate::settings::CheckedSettings;

/// Camera sub-paths, if there are many emitters.
const CAMERA_PATHS: u32 = 2048;
/// Light sub-paths, unless they are long or emitters are few.
const LIGHT_PATHS: u32 = 4096;
/// Emitters from which on the number of sub-paths does not grow any more.
const MANY: usize = 8;
/// Light vertices that are enough.
const LIGHT_VERTICES: f64 = 2e5;
/// Steps towards probabilities that reproduce themselves.
const ROUNDS: u32 = 16;
/// Runs, if starts are guided: one that looks for places, and two that are guided there.
const GUIDED_ROUNDS: u32 = 3;

/// Part of the time of a preparation that this may take.
const PART: f64 = 0.2;
/// Part of this that a quick look at the length of light sub-paths may take.
const QUICK_LOOK: f64 = 0.2;

/// The part of all sub-paths that tells enough of a number of emitters.
fn enough(emitters: usize) -> f64 {
    emitters.clamp(2, MANY) as f64 / MANY as f64
}

/// Lets the scene choose its emitters, and the starts of light sub-paths on them, by what they contribute
/// under a plan with `techniques`. The scene has to be as it was prepared, with emitters chosen by power.
///
/// # Errors
/// [`RenderError::Cancelled`].
pub(crate) fn choose<S: Scene>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    budget: &Budget<'_>,
) -> Result<(), RenderError> {
    let emitters = scene.scene.emitters().len();
    let is_guided = guides::can_guide(scene, techniques);
    if emitters < 2 && !is_guided {
        return Ok(());
    }
    let quick = budget.part(QUICK_LOOK * PART);
    let statistics = statistics::measure(scene, settings, techniques, statistics::FEW_LIGHT_PATHS, &quick)?;
    let vertices = statistics.vertices_per_path.max(1.0);
    let light_paths = (LIGHT_VERTICES / vertices).clamp(64.0, f64::from(LIGHT_PATHS));
    let paths = [light_paths, f64::from(CAMERA_PATHS)].map(|paths| (paths * enough(emitters)) as u32);
    let plan = plan_with(scene, settings, techniques, &statistics, [paths[0], paths[0] / 8]);
    let plan = iteration_plan(scene, settings, &plan, 0);
    let rounds = if is_guided { GUIDED_ROUNDS } else { 1 };
    let part = (1.0 - QUICK_LOOK) * PART / f64::from(rounds);
    let mut first = Vec::new();
    for round in 0..rounds {
        // Each round has random numbers of its own.
        let plan = IterationPlan { iteration: plan.iteration + u64::from(round), ..plan.clone() };
        let run = |part, halt: &Halt<'_>| measure(scene, &plan, paths[1], part, halt);
        let seen = budget.part(part).largest(run).ok_or(RenderError::Cancelled)?;
        if emitters > 1 {
            scene.choose_emitters_by(&seen.emission, &seen.next_event);
        }
        if is_guided {
            let guides: Vec<_> = if round == 0 {
                if let Some(focus) = guides::focus(scene, &seen.guides) {
                    scene.focus_emission(focus);
                }
                first = guides::first(scene, &plan, &seen.guides);
                first.iter().map(Starts::fit).collect()
            } else {
                guides::next(scene, &seen.guides, &first)
            };
            let is_done = guides.iter().all(Option::is_none);
            scene.guide_emission(guides);
            if is_done {
                break;
            }
        }
    }
    Ok(())
}

/// Light that small runs of light and camera sub-paths have seen, by emitter.
struct Measured {
    /// The contribution of every emitter by light sub-paths.
    emission: EmitterShares,
    /// The contribution of every emitter by next events.
    next_event: EmitterShares,
    guides: Evidence,
}

/// Traces the light sub-paths of `plan` and some camera sub-paths, or a part of both. `None` if it was
/// halted.
fn measure<S: Scene>(
    scene: &PreparedScene<'_, S>,
    plan: &IterationPlan,
    camera_paths: u32,
    part: f64,
    halt: &Halt<'_>,
) -> Option<Measured> {
    let mut plan = plan.clone();
    // Fewer light sub-paths, each of which counts for more; weights as in the plan.
    let fewer = |count: u32| (part * f64::from(count)).ceil() as u32;
    (plan.light_paths, plan.beam_paths) = (fewer(plan.light_paths), fewer(plan.beam_paths));
    let plan = &plan;
    let context = Context { prepared: scene, plan };
    // The whole film: a crop shows the same camera samples.
    let (width, height) = scene.scene.camera().resolution();
    let film = PixelRect { x: 0, y: 0, width, height };
    let pixels = u64::from(width) * u64::from(height);
    let emitters = scene.scene.emitters().len();
    let mut emission = Tally::new(emitters, |emitter| scene.emission_probability(emitter));
    let mut next_event = Tally::new(emitters, |emitter| scene.next_event_probability(emitter));

    let paths = if plan.needs_light_paths() { plan.light_paths } else { 0 };
    let kind = StreamKind::PilotLight;
    let pieces = in_pieces(paths, halt, |index, scratch, (out, seen): &mut (LightChunk<_>, Seen)| {
        let observer: &mut DynObserver<'_, S::Bsdf> = seen;
        trace_light_path(&context, kind, index, scratch, out, observer);
        true
    })?;
    let mut starts = vec![None; paths as usize];
    let (mut vertices, mut beams) = (Vec::new(), Vec::new());
    let mut seen = Seen::default();
    for (out, own) in pieces {
        vertices.extend(out.vertices);
        beams.extend(out.beams);
        seen.append(own);
    }
    for &(path, end) in &seen.starts {
        starts[path as usize] = Some((end, 0.0));
    }
    let map = if plan.stores_vertices() || plan.stores_beams() {
        LightMap::build(plan, vertices, beams)
    } else {
        LightMap::empty()
    };
    let mut by_path = |seen: &[(u32, Contribution)], scale| {
        for &(path, contribution) in seen {
            if let Some((end, light)) = &mut starts[path as usize] {
                emission.add(end.emitter.0, contribution, scale);
                *light += scale * contribution.value * contribution.weight;
            }
        }
    };
    by_path(&seen.emission, 1.0);

    let camera_paths = (part * f64::from(camera_paths)).ceil() as u32;
    let walks = in_pieces(camera_paths, halt, |index, scratch, seen: &mut Seen| {
        let (kind, index) = (StreamKind::PilotCamera, u64::from(index));
        let observer: &mut DynObserver<'_, S::Bsdf> = seen;
        let counters = &mut Counters::default();
        trace_camera_path(&context, &map, kind, pixel(film, index), index, scratch, counters, observer);
        true
    })?;
    // Light tracing fills the whole picture, camera sub-paths a part of it.
    let scale = pixels as f64 / f64::from(camera_paths);
    let mut guides = Evidence::default();
    for seen in walks {
        by_path(&seen.emission, scale);
        for (end, receiver, contribution) in seen.next_event {
            next_event.add(end.emitter.0, contribution, scale);
            guides.lit.push((end, receiver));
        }
        guides.specular.extend(seen.specular);
    }
    guides.starts = starts.into_iter().flatten().collect();
    Some(Measured { emission: emission.shares(), next_event: next_event.shares(), guides })
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

    /// The light of each emitter that no other technique would find: contributions times the square of their
    /// weights, at the probabilities that follow from just that. A sky that emission hits find anyway so
    /// fades out of the next events.
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

/// Contributions that sub-paths of one piece of work made.
#[derive(Default)]
struct Seen {
    /// Light sub-paths with their starts.
    starts: Vec<(u32, LightEnd)>,
    /// By light sub-path.
    emission: Vec<(u32, Contribution)>,
    /// By light and receiver.
    next_event: Vec<(LightEnd, Vec3, Contribution)>,
    /// Where camera sub-paths were reflected or refracted in one direction.
    specular: Vec<Vec3>,
}

impl Seen {
    fn append(&mut self, mut more: Self) {
        self.starts.append(&mut more.starts);
        self.emission.append(&mut more.emission);
    }
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
        self.starts.push((path, *end));
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        if vertex.delta {
            self.specular.push(vertex.position);
        }
    }

    fn sample(&mut self, sample: &ObservedSample<B>) {
        let seen = Contribution { value: f64::from(sample.value.mean()), weight: sample.weight.value() };
        match sample.completion {
            Completion::Emission | Completion::Hit(_) => {}
            Completion::Nee { light, camera: (receiver, _) } => self.next_event.push((light, receiver, seen)),
            Completion::Connect { path, .. }
            | Completion::LightTracing { path, .. }
            | Completion::Merge { path, .. } => {
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
