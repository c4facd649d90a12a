//! The emitting volumes that sub-paths begin at.
//!
//! Light sub-paths and next events to a volume pay where camera sub-paths seldom pass through it: a flame in
//! a large room. A volume that fills the picture is found by camera sub-paths anyway, in closed form, and is
//! left to them: its emission then costs what it always did. So a small run with hits and next events
//! compares the variance that the light of each volume has with that of hits alone, on the same sub-paths
//! (`docs/theory.md`, section 6.12).

use std::collections::BTreeSet;

use upbp_estimators::mis::ByTechnique;
use upbp_estimators::observer::{Completion, ObservedSample, Observer};
use upbp_estimators::path::Context;
use upbp_estimators::scene::{Camera, EmitterId, PixelRect, Scene};
use upbp_estimators::{Counters, IterationPlan, LightMap, PreparedScene, Technique, TechniqueSet};

use super::full_plan::{Inputs, Planner, pilot_plan};
use super::parallel_walks::{PilotRun, camera_path, in_pieces, pixel};
use super::statistics::Statistics;
use crate::deadline::{Budget, FIRST_RUN, Halt};
use crate::error::RenderError;
use crate::media::Medium;
use crate::settings::CheckedSettings;

/// Camera sub-paths of a pass.
const PATHS: u32 = 2048;
/// Passes, with the same pixels.
const PASSES: usize = 2;
/// Blocks of the picture along each side, whose mean radiance errors are relative to.
const BLOCKS: u32 = 8;
/// Part of the mean radiance of the picture that is added to that of a block, so that a black one has no say.
const DARK: f64 = 0.1;
/// The variance of hits alone, relative to that with next events, up to which a volume is left to hits: a
/// next event costs as much as a step of the walk.
const MOST_BY_HITS: f64 = 2.0;
/// Effective number of camera sub-paths that must have met a volume, or nothing is known of the variance of
/// hits.
const LEAST_MET: f64 = 64.0;
/// Part of all camera sub-paths that this number must be, where light may come by specular surfaces: there
/// light sub-paths may find what next events cannot.
const SELDOM: f64 = 0.125;
/// Part of the time of a preparation that this may take.
const TIME_FOR_VOLUMES: f64 = 0.05;

/// Leaves volumes that emit to camera sub-paths, where these find their light about as well.
///
/// # Errors
/// [`RenderError::Cancelled`].
pub(crate) fn choose<S: Scene>(
    scene: &mut PreparedScene<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    budget: &Budget<'_>,
) -> Result<(), RenderError> {
    let hit = TechniqueSet::only(Technique::Hit);
    if !scene.has_volume_emitters() || !techniques.intersects(hit) {
        return Ok(());
    }
    let connects = scene.scene.has_connectible_surfaces() || scene.scene.media().iter().any(Medium::scatters);
    if techniques.without(hit).is_empty() || settings.max_length < 2 || !connects {
        scene.leave_out_volumes(|_| true);
        return Ok(());
    }
    let inputs = Inputs { settings, techniques: TechniqueSet::PT, lanes: None };
    let plan = Planner { scene, inputs, statistics: &Statistics::default() }.plan_with([0; 2]);
    let plan = pilot_plan(scene, settings, &plan);
    let run = |part: f64, halt: &Halt<'_>| {
        let paths = (part * f64::from(PATHS)).ceil() as u32;
        let trace = |pass| trace_pass(scene, &plan, pass, paths, halt);
        Some(Walks { paths, passes: [trace(0)?, trace(1)?] })
    };
    let walks = budget.part(TIME_FOR_VOLUMES).largest(FIRST_RUN, run).ok_or(RenderError::Cancelled)?;
    let factors = walks.relative_to(PixelRect::whole(scene.scene.camera().resolution()));
    let least = if scene.scene.has_specular_surfaces() { SELDOM * walks.count() } else { LEAST_MET };
    scene.leave_out_volumes(|emitter| walks.are_hits_enough(emitter, &factors, least));
    Ok(())
}

