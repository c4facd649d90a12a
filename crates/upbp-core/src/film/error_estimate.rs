//! Estimates of the error of an image, by two halves of it that are independent.
//!
//! Their difference has the variance that stratified random numbers leave. What the error is relative
//! to, the converged image, is not known: a pixel's own value is the worst guess where it matters, since
//! a pixel that is far too bright would excuse its error by its brightness. It is estimated by Wiener
//! filters on two scales, which trust a pixel as far as the spread around it is more than noise.
//!
//! The mean of such errors says little while few pixels make it: a tail that is too heavy for a mean is
//! found, and then no upper end is given. Bias is not seen: neither that of kernels, nor light that no
//! technique of the set can find.
//!
//! Formulas and sources: `docs/theory.md`, section 6.10. Oracles: `tests`, images with known truth.

use std::fmt;
use std::ops::AddAssign;

use rayon::prelude::*;
use serde::Serialize;

/// Reach of the fine windows: 5 × 5 pixels, as few as still tell a spread from noise.
const REACH: usize = 2;
/// Side of the blocks of which 3 × 3 make a coarse window: with rare light, one sample in a hundred, its
/// mean is of six.
const BLOCK: usize = 8;
/// Added to the square of the converged value, so that dark pixels do not count without bound: as
/// [`crate::Image::relative_mse`].
const DARK: f64 = 0.01;
/// Part of the pixels that are the tail.
const TAIL: f64 = 0.01;
/// Tail index from which on a mean of errors does not converge.
const HEAVY: f64 = 1.0;
/// Uncertainty that remains with any number of pixels, that of the converged values: nine tenths of the
/// renders of the test scenes are within.
const DENOMINATORS: f64 = 0.1;
/// Standard errors on each side of an interval.
const SIGMAS: f64 = 2.0;
/// Iterations below which light that is seen now and then has mostly not been seen.
const FEW_ITERATIONS: u64 = 8;

/// The mean of the iterations of one half, per pixel, row by row.
#[derive(Clone, Copy, Debug)]
pub struct HalfImage<'a> {
    /// All light.
    pub image: &'a [[f32; 3]],
    /// The part of the light that the camera sees directly, or by mirrors and through glass only: then it is
    /// no sign of an error that a pixel is much brighter than its neighbours. `None` where it is not known.
    pub seen: Option<&'a [[f32; 3]]>,
    /// Number of iterations.
    pub iterations: u64,
}

/// Estimated relMSE of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// The likely value; infinite where there is nothing to tell it from.
    pub relative_mse: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval; infinite with a doubt.
    pub high: f64,
    /// The doubt for which there is no upper end.
    pub doubt: Option<Doubt>,
    /// Weight of the tail of the pixels' errors: the exponent of a Pareto distribution inverted:
    /// without a variance from 1/2 on, without a mean from 1 on.
    pub tail_index: f64,
}

/// A reason for which the error could be anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Doubt {
    /// Fewer than two halves, or fewer than eight iterations in both.
    FewIterations,
    /// No light was found at all.
    Black,
    /// A few pixels make the error, and more of the kind that were not met yet could make more of it.
    HeavyTail,
}

/// The error of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// Estimated `(value − converged)² / (converged² + 0.01)` by channel; their mean is the estimated
    /// relMSE. Infinite with an empty half.
    pub relative: Vec<[f32; 3]>,
    /// Mean over the channels, if light that one half only has seen was there by luck.
    upper: Vec<f32>,
    iterations: u64,
    black: bool,
}

