//! Samples of the pilot render under another plan: their moments, and products of pairs of them. A pair is of
//! one camera sub-path, or of one light sub-path at two pixels.

use std::num::NonZeroU32;

use glam::{DVec3, Vec3};
use upbp_estimators::{PerTechnique, Technique};

use super::{Counts, TRUSTED};
use crate::auto::pilot_render::recorder::Sample;
use crate::auto::pilot_render::{PilotRender, PixelPair};
use crate::auto::roulette::{COUNT, relative_pass_probability};

/// The samples of a pilot render, ready for the predictions of many plans.
pub(super) struct ReadySamples {
    /// By camera sub-path, those after most albedos first.
    samples: Vec<ReadySample>,
    /// Index behind the last of each camera sub-path, and its number of light sub-paths with several photons.
    ends: Vec<(u32, u32)>,
}

/// A sample, with all that no plan changes.
struct ReadySample {
    technique: Technique,
    /// The number, in its camera sub-path and from 1, of a light sub-path with several photons.
    light_path: Option<NonZeroU32>,
    albedos: f32,
    /// Weight relative to that in the pilot render, by the number of a roulette: walks get to it less often.
    per_walk: [f32; COUNT],
    value: Vec3,
    /// Square of the value, of as many samples as the plan has.
    square: f32,
    /// Density of the path with the pilot render's plan, mean over iterations, relative to the first
    /// iteration.
    of_pilot: f32,
    /// Balance-heuristic weights of all techniques on its path.
    weights: PerTechnique<f32>,
}

impl ReadySamples {
    /// Takes the samples of a pilot render.
    pub(super) fn new(pilot: &PilotRender) -> Self {
        let mut ready = Self { samples: Vec::with_capacity(pilot.samples.len()), ends: Vec::new() };
        let mean_photons = harmonic_mean_photons(pilot);
        let of_one_path = |a: &Sample, b: &Sample| a.light_path.is_some() && a.light_path == b.light_path;
        for path in 0..pilot.cells * pilot.passes {
            let start = ready.samples.len();
            let mut light_paths = 0;
            for photons in pilot.samples_of(path / pilot.passes, path % pilot.passes).chunk_by(of_one_path) {
                light_paths += u32::from(photons.len() > 1);
                let light_path = if photons.len() > 1 { NonZeroU32::new(light_paths) } else { None };
                ready.samples.extend(photons.iter().map(|sample| ReadySample {
                    technique: sample.technique,
                    light_path,
                    albedos: sample.albedos,
                    per_walk: std::array::from_fn(|number| {
                        relative_pass_probability(number, sample.albedos).recip()
                    }),
                    value: sample.value,
                    square: pilot.second_moment(sample) as f32,
                    of_pilot: density_of_pilot(&sample.weights, &mean_photons),
                    weights: sample.weights,
                }));
            }
            ready.samples[start..].sort_by(|a, b| a.albedos.total_cmp(&b.albedos));
            ready.ends.push((ready.samples.len() as u32, light_paths));
        }
        ready
    }

    /// Whether there are no samples at all.
    pub(super) const fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The samples of a camera sub-path, and its number of light sub-paths with several photons.
    fn of(&self, path: usize) -> (&[ReadySample], u32) {
        let start = if path == 0 { 0 } else { self.ends[path - 1].0 };
        let (end, light_paths) = self.ends[path];
        (&self.samples[start as usize..end as usize], light_paths)
    }
}

/// Moments of the samples of a camera sub-path under a plan.
#[derive(Default)]
pub(super) struct PathMoments {
    /// Second moments of single samples.
    pub(super) single: f64,
    /// The part of `single` that is due to light sub-paths: to splats and merges.
    pub(super) light: f64,
    /// The charge beyond `single` for samples that the plan finds rarely.
    pub(super) excess: Excess,
    /// Products of all pairs of different samples.
    pub(super) products: f64,
    /// Sum of all samples.
    pub(super) sum: DVec3,
}

