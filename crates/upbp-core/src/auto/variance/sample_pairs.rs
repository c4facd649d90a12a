//! Covariances of the samples of one camera sub-path.

use std::num::NonZeroU32;

use glam::{DVec3, Vec3};
use upbp_estimators::Technique;

use super::{Counts, TRUSTED, has_camera_factor};
use crate::auto::pilot_render::PilotRender;
use crate::auto::pilot_render::recorder::{Sample, TECHNIQUES};
use crate::auto::roulette::{COUNT, relative_pass_probability};

/// The samples of a pilot render, ready for the predictions of many plans.
pub(super) struct Looks {
    /// By look, those after most albedos first.
    samples: Vec<ReadySample>,
    /// Index behind the last of each look, and its number of light sub-paths with several photons.
    ends: Vec<(u32, u32)>,
}

/// A sample, with all that no plan changes.
struct ReadySample {
    technique: Technique,
    /// The number, in its look and from 1, of a light sub-path with several photons.
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
    shares: [f32; TECHNIQUES],
}

impl Looks {
    /// Takes the samples of a pilot.
    pub(super) fn new(pilot: &PilotRender) -> Self {
        let mut looks = Self { samples: Vec::with_capacity(pilot.samples.len()), ends: Vec::new() };
        let mean_photons = mean_photons(pilot);
        let of_one_path = |a: &Sample, b: &Sample| a.merged.is_some() && a.merged == b.merged;
        for look in 0..pilot.cells * pilot.passes {
            let start = looks.samples.len();
            let mut light_paths = 0;
            for photons in pilot.look(look / pilot.passes, look % pilot.passes).chunk_by(of_one_path) {
                light_paths += u32::from(photons.len() > 1);
                let light_path = if photons.len() > 1 { NonZeroU32::new(light_paths) } else { None };
                looks.samples.extend(photons.iter().map(|sample| ReadySample {
                    technique: sample.technique,
                    light_path,
                    albedos: sample.albedos,
                    per_walk: std::array::from_fn(|number| {
                        relative_pass_probability(number, sample.albedos).recip()
                    }),
                    value: sample.value,
                    square: pilot.second_moment(sample) as f32,
                    of_pilot: density_of_pilot(&sample.shares, &mean_photons),
                    shares: sample.shares,
                }));
            }
            looks.samples[start..].sort_by(|a, b| a.albedos.total_cmp(&b.albedos));
            looks.ends.push((looks.samples.len() as u32, light_paths));
        }
        looks
    }

    /// Whether there are no samples at all.
    pub(super) const fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The samples of a look, and its number of light sub-paths.
    fn of(&self, look: usize) -> (&[ReadySample], u32) {
        let start = if look == 0 { 0 } else { self.ends[look - 1].0 };
        let (end, light_paths) = self.ends[look];
        (&self.samples[start as usize..end as usize], light_paths)
    }
}

/// A look under a plan.
#[derive(Default)]
pub(super) struct Look {
    /// Second moments of single samples.
    pub(super) single: f64,
    /// The part of `single` that is due to light sub-paths: to splats and merges.
    pub(super) light: f64,
    /// The charge beyond `single` for samples that the plan finds rarely.
    pub(super) excess: Excess,
    /// Products of all pairs of different samples.
    pub(super) products: f64,
    /// All samples.
    pub(super) sum: DVec3,
}

/// Looks with the eyes of a plan.
pub(super) struct View<'a> {
    looks: &'a Looks,
    roulette: usize,
    /// Samples of each technique relative to the pilot render's plan.
    relative: [f32; TECHNIQUES],
    /// Samples of each technique, relative, times their factors in the weights.
    weighted: [f32; TECHNIQUES],
    /// The factor of emission hits, next events and connections.
    camera_factor: f32,
    /// Extra weight of pairs of samples of one camera sub-path, which makes the queries for both or for none.
    common: [f32; TECHNIQUES],
    /// Pairs of photons of one light sub-path that the plan has, less those of the pilot render: by points
    /// and by beams.
    more: [f32; 2],
    /// Whether any technique makes queries in some pixels only.
    periodic: bool,
    /// Sums of what was found of a light sub-path: by class and, where queries are periodic, by technique.
    by_class: Vec<[Vec3; 2]>,
    by_technique: Vec<[Vec3; TECHNIQUES]>,
}