impl ErrorMap {
    /// Estimates the error of the mean of both halves.
    ///
    /// # Panics
    /// If the halves are of different sizes, or not of whole rows of `width`.
    #[must_use]
    pub fn new(width: usize, halves: [HalfImage<'_>; 2]) -> Self {
        let pair = Pair::new(width, halves);
        let iterations = halves[0].iterations.saturating_add(halves[1].iterations);
        let black = halves.iter().all(|half| half.image.iter().all(|pixel| *pixel == [0.0; 3]));
        let pixels = halves[0].image.len();
        let mut relative = vec![[f32::INFINITY; 3]; pixels];
        let mut upper = vec![f32::INFINITY; pixels];
        if pixels > 0 && halves.iter().all(|half| half.iterations > 0) {
            let blocks: Vec<Vec<Block>> =
                (0..pair.height.div_ceil(BLOCK)).into_par_iter().map(|row| pair.blocks(row)).collect();
            let rows = relative.par_chunks_mut(BLOCK * width).zip(upper.par_chunks_mut(BLOCK * width));
            rows.enumerate().for_each(|(row, (relative, upper))| pair.errors(&blocks, row, relative, upper));
        }
        Self { relative, upper, iterations, black }
    }

    /// The estimate for the whole image.
    #[must_use]
    pub fn estimate(&self) -> ErrorEstimate {
        let mean = |[r, g, b]: &[f32; 3]| to_f32((f64::from(*r) + f64::from(*g) + f64::from(*b)) / 3.0);
        let mut upper = self.upper.clone();
        let (relative_mse, below) = mean_and_factor(&self.relative.par_iter().map(mean).collect::<Vec<_>>());
        let (most, above) = mean_and_factor(&upper);
        let tail_index = tail_index(&mut upper);
        let doubt = if self.iterations < FEW_ITERATIONS || !relative_mse.is_finite() {
            Some(Doubt::FewIterations)
        } else if self.black {
            Some(Doubt::Black)
        } else if tail_index >= HEAVY {
            Some(Doubt::HeavyTail)
        } else {
            None
        };
        let low = if relative_mse.is_finite() { relative_mse / below } else { 0.0 };
        let high = if doubt.is_some() { f64::INFINITY } else { most * above };
        ErrorEstimate { relative_mse, low, high, doubt, tail_index }
    }
}

impl ErrorEstimate {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        relative_mse: f64::INFINITY,
        low: 0.0,
        high: f64::INFINITY,
        doubt: Some(Doubt::FewIterations),
        tail_index: 0.0,
    };

    /// Whether the error is below `target` as far as can be told.
    ///
    /// A rule that asks often stops at the luckiest answer: ask after the iterations that
    /// [`is_due`](Self::is_due) names.
    #[must_use]
    pub fn reached(&self, target: f64) -> bool {
        self.high <= target
    }

    /// Whether a rule asks for the error after this many iterations: 8, 10, 12, 14, 16, 20, 24, 28, 32,
    /// 40 and so on, four times while the number doubles. Which ones does not depend on where a render
    /// was interrupted.
    #[must_use]
    pub const fn is_due(iterations: u64) -> bool {
        // No digits but the first three.
        iterations >= FEW_ITERATIONS && iterations.trailing_zeros() + 2 >= iterations.ilog2()
    }
}

impl fmt::Display for ErrorEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { relative_mse, low, high, .. } = self;
        match self.doubt {
            _ if relative_mse.is_infinite() => write!(f, "unknown"),
            None => write!(f, "{relative_mse:.2e}, between {low:.2e} and {high:.2e}"),
            Some(doubt) => write!(f, "{relative_mse:.2e} or more: {doubt}"),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::FewIterations => "fewer than eight iterations",
            Self::Black => "no light was found yet",
            Self::HeavyTail => "a few pixels make the error",
        })
    }
}

/// The mean of the pixels' errors, infinite without any, and the factor between it and the ends of its
/// interval.
fn mean_and_factor(errors: &[f32]) -> (f64, f64) {
    // Pieces of fixed size, added in their order.
    let add = |[sum, squares]: [f64; 2], t: &f32| [sum + f64::from(*t), squares + f64::from(*t).powi(2)];
    let pieces: Vec<[f64; 2]> =
        errors.par_chunks(4096).map(|piece| piece.iter().fold([0.0; 2], add)).collect();
    let [sum, squares] = pieces.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    if errors.is_empty() || sum.is_infinite() {
        return (f64::INFINITY, 1.0);
    }
    let standard_error = if sum > 0.0 { squares.sqrt() / sum } else { 0.0 };
    (sum / errors.len() as f64, 1.0 + SIGMAS * standard_error + DENOMINATORS)
}

