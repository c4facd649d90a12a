//! The variance that a plan would have, predicted from a trial of another one.
//!
//! With the balance heuristic, the second moment of single samples is `∫ f²/S`, `S` the sum of the densities of all techniques
//! with their counts; it can be estimated for every `S` by the samples of a trial (`docs/theory.md`, section 6(a)), and
//! knows of paths that the techniques of a plan would find once in a million years. What samples of one camera sub-path have in
//! common is added: photons that are merged with one vertex share its error, and those of one light sub-path share that of their own.

use glam::DVec3;
use upbp_estimators::{Technique, TechniqueSet};

use super::grid::Grid;
use super::recorder::{Sample, TECHNIQUES};
use super::trial::{PASSES, Trial};

/// No sample says more than this part of the whole.
const LARGEST_PART: f64 = 0.03;
/// Of the squared mean of the picture, what is added to the squared radiance that errors are relative to: for a picture of mean
/// 0.5 the 0.01 of relMSE.
const DARKNESS: f64 = 0.04;
/// The least variance, relative to the second moments of single samples.
const LEAST_PART: f64 = 0.05;

/// Parts that a variance is given in, so that its own error can be told.
pub(crate) const GROUPS: usize = 8;
/// Light sub-paths are at least so uneven.
const LEAST_EVENNESS: f64 = 0.1;

/// How many samples of each technique a plan has, relative to the trial's plan; and what part of the camera sub-paths look
/// photons up, which those numbers contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Counts {
    pub(crate) relative: [f64; TECHNIQUES],
    /// Light sub-paths that they come from, and those with beams, relative to the trial's plan.
    pub(crate) paths: [f64; 2],
    pub(crate) look_ups: [f64; TECHNIQUES],
}

/// A trial, made ready for predictions.
pub(crate) struct Prediction {
    trial: Trial,
    /// One over the squared radiance that errors are relative to, by cell: of what was seen around it, so that no bright sample makes
    /// itself less important.
    scale: Vec<DVec3>,
    evenness: f64,
}

impl Prediction {
    /// Takes a trial. Samples that say too much are made smaller, and so are those of camera sub-paths that do together.
    pub(crate) fn new(mut trial: Trial, grid: &Grid) -> Self {
        let scale = relative_to(&surroundings(&trial.means(), grid.columns()));
        let per_look = 1.0 / (trial.cells * trial.passes) as f64;
        let looks = (0..trial.cells).flat_map(|cell| (0..trial.passes).map(move |pass| (cell, pass)));
        let mut parts = Vec::with_capacity(trial.samples.len() + trial.splats.len());
        for (cell, pass) in looks.clone() {
            let samples = &trial.samples[trial.range(cell, pass)];
            parts.extend(samples.iter().map(|s| per_look * trial.second_moment(s, &scale[cell])));
        }
        for (_, cell, splat) in trial.splats() {
            parts.push(trial.per_splat() * trial.second_moment(splat, &scale[cell]));
        }
        let by_sample = reductions(&parts);
        let splats = trial.splats.iter_mut().map(|(_, splat)| splat);
        for (sample, reduction) in trial.samples.iter_mut().chain(splats).zip(by_sample) {
            sample.value *= reduction;
        }
        let together = |(cell, pass)| {
            let sum: DVec3 = trial.samples[trial.range(cell, pass)].iter().map(|s| s.value.as_dvec3()).sum();
            (sum * sum).dot(scale[cell])
        };
        let parts: Vec<f64> = looks.clone().map(together).collect();
        for ((cell, pass), reduction) in looks.zip(reductions(&parts)) {
            let range = trial.range(cell, pass);
            trial.samples[range].iter_mut().for_each(|sample| sample.value *= reduction);
        }
        let mut prediction = Self { trial, scale, evenness: 1.0 };
        prediction.evenness = prediction.splat_evenness();
        prediction
    }

