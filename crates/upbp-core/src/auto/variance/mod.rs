//! The variance that an iteration of a plan would have, predicted from the pilot render of another one.
//!
//! With the balance heuristic, the second moment of single samples is `∫ f²/S`, `S` the sum of the densities
//! of all techniques with their counts; it can be estimated for every `S` by the samples of a pilot render
//! (`docs/theory.md`, section 6.2), and knows of paths that the techniques of a plan would find once in a
//! million years. Products of the samples of one camera sub-path are added: photons that are merged with one
//! vertex share its error, and those of one light sub-path share that of their own.

mod limits;
mod sample_pairs;
#[cfg(test)]
pub(super) mod tests;

use glam::DVec3;

use upbp_estimators::{PerTechnique, Technique, TechniqueSet};

use super::pilot_render::recorder::Sample;
use super::pilot_render::{PilotRender, PixelPair};
use crate::plan::Plan;
use limits::{Brightness, limit_means, limiting_factors, surroundings};
use sample_pairs::{Excess, ReadySamples, Reweighted, density_of_pilot, harmonic_mean_photons};

/// The least variance, relative to the second moments of single samples.
const LEAST_PART: f64 = 0.05;

/// A path that a plan finds at least `1 / TRUSTED` times as often as the pilot render is charged its plain
/// second moment. Of rarer ones the pilot render mostly met too few, as of any heavy tail, so that the charge
/// grows with the square root of the rest of the ratio, unless there are so many that the plan
/// [would have met some itself](RareCharges).
const TRUSTED: f32 = 4.0;

/// Parts that a variance is given in, so that its own error can be told.
pub(super) const GROUPS: usize = 8;

/// Samples of each technique under a plan, relative to those of the pilot render's plan.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Counts {
    relative: PerTechnique<f64>,
    /// Light sub-paths that they come from, and those with beams.
    paths: [f64; 2],
    /// Part of the camera sub-paths that make the queries of a technique, which `relative` contains.
    active: PerTechnique<f64>,
    /// Factor of emission hits, next events and connections in the weights.
    camera_factor: f64,
    /// The number of the roulette.
    roulette: usize,
    /// The fewest light sub-paths that merges come from: those with beams, if there are any.
    light_paths: f64,
}

impl Counts {
    fn of(plan: &Plan, pilot: &PilotRender) -> Self {
        // Camera sub-paths are never told apart by how they find the light.
        let techniques = plan.techniques.union(TechniqueSet::PT);
        let mut counts = Self {
            relative: [0.0; Technique::COUNT],
            paths: [Technique::Surf, Technique::Bb1d].map(|technique| pilot.relative_paths(technique, plan)),
            active: [1.0; Technique::COUNT],
            camera_factor: f64::from(plan.camera_factor),
            roulette: pilot.roulette(plan),
            light_paths: f64::from(if plan.techniques.intersects(TechniqueSet::BEAMS) {
                plan.beam_paths
            } else {
                plan.light_paths
            })
            .max(1.0),
        };
        for technique in techniques.iter() {
            let active = plan.active_part(technique);
            counts.active[technique as usize] = active;
            counts.relative[technique as usize] = if technique.is_per_camera_vertex() {
                1.0
            } else {
                active * pilot.relative_photons(technique, plan)
            };
        }
        counts
    }
}

/// A pilot render, made ready for predictions.
pub(super) struct Variance {
    /// Splats and counts; values are relative to the radiance around them.
    pilot: PilotRender,
    samples: ReadySamples,
    /// The relMSE of a relative variance of one.
    relative_mse: f64,
}

