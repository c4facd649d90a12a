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

use super::Image;

/// Reach of the fine windows: 5 × 5 pixels, as few as still tell a spread from noise.
const REACH: usize = 2;
/// Side of the blocks of which 3 × 3 make a coarse window: with rare light, one sample in a hundred, its
/// mean is of six.
const BLOCK: usize = 8;
/// Side of the blocks that tell how far neighbours share errors: two of those, about as wide as the widest
/// kernels.
const SHARING: usize = 2 * BLOCK;
/// Part of the pixels that are the tail.
const TAIL: f64 = 0.01;
/// Part of the errors by pixels that one half alone has seen, from which on light is rare.
const RARE: f64 = 0.1;
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
pub(crate) struct HalfImage<'a> {
    /// Mean radiance of each pixel.
    pub(crate) image: &'a [[f32; 3]],
    /// The part of the light that the camera sees directly, or by mirrors and through glass only: then it is
    /// no sign of an error that a pixel is much brighter than its neighbours.
    pub(crate) seen: &'a [[f32; 3]],
    /// Number of iterations, at least one.
    pub(crate) iterations: u64,
}

/// Estimated relMSE of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// The relMSE that is likely; infinite where there is nothing to tell it from.
    pub relative_mse: f64,
    /// Lower end of the interval that the relMSE is likely in.
    pub low: f64,
    /// Upper end of the interval that the relMSE is likely in; infinite with a doubt.
    pub high: f64,
    /// The doubt for which there is no upper end.
    pub doubt: Option<Doubt>,
    /// Weight of the tail of the pixels' errors: one over the exponent of a Pareto distribution with such a
    /// tail. From 1/2 on it has no variance, from 1 on no mean.
    pub tail_index: f64,
}

/// A reason for which the error could be anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub enum Doubt {
    /// Fewer than two halves, or fewer than eight iterations in both together.
    FewIterations,
    /// A pixel of a half is no number, or infinite.
    NotANumber,
    /// No light was found at all.
    Black,
    /// A few pixels make the error, and more of the kind that were not met yet could make more of it.
    HeavyTail,
}

/// The error of each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// Estimated `(value − converged)² / (converged² + 0.01)` by channel; their mean is the estimated
    /// relMSE.
    pub relative: Vec<[f32; 3]>,
    /// Mean over the channels, if light that one half only has seen was there by luck.
    upper: Vec<f32>,
    /// Whether both halves have seen light there.
    seen_twice: Vec<bool>,
    /// Number of pixels that share an error: 1 where errors of neighbours are independent, else more.
    sharing: f64,
    iterations: u64,
    black: bool,
}

impl ErrorMap {
    /// Estimates the error of the mean of both halves.
    ///
    /// # Panics
    /// If the halves are of different sizes, or not of whole rows of `width`, or one has no iterations.
    pub(crate) fn new(width: usize, halves: [HalfImage<'_>; 2]) -> Self {
        let pair = Pair::new(width, halves);
        let iterations = halves[0].iterations.saturating_add(halves[1].iterations);
        let black = halves.iter().all(|half| half.image.iter().all(|pixel| *pixel == [0.0; 3]));
        let pixels = halves[0].image.len();
        let mut relative = vec![[0.0; 3]; pixels];
        let mut upper = vec![0.0; pixels];
        if pixels > 0 {
            let blocks: Vec<Vec<Block>> =
                (0..pair.height.div_ceil(BLOCK)).into_par_iter().map(|row| pair.blocks(row)).collect();
            let rows = relative.par_chunks_mut(BLOCK * width).zip(upper.par_chunks_mut(BLOCK * width));
            rows.enumerate().for_each(|(row, (relative, upper))| pair.errors(&blocks, row, relative, upper));
        }
        let lit = |half: &HalfImage<'_>, i: usize| half.image[i] != [0.0; 3];
        let seen_twice = (0..pixels).map(|i| halves.iter().all(|half| lit(half, i))).collect();
        let sharing = pair.sharing(&relative);
        Self { relative, upper, seen_twice, sharing, iterations, black }
    }

    /// The estimate for the whole image.
    #[must_use]
    pub fn estimate(&self) -> ErrorEstimate {
        let mean = |[r, g, b]: &[f32; 3]| to_f32((f64::from(*r) + f64::from(*g) + f64::from(*b)) / 3.0);
        let means: Vec<f32> = self.relative.par_iter().map(mean).collect();
        let (relative_mse, below) = mean_and_factor(&means, self.sharing);
        let (most, above) = mean_and_factor(&self.upper, self.sharing);
        let tail_index = tail_index(&mut self.noisy());
        let doubt = if self.iterations < FEW_ITERATIONS || relative_mse == f64::INFINITY {
            Some(Doubt::FewIterations)
        } else if !relative_mse.is_finite() {
            Some(Doubt::NotANumber)
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

    /// Errors of the pixels of which the tail is a part: those that both halves have seen, so that the size
    /// of what is in the picture does not matter beside its black background. Where light is rare, black
    /// pixels are some that it has not met yet.
    fn noisy(&self) -> Vec<f32> {
        let pixels = self.upper.iter().zip(&self.seen_twice);
        let noisy: Vec<f32> = pixels.filter_map(|(error, twice)| twice.then_some(*error)).collect();
        let sum = |errors: &[f32]| errors.iter().map(|t| f64::from(*t)).sum::<f64>();
        let (seen_twice, all) = (sum(&noisy), sum(&self.upper));
        if all - seen_twice > RARE * all { self.upper.clone() } else { noisy }
    }
}

impl ErrorEstimate {
    /// The estimate while nothing is known of the error: anything from zero to infinity.
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
    pub(crate) fn reached(&self, target: f64) -> bool {
        self.high <= target
    }

    /// Whether a rule asks for the error after this many iterations: 8, 10, 12, 14, 16, 20, 24, 28, 32,
    /// 40 and so on, four times while the number doubles. Which ones does not depend on where a render
    /// was interrupted.
    #[must_use]
    pub(crate) const fn is_due(iterations: u64) -> bool {
        // No digits but the first three.
        iterations >= FEW_ITERATIONS && iterations.trailing_zeros() + 2 >= iterations.ilog2()
    }
}

impl fmt::Display for ErrorEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { relative_mse, low, high, .. } = self;
        match self.doubt {
            _ if relative_mse.is_infinite() => write!(f, "unknown"),
            Some(Doubt::Black) => write!(f, "unknown: {}", Doubt::Black),
            None => write!(f, "{relative_mse:.2e}, between {low:.2e} and {high:.2e}"),
            Some(doubt) => write!(f, "{relative_mse:.2e} or more: {doubt}"),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::FewIterations => "fewer than eight iterations",
            Self::NotANumber => "a pixel is no number, or infinite",
            Self::Black => "no light was found yet",
            Self::HeavyTail => "a few pixels make the error",
        })
    }
}