    /// The relative variance of an iteration of a plan with these counts, mean over pixels and channels, in parts due to groups of
    /// cells. Infinite if a path that the trial found is one that the plan cannot find.
    pub(crate) fn relative_variance(&self, counts: &Counts) -> [f64; GROUPS] {
        let trial = &self.trial;
        let mut single = [0.0; GROUPS];
        let mut all = [0.0; GROUPS];
        for cell in 0..trial.cells {
            let sums = self.of_cell(cell, counts);
            single[group(cell)] += sums[0] / trial.cells as f64;
            all[group(cell)] += sums[1] / trial.cells as f64;
        }
        // The difference of two noisy numbers may be anything.
        let mut variance = std::array::from_fn(|group| f64::max(all[group], LEAST_PART * single[group]));
        let relative = counts.relative.map(|count| count as f32);
        for (_, cell, splat) in trial.splats() {
            let moment = trial.second_moment(splat, &self.scale[cell]) / share(splat, &relative);
            variance[group(cell)] += self.evenness * trial.per_splat() * moment;
        }
        variance.map(|part: f64| if part.is_finite() { part } else { f64::INFINITY })
    }

    /// The variance of the light that splats bring to a cell between passes, relative to what it would be if light sub-paths were
    /// independent: they are stratified among each other, and a cell gets as many splats of a pass as a pixel of an iteration.
    fn splat_evenness(&self) -> f64 {
        let trial = &self.trial;
        let mut sums = vec![[DVec3::ZERO; PASSES as usize]; trial.cells];
        let mut independent = 0.0;
        for (pass, cell, splat) in trial.splats() {
            sums[cell][pass] += splat.value.as_dvec3();
            independent += square(splat, &self.scale[cell]);
        }
        // Two passes: the squared difference is twice the variance of one, and the sum of squares over both is twice its own.
        let apart = |(cell, [first, second]): (usize, &[DVec3; 2])| {
            (first - second).powf(2.0).dot(self.scale[cell]) / 3.0
        };
        let apart: f64 = sums.iter().enumerate().map(apart).sum();
        if independent > 0.0 { (apart / independent).clamp(LEAST_EVENNESS, 1.0) } else { 1.0 }
    }

    /// Its second moments of single samples, and all of its variance.
    fn of_cell(&self, cell: usize, counts: &Counts) -> [f64; 2] {
        let Self { trial, scale, .. } = self;
        let scale = &scale[cell];
        let passes = trial.passes as f64;
        let relative = counts.relative.map(|count| count as f32);
        // As many pairs of photons of one light sub-path as the plan has, less those of the trial.
        let more = [0, 1].map(|i| (trial.thinning[i] / counts.paths[i] - 1.0).min(1e6));
        let (mut single, mut common) = (0.0, DVec3::ZERO);
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for pass in 0..trial.passes {
            let mut all = Pairs::default();
            let together = |a: &Sample, b: &Sample| a.merged.is_some() && a.merged == b.merged;
            for run in trial.samples[trial.range(cell, pass)].chunk_by(together) {
                let mut same = Pairs::default();
                for sample in run {
                    let share = share(sample, &relative);
                    single += trial.second_moment(sample, scale) / share;
                    let weight = counts.relative[sample.technique as usize] / share;
                    if weight > 0.0 {
                        let into = if run.len() > 1 { &mut same } else { &mut all };
                        into.add(sample.technique, sample.value.as_dvec3() * weight, counts);
                    }
                }
                if run.len() > 1 {
                    common += same.total(more, counts);
                    all.join(&same);
                }
            }
            common += all.total([1.0; 2], counts);
            let own = all.sum();
            sum += own;
            squares += own * own;
        }
        // The square of the mean from products of different passes, which have no part of their own variance.
        let mean_square = (sum * sum - squares) / (passes * (passes - 1.0));
        let rest = (common / passes - mean_square).dot(*scale) / 3.0;
        [single / passes, single / passes + rest]
    }
}

/// Sums over pairs of different samples.
#[derive(Default)]
struct Pairs {
    /// Of samples whose number goes with light sub-paths, and with those with beams.
    sums: [DVec3; 2],
    /// Pairs of a sample and itself.
    squares: [DVec3; 2],
    /// Of techniques that are looked up seldom.
    seldom: [DVec3; TECHNIQUES],
}

impl Pairs {
    fn add(&mut self, technique: Technique, y: DVec3, counts: &Counts) {
        let p = counts.look_ups[technique as usize];
        self.sums[class(technique)] += y;
        self.squares[class(technique)] += y * y / p;
        if p < 1.0 {
            self.seldom[technique as usize] += y;
        }
    }