/// Hill's estimate from the largest hundredth, which is moved to the front: the mean logarithm over the
/// largest value below it. Infinite if that is zero.
fn tail_index(errors: &mut [f32]) -> f64 {
    let count = ((TAIL * errors.len() as f64) as usize).max(10).min(errors.len() / 5);
    if count == 0 {
        return 0.0;
    }
    let (tail, threshold, _) = errors.select_nth_unstable_by(count, |a, b| b.total_cmp(a));
    if tail.iter().all(|t| *t == 0.0) {
        return 0.0;
    }
    // In an order that does not depend on how they were selected.
    tail.sort_unstable_by(f32::total_cmp);
    let threshold = f64::from(*threshold);
    if threshold == 0.0 {
        return f64::INFINITY;
    }
    tail.iter().map(|t| (f64::from(*t) / threshold).ln()).sum::<f64>() / count as f64
}

/// The halves as one image.
struct Pair<'a> {
    width: usize,
    height: usize,
    halves: [HalfImage<'a>; 2],
    /// Parts of the iterations.
    parts: [f64; 2],
}

/// Sums over the pixels of a fine window, by channel.
#[derive(Clone, Copy, Default)]
struct Sums {
    value: [f64; 3],
    square: [f64; 3],
    difference: [f64; 3],
    noise: [f64; 3],
}

/// Estimate for a pixel from the fine window around it.
#[derive(Clone, Copy)]
struct Fine {
    mean: [f64; 3],
    /// Variance of the mean by the difference of the halves, which counts what neighbours share.
    noise: [f64; 3],
    /// The mean without the pixel in the middle.
    others: [f64; 3],
    /// Trust in the pixel's own value, `[0, 1]`.
    own: [f64; 3],
}

/// Sums over the pixels of a block, by channel.
#[derive(Clone, Copy, Default)]
struct Block {
    pixels: f64,
    value: [f64; 3],
    mean: [f64; 3],
    square: [f64; 3],
    noise: [f64; 3],
}

impl HalfImage<'_> {
    /// Light that is not seen directly.
    fn rest(&self, i: usize) -> [f32; 3] {
        let seen = self.seen.map_or([0.0; 3], |seen| seen[i]);
        std::array::from_fn(|c| (self.image[i][c] - seen[c]).max(0.0))
    }
}