impl Variance {
    /// Takes a pilot render. Samples that say too much are made smaller, and so are those of camera sub-paths
    /// that do together. Not so pairs of pixels: what these share is in few light sub-paths by its nature.
    pub(super) fn of(mut pilot: PilotRender) -> Self {
        let mut means = pilot.means();
        limit_means(&mut means);
        let brightness = Brightness::of(&surroundings(&means, pilot.columns), &pilot.steady_means());
        pilot.make_relative(&brightness.factors());
        let per_path = 1.0 / (pilot.cells * pilot.passes) as f64;
        let mut parts: Vec<f64> = pilot.samples.iter().map(|s| per_path * pilot.second_moment(s)).collect();
        parts.extend(pilot.splats.iter().map(|(_, splat)| pilot.per_splat() * pilot.second_moment(splat)));
        let by_sample = limiting_factors(&parts);
        let splats = pilot.splats.iter_mut().map(|(_, splat)| splat);
        for (sample, factor) in pilot.samples.iter_mut().chain(splats).zip(by_sample) {
            sample.value *= factor;
        }
        let camera_paths = (0..pilot.cells).flat_map(|cell| (0..pilot.passes).map(move |pass| (cell, pass)));
        let parts: Vec<f64> =
            camera_paths.clone().map(|(cell, pass)| pilot.second_moment_together(cell, pass)).collect();
        for ((cell, pass), factor) in camera_paths.zip(limiting_factors(&parts)) {
            let range = pilot.range(cell, pass);
            pilot.samples[range].iter_mut().for_each(|sample| sample.value *= factor);
        }
        let samples = ReadySamples::new(&pilot);
        pilot.samples = Vec::new();
        Self { pilot, samples, relative_mse: brightness.relative_mse() }
    }

    /// Whether the pilot render met any light.
    pub(super) fn sees_light(&self) -> bool {
        !self.samples.is_empty() || !self.pilot.splats.is_empty()
    }

    /// The pilot render, without its samples.
    pub(super) const fn pilot(&self) -> &PilotRender {
        &self.pilot
    }

    /// The relative variance of an iteration of a plan, mean over pixels and channels, in parts due to groups
    /// of cells. Infinite if a path that the pilot render found is one that the plan cannot find.
    pub(super) fn relative(&self, plan: &Plan) -> [f64; GROUPS] {
        self.with(&Counts::of(plan, &self.pilot))
    }

    /// The relMSE of an iteration of a plan.
    pub(super) fn relative_mse(&self, plan: &Plan) -> f64 {
        self.relative_mse * self.relative(plan).iter().sum::<f64>()
    }

    /// Variances of blocks of pixels, times their pixels, mean over [sides](crate::film::BLOCK_SIDES) of
    /// blocks: what a pair of pixels shares counts once for each of them.
    ///
    /// The gain of more light sub-paths than the pilot render's is told by rare paths at their face value:
    /// the charge for them guards against techniques that a pilot render knows too little of, and numbers of
    /// light sub-paths are no such techniques.
    pub(super) fn over_scales(&self, plan: &Plan) -> [f64; GROUPS] {
        let usual = self.pilot.plan.light_paths;
        let with = |light_paths: u32| {
            self.over_scales_with(&Counts::of(&Plan { light_paths, ..*plan }, &self.pilot))
        };
        let [variance, charges] = with(plan.light_paths.min(usual));
        let sum = |parts: &[f64; GROUPS]| parts.iter().sum::<f64>();
        let more =
            if plan.light_paths > usual { sum(&with(plan.light_paths)[0]) / sum(&variance) } else { 1.0 };
        std::array::from_fn(|group| finite_or_infinite((variance[group] + charges[group]) * more))
    }

    /// Variances of blocks without what rare paths are charged for, and those charges. Pairs of pixels are
    /// grouped by light sub-path: all cells meet the same ones.
    fn over_scales_with(&self, counts: &Counts) -> [[f64; GROUPS]; 2] {
        let [mut variance, charges] = self.parts(counts);
        let reweighted = Reweighted::new(&self.pilot, &self.samples, counts);
        for pair in &self.pilot.pairs {
            variance[group(pair.path as usize)] += reweighted.pair_product(pair) / self.pilot.cells as f64;
        }
        [variance, charges]
    }

    fn with(&self, counts: &Counts) -> [f64; GROUPS] {
        let [variance, charges] = self.parts(counts);
        std::array::from_fn(|group| finite_or_infinite(variance[group] + charges[group]))
    }