/// Traces the camera sub-paths of a pass.
fn trace_pass<S: Scene>(
    scene: &PreparedScene<'_, S>,
    plan: &IterationPlan,
    pass: u32,
    paths: u32,
    halt: &Halt<'_>,
) -> Option<Vec<WalkLight>> {
    let plan = &IterationPlan { iteration: PilotRun::Volumes { pass }.iteration(), ..plan.clone() };
    let context = Context { prepared: scene, plan };
    let film = PixelRect::whole(scene.scene.camera().resolution());
    let map = LightMap::<_, _, f64>::empty();
    let volumes = &scene.volume_emitters().collect::<BTreeSet<_>>();
    let pieces = in_pieces(paths, halt, |index, scratch, piece: &mut Vec<WalkLight>| {
        let mut recorder = LightRecorder { volumes, seen: WalkLight::default() };
        let (index, counters) = (u64::from(index), &mut Counters::default());
        camera_path(&context, &map, pixel(film, index), index, scratch, counters, &mut recorder);
        piece.push(recorder.seen);
        true
    })?;
    Some(pieces.into_iter().flatten().collect())
}

/// Light of one emitter along one camera sub-path, in paths that several techniques can make.
#[derive(Clone, Copy, Default)]
struct Light {
    /// By hits and next events, weighted.
    shared: f64,
    /// By hits alone.
    hits: f64,
    /// Squares of single hits.
    squares: f64,
    /// Expected squares by all samples, those of next events included: a hit there would have been as bright.
    expected_squares: f64,
}

/// Light that a camera sub-path has seen.
#[derive(Default)]
struct WalkLight {
    all: f64,
    /// By emitting volume, in the order in which they were seen.
    lights: Vec<(EmitterId, Light)>,
}

impl WalkLight {
    fn of(&self, emitter: EmitterId) -> Light {
        let found = self.lights.iter().find(|(other, _)| *other == emitter);
        found.map_or(Light::default(), |(_, light)| *light)
    }
}

/// Writes down the light that a camera sub-path sees.
struct LightRecorder<'v> {
    volumes: &'v BTreeSet<EmitterId>,
    seen: WalkLight,
}

impl<B> Observer<B> for LightRecorder<'_> {
    type Densities = ByTechnique;

    fn sample(&mut self, sample: &ObservedSample<B, ByTechnique>) {
        let (value, weight) = (f64::from(sample.value.mean()), sample.weight.value());
        self.seen.all += value * weight;
        let (emitter, hit) = match sample.completion {
            Completion::Hit(end) => (end.emitter, value),
            // Next events have the rest of the weight.
            Completion::Nee { light, .. } if weight < 1.0 => (light.emitter, value * weight / (1.0 - weight)),
            _ => return,
        };
        if !self.volumes.contains(&emitter) {
            return;
        }
        let lights = &mut self.seen.lights;
        let index = lights.iter().position(|(other, _)| *other == emitter).unwrap_or_else(|| {
            lights.push((emitter, Light::default()));
            lights.len() - 1
        });
        let light = &mut lights[index].1;
        light.shared += value * weight;
        light.expected_squares += value * weight * hit;
        if sample.technique == Technique::Hit {
            light.hits += value;
            light.squares += value * value;
        }
    }
}

/// Camera sub-paths, by pass and pixel.
struct Walks {
    paths: u32,
    passes: [Vec<WalkLight>; PASSES],
}

impl Walks {
    /// Number of camera sub-paths of all passes.
    fn count(&self) -> f64 {
        PASSES as f64 * f64::from(self.paths)
    }

