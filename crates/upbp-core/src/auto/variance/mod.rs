//! The variance that a plan would have, predicted from a trial of another one.
//!
//! With the balance heuristic, the second moment of single samples is `∫ f²/S`, `S` the sum of the densities of all techniques
//! with their counts; it can be estimated for every `S` by the samples of a trial (`docs/theory.md`, section 6(a)), and
//! knows of paths that the techniques of a plan would find once in a million years. What samples of one camera sub-path have in
//! common is added: photons that are merged with one vertex share its error, and those of one light sub-path share that of their own.

mod limits;
mod pairs;
#[cfg(test)]
mod tests;

use glam::DVec3;

use super::pilot_render::Trial;
use super::pilot_render::grid::Grid;
use super::pilot_render::recorder::{Sample, TECHNIQUES};
use crate::auto::choices::BEAMS;
use limits::{reductions, relative_to, surroundings};
use pairs::{Looks, View};

/// The least variance, relative to the second moments of single samples.
const LEAST_PART: f64 = 0.05;

/// Parts that a variance is given in, so that its own error can be told.
pub(crate) const GROUPS: usize = 8;

/// How many samples of each technique a plan has, relative to the trial's plan; and what part of the iterations look
/// photons up, which those numbers contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Counts {
    pub(crate) relative: [f64; TECHNIQUES],
    /// Light sub-paths that they come from, and those with beams, relative to the trial's plan.
    pub(crate) paths: [f64; 2],
    pub(crate) look_ups: [f64; TECHNIQUES],
    /// The number of the roulette.
    pub(crate) roulette: usize,
}

impl Counts {
    /// The fewest light sub-paths that merges of the plan come from: those with beams, if it has any.
    fn light_paths(&self, trial: &Trial) -> f64 {
        let beams = BEAMS.iter().any(|technique| self.relative[technique as usize] > 0.0);
        (trial.planned[usize::from(beams)] * self.paths[usize::from(beams)]).max(1.0)
    }
}

/// A trial, made ready for predictions.
pub(crate) struct Prediction {
    /// Splats and counts; values are relative to the radiance around them.
    trial: Trial,
    looks: Looks,
}

impl Prediction {
    /// Takes a trial. Samples that say too much are made smaller, and so are those of camera sub-paths that do together.
    pub(crate) fn new(mut trial: Trial, grid: &Grid) -> Self {
        trial.make_relative(&relative_to(&surroundings(&trial.means(), grid.columns())));
        let per_look = 1.0 / (trial.cells * trial.passes) as f64;
        let mut parts: Vec<f64> = trial.samples.iter().map(|s| per_look * trial.second_moment(s)).collect();
        parts.extend(trial.splats.iter().map(|(_, splat)| trial.per_splat() * trial.second_moment(splat)));
        let by_sample = reductions(&parts);
        let splats = trial.splats.iter_mut().map(|(_, splat)| splat);
        for (sample, reduction) in trial.samples.iter_mut().chain(splats).zip(by_sample) {
            sample.value *= reduction;
        }
        let looks = (0..trial.cells).flat_map(|cell| (0..trial.passes).map(move |pass| (cell, pass)));
        let together = |(cell, pass)| {
            let sum: DVec3 = trial.look(cell, pass).iter().map(|s| s.value.as_dvec3()).sum();
            sum.length_squared()
        };
        let parts: Vec<f64> = looks.clone().map(together).collect();
        for ((cell, pass), reduction) in looks.clone().zip(reductions(&parts)) {
            let range = trial.range(cell, pass);
            trial.samples[range].iter_mut().for_each(|sample| sample.value *= reduction);
        }
        let looks = Looks::new(&trial);
        trial.samples = Vec::new();
        Self { trial, looks }
    }