    /// Variances of pixels without what rare paths are charged for, and those charges.
    fn parts(&self, counts: &Counts) -> [[f64; GROUPS]; 2] {
        let pilot = &self.pilot;
        let mut reweighted = Reweighted::new(pilot, &self.samples, counts);
        let mut groups = [Moments::default(); GROUPS];
        let mut charges = RareCharges::default();
        for cell in 0..pilot.cells {
            groups[group(cell)].add(&self.of_cell(cell, &mut reweighted, &mut charges));
        }
        let mut variance = variances(&groups, counts.light_paths).map(|sum| sum / pilot.cells as f64);
        let photons = harmonic_mean_photons(pilot);
        for of_path in pilot.splats.chunk_by(|(_, a), (_, b)| a.light_path == b.light_path) {
            let mut excess = Excess::default();
            for (cell, splat) in of_path {
                let densities = reweighted.densities(&splat.weights);
                let square = pilot.second_moment(splat) as f32;
                let of_pilot = density_of_pilot(&splat.weights, &photons);
                variance[group(*cell as usize)] += pilot.per_splat() * f64::from(densities.single(square));
                densities.excess(square, of_pilot).inspect(|more| excess.add(more));
            }
            let path = of_path[0].1.light_path.unwrap_or(0);
            charges.add(group(path as usize), pilot.per_splat(), &excess);
        }
        [variance, charges.charges()]
    }

    /// Moments of the samples of a cell.
    fn of_cell(&self, cell: usize, reweighted: &mut Reweighted<'_>, charges: &mut RareCharges) -> Moments {
        let passes = self.pilot.passes as f64;
        let mut moments = Moments::default();
        let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
        for pass in 0..self.pilot.passes {
            let path = reweighted.moments(cell * self.pilot.passes + pass);
            moments.single += path.single / passes;
            moments.light += path.light / passes;
            moments.pairs += path.products / passes;
            charges.add(group(cell), 1.0 / (passes * self.pilot.cells as f64), &path.excess);
            sum += path.sum;
            squares += path.sum.length_squared();
        }
        // Products of different passes have no part of their own variance.
        moments.mean_square = (sum.length_squared() - squares) / (passes * (passes - 1.0));
        moments
    }
}

/// Infinite instead of not a number, which it is where no technique of a plan finds a path.
fn finite_or_infinite(variance: f64) -> f64 {
    if variance.is_finite() { variance } else { f64::INFINITY }
}

/// Moments of the samples of camera sub-paths.
#[derive(Clone, Copy, Default)]
struct Moments {
    /// Second moments of single samples.
    single: f64,
    /// The part of `single` that is due to light sub-paths.
    light: f64,
    /// Products of pairs of samples.
    pairs: f64,
    mean_square: f64,
}

impl Moments {
    fn add(&mut self, more: &Self) {
        self.single += more.single;
        self.light += more.light;
        self.pairs += more.pairs;
        self.mean_square += more.mean_square;
    }

    /// The variance, a difference of noisy numbers.
    fn variance(&self) -> f64 {
        self.single + self.pairs - self.mean_square
    }

    /// The least that the variance may be, as if nothing was due to camera sub-paths: that of independent
    /// light sub-paths is their second moment less the square of the mean over their number, and pairs only
    /// add to it.
    fn least_variance(&self, light_paths: f64) -> f64 {
        let of_light = self.light - self.mean_square / light_paths;
        (LEAST_PART * (self.single - self.light) + of_light).max(LEAST_PART * self.single)
    }
}

/// Variances of groups, whose sum is no less than it may be. Not each for itself: where a plan has many times
/// the photons of the pilot render, the noise of a group is larger than its variance, and if groups could
/// only be too large, so would be their sum.
fn variances(groups: &[Moments; GROUPS], light_paths: f64) -> [f64; GROUPS] {
    let mut all = Moments::default();
    for group in groups {
        all.add(group);
    }
    let missing = (all.least_variance(light_paths) - all.variance()).max(0.0);
    groups.map(|group| group.variance() + missing / GROUPS as f64)
}

/// Charges for samples that a plan finds rarely, and how much they are to be believed.
///
/// If there are so many that the plan itself would have met some in the place of the pilot render, their mean
/// says what there is.
#[derive(Default)]
struct RareCharges {
    charges: [f64; GROUPS],
    /// Sum of squares of the charges for what one sub-path found, each times how rarely the plan finds it.
    squares: f64,
}

impl RareCharges {
    /// Charges a group for what one sub-path found, `weight` its part in the picture.
    fn add(&mut self, group: usize, weight: f64, excess: &Excess) {
        self.charges[group] += weight * excess.charge;
        self.squares += weight * weight * excess.charge * excess.by_rarity;
    }

