//! Probabilities of emitters, by the samples that they are worth.
//!
//! By power, a sky takes most of the light sub-paths and next events of a room with a window, and most of
//! them are lost: the light goes past the scene, or emission hits find it anyway. So a small run counts the
//! weighted contributions that come from each emitter, by next events and by light sub-paths, as far as no
//! other technique would find them. Next events then choose emitters in proportion, light sub-paths for the
//! least variance (`docs/theory.md`, section 6.6). Weights are exact for any choice, and the choice is fixed
//! before any sample of the image. Next events choose by the place of the receiver where that pays. Further
//! rounds learn where on the emitters light sub-paths should start ([`guides`]).

use glam::Vec3;
use upbp_estimators::mis::{ByTechnique, Densities};
use upbp_estimators::observer::{Completion, LightEnd, ObservedSample, ObservedVertex, Observer};
use upbp_estimators::path::{Context, LightChunk, LightVertex};
use upbp_estimators::scene::{Camera, EmitterId, PixelRect, Scene};
use upbp_estimators::{
    Counters, EmitterSample, EmitterShares, IterationPlan, LightMap, PerTechnique, PreparedScene, Technique,
    TechniqueSet, effective_samples,
};
use upbp_media::Lanes;

use super::full_plan::{Inputs, Planner, pilot_plan};
use super::guides::{self, Evidence};
use super::memory_limit::Room;
use super::parallel_walks::{PilotRun, SampleRoom, camera_path, in_pieces, light_path, pixel};
use super::statistics::{self, PATHS_PER_BEAM_PATH};
use super::thinned::Thinned;
use crate::deadline::{Budget, Halt};
use crate::error::RenderError;

/// Camera sub-paths of a round with [many](MANY) emitters, or with guides.
const CAMERA_PATHS: u32 = 2048;
/// Light sub-paths of a round with [many](MANY) emitters, at most.
const ROUND_LIGHT_PATHS: u32 = 4096;
/// Light sub-paths of a round with guides, at most: few of them bring light.
const GUIDED_LIGHT_PATHS: u32 = 16384;
/// Emitters from which on the number of sub-paths does not grow any more.
const MANY: usize = 8;
/// Contributions of a round, at most, about: more tell nothing new.
const CONTRIBUTIONS: f64 = 1e6;
/// Part of the planned sub-paths that a first run traces, to predict the number of contributions. It is also
/// the least that runs when time is short: fewer miss what is small in the picture.
const FIRST_PART: f64 = 1.0 / 16.0;
/// Light vertices of a round, at most, about: more tell nothing new.
const LIGHT_VERTICES: f64 = 2e5;
/// Factor of the camera sub-paths if [many](MANY) emitters are chosen by receiver: there is more to learn.
const MORE_CAMERA_PATHS: u32 = 4;
/// Second moment of next events with a choice by receiver, over that without, up to which it is made.
const MOST_OF_ALIKE: f64 = 0.9;
/// Points of specular surfaces that a piece of the work keeps.
const SPECULAR_OF_PIECE: usize = 4096;
/// Rounds with guides, each by its part of the time and the most that its sub-paths may be multiplied by: one
/// that looks for places, and two that are guided there. The guide of the last one stays.
const GUIDED_ROUNDS: [(f64, u32); 3] = [(0.25, 1), (0.25, 1), (0.5, 4)];

/// Part of the time of a preparation that the choice of emitters may take.
pub(super) const TIME_FOR_EMITTERS: f64 = 0.2;
/// Part of that time for a quick look at the length of light sub-paths.
const QUICK_LOOK: f64 = 0.2;