    /// The relative variance of an iteration of a plan with these counts, mean over pixels and channels, in parts due to groups of
    /// cells. Infinite if a path that the trial found is one that the plan cannot find.
    pub(crate) fn relative_variance(&self, counts: &Counts) -> [f64; GROUPS] {
        let trial = &self.trial;
        let mut view = View::new(trial, &self.looks, counts);
        let light_paths = counts.light_paths(trial);
        let mut groups = [Moments::default(); GROUPS];
        for cell in 0..trial.cells {
            groups[group(cell)].add(&self.of_cell(cell, &mut view));
        }
        let mut variance = groups.map(|moments| moments.variance(light_paths) / trial.cells as f64);
        for (cell, splat) in &trial.splats {
            let square = trial.second_moment(splat) as f32;
            let second_moment = f64::from(view.share(&splat.shares).single(square));
            variance[group(*cell as usize)] += trial.per_splat() * second_moment;
        }
        // Not a number where no technique of the plan finds a path.
        variance.map(|part: f64| if part.is_finite() { part } else { f64::INFINITY })
    }

    /// What samples of a cell say.
    fn of_cell(&self, cell: usize, view: &mut View<'_>) -> Moments {
        let passes = self.trial.passes as f64;
        let mut moments = Moments::default();
        let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
        for pass in 0..self.trial.passes {
            let look = view.look(cell * self.trial.passes + pass);
            moments.single += look.single / passes;
            moments.light += look.light / passes;
            moments.pairs += look.products / passes;
            sum += look.sum;
            squares += look.sum.length_squared();
        }
        // Products of different passes have no part of their own variance.
        moments.mean_square = (sum.length_squared() - squares) / (passes * (passes - 1.0));
        moments
    }
}

/// Moments of what camera sub-paths find.
#[derive(Clone, Copy, Default)]
struct Moments {
    /// Second moments of single samples.
    single: f64,
    /// What of those is due to light sub-paths.
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

    /// The variance. As the difference of noisy numbers it may be anything, but not less than if nothing was due to camera sub-paths: that of
    /// independent light sub-paths is their second moment less the square of the mean over their number, and pairs only add to it.
    fn variance(&self, light_paths: f64) -> f64 {
        let of_light = self.light - self.mean_square / light_paths;
        let least = LEAST_PART * (self.single - self.light) + of_light;
        (self.single + self.pairs - self.mean_square).max(least).max(LEAST_PART * self.single)
    }
}

/// Groups are spread over the picture.
const fn group(cell: usize) -> usize {
    ((cell as u32).wrapping_mul(2_654_435_761) >> 29) as usize % GROUPS
}

impl Trial {
    fn range(&self, cell: usize, pass: usize) -> std::ops::Range<usize> {
        let group = cell * self.passes + pass;
        let start = if group == 0 { 0 } else { self.ends[group - 1] };
        start as usize..self.ends[group] as usize
    }

    /// The mean radiance of each cell.
    fn means(&self) -> Vec<DVec3> {
        let passes = self.passes as f64;
        let of_cell = |cell| {
            let samples = (0..self.passes).flat_map(|pass| self.look(cell, pass));
            samples.map(|sample| sample.value.as_dvec3()).sum::<DVec3>() / passes
        };
        let mut means: Vec<DVec3> = (0..self.cells).map(of_cell).collect();
        for (cell, splat) in &self.splats {
            means[*cell as usize] += splat.value.as_dvec3() * self.per_splat() * self.cells as f64;
        }
        means
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
    }

    /// The samples of a look.
    fn look(&self, cell: usize, pass: usize) -> &[Sample] {
        &self.samples[self.range(cell, pass)]
    }

    /// The square of a sample, as much of it as all samples of the plan would have.
    fn second_moment(&self, sample: &Sample) -> f64 {
        f64::from(sample.value.length_squared()) * self.thinning(sample.technique)
    }

    /// The part of a splat in a mean over pixels.
    fn per_splat(&self) -> f64 {
        1.0 / (self.pixels * self.passes as f64)
    }
}