impl<'a> Pair<'a> {
    fn new(width: usize, halves: [HalfImage<'a>; 2]) -> Self {
        let pixels = halves[0].image.len();
        for image in halves.iter().flat_map(|half| [Some(half.image), half.seen]).flatten() {
            assert_eq!(image.len(), pixels, "the halves have one size");
        }
        assert!(pixels.checked_rem(width).unwrap_or(pixels) == 0, "{pixels} pixels in rows of {width}");
        let [a, b] = halves.map(|half| half.iterations as f64);
        let sum = (a + b).max(1.0);
        Self { width, height: pixels.checked_div(width).unwrap_or(0), halves, parts: [a / sum, b / sum] }
    }

    /// The mean of both halves.
    fn mean(&self, of: impl Fn(&HalfImage<'a>) -> [f32; 3]) -> [f64; 3] {
        let [a, b] = [of(&self.halves[0]), of(&self.halves[1])];
        std::array::from_fn(|c| self.parts[0] * f64::from(a[c]) + self.parts[1] * f64::from(b[c]))
    }

    /// Light seen directly: the mean, and what both halves have of it.
    fn seen(&self, i: usize) -> [[f64; 3]; 2] {
        let of = |half: &HalfImage<'_>| half.seen.map_or([0.0; 3], |seen| seen[i]);
        let [a, b] = self.halves.each_ref().map(of);
        [self.mean(of), std::array::from_fn(|c| f64::from(a[c].min(b[c])))]
    }

    /// A difference of the halves, so that its square is the variance of their mean.
    fn scaled(&self, a: f32, b: f32) -> f64 {
        (f64::from(a) - f64::from(b)) * (self.parts[0] * self.parts[1]).sqrt()
    }

    /// The variance of the mean.
    fn noise(&self, i: usize) -> [f64; 3] {
        let [a, b] = self.halves.map(|half| half.image[i]);
        if self.parts.contains(&0.0) {
            return [f64::INFINITY; 3];
        }
        std::array::from_fn(|c| self.scaled(a[c], b[c]).powi(2))
    }

    fn pixel(&self, i: usize) -> Sums {
        let [a, b] = self.halves.each_ref().map(|half| half.rest(i));
        let value = self.mean(|half| half.rest(i));
        let difference: [f64; 3] = std::array::from_fn(|c| self.scaled(a[c], b[c]));
        Sums { value, square: value.map(|v| v * v), difference, noise: difference.map(|d| d * d) }
    }

    /// Calls `each` with the column, the value and the window of all pixels of a row.
    fn windows(&self, y: usize, mut each: impl FnMut(usize, [f64; 3], Fine)) {
        let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(self.height);
        let mut columns = vec![Sums::default(); self.width];
        for row in rows.clone() {
            for (x, column) in columns.iter_mut().enumerate() {
                *column += self.pixel(row * self.width + x);
            }
        }
        for x in 0..self.width {
            let reach = x.saturating_sub(REACH)..(x + REACH + 1).min(self.width);
            let mut sums = Sums::default();
            let count = (rows.len() * reach.len()) as f64;
            for column in &columns[reach] {
                sums += *column;
            }
            let value = self.mean(|half| half.rest(y * self.width + x));
            each(x, value, Fine::new(count, &sums, value));
        }
    }

    /// The blocks of a row of blocks.
    fn blocks(&self, row: usize) -> Vec<Block> {
        let mut blocks = vec![Block::default(); self.width.div_ceil(BLOCK)];
        for y in row * BLOCK..((row + 1) * BLOCK).min(self.height) {
            self.windows(y, |x, value, fine| {
                blocks[x / BLOCK] += Block {
                    pixels: 1.0,
                    value,
                    mean: fine.mean,
                    square: fine.mean.map(|m| m * m),
                    noise: fine.noise,
                };
            });
        }
        blocks
    }

    /// The errors of the pixels of a row of blocks.
    fn errors(&self, blocks: &[Vec<Block>], row: usize, relative: &mut [[f32; 3]], upper: &mut [f32]) {
        let coarse: Vec<Block> = (0..blocks[row].len()).map(|column| around(blocks, row, column)).collect();
        let rows = relative.chunks_mut(self.width).zip(upper.chunks_mut(self.width));
        for (y, (relative, upper)) in (row * BLOCK..).zip(rows) {
            self.windows(y, |x, value, fine| {
                let i = y * self.width + x;
                let (coarse, noise) = (&coarse[x / BLOCK], self.noise(i));
                let [seen, by_both] = self.seen(i);
                let mut most = 0.0;
                relative[x] = std::array::from_fn(|c| {
                    let others = if coarse.pixels > 1.0 {
                        (coarse.value[c] - value[c]) / (coarse.pixels - 1.0)
                    } else {
                        value[c]
                    };
                    let smooth = others + coarse.trust(c) * (fine.others[c] - others);
                    let rest = smooth + fine.own[c] * (value[c] - smooth);
                    let error = |seen: f64| noise[c] / ((seen + rest).powi(2) + DARK);
                    most += error(by_both[c]) / 3.0;
                    to_f32(error(seen[c]))
                });
                upper[x] = to_f32(most);
            });
        }
    }
}

/// The sums over a block and those beside it.
fn around(blocks: &[Vec<Block>], row: usize, column: usize) -> Block {
    let mut sums = Block::default();
    for row in &blocks[row.saturating_sub(1)..(row + 2).min(blocks.len())] {
        for block in &row[column.saturating_sub(1)..(column + 2).min(row.len())] {
            sums += *block;
        }
    }
    sums
}

impl Fine {
    fn new(count: f64, sums: &Sums, value: [f64; 3]) -> Self {
        let mean = sums.value.map(|v| v / count);
        let others = if count > 1.0 { count - 1.0 } else { 1.0 };
        Self {
            mean,
            noise: sums.difference.map(|d| (d / count).powi(2)),
            others: std::array::from_fn(|c| {
                if count > 1.0 { (sums.value[c] - value[c]) / others } else { value[c] }
            }),
            own: std::array::from_fn(|c| {
                let spread = (sums.square[c] / count - mean[c] * mean[c]) * count / others;
                signal(spread, sums.noise[c] / count)
            }),
        }
    }
}

impl Block {
    /// Trust in the mean of a fine window beside that of the coarse one.
    fn trust(&self, c: usize) -> f64 {
        let mean = self.mean[c] / self.pixels;
        signal(self.square[c] / self.pixels - mean * mean, self.noise[c] / self.pixels)
    }
}

/// The part of a spread that is not noise.
fn signal(spread: f64, noise: f64) -> f64 {
    if spread > noise { (spread - noise) / spread } else { 0.0 }
}

/// In single precision, at most the largest number unless infinite.
fn to_f32(value: f64) -> f32 {
    if value.is_finite() { value.min(f64::from(f32::MAX)) as f32 } else { value as f32 }
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        add(&mut self.value, other.value);
        add(&mut self.square, other.square);
        add(&mut self.difference, other.difference);
        add(&mut self.noise, other.noise);
    }
}

impl AddAssign for Block {
    fn add_assign(&mut self, other: Self) {
        self.pixels += other.pixels;
        add(&mut self.value, other.value);
        add(&mut self.mean, other.mean);
        add(&mut self.square, other.square);
        add(&mut self.noise, other.noise);
    }
}

fn add(sum: &mut [f64; 3], other: [f64; 3]) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += other;
    }
}