/// The samples of a pilot render under another plan.
pub(super) struct Reweighted<'a> {
    samples: &'a ReadySamples,
    roulette: usize,
    /// Samples of each technique relative to the pilot render's plan.
    relative: PerTechnique<f32>,
    /// Samples of each technique, relative, times their factors in the weights.
    weighted: PerTechnique<f32>,
    /// The factor of emission hits, next events and connections.
    camera_factor: f32,
    /// Extra weight of pairs of samples of one camera sub-path, which makes the queries for both or for none.
    common: PerTechnique<f32>,
    /// Pairs of photons of one light sub-path that the plan has, less those of the pilot render: by points
    /// and by beams.
    more: [f32; 2],
    /// Whether any technique makes queries in some pixels only.
    periodic: bool,
    /// Sums of what was found of a light sub-path: by class and, where queries are periodic, by technique.
    by_class: Vec<[Vec3; 2]>,
    by_technique: Vec<PerTechnique<Vec3>>,
}

impl<'a> Reweighted<'a> {
    pub(super) fn new(pilot: &PilotRender, samples: &'a ReadySamples, counts: &Counts) -> Self {
        Self {
            samples,
            roulette: counts.roulette,
            relative: counts.relative.map(|count| count as f32),
            weighted: Technique::ALL.map(|technique| {
                let factor = if technique.is_per_camera_vertex() { counts.camera_factor } else { 1.0 };
                (factor * counts.relative[technique as usize]) as f32
            }),
            camera_factor: counts.camera_factor as f32,
            common: counts.active.map(|p| (1.0 / p - 1.0) as f32),
            more: [0, 1].map(|i| (pilot.thinning[i] / counts.paths[i] - 1.0).min(1e6) as f32),
            periodic: counts.active.iter().any(|p| *p < 1.0),
            by_class: Vec::new(),
            by_technique: Vec::new(),
        }
    }

    /// The moments of a camera sub-path.
    pub(super) fn moments(&mut self, path: usize) -> PathMoments {
        if self.periodic { self.path_moments::<true>(path) } else { self.path_moments::<false>(path) }
    }

    fn path_moments<const PERIODIC: bool>(&mut self, path: usize) -> PathMoments {
        let mut result = PathMoments::default();
        let mut all = [Vec3::ZERO; 2];
        let mut all_by_technique = [Vec3::ZERO; Technique::COUNT];
        let (samples, light_paths) = self.samples.of(path);
        self.by_class.clear();
        self.by_class.resize(light_paths as usize, all);
        if PERIODIC {
            self.by_technique.clear();
            self.by_technique.resize(light_paths as usize, all_by_technique);
        }
        for sample in samples {
            let i = sample.technique as usize;
            let densities = self.densities(&sample.weights);
            let per_walk = sample.per_walk[self.roulette];
            result.single += f64::from(per_walk * densities.single(sample.square));
            result.light += f64::from(per_walk * densities.light(sample.square));
            if let Some(excess) = densities.excess(per_walk * sample.square, sample.of_pilot) {
                result.excess.add(&excess);
            }
            let weight = self.weighted[i] * densities.inverse;
            // Neither without samples nor without a number.
            if !(weight > 0.0) {
                continue;
            }
            let y = sample.value * weight;
            let own = usize::from(sample.technique.uses_beams());
            let mut others = all[0] + all[1];
            all[own] += y;
            if PERIODIC {
                others += self.common[i] * all_by_technique[i];
                all_by_technique[i] += y;
            }
            if let Some(path) = sample.light_path {
                let path = path.get() as usize - 1;
                let found = &mut self.by_class[path];
                others += self.more[0] * found[0] + self.more[own] * found[1];
                found[own] += y;
                if PERIODIC {
                    let found = &mut self.by_technique[path][i];
                    others += self.more[own] * self.common[i] * *found;
                    *found += y;
                }
            }
            // The deepest come first. A pair exists as often as walks reach its deeper vertex, which cancels
            // the weight of the deeper sample; that of the other one remains.
            result.products += f64::from(2.0 * per_walk * y.dot(others));
        }
        result.sum = (all[0] + all[1]).as_dvec3();
        result
    }

    /// The factor of a sample under the plan.
    fn factor(&self, sample: &Sample) -> f32 {
        self.weighted[sample.technique as usize] * self.densities(&sample.weights).inverse
    }

