//! What the samples of one camera sub-path have in common.

use glam::DVec3;
use upbp_estimators::{Technique, TechniqueSet};

use super::super::recorder::{Sample, TECHNIQUES};
use super::super::roulette::{TRIAL, relative_reach};
use super::super::trial::Trial;
use super::Counts;

/// What a plan makes of looks at cells.
pub(super) struct Looks<'a> {
    counts: &'a Counts,
    /// Samples of each technique relative to the trial's.
    relative: [f32; TECHNIQUES],
    /// Samples of the trial of what its plan has one of.
    thinning: [f64; TECHNIQUES],
    /// As many pairs of photons of one light sub-path as the plan has, less those of the trial: by points and by beams.
    more: [f64; 2],
}

/// A look under a plan.
#[derive(Default)]
pub(super) struct Look {
    /// Second moments of single samples.
    pub(super) single: f64,
    /// Products of all pairs of different samples.
    pub(super) products: f64,
    /// All samples.
    pub(super) sum: DVec3,
}

impl<'a> Looks<'a> {
    pub(super) fn new(trial: &Trial, counts: &'a Counts) -> Self {
        Self {
            counts,
            relative: counts.relative.map(|count| count as f32),
            thinning: Technique::ALL.map(|technique| trial.thinning(technique)),
            more: [0, 1].map(|i| (trial.thinning[i] / counts.paths[i] - 1.0).min(1e6)),
        }
    }

    /// Second moment of a sample, of as many as the plan has.
    pub(super) fn second_moment(&self, sample: &Sample) -> f64 {
        self.thinning[sample.technique as usize] * f64::from(sample.value.length_squared())
            / self.share(sample)
    }

    /// A look at samples, which come after the given albedos, descending.
    pub(super) fn look(&self, samples: &[Sample], levels: &[f32]) -> Look {
        let mut look = self.after(samples, f32::INFINITY);
        if self.counts.roulette != TRIAL {
            // A pair is there as often as the sub-path gets to the deeper of both, and each weighs as if it was as often as the
            // sub-path gets to it: by the less deep one, pairs count more or less than in the trial.
            let mut before = 1.0;
            for &level in levels {
                let factor = self.per_reach(level);
                if factor != before {
                    look.products += (factor - before) * self.after(samples, level).products;
                    before = factor;
                }
            }
        }
        look
    }

    /// A look at the samples after vertices with no more than these albedos.
    fn after(&self, samples: &[Sample], albedos: f32) -> Look {
        let mut look = Look::default();
        let mut all = Pairs::default();
        let together = |a: &Sample, b: &Sample| a.merged.is_some() && a.merged == b.merged;
        for run in samples.chunk_by(together) {
            let mut same = Pairs::default();
            let into = if run.len() > 1 { &mut same } else { &mut all };
            for sample in run.iter().filter(|sample| sample.albedos <= albedos) {
                let i = sample.technique as usize;
                let per_share = self.share(sample).recip();
                let square = f64::from(sample.value.length_squared());
                look.single += self.per_reach(sample.albedos) * self.thinning[i] * square * per_share;
                let weight = self.counts.relative[i] * per_share;
                // Neither without samples nor without a number.
                if weight > 0.0 {
                    into.add(sample, square, weight, self.counts);
                }
            }
            if run.len() > 1 {
                look.products += same.total(self.more, self.counts);
                all.join(&same);
            }
        }
        look.products += all.total([1.0; 2], self.counts);
        look.sum = all.sum();
        look
    }

    /// The densities of the plan at a sample's path, relative to the trial's.
    #[inline]
    fn share(&self, sample: &Sample) -> f64 {
        let [a, b, c, d, e, f, g, h, i]: [f32; TECHNIQUES] =
            std::array::from_fn(|i| sample.shares[i] * self.relative[i]);
        // Not one after the other: the search has nothing else to wait for.
        f64::from((((a + b) + (c + d)) + ((e + f) + (g + h))) + i)
    }

    /// How much more a sample weighs after vertices with this product of albedos than in the trial.
    #[inline]
    fn per_reach(&self, albedos: f32) -> f64 {
        match self.counts.roulette {
            TRIAL => 1.0,
            roulette => f64::from(relative_reach(roulette, albedos)).recip(),
        }
    }
}

/// Sums over pairs of different samples.
#[derive(Default)]
struct Pairs {
    /// Of samples whose number goes with light sub-paths, and with those with beams.
    sums: [DVec3; 2],
    /// Pairs of a sample and itself.
    squares: [f64; 2],
    /// Of techniques that are looked up seldom.
    seldom: Option<[DVec3; TECHNIQUES]>,
}

impl Pairs {
    #[inline]
    fn add(&mut self, sample: &Sample, square: f64, weight: f64, counts: &Counts) {
        let technique = sample.technique;
        let y = sample.value.as_dvec3() * weight;
        let p = counts.look_ups[technique as usize];
        self.sums[class(technique)] += y;
        if p < 1.0 {
            self.squares[class(technique)] += square * weight * weight / p;
            self.seldom.get_or_insert_default()[technique as usize] += y;
        } else {
            self.squares[class(technique)] += square * weight * weight;
        }
    }

    fn join(&mut self, other: &Self) {
        for i in 0..2 {
            self.sums[i] += other.sums[i];
            self.squares[i] += other.squares[i];
        }
        if let Some(seldom) = &other.seldom {
            for (sum, other) in self.seldom.get_or_insert_default().iter_mut().zip(seldom) {
                *sum += other;
            }
        }
    }

    fn sum(&self) -> DVec3 {
        self.sums[0] + self.sums[1]
    }

    /// The products of all pairs. Those of a look-up that is made with probability p count 1/p times; those of two beams count
    /// `factors[1]` times, all others `factors[0]` times.
    fn total(&self, factors: [f64; 2], counts: &Counts) -> f64 {
        let [points, beams] = self.sums;
        let mut total = factors[0] * points.dot(points + 2.0 * beams) + factors[1] * beams.length_squared();
        for (squares, factor) in self.squares.iter().zip(factors) {
            total -= factor * squares;
        }
        if let Some(seldom) = &self.seldom {
            for technique in TechniqueSet::ALL.without(TechniqueSet::BPT).iter() {
                let (sum, p) = (seldom[technique as usize], counts.look_ups[technique as usize]);
                total += factors[class(technique)] * (1.0 / p - 1.0) * sum.length_squared();
            }
        }
        total
    }
}

/// Which sub-paths a technique's samples go with: 1 for those with beams.
const fn class(technique: Technique) -> usize {
    matches!(technique, Technique::Bp2d | Technique::Bb1d) as usize
}