#[cfg(test)]
mod tests {
    use upbp_estimators::{Stream, StreamKind};

    use super::*;

    const SIDE: usize = 64;
    const SEEDS: u64 = 20;

    /// Random numbers, uniform in (0, 1].
    struct Uniform(Stream);

    impl Uniform {
        fn new(seed: u64) -> Self {
            Self(Stream::new(seed, 0, StreamKind::MergePeriods, 0))
        }

        fn next(&mut self) -> f64 {
            1.0 - f64::from(self.0.uniform())
        }

        fn normal(&mut self) -> f64 {
            (-2.0 * self.next().ln()).sqrt() * (std::f64::consts::TAU * self.next()).cos()
        }
    }

    /// The converged value of a pixel: a ramp, an edge, and a dark part.
    fn scene(x: usize, y: usize) -> f64 {
        match (x, y) {
            (0..20, _) => 0.05,
            (_, 0..30) => 0.2 + 0.01 * x as f64,
            _ => 2.0,
        }
    }

    /// Two halves of 16 iterations, each the mean of `sample(random, converged)`.
    fn render(seed: u64, mut sample: impl FnMut(&mut Uniform, f64) -> f64) -> [Vec<[f32; 3]>; 2] {
        let mut random = Uniform::new(seed);
        [0, 1].map(|_| {
            let pixels = (0..SIDE * SIDE).map(|i| scene(i % SIDE, i / SIDE));
            pixels
                .map(|r| {
                    std::array::from_fn(|_| {
                        ((0..16).map(|_| sample(&mut random, r)).sum::<f64>() / 16.0).max(0.0) as f32
                    })
                })
                .collect()
        })
    }

    fn halves(images: &[Vec<[f32; 3]>; 2]) -> [HalfImage<'_>; 2] {
        images.each_ref().map(|image| HalfImage { image, seen: None, iterations: 16 })
    }

    fn truth(images: &[Vec<[f32; 3]>; 2]) -> f64 {
        let error = |i: usize| {
            let r = scene(i % SIDE, i / SIDE);
            let term = |c: usize| {
                let x = 0.5 * (f64::from(images[0][i][c]) + f64::from(images[1][i][c]));
                (x - r).powi(2) / (r * r + 0.01)
            };
            term(0) + term(1) + term(2)
        };
        (0..SIDE * SIDE).map(error).sum::<f64>() / (3 * SIDE * SIDE) as f64
    }

    /// Estimates with the true errors, in the order of the ratio.
    fn estimates(sample: impl Fn(&mut Uniform, f64) -> f64) -> Vec<(ErrorEstimate, f64)> {
        let estimate = |seed| {
            let images = render(seed, &sample);
            (ErrorMap::new(SIDE, halves(&images)).estimate(), truth(&images))
        };
        let mut estimates: Vec<_> = (0..SEEDS).map(estimate).collect();
        estimates.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        estimates
    }

    fn ratio((found, truth): &(ErrorEstimate, f64)) -> f64 {
        found.relative_mse / truth
    }

    #[test]
    fn normal_noise_is_estimated_well() {
        for relative in [0.1, 1.0] {
            let estimates = estimates(|random, r| r * (1.0 + relative * random.normal()));
            assert!(ratio(&estimates[0]) > 0.9 && ratio(&estimates[19]) < 1.1, "{estimates:?}");
            assert!(estimates.iter().all(|(found, truth)| (found.low..=found.high).contains(truth)));
        }
    }