    /// Product of what one light sub-path brings to two pixels under the plan, times its weight in the errors
    /// of blocks.
    ///
    /// A covariance is less by the product of the means over the number of light sub-paths: little where
    /// each of them meets a small part of the picture.
    pub(super) fn pair_product(&self, pair: &PixelPair) -> f64 {
        let [own, other] = pair.samples.each_ref().map(|samples| self.sums_by_class(samples));
        let with_points = own[0].dot(other[0] + other[1]) + own[1].dot(other[0]);
        // Pairs that the plan has, over those of the pilot render.
        let [points, beams] = self.more.map(|more| 1.0 + more);
        pair.weight * f64::from(points * with_points + beams * own[1].dot(other[1]))
    }

    /// Sums of samples by points and by beams.
    fn sums_by_class(&self, samples: &[Sample]) -> [Vec3; 2] {
        let mut sums = [Vec3::ZERO; 2];
        for sample in samples {
            let factor = self.factor(sample);
            // Neither without samples nor without a number.
            if factor > 0.0 {
                sums[usize::from(sample.technique.uses_beams())] += sample.value * factor;
            }
        }
        sums
    }

    /// The densities of the plan at the path of a sample with these weights.
    #[inline]
    pub(super) fn densities(&self, weights: &PerTechnique<f32>) -> PathDensities {
        let [a, b, c, d, e, f, g, h, i]: PerTechnique<f32> =
            std::array::from_fn(|i| weights[i] * self.relative[i]);
        // Not one after the other: the search has nothing else to wait for.
        let (camera, light) = ((a + b) + c, (((e + f) + (g + h)) + i) + d);
        let weighted = self.camera_factor * camera;
        PathDensities {
            light,
            all: self.camera_factor * weighted + light,
            density: camera + light,
            inverse: 1.0 / (weighted + light),
        }
    }
}

/// Densities of a path by the techniques of a plan, relative to that of the pilot render.
pub(super) struct PathDensities {
    /// Of light tracing and of merges.
    light: f32,
    /// Of all, each with the square of its factor in the weights.
    all: f32,
    /// Of all, without factors.
    density: f32,
    /// One over the sum of all with their factors.
    inverse: f32,
}

impl PathDensities {
    /// The part in the second moment of single samples of one whose square is `square`.
    #[inline]
    pub(super) fn single(&self, square: f32) -> f32 {
        square * self.inverse * (self.all * self.inverse)
    }

    /// The part of it that is due to splats and merges.
    #[inline]
    fn light(&self, square: f32) -> f32 {
        square * self.inverse * (self.light * self.inverse)
    }

    /// The charge for such a sample beyond its part, if there is one; `of_pilot` is the density of its path
    /// with the pilot render's plan.
    #[inline]
    pub(super) fn excess(&self, square: f32, of_pilot: f32) -> Option<Excess> {
        // Most samples are found often enough: no division for these.
        if of_pilot <= TRUSTED * self.density {
            return None;
        }
        let rarity = of_pilot / self.density;
        let charge = f64::from(self.single(square) * ((rarity / TRUSTED).sqrt() - 1.0));
        Some(Excess { charge, by_rarity: charge * f64::from(rarity) })
    }
}

/// Charges for samples that a plan finds more rarely than it can be [trusted](super::TRUSTED) with.
#[derive(Clone, Copy, Default)]
pub(super) struct Excess {
    pub(super) charge: f64,
    /// Charges, each times how much more rarely the plan finds the sample than the pilot render does.
    pub(super) by_rarity: f64,
}

impl Excess {
    pub(super) fn add(&mut self, more: &Self) {
        self.charge += more.charge;
        self.by_rarity += more.by_rarity;
    }
}

/// Photons of each technique in a query of the pilot render's plan, harmonic mean over iterations, relative
/// to the first iteration.
pub(super) fn harmonic_mean_photons(pilot: &PilotRender) -> PerTechnique<f32> {
    Technique::ALL.map(|technique| pilot.harmonic_mean_photons(technique) as f32)
}

/// Density of a path with the pilot render's plan, by such means over iterations.
pub(super) fn density_of_pilot(weights: &PerTechnique<f32>, mean_photons: &PerTechnique<f32>) -> f32 {
    weights.iter().zip(mean_photons).map(|(weight, photons)| weight * photons).sum()
}