impl<'a> View<'a> {
    pub(super) fn new(pilot: &PilotRender, looks: &'a Looks, counts: &Counts) -> Self {
        Self {
            looks,
            roulette: counts.roulette,
            relative: counts.relative.map(|count| count as f32),
            weighted: Technique::ALL.map(|technique| {
                let factor = if has_camera_factor(technique) { counts.camera_factor } else { 1.0 };
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

    /// A look at what one camera sub-path found.
    pub(super) fn look(&mut self, look: usize) -> Look {
        if self.periodic { self.look_at::<true>(look) } else { self.look_at::<false>(look) }
    }

    fn look_at<const PERIODIC: bool>(&mut self, look: usize) -> Look {
        let mut result = Look::default();
        let mut all = [Vec3::ZERO; 2];
        let mut all_by_technique = [Vec3::ZERO; TECHNIQUES];
        let (samples, light_paths) = self.looks.of(look);
        self.by_class.clear();
        self.by_class.resize(light_paths as usize, all);
        if PERIODIC {
            self.by_technique.clear();
            self.by_technique.resize(light_paths as usize, all_by_technique);
        }
        for sample in samples {
            let i = sample.technique as usize;
            let share = self.share(&sample.shares);
            let per_walk = sample.per_walk[self.roulette];
            result.single += f64::from(per_walk * share.single(sample.square));
            result.light += f64::from(per_walk * share.light(sample.square));
            if let Some(excess) = share.excess(per_walk * sample.square, sample.of_pilot) {
                result.excess.add(&excess);
            }
            let weight = self.weighted[i] * share.inverse;
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
    pub(super) fn weight(&self, technique: Technique, shares: &[f32; TECHNIQUES]) -> f32 {
        self.weighted[technique as usize] * self.share(shares).inverse
    }

    /// Pairs of merges with one light sub-path, by two camera sub-paths, over those of the pilot render: the
    /// ones with a photon point, then the ones with beams alone.
    pub(super) fn pairs_relative(&self) -> [f32; 2] {
        self.more.map(|more| 1.0 + more)
    }

    /// The densities of the plan at a sample's path.
    #[inline]
    pub(super) fn share(&self, shares: &[f32; TECHNIQUES]) -> Share {
        let [a, b, c, d, e, f, g, h, i]: [f32; TECHNIQUES] =
            std::array::from_fn(|i| shares[i] * self.relative[i]);
        // Not one after the other: the search has nothing else to wait for.
        let (camera, light) = ((a + b) + c, (((e + f) + (g + h)) + i) + d);
        let weighted = self.camera_factor * camera;
        Share {
            light,
            all: self.camera_factor * weighted + light,
            density: camera + light,
            inverse: 1.0 / (weighted + light),
        }
    }
}

/// Densities of techniques relative to those of the pilot render.
pub(super) struct Share {
    /// Of light tracing and of merges.
    light: f32,
    /// Of all, each with the square of its factor in the weights.
    all: f32,
    /// Of all, without factors.
    density: f32,
    /// One over the sum of all with their factors.
    inverse: f32,
}

impl Share {
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

/// Photons of each technique in a query of the pilot render's plan, mean over iterations, relative to the
/// first iteration.
pub(super) fn mean_photons(pilot: &PilotRender) -> [f32; TECHNIQUES] {
    Technique::ALL.map(|technique| pilot.mean_photons(technique) as f32)
}

/// Density of a path with the pilot render's plan, mean over iterations, relative to the first iteration.
pub(super) fn density_of_pilot(shares: &[f32; TECHNIQUES], mean_photons: &[f32; TECHNIQUES]) -> f32 {
    shares.iter().zip(mean_photons).map(|(share, photons)| share * photons).sum()
}