    #[test]
    fn rare_bright_samples_do_not_excuse_themselves() {
        // One sample in three hundred carries all light of the dark and of the middle, so that most
        // pixels of a half are black.
        let rare = |random: &mut Uniform, r: f64| {
            if r > 1.0 {
                r
            } else if random.next() < 1.0 / 300.0 {
                300.0 * r
            } else {
                0.0
            }
        };
        let estimates = estimates(rare);
        assert!((0.8..1.25).contains(&ratio(&estimates[10])), "{estimates:?}");
        assert!(ratio(&estimates[0]) > 0.5 && ratio(&estimates[19]) < 2.0, "{estimates:?}");
        assert!(estimates.iter().all(|(found, truth)| *truth <= found.high), "{estimates:?}");
    }

    #[test]
    fn tails_without_a_mean_of_errors_are_told_from_others() {
        // Pareto samples with mean r and tail index 1/α: errors are their squares.
        let pareto = |alpha: f64| {
            move |random: &mut Uniform, r: f64| r * (alpha - 1.0) / alpha * random.next().powf(-1.0 / alpha)
        };
        for (alpha, heavy) in [(1.3, true), (4.0, false)] {
            for seed in 0..SEEDS {
                let images = render(seed, pareto(alpha));
                let found = ErrorMap::new(SIDE, halves(&images)).estimate();
                assert_eq!(found.doubt, heavy.then_some(Doubt::HeavyTail), "{alpha} {found:?}");
                assert_eq!(found.high.is_infinite(), heavy);
                assert!(!found.reached(1e3) || !heavy);
            }
        }
    }

    #[test]
    fn hill_finds_the_index() {
        for index in [0.25, 0.5, 1.0, 2.0_f64] {
            let mut random = Uniform::new(3);
            let mut errors: Vec<f32> = (0..100_000).map(|_| random.next().powf(-index) as f32).collect();
            // A thousand values in the tail: a standard error of 3 %.
            assert!((tail_index(&mut errors) / index - 1.0).abs() < 0.1, "{index}");
        }
        assert_eq!(tail_index(&mut [0.0; 100]), 0.0);
        let mut lone = vec![0.0; 1000];
        lone[500] = 1.0;
        assert!(tail_index(&mut lone).is_infinite());
    }

    #[test]
    fn a_light_that_is_seen_is_no_outlier() {
        // A light much smaller than a pixel, met by one of the 32 iterations.
        let mut images = render(1, |random, r| r * (1.0 + random.normal()));
        let seen: [Vec<[f32; 3]>; 2] = [0.0, 50.0].map(|value: f32| {
            let mut seen = vec![[0.0; 3]; SIDE * SIDE];
            seen[10 * SIDE + 10] = [value; 3];
            seen
        });
        let without = ErrorMap::new(SIDE, halves(&images)).estimate().relative_mse;
        for (image, seen) in images.iter_mut().zip(&seen) {
            image[10 * SIDE + 10][0] += seen[10 * SIDE + 10][0];
        }
        let told = [0, 1].map(|h| HalfImage { image: &images[h], seen: Some(&seen[h]), iterations: 16 });
        let [known, unknown] =
            [told, halves(&images)].map(|h| ErrorMap::new(SIDE, h).estimate().relative_mse);
        assert!(known < without + 1.5 / (3 * SIDE * SIDE) as f64 && known > without, "{known} {without}");
        assert!(unknown > 10.0 * without);
        // One half only has seen it: that it was luck is not excluded.
        let high = ErrorMap::new(SIDE, told).estimate().high;
        assert!(high > unknown, "{high} {unknown}");
    }

    #[test]
    fn photons_that_neighbours_share_do_not_excuse_themselves() {
        // Blotches of 7 × 7 pixels, as wide as a kernel, that the other half does not have.
        let images = [0, 1].map(|half| {
            let mut random = Uniform::new(half + 10);
            let mut image = vec![[0.0_f64; 3]; SIDE * SIDE];
            for _ in 0..100 {
                let [x, y] = [0, 1].map(|_| (random.next() * (SIDE - 7) as f64) as usize);
                for i in 0..49 {
                    image[(y + i / 7) * SIDE + x + i % 7].iter_mut().for_each(|v| *v += 1.0);
                }
            }
            image.into_iter().map(|pixel| pixel.map(|v| v as f32)).collect::<Vec<_>>()
        });
        // Away from the borders the mean is that of a Poisson process.
        let mean = 100.0 * 49.0 / ((SIDE - 6) * (SIDE - 6)) as f64;
        let map = ErrorMap::new(SIDE, halves(&images));
        let (mut found, mut truth) = (0.0, 0.0);
        for y in 8..SIDE - 8 {
            for x in 8..SIDE - 8 {
                let i = y * SIDE + x;
                let value = 0.5 * f64::from(images[0][i][0] + images[1][i][0]);
                found += f64::from(map.relative[i][0]);
                truth += (value - mean).powi(2) / (mean * mean + 0.01);
            }
        }
        assert!((0.67..1.5).contains(&(found / truth)), "{}", found / truth);
    }