    /// The charges, divided by the number of such samples, weighted by what they are charged, that the plan
    /// would have met itself, if that is more than one.
    fn charges(&self) -> [f64; GROUPS] {
        let sum: f64 = self.charges.iter().sum();
        let met = (sum * sum / self.squares).max(1.0);
        self.charges.map(|charge| charge / met)
    }
}

/// The group of a cell, or of a light sub-path: spread over the picture, and over all of them.
const fn group(number: usize) -> usize {
    ((number as u32).wrapping_mul(2_654_435_761) >> 29) as usize
}

impl PilotRender {
    /// The mean radiance of each cell.
    fn means(&self) -> Vec<DVec3> {
        let passes = self.passes as f64;
        let of_cell = |cell| {
            let samples = (0..self.passes).flat_map(|pass| self.samples_of(cell, pass));
            samples.map(|sample| sample.value.as_dvec3()).sum::<DVec3>() / passes
        };
        let mut means: Vec<DVec3> = (0..self.cells).map(of_cell).collect();
        for (cell, splat) in &self.splats {
            means[*cell as usize] += splat.value.as_dvec3() * self.per_splat() * self.cells as f64;
        }
        means
    }

    /// The radiance of each cell that does not hang on one sample: the least of all passes, and its splats
    /// but for the brightest. Something small and bright is not as dark as what is around it.
    pub(super) fn steady_means(&self) -> Vec<DVec3> {
        let of_pass = |cell, pass| -> DVec3 {
            self.samples_of(cell, pass).iter().map(|sample| sample.value.as_dvec3()).sum()
        };
        let of_cell =
            |cell| (0..self.passes).map(|pass| of_pass(cell, pass)).fold(DVec3::INFINITY, DVec3::min);
        let mut means: Vec<DVec3> = (0..self.cells).map(of_cell).collect();
        let mut brightest = vec![DVec3::ZERO; self.cells];
        for (cell, splat) in &self.splats {
            let (cell, value) =
                (*cell as usize, splat.value.as_dvec3() * self.per_splat() * self.cells as f64);
            means[cell] += value;
            brightest[cell] = brightest[cell].max(value);
        }
        means.iter().zip(brightest).map(|(mean, brightest)| (mean - brightest).max(DVec3::ZERO)).collect()
    }

    /// Multiplies samples by a factor of their cell.
    fn make_relative(&mut self, factors: &[DVec3]) {
        let times = |sample: &mut Sample, factor: DVec3| {
            sample.value = (sample.value.as_dvec3() * factor).as_vec3();
        };
        for (cell, factor) in factors.iter().enumerate() {
            let range = self.range(cell, 0).start..self.range(cell, self.passes - 1).end;
            self.samples[range].iter_mut().for_each(|sample| times(sample, *factor));
        }
        for (cell, splat) in &mut self.splats {
            times(splat, factors[*cell as usize]);
        }
        for PixelPair { cell, samples, .. } in &mut self.pairs {
            samples.iter_mut().flatten().for_each(|sample| times(sample, factors[*cell as usize]));
        }
    }

    /// The square of a sample, as large as that of all samples of the plan together.
    fn second_moment(&self, sample: &Sample) -> f64 {
        f64::from(sample.value.length_squared()) * self.thinning(sample.technique)
    }

    /// The square of all samples of a camera sub-path together, as large as with all light sub-paths of the
    /// plan: what different ones bring counts as it is, and what the same one brings as often as it is here.
    fn second_moment_together(&self, cell: usize, pass: usize) -> f64 {
        let [points_kept, beams_kept] = self.thinning;
        let mut all = DVec3::ZERO;
        let mut of_others = 0.0;
        for samples in self.samples_of(cell, pass).chunk_by(|a, b| a.light_path == b.light_path) {
            let mut sums = [DVec3::ZERO; 2];
            for sample in samples {
                sums[usize::from(sample.technique.uses_beams())] += sample.value.as_dvec3();
            }
            let [points, beams] = sums;
            all += points + beams;
            if samples[0].light_path.is_some() {
                of_others += (1.0 - points_kept) * points.dot(points + 2.0 * beams)
                    + (1.0 - beams_kept) * beams.length_squared();
            }
        }
        all.length_squared() - of_others
    }

    /// The part of a splat in a mean over pixels.
    fn per_splat(&self) -> f64 {
        1.0 / (self.pixels * self.passes as f64)
    }
}