    fn join(&mut self, other: &Self) {
        for i in 0..2 {
            self.sums[i] += other.sums[i];
            self.squares[i] += other.squares[i];
        }
        for (sum, other) in self.seldom.iter_mut().zip(&other.seldom) {
            *sum += other;
        }
    }

    fn sum(&self) -> DVec3 {
        self.sums[0] + self.sums[1]
    }

    /// The products of all pairs. Those of a look-up that is made with probability p count 1/p times; those of two beams count
    /// `factors[1]` times, all others `factors[0]` times.
    fn total(&self, factors: [f64; 2], counts: &Counts) -> DVec3 {
        let [points, beams] = self.sums;
        let mut total = factors[0] * (points * points + 2.0 * points * beams) + factors[1] * beams * beams;
        for (squares, factor) in self.squares.iter().zip(factors) {
            total -= factor * squares;
        }
        for technique in TechniqueSet::ALL.without(TechniqueSet::BPT).iter() {
            let (sum, p) = (self.seldom[technique as usize], counts.look_ups[technique as usize]);
            total += factors[class(technique)] * (1.0 / p - 1.0) * sum * sum;
        }
        total
    }
}

/// Which sub-paths a technique's samples go with: 1 for those with beams.
const fn class(technique: Technique) -> usize {
    matches!(technique, Technique::Bp2d | Technique::Bb1d) as usize
}

/// Groups are spread over the picture.
const fn group(cell: usize) -> usize {
    ((cell as u32).wrapping_mul(2_654_435_761) >> 29) as usize % GROUPS
}

/// The densities of a plan at a sample's path, relative to the trial's.
fn share(sample: &Sample, relative: &[f32; TECHNIQUES]) -> f64 {
    f64::from(sample.shares.iter().zip(relative).map(|(share, count)| share * count).sum::<f32>())
}

/// The squared value of a sample, relative, mean over channels.
fn square(sample: &Sample, scale: &DVec3) -> f64 {
    let value = sample.value.as_dvec3();
    (value * value).dot(*scale) / 3.0
}

impl Trial {
    fn range(&self, cell: usize, pass: usize) -> std::ops::Range<usize> {
        let group = cell * self.passes + pass;
        let start = if group == 0 { 0 } else { self.ends[group - 1] };
        start as usize..self.ends[group] as usize
    }

    /// Splats with their passes and cells.
    fn splats(&self) -> impl Iterator<Item = (usize, usize, &Sample)> {
        let pass = |i| self.splat_passes.partition_point(|end| *end <= i);
        self.splats.iter().enumerate().map(move |(i, (cell, splat))| (pass(i), *cell as usize, splat))
    }

    /// The mean radiance of each cell.
    fn means(&self) -> Vec<DVec3> {
        let passes = self.passes as f64;
        let of_cell = |cell| {
            let samples = (0..self.passes).flat_map(|pass| &self.samples[self.range(cell, pass)]);
            samples.map(|sample| sample.value.as_dvec3()).sum::<DVec3>() / passes
        };
        let mut means: Vec<DVec3> = (0..self.cells).map(of_cell).collect();
        for (_, cell, splat) in self.splats() {
            means[cell] += splat.value.as_dvec3() * self.per_splat() * self.cells as f64;
        }
        means
    }

    /// The square of a sample, relative, as much of it as all samples of the plan would have.
    fn second_moment(&self, sample: &Sample, scale: &DVec3) -> f64 {
        square(sample, scale) * self.thinning(sample.technique)
    }

    /// The part of a splat in a mean over pixels.
    fn per_splat(&self) -> f64 {
        1.0 / (self.pixels * self.passes as f64)
    }
}

/// Means over squares of five by five cells, without the one in the middle.
fn surroundings(cells: &[DVec3], columns: usize) -> Vec<DVec3> {
    let rows = cells.len() / columns;
    let around = |i: usize, count: usize| i.saturating_sub(2)..(i + 3).min(count);
    let mean = |(cell, own): (usize, &DVec3)| {
        let (near_rows, near_columns) = (around(cell / columns, rows), around(cell % columns, columns));
        let others = near_rows.len() * near_columns.len() - 1;
        let row =
            |row: usize| near_columns.clone().map(|column| cells[row * columns + column]).sum::<DVec3>();
        (near_rows.map(row).sum::<DVec3>() - own).max(DVec3::ZERO) / others.max(1) as f64
    };
    cells.iter().enumerate().map(mean).collect()
}