/// The mean of the pixels' errors, infinite without any, and the factor between it and the ends of its
/// interval, if so many pixels share an error.
fn mean_and_factor(errors: &[f32], sharing: f64) -> (f64, f64) {
    // Pieces of fixed size, added in their order.
    let add = |[sum, squares]: [f64; 2], t: &f32| [sum + f64::from(*t), squares + f64::from(*t).powi(2)];
    let pieces: Vec<[f64; 2]> =
        errors.par_chunks(4096).map(|piece| piece.iter().fold([0.0; 2], add)).collect();
    let [sum, squares] = pieces.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    if errors.is_empty() || sum.is_infinite() {
        return (f64::INFINITY, 1.0);
    }
    let standard_error = if sum > 0.0 { (sharing * squares).sqrt() / sum } else { 0.0 };
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
        std::array::from_fn(|c| (self.image[i][c] - self.seen[i][c]).max(0.0))
    }
}

impl<'a> Pair<'a> {
    fn new(width: usize, halves: [HalfImage<'a>; 2]) -> Self {
        let pixels = halves[0].image.len();
        for image in halves.iter().flat_map(|half| [half.image, half.seen]) {
            assert_eq!(image.len(), pixels, "the halves have one size");
        }
        assert!(pixels.checked_rem(width).unwrap_or(pixels) == 0, "{pixels} pixels in rows of {width}");
        assert!(halves.iter().all(|half| half.iterations > 0), "there are two halves");
        let [a, b] = halves.map(|half| half.iterations as f64);
        let parts = [a / (a + b), b / (a + b)];
        Self { width, height: pixels.checked_div(width).unwrap_or(0), halves, parts }
    }

    /// The mean of both halves.
    fn mean(&self, of: impl Fn(&HalfImage<'a>) -> [f32; 3]) -> [f64; 3] {
        let [a, b] = [of(&self.halves[0]), of(&self.halves[1])];
        std::array::from_fn(|c| self.parts[0] * f64::from(a[c]) + self.parts[1] * f64::from(b[c]))
    }

    /// Light seen directly: the mean, and what both halves have of it.
    fn seen(&self, i: usize) -> [[f64; 3]; 2] {
        let of = |half: &HalfImage<'_>| half.seen[i];
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
        std::array::from_fn(|c| self.scaled(a[c], b[c]).powi(2))
    }

    /// Ratio of the errors of the means of square blocks, times their pixels, to those of pixels, as far as
    /// it is more than the chance of independent errors; at least 1.
    fn sharing(&self, relative: &[[f32; 3]]) -> f64 {
        let [a, b] = self.halves.map(|half| half.image);
        let block_row = |y: usize| {
            // By block: sums of errors with their signs, by channel, and of their squares.
            let mut blocks = vec![([0.0; 3], 0.0); self.width.div_ceil(SHARING)];
            for i in y * self.width..(y + SHARING).min(self.height) * self.width {
                let (sums, squares) = &mut blocks[i % self.width / SHARING];
                for (c, sum) in sums.iter_mut().enumerate() {
                    let square = f64::from(relative[i][c]);
                    *sum += square.sqrt().copysign(f64::from(a[i][c]) - f64::from(b[i][c]));
                    *squares += square;
                }
            }
            blocks.iter().fold([0.0; 3], |sums, ([r, g, b], squares)| {
                [sums[0] + r * r + g * g + b * b, sums[1] + squares, sums[2] + squares * squares]
            })
        };
        let rows: Vec<_> = (0..self.height).into_par_iter().step_by(SHARING).map(block_row).collect();
        let mut sums = [0.0; 3];
        for row in rows {
            add(&mut sums, row);
        }
        let [blocks, pixels, squares] = sums;
        let by_chance = SIGMAS * (2.0 * squares).sqrt();
        // What is no number is not the larger one.
        ((blocks - by_chance) / pixels).max(1.0)
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
                    let error = |seen: f64| noise[c] / ((seen + rest).powi(2) + Image::DARK);
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
mod tests;