/// Lets the scene choose its emitters, and the starts of light sub-paths on them, by what they contribute
/// under a plan with all techniques of `inputs`; returns the light that each brought from light sub-paths, in
/// any unit. The scene has to be as it was prepared.
///
/// # Errors
/// [`RenderError::Cancelled`].
pub(crate) fn choose<S: Scene, L: Lanes>(
    scene: &mut PreparedScene<'_, S>,
    inputs: Inputs<'_>,
    room: &Room,
    budget: &Budget<'_>,
) -> Result<PerTechnique<f64>, RenderError> {
    let mut by_technique = [0.0; Technique::COUNT];
    let emitters = scene.scene.emitters().len();
    let is_guided = guides::can_guide(scene, inputs.techniques);
    if emitters < 2 && !is_guided {
        return Ok(by_technique);
    }
    if emitters > 1 {
        scene.choose_emitters_to_measure();
        scene.choose_by_receiver(&[]);
    }
    let quick = budget.part(QUICK_LOOK * TIME_FOR_EMITTERS);
    let few = statistics::FEW_LIGHT_PATHS;
    let statistics = statistics::measure::<S, L>(scene, inputs, few, room, &quick)?;
    let rounds: &[_] = if is_guided { &GUIDED_ROUNDS } else { &[(1.0, 1)] };
    let most_times = f64::from(rounds.iter().map(|(_, times)| *times).max().unwrap_or(1));
    let vertices =
        LIGHT_VERTICES.min(room.items::<LightVertex<S::Bsdf, ByTechnique, L>>() as f64 / most_times);
    let most = if is_guided { GUIDED_LIGHT_PATHS } else { ROUND_LIGHT_PATHS };
    // Where no technique uses vertices, beams alone are stored.
    let stored = statistics.vertices_per_path.max(statistics.beams_per_path / f64::from(PATHS_PER_BEAM_PATH));
    let light_paths = (vertices / stored.max(1.0)).clamp(1.0, f64::from(most));
    let enough = CONTRIBUTIONS.min(room.items::<NextEvent>() as f64);
    let is_much = emitters >= MANY && scene.can_choose_by_receiver();
    let camera_paths = CAMERA_PATHS * if is_much { MORE_CAMERA_PATHS } else { 1 };
    // Fewer emitters need fewer sub-paths.
    let part = if is_guided { 1.0 } else { emitters.min(MANY) as f64 / MANY as f64 };
    let paths = [light_paths, f64::from(camera_paths)].map(|paths| ((paths * part) as u32).max(1));
    // Light is weighted as with so many light sub-paths, for a plan may have far fewer than the full one.
    let planner = Planner { scene, inputs, statistics: &statistics };
    let small = planner.plan_with([paths[0], paths[0] / PATHS_PER_BEAM_PATH]);
    let full = planner.full_plan(room, budget);
    let [small, full] = [small, full].map(|plan| pilot_plan(scene, inputs.settings, &plan));
    // Kernels are those of the full one, and so are the most that they may be in a medium.
    let mut mis = small.mis;
    for (small, full) in mis.volume.iter_mut().zip(&full.mis.volume) {
        small.pp3d.greatest_scale = full.pp3d.greatest_scale;
        small.pb2d.greatest_scale = full.pb2d.greatest_scale;
        small.bp2d.greatest_scale = full.bp2d.greatest_scale;
        small.bb1d.greatest_scale = full.bb1d.greatest_scale;
    }
    let plan = IterationPlan { mis, ..full };
    let most = (plan.light_paths / paths[0].max(1)).max(1);
    let mut first = Vec::new();
    for (round, &(part, times)) in rounds.iter().enumerate() {
        let run = PilotRun::Emitters { round: round as u32 };
        let plan = IterationPlan { iteration: run.iteration(), ..plan.clone() };
        let times = times.min(most);
        let paths = paths.map(|count| times * count);
        let run = |part, halt: &Halt<'_>| measure_enough::<S, L>(scene, &plan, paths, part, enough, halt);
        let allowance = budget.part((1.0 - QUICK_LOOK) * TIME_FOR_EMITTERS * part);
        let seen = allowance.largest(FIRST_PART / f64::from(times), run).ok_or(RenderError::Cancelled)?;
        by_technique = seen.by_technique;
        if emitters > 1 {
            scene.choose_emitters_by(&seen.emission, &shares(&seen.next_events, emitters));
            choose_by_receiver(scene, &seen.next_events);
        }
        if is_guided {
            let guides: Vec<_> = if round == 0 {
                if let Some(focus) = guides::focus(scene, &seen.guides) {
                    scene.focus_emission(focus);
                }
                first = guides::first(scene, &plan, &seen.guides);
                guides::to_all(scene, &first)
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
    Ok(by_technique)
}

/// Light that small runs of light and camera sub-paths have seen, by emitter.
struct Measured {
    /// The contribution of every emitter by light sub-paths.
    emission: EmitterShares,
    /// Contributions of next events, in two halves of different camera sub-paths.
    next_events: [Vec<NextEvent>; 2],
    guides: Evidence,
    /// Light that light sub-paths brought, relative to that of its pixel.
    by_technique: PerTechnique<f64>,
    /// Number of contributions.
    contributions: usize,
}

/// A contribution of a next event.
#[derive(Clone, Copy)]
struct NextEvent {
    receiver: Vec3,
    sample: EmitterSample,
    /// The probability that its emitter was chosen with.
    chosen: f64,
}

/// The contribution of every emitter by next events.
fn shares(next_events: &[Vec<NextEvent>; 2], emitters: usize) -> EmitterShares {
    let samples: Vec<_> = next_events.iter().flatten().map(|event| event.sample).collect();
    let even = vec![1.0 / emitters as f64; emitters];
    EmitterShares::of(even, &samples)
}

/// Lets next events choose by receiver, if what one half of those that were seen tells makes the variance of
/// the other half less.
fn choose_by_receiver<S: Scene>(scene: &mut PreparedScene<'_, S>, seen: &[Vec<NextEvent>; 2]) {
    let samples = |events: &[NextEvent]| events.iter().map(|e| (e.receiver, e.sample)).collect::<Vec<_>>();
    scene.choose_alike();
    let alike = second_moment(scene, &seen[1]);
    scene.choose_by_receiver(&samples(&seen[0]));
    if second_moment(scene, &seen[1]) < MOST_OF_ALIKE * alike {
        scene.choose_by_receiver(&samples(&seen.concat()));
    } else {
        scene.choose_alike();
    }
}

/// The second moment of next events, as the scene chooses emitters now.
fn second_moment<S: Scene>(scene: &PreparedScene<'_, S>, seen: &[NextEvent]) -> f64 {
    let moment = |event: &NextEvent| {
        let probability = f64::from(scene.next_event_probability(event.receiver, event.sample.emitter));
        let weighted = event.sample.light * event.chosen / (probability + event.sample.others);
        probability / event.chosen * weighted * weighted
    };
    seen.iter().map(moment).sum()
}

/// As [`measure`], but no larger a part than brings enough contributions. A part that brings far more, since
/// a few sub-paths merge very often, is broken off.
fn measure_enough<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    plan: &IterationPlan,
    paths: [u32; 2],
    part: f64,
    enough: f64,
    halt: &Halt<'_>,
) -> Option<Measured> {
    /// Most contributions that a run may bring, relative to those that are enough.
    const FAR_MORE: f64 = 2.0;
    let (mut next, mut best) = (part.min(FIRST_PART), None);
    loop {
        let room = SampleRoom::new((FAR_MORE * enough) as usize);
        let Some(seen) = measure::<S, L>(scene, plan, paths, next, &room, halt) else {
            match best {
                _ if halt.now() => return None,
                Some(best) => return Some(best),
                None => next *= FIRST_PART,
            }
            continue;
        };
        let most = next * enough / (seen.contributions as f64).max(1.0);
        let affordable = part.min(most);
        if affordable < 2.0 * next {
            return Some(seen);
        }
        (next, best) = (affordable, Some(seen));
    }
}

/// Traces numbers of light and camera sub-paths, or a part of both. Light is weighted as under `plan`.
/// `None` if it was halted, or if there is no room for what is seen.
fn measure<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    plan: &IterationPlan,
    paths: [u32; 2],
    part: f64,
    room: &SampleRoom,
    halt: &Halt<'_>,
) -> Option<Measured> {
    let [light_paths, camera_paths] = paths.map(|count| (part * f64::from(count)).ceil() as u32);
    let beam_paths = light_paths.div_ceil(PATHS_PER_BEAM_PATH).min(plan.beam_paths);
    let (full, plan) = (plan, &plan.blurred(light_paths, beam_paths));
    // In an iteration kernels are narrower, and contributions rarer and brighter by that; there are more
    // light sub-paths, of which connections alone do not make more. So squares count this many times.
    let growth_of_squares = |technique: Technique| {
        let blur = match [plan, full].map(|plan| plan.kernels.get(technique)) {
            [Some(wide), Some(narrow)] if narrow.effective_volume() > 0.0 => {
                wide.effective_volume() / narrow.effective_volume()
            }
            _ => 1.0,
        };
        let [few, many] = [plan, full].map(|plan| match technique {
            Technique::Connect => 1.0,
            _ if technique.uses_beams() => f64::from(plan.beam_paths.max(1)),
            _ => f64::from(plan.light_paths.max(1)),
        });
        blur * few / many
    };
    let context = Context { prepared: scene, plan };
    // Light tracing fills the crop. Without light sub-paths, a crop shows what the whole film does there.
    let camera = scene.scene.camera();
    let film = if plan.needs_light_paths() { camera.crop() } else { PixelRect::whole(camera.resolution()) };
    let pixels = film.pixels();
    let emitters = scene.scene.emitters().len();
    let emission_probability = |emitter| f64::from(scene.emission_probability(emitter));
    let mut emission = Vec::new();

    let mut seen = Findings::default();
    let map = light_sub_paths::<_, L>(&context, &mut seen, halt)?;
    let mut starts = vec![None; plan.light_paths as usize];
    for &(path, end) in &seen.starts {
        starts[path as usize] = Some((end, 0.0));
    }
    // As with one light sub-path per pixel: fewer bring more each than any pixel has.
    let per_pixel = f64::from(plan.light_paths) / pixels as f64;
    seen.emission.iter_mut().for_each(|(_, contribution)| contribution.pixel *= per_pixel);

    let walks = in_pieces(camera_paths, halt, |index, scratch, seen: &mut Findings| {
        let (index, counters) = (u64::from(index), &mut Counters::default());
        let before = (seen.light, seen.emission.len(), seen.next_event.len(), seen.contributions);
        seen.most = before.3 + room.most();
        camera_path(&context, &map, pixel(film, index), index, scratch, counters, seen);
        let pixel = seen.light - before.0;
        let emission = seen.emission[before.1..].iter_mut().map(|(_, contribution)| contribution);
        let next_events = seen.next_event[before.2..].iter_mut().map(|(.., contribution)| contribution);
        emission.chain(next_events).for_each(|contribution| contribution.pixel = pixel);
        // A run of single sub-paths has no smaller one.
        room.take(seen.contributions - before.3) || light_paths.max(camera_paths) == 1
    })?;
    // Light tracing fills all of these pixels, camera sub-paths a part of them.
    let scale = pixels as f64 / f64::from(camera_paths);
    let mean = walks.iter().map(|seen| seen.light).sum::<f64>() / f64::from(camera_paths)
        + seen.light / pixels as f64;
    // Errors are relative: light counts by the part of its pixel, so that no bright spot decides for all.
    let relative = |contribution: Contribution| {
        if mean > 0.0 { mean / (mean + contribution.pixel) } else { 1.0 }
    };
    let mut by_technique = [0.0; Technique::COUNT];
    let mut by_path = |seen: &[(u32, Contribution)], scale: f64| {
        for &(path, contribution) in seen {
            if let Some((end, light)) = &mut starts[path as usize] {
                let (chosen, relative) = (emission_probability(end.emitter), relative(contribution));
                let scale_of_squares = scale * growth_of_squares(contribution.technique);
                emission.push(contribution.square_of(end.emitter, chosen, scale_of_squares, relative));
                let brought = scale * relative * contribution.value * contribution.weight;
                *light += brought;
                by_technique[contribution.technique as usize] += brought;
            }
        }
    };
    by_path(&seen.emission, 1.0);
    let mut guides = Evidence::default();
    let (mut next_events, mut specular) = ([Vec::new(), Vec::new()], Vec::new());
    for (piece, seen) in walks.into_iter().enumerate() {
        by_path(&seen.emission, scale);
        for (end, receiver, contribution) in seen.next_event {
            let chosen = f64::from(scene.next_event_probability(receiver, end.emitter));
            let sample = contribution.of(end.emitter, chosen, scale * relative(contribution));
            next_events[piece % 2].push(NextEvent { receiver, sample, chosen });
            guides.lit.push((end, receiver));
        }
        specular.push(seen.specular);
    }
    guides.specular = Thinned::joined(specular);
    guides.starts = starts.into_iter().flatten().collect();
    // All that one sub-path brings is one sample.
    let light_paths = effective_samples(guides.starts.iter().map(|&(_, light)| light));
    let probabilities = (0..emitters).map(|i| emission_probability(EmitterId(i as u32))).collect();
    let contributions = emission.len() + next_events.iter().map(Vec::len).sum::<usize>();
    let mut emission = EmitterShares::of_squares(probabilities, &emission);
    emission.samples = emission.samples.min(light_paths);
    Some(Measured { emission, next_events, guides, by_technique, contributions })
}

/// The map that light sub-paths of a plan leave; what they contribute by themselves goes to `seen`.
fn light_sub_paths<S: Scene, L: Lanes>(
    context: &Context<'_, S>,
    seen: &mut Findings,
    halt: &Halt<'_>,
) -> Option<LightMap<S::Bsdf, ByTechnique, L>> {
    let plan = context.plan;
    let paths = plan.traced_light_paths();
    let pieces = in_pieces(
        paths,
        halt,
        |index, scratch, (out, seen): &mut (LightChunk<_, ByTechnique, L>, Findings)| {
            // They contribute by light tracing alone.
            seen.most = usize::MAX;
            light_path(context, index, scratch, out, seen);
            true
        },
    )?;
    let (mut vertices, mut beams) = (Vec::new(), Vec::new());
    for (out, own) in pieces {
        vertices.extend(out.vertices);
        beams.extend(out.beams);
        seen.append(own);
    }
    Some(LightMap::build(plan, vertices, beams))
}

/// Contributions that sub-paths of one piece of work made.
#[derive(Default)]
struct Findings {
    /// Light sub-paths with their starts.
    starts: Vec<(u32, LightEnd)>,
    /// By light sub-path.
    emission: Vec<(u32, Contribution)>,
    /// By light and receiver.
    next_event: Vec<(LightEnd, Vec3, Contribution)>,
    /// Light that arrived in all.
    light: f64,
    /// Number of contributions, those included that are not kept since there were more than `most`.
    contributions: usize,
    most: usize,
    /// Places where camera sub-paths were reflected or refracted in one direction.
    specular: Thinned<Vec3, SPECULAR_OF_PIECE>,
}

impl Findings {
    /// Counts a contribution; whether it is to be kept.
    fn has_room(&mut self) -> bool {
        self.contributions += 1;
        self.contributions <= self.most
    }

    fn append(&mut self, mut more: Self) {
        self.starts.append(&mut more.starts);
        self.emission.append(&mut more.emission);
        self.light += more.light;
    }
}

#[derive(Clone, Copy)]
struct Contribution {
    technique: Technique,
    /// Before weighting.
    value: f64,
    weight: f64,
    /// Sum of the weights of all techniques whose density grows with the probability of this emitter.
    together: f64,
    /// Light of its pixel, this included.
    pixel: f64,
}

impl Contribution {
    /// Turns the sample into one of its emitter, which was chosen with a probability; `scale` is what it
    /// stands for.
    fn of(self, emitter: EmitterId, chosen: f64, scale: f64) -> EmitterSample {
        let others = chosen * (1.0 - self.weight) / self.weight;
        EmitterSample { emitter, light: scale * self.value, others }
    }

    /// The square of the sample, but for the weight of all techniques that the choice of its emitter makes
    /// likelier together with it, as a sample of that emitter; `scale` is what it stands for, relative to
    /// the light of its pixel.
    fn square_of(self, emitter: EmitterId, chosen: f64, scale: f64, relative: f64) -> EmitterSample {
        let others = chosen * (1.0 - self.together) / self.together;
        let value = relative * self.value * self.weight / self.together;
        EmitterSample { emitter, light: scale * chosen * value * value, others }
    }
}

impl<B> Observer<B> for Findings {
    type Densities = ByTechnique;

    fn light_end(&mut self, path: u32, end: &LightEnd) {
        self.starts.push((path, *end));
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        if vertex.delta {
            self.specular.push(vertex.position);
        }
    }

    fn sample(&mut self, sample: &ObservedSample<B, ByTechnique>) {
        let (value, weight) = (f64::from(sample.value.mean()), sample.weight.value());
        let all = sample.weight.all;
        let of_light: f64 =
            TechniqueSet::LIGHT_PATHS.iter().map(|technique| all.of[technique as usize]).sum();
        let (technique, pixel) = (sample.technique, value * weight);
        let seen = |together| Contribution { technique, value, weight, together, pixel };
        self.light += pixel;
        match sample.completion {
            // No choice of an emitter has part in it.
            Completion::Emission | Completion::Hit(_) | Completion::Lens { .. } => {}
            Completion::Nee { light, camera: (receiver, _) } => {
                if self.has_room() {
                    self.next_event.push((light, receiver, seen(weight)));
                }
            }
            Completion::Connect { path, .. }
            | Completion::LightTracing { path, .. }
            | Completion::Merge { path, .. } => {
                if self.has_room() {
                    self.emission.push((path, seen(of_light / all.total())));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Techniques of one light sub-path do not compete: what is left beside them does not depend on how many
    /// they are, and each contributes its part of the light.
    #[test]
    fn techniques_with_a_light_sub_path_count_together() {
        for (count, together) in [(1.0, 1.0), (4.0, 1.0), (1.0, 0.01), (4.0, 0.01)] {
            let (technique, weight) = (Technique::Surf, together / count);
            let contribution = Contribution { technique, value: 2.0, weight, together, pixel: 0.0 };
            let sample = contribution.square_of(EmitterId(0), 0.3, 10.0, 0.5);
            let expected = 10.0 * 0.3 * (0.5 * 2.0 / count).powi(2);
            assert!((sample.light / expected - 1.0).abs() < 1e-12, "{sample:?}, {expected}");
            let others = 0.3 * (1.0 - together) / together;
            assert!((sample.others - others).abs() <= 1e-12 * others, "{sample:?}, {others}");
        }
    }
}