fn relative_to(means: &[DVec3]) -> Vec<DVec3> {
    let overall = means.iter().map(|mean| mean.element_sum()).sum::<f64>() / (3 * means.len()) as f64;
    let dark = (DARKNESS * overall * overall).max(f64::MIN_POSITIVE);
    means.iter().map(|mean| (mean * mean + dark).recip()).collect()
}

/// Factors of values, by the parts that their squares have: none is to be more than [`LARGEST_PART`] of the whole.
fn reductions(parts: &[f64]) -> Vec<f32> {
    let most = largest(parts.to_vec());
    parts.iter().map(|part| if *part > most { (most / part).sqrt() as f32 } else { 1.0 }).collect()
}

/// The limit of parts such that none is more than [`LARGEST_PART`] of the sum of all that are so limited.
fn largest(mut parts: Vec<f64>) -> f64 {
    parts.sort_unstable_by(|a, b| b.total_cmp(a));
    let mut rest: f64 = parts.iter().sum();
    for (above, part) in parts.iter().enumerate() {
        // With `above` parts limited to `most`: most = LARGEST_PART (above most + rest).
        let most = LARGEST_PART * rest / (1.0 - LARGEST_PART * above as f64);
        if *part <= most || LARGEST_PART * (above as f64 + 1.0) >= 1.0 {
            return most.max(*part);
        }
        rest -= part;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use upbp_estimators::scene::PixelRect;

    use super::super::trial::Work;
    use super::*;

    const SIDE: u32 = 128;

    /// Uniform numbers that fill the unit interval evenly enough, and independently in two sequences.
    fn uniform(i: usize, sequence: u32) -> f64 {
        let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (u64::from(sequence) << 32);
        for _ in 0..3 {
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x ^= x >> 27;
        }
        (x >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// `∫ 3x² dx = 1` over the unit interval, by one sample of density 1 and one of density `2x`, as if they were an emission
    /// hit and a connection.
    fn trial() -> Trial {
        let cells = (SIDE * SIDE) as usize;
        let passes = PASSES as usize;
        let mut samples = Vec::new();
        let mut ends = Vec::new();
        for i in 0..cells * passes {
            for (technique, x) in
                [(Technique::Hit, uniform(i, 0)), (Technique::Connect, uniform(i, 1).sqrt())]
            {
                let mut shares = [0.0; TECHNIQUES];
                shares[Technique::Hit as usize] = (1.0 / (1.0 + 2.0 * x)) as f32;
                shares[Technique::Connect as usize] = (2.0 * x / (1.0 + 2.0 * x)) as f32;
                let value = Vec3::splat((3.0 * x * x / (1.0 + 2.0 * x)) as f32);
                samples.push(Sample { technique, merged: None, value, shares });
            }
            ends.push(samples.len() as u32);
        }
        Trial {
            passes,
            cells,
            samples,
            ends,
            splats: Vec::new(),
            splat_passes: vec![0; passes],
            thinning: [1.0; 2],
            planned: [1.0; 2],
            pixels: cells as f64,
            work: Work::default(),
        }
    }

    fn quadrature(f: impl Fn(f64) -> f64) -> f64 {
        let n = 100_000;
        (0..n).map(|i| f((f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn variances_are_those_of_the_estimators() {
        let trial = trial();
        let prediction = Prediction::new(
            trial,
            &Grid::new(PixelRect { x: 0, y: 0, width: SIDE, height: SIDE }, SIDE * SIDE),
        );
        let f = |x: f64| 3.0 * x * x;
        // The picture is 1 everywhere.
        let relative = 1.0 / (1.0 + DARKNESS);
        for (hit, connect) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let mut counts =
                Counts { relative: [0.0; TECHNIQUES], paths: [1.0; 2], look_ups: [1.0; TECHNIQUES] };
            counts.relative[Technique::Hit as usize] = hit;
            counts.relative[Technique::Connect as usize] = connect;
            // n samples of a technique have the variance ∫ (w f)² / (n p) − (∫ w f)² / n.
            let sum = |x: f64| hit + connect * 2.0 * x;
            let part = |n: f64, p: fn(f64) -> f64| {
                if n == 0.0 {
                    return 0.0;
                }
                let mean = quadrature(|x| n * p(x) * f(x) / sum(x));
                quadrature(|x| n * p(x) * (f(x) / sum(x)).powi(2)) - mean * mean / n
            };
            let expected = relative * (part(hit, |_| 1.0) + part(connect, |x| 2.0 * x));
            let found: f64 = prediction.relative_variance(&counts).iter().sum();
            assert!((found / expected - 1.0).abs() < 0.1, "{hit}, {connect}: {found}, expected {expected}");
        }
    }

    /// Photons of one light sub-path that are merged together share its error; those of different ones do not.
    #[test]
    fn variances_know_which_photons_are_of_one_light_sub_path() {
        const PLANNED: f64 = 16_000.0;
        const TRACED: usize = 8000;
        const PHOTONS: usize = 3;
        /// One light sub-path out of so many comes by.
        const RARE: f64 = 400.0;
        let cells = (SIDE * SIDE) as usize;
        let mut shares = [0.0; TECHNIQUES];
        shares[Technique::Pb2d as usize] = 1.0;
        let value = Vec3::splat((RARE / (TRACED * PHOTONS) as f64) as f32);
        let (mut samples, mut ends, mut drawn) = (Vec::new(), Vec::new(), 0);
        for _ in 0..cells * PASSES as usize {
            let mut path = 0.0;
            loop {
                path += 1.0 + (uniform(drawn, 2).ln() / (1.0 - 1.0 / RARE).ln()).floor();
                drawn += 1;
                if path > TRACED as f64 {
                    break;
                }
                let merged = Some(path as u32);
                samples.extend([Sample { technique: Technique::Pb2d, merged, value, shares }; PHOTONS]);
            }
            ends.push(samples.len() as u32);
        }
        let trial =
            Trial { samples, ends, thinning: [TRACED as f64 / PLANNED; 2], planned: [PLANNED; 2], ..trial() };
        let grid = Grid::new(PixelRect { x: 0, y: 0, width: SIDE, height: SIDE }, SIDE * SIDE);
        let prediction = Prediction::new(trial, &grid);
        for paths in [0.25, 1.0, 4.0] {
            let mut counts =
                Counts { relative: [0.0; TECHNIQUES], paths: [paths; 2], look_ups: [1.0; TECHNIQUES] };
            counts.relative[Technique::Pb2d as usize] = paths;
            let found: f64 = prediction.relative_variance(&counts).iter().sum();
            let expected = (RARE - 1.0) / (paths * PLANNED) / (1.0 + DARKNESS);
            assert!((found / expected - 1.0).abs() < 0.1, "{paths}: {found}, expected {expected}");
        }
    }

    #[test]
    fn a_plan_that_cannot_find_what_was_seen_is_out_of_the_question() {
        let mut trial = trial();
        for sample in &mut trial.samples {
            if sample.technique == Technique::Connect {
                sample.shares = [0.0; TECHNIQUES];
                sample.shares[Technique::Connect as usize] = 1.0;
            }
        }
        let prediction = Prediction::new(
            trial,
            &Grid::new(PixelRect { x: 0, y: 0, width: SIDE, height: SIDE }, SIDE * SIDE),
        );
        let mut counts = Counts { relative: [0.0; TECHNIQUES], paths: [1.0; 2], look_ups: [1.0; TECHNIQUES] };
        counts.relative[Technique::Hit as usize] = 1.0;
        assert!(prediction.relative_variance(&counts).iter().sum::<f64>().is_infinite());
    }

    #[test]
    fn no_part_is_more_than_the_largest() {
        let mut parts = vec![1.0; 1000];
        parts.extend([1e6, 1e3]);
        let most = largest(parts.clone());
        let sum: f64 = parts.iter().map(|part: &f64| part.min(most)).sum();
        assert!((most / sum - LARGEST_PART).abs() < 1e-9, "{most} of {sum}");
        // Nothing to limit.
        assert!(largest(vec![1.0; 1000]) >= 1.0);
    }
}