    /// The factor by which the light at each pixel becomes relative to the radiance around.
    fn relative_to(&self, film: PixelRect) -> Vec<f64> {
        let block = |index: usize| {
            let [x, y] = pixel(film, index as u64);
            (y * BLOCKS / film.height * BLOCKS + x * BLOCKS / film.width) as usize
        };
        let mut blocks = vec![(0.0, 0.0); (BLOCKS * BLOCKS) as usize];
        let mut sum = 0.0;
        for (index, seen) in self.passes.iter().flat_map(|pass| pass.iter().enumerate()) {
            let (radiance, count) = &mut blocks[block(index)];
            *radiance += seen.all;
            *count += 1.0;
            sum += seen.all;
        }
        let mean = sum / self.count();
        let around = |index: usize| {
            let (radiance, count) = blocks[block(index)];
            radiance / count + DARK * mean
        };
        (0..self.paths as usize).map(|index| 1.0 / around(index)).collect()
    }

    /// Whether hits alone find the light of a volume about as well as together with next events; `least` are
    /// the camera sub-paths that must have met it.
    fn are_hits_enough(&self, emitter: EmitterId, factors: &[f64], least: f64) -> bool {
        let (mut shared, mut hits, mut unseen) = (0.0, 0.0, 0.0);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (index, factor) in factors.iter().enumerate() {
            let square = factor * factor;
            let lights = self.passes.each_ref().map(|pass| pass[index].of(emitter));
            // Two independent walks at a pixel: half the square of their difference is their variance.
            let variance = |of: fn(&Light) -> f64| 0.5 * square * (of(&lights[0]) - of(&lights[1])).powi(2);
            shared += variance(|light| light.shared);
            hits += variance(|light| light.hits);
            for light in lights {
                unseen += 0.5 * square * (light.expected_squares - light.squares);
                sum += factor * light.hits;
                squares += square * light.hits * light.hits;
            }
        }
        // Hits that are as rare as they are bright are missing in the squares of a few.
        let hits = hits + unseen.max(0.0);
        let met = if squares > 0.0 { sum * sum / squares } else { 0.0 };
        met >= least && hits <= MOST_BY_HITS * shared
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAMP: EmitterId = EmitterId(2);

    fn walks(of: impl Fn(usize, usize) -> Light) -> Walks {
        let seen = |pass, index| WalkLight { all: 1.0, lights: vec![(LAMP, of(pass, index))] };
        let passes = [0, 1].map(|pass| (0..1000).map(|index| seen(pass, index)).collect());
        Walks { paths: 1000, passes }
    }

    /// A hit of the given value.
    fn hit(value: f64, shared: f64) -> Light {
        Light { shared, hits: value, squares: value * value, expected_squares: value * value }
    }

    fn are_enough(walks: &Walks) -> bool {
        walks.are_hits_enough(LAMP, &[1.0; 1000], LEAST_MET)
    }

    #[test]
    fn a_volume_is_left_to_hits_that_are_even() {
        let noise = |pass: usize, index: usize| ((pass + 7 * index) % 5) as f64;
        assert!(are_enough(&walks(|pass, index| hit(1.0 + noise(pass, index), 1.0 + noise(pass, index)))));
        // Next events make it much more even.
        assert!(!are_enough(&walks(|pass, index| hit(
            1.0 + noise(pass, index),
            3.0 + 0.5 * noise(pass, index)
        ))));
        // Every hundredth path meets it.
        let spark =
            |pass: usize, index: usize| if (index + 50 * pass).is_multiple_of(100) { 100.0 } else { 0.0 };
        assert!(!are_enough(&walks(|pass, index| hit(spark(pass, index), spark(pass, index)))));
    }

    #[test]
    fn hits_that_were_never_seen_count_by_next_events() {
        let even = Light { shared: 1.0, hits: 1.0, squares: 1.0, expected_squares: 1.0 };
        let noisy = |pass: usize, light: Light| Light { shared: 1.0 + pass as f64, ..light };
        assert!(are_enough(&walks(|pass, _| noisy(pass, even))));
        let bright = Light { expected_squares: 50.0, ..even };
        assert!(!are_enough(&walks(|pass, _| noisy(pass, bright))));
    }

    #[test]
    fn what_was_not_seen_is_kept() {
        assert!(!are_enough(&walks(|_, _| Light::default())));
    }
}