    #[test]
    fn what_cannot_be_told_is_not_told() {
        let image = vec![[1.0_f32, 0.5, 0.0]; 12];
        let other = vec![[0.5_f32; 3]; 12];
        let black = vec![[0.0_f32; 3]; 12];
        let estimate = |a: &[[f32; 3]], b: &[[f32; 3]], iterations: [u64; 2]| {
            let half = |image, iterations| HalfImage { image, seen: None, iterations };
            let halves = [half(a, iterations[0]), half(b, iterations[1])];
            assert_eq!(Pair::new(4, halves).noise(0)[0].is_infinite(), iterations[1] == 0);
            ErrorMap::new(4, halves).estimate()
        };
        let one = estimate(&image, &other, [9, 0]);
        assert!(one.relative_mse.is_infinite() && one.high.is_infinite());
        assert_eq!(one.doubt, Some(Doubt::FewIterations));
        assert_eq!(estimate(&image, &other, [3, 3]).doubt, Some(Doubt::FewIterations));
        assert_eq!(estimate(&black, &black, [90, 90]).doubt, Some(Doubt::Black));
        let same = estimate(&image, &image, [4, 4]);
        assert_eq!((same.low, same.relative_mse, same.high, same.doubt), (0.0, 0.0, 0.0, None));
        let nothing = HalfImage { image: &[], seen: None, iterations: 9 };
        assert!(ErrorMap::new(0, [nothing; 2]).estimate().high.is_infinite());
    }

    #[test]
    fn unequal_halves_count_by_their_iterations() {
        // Variance of the mean of n and m iterations: σ² / (n + m), of which (a − b)² n m / (n + m)² is
        // the mean.
        let mut random = Uniform::new(5);
        let (mut sum, count) = (0.0, 20_000);
        for _ in 0..count {
            let [a, b] = [12.0, 4.0].map(|n: f64| [(100.0 + random.normal() / n.sqrt()) as f32; 3]);
            let halves = [
                HalfImage { image: &[a], seen: None, iterations: 12 },
                HalfImage { image: &[b], seen: None, iterations: 4 },
            ];
            sum += Pair::new(1, halves).noise(0)[0];
        }
        assert!((sum / f64::from(count) * 16.0 - 1.0).abs() < 0.05);
    }

    #[test]
    fn rules_ask_seldom() {
        let due: Vec<u64> = (0..70).filter(|n| ErrorEstimate::is_due(*n)).collect();
        assert_eq!(due, [8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64]);
        assert!(ErrorEstimate::is_due(7 << 40) && !ErrorEstimate::is_due((7 << 40) + 1));
    }

    proptest::proptest! {
        #[test]
        fn any_image_has_an_estimate(
            pixels in proptest::collection::vec(proptest::array::uniform6(0.0..f32::MAX), 0..400),
            exponent in 0..38_i32,
            width in 1..30_usize,
        ) {
            let rows = pixels.len() / width;
            let scale = 10_f32.powi(-exponent);
            let image = |from: usize| -> Vec<[f32; 3]> {
                pixels[..rows * width].iter().map(|p| [0, 1, 2].map(|c| p[from + c] * scale)).collect()
            };
            let images = [image(0), image(3)];
            let map = ErrorMap::new(width, halves(&images));
            proptest::prop_assert!(map.relative.iter().flatten().all(|t| *t >= 0.0));
            let found = map.estimate();
            proptest::prop_assert!(found.low <= found.relative_mse && found.relative_mse <= found.high, "{:?}", found);
            // The same on one thread, to the last bit.
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            proptest::prop_assert_eq!(pool.install(|| ErrorMap::new(width, halves(&images))), map);
        }
    }
}
