//! The film: running sums of all iterations, one layer per technique.

mod error_estimate;
pub(crate) mod exact_sum;
mod features;
mod image;
mod iterations;
pub(crate) mod pixel_sets;

use std::collections::BTreeMap;
use std::num::NonZeroU8;
use std::ops::Range;

use rayon::prelude::*;
use upbp_estimators::scene::PixelRect;
use upbp_estimators::{Features, Layer, Spectrum, TechniqueSet, half};

use error_estimate::HalfImage;
pub use error_estimate::{Doubt, ErrorEstimate, ErrorMap};
use exact_sum::Sum3;
pub use features::FeatureImages;
use features::FeatureSums;
pub(crate) use image::BLOCK_SIDES;
pub use image::Image;
pub use iterations::{IterationSet, MAX_ITERATIONS};
use pixel_sets::{SETS, set_of, stand_ins};

/// A pixel of one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pixel {
    /// Radiance by layer.
    pub(crate) layers: [Spectrum; Layer::COUNT],
    /// The part of the light that the camera sees directly, by mirrors or through glass: then it is no sign
    /// of an error that a pixel is much brighter than its neighbours.
    pub(crate) seen: Spectrum,
    /// The sum of splats so far, less what it would be without rounding.
    excess: Spectrum,
}

// What the design says of memory.
const _: () = assert!(size_of::<Pixel>() == 96);

impl Pixel {
    /// No light.
    pub(crate) const BLACK: Self =
        Self { layers: [Spectrum::ZERO; Layer::COUNT], seen: Spectrum::ZERO, excess: Spectrum::ZERO };

    /// Adds a splat of light tracing, before anything else is added to the layer.
    ///
    /// A pixel with all the light of a caustic may get millions, and a sum in single precision would be off
    /// by their roundings, which are alike in each iteration: so it is compensated (Kahan 1965).
    #[inline]
    pub(crate) fn add_splat(&mut self, value: Spectrum) {
        let sum = &mut self.layers[Layer::Bpt as usize];
        let value = value - self.excess;
        let next = *sum + value;
        self.excess = (next - *sum) - value;
        *sum = next;
    }
}

/// Sums over a set of iterations, to the last bit the same in whatever order they were added. A mean is too
/// small by less than 2⁻³⁶ of the largest iteration of that pixel.
///
/// The even and the odd iterations are two halves with no random decision in common: what they differ in
/// tells the error.
///
/// A film may hold a part of an iteration that was stopped: some sets of pixels that are spread evenly. A
/// pixel without any samples shows a neighbour's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    rect: PixelRect,
    /// In the order of [`Layer`]; a sum per pixel.
    layers: Vec<(Layer, Vec<Sum3>)>,
    /// Sums of the even iterations, all layers together.
    even: Vec<Sum3>,
    /// Sums of what the camera sees directly, of even and of odd iterations.
    seen: [Vec<Sum3>; 2],
    /// Sums of the squares of each iteration's whole radiance.
    squares: Vec<Sum3>,
    /// Sums of what the camera sees first, if they are kept.
    features: Option<FeatureSums>,
    iterations: IterationSet,
    /// Iterations that are there in part.
    parts: Parts,
}

/// Numbers of [sets of pixels](pixel_sets) that are there of iterations: at least one, and not all 256.
pub(crate) type Parts = BTreeMap<u64, NonZeroU8>;

const fn pixels(rect: PixelRect) -> usize {
    rect.pixels() as usize
}

impl Film {
    /// A black film for the layers of `techniques`, and for [features](FeatureImages) if they are to be kept.
    pub(crate) fn new(rect: PixelRect, techniques: TechniqueSet, features: bool) -> Self {
        Self::of(rect, techniques, features, || vec![exact_sum::ZERO; pixels(rect)])
    }

    /// A film of such lists of sums.
    fn of(
        rect: PixelRect,
        techniques: TechniqueSet,
        features: bool,
        list: impl Fn() -> Vec<Sum3> + Copy,
    ) -> Self {
        Self {
            rect,
            layers: Self::layers_of(techniques).into_iter().map(|layer| (layer, list())).collect(),
            even: list(),
            seen: [list(), list()],
            squares: list(),
            features: features.then(|| FeatureSums::of(list)),
            iterations: IterationSet::default(),
            parts: Parts::new(),
        }
    }

    /// The layers that `techniques` contribute to, in order.
    pub(crate) fn layers_of(techniques: TechniqueSet) -> Vec<Layer> {
        let mut layers: Vec<_> = techniques.iter().map(upbp_estimators::Technique::layer).collect();
        layers.dedup();
        layers
    }

    /// Bytes that a film takes, with the buffer of one iteration.
    pub(crate) fn memory_bytes(rect: PixelRect, techniques: TechniqueSet, features: bool) -> u64 {
        let pixel = (Self::layers_of(techniques).len() + 4) * size_of::<Sum3>() + size_of::<Pixel>();
        let features = if features { FeatureSums::BYTES + size_of::<Features>() } else { 0 };
        (pixels(rect) as u64).saturating_mul((pixel + features) as u64)
    }

    /// Bytes that an estimate of the error takes besides: both halves with what is seen directly in them, and
    /// for each pixel the error by channel, the largest it may be, and whether both have seen light there.
    pub(crate) const fn estimate_bytes(rect: PixelRect) -> u64 {
        let pixel = 5 * size_of::<[f32; 3]>() + size_of::<f32>() + size_of::<bool>();
        (pixels(rect) as u64).saturating_mul(pixel as u64)
    }

    /// Bytes that writing a film as an image takes besides: the picture, the layers, two halves, variance and
    /// error in single precision, and one more while it is copied or compressed.
    pub(crate) fn output_bytes(rect: PixelRect, techniques: TechniqueSet, features: bool) -> u64 {
        let images = Self::layers_of(techniques).len() + 6 + if features { 3 } else { 0 };
        let pixel = images * size_of::<[f32; 3]>();
        (pixels(rect) as u64).saturating_mul(pixel as u64)
    }

    /// The part of the camera's film that this is.
    #[must_use]
    pub const fn rect(&self) -> PixelRect {
        self.rect
    }

    /// The layers that are kept, in order.
    #[must_use]
    pub fn layers(&self) -> impl ExactSizeIterator<Item = Layer> + '_ {
        self.layers.iter().map(|(layer, _)| *layer)
    }

    /// Number of iterations that are there as a whole.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.iterations.len()
    }

    /// The iterations that are on the film.
    #[must_use]
    pub const fn iteration_set(&self) -> &IterationSet {
        &self.iterations
    }

    /// Iterations of which only some of the 256 sets of pixels are there, with the number of these.
    pub(crate) const fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Iterations of which only some of the pixels are there, with their share.
    #[must_use]
    pub fn begun(&self) -> BTreeMap<u64, f64> {
        let share = |sets: &NonZeroU8| f64::from(sets.get()) / f64::from(SETS);
        self.parts.iter().map(|(iteration, sets)| (*iteration, share(sets))).collect()
    }

    /// Number of pixels.
    pub(crate) const fn len(&self) -> usize {
        pixels(self.rect)
    }

    /// Whether there is nothing on the film, not even a part of an iteration.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.iterations.is_empty() && self.parts.is_empty()
    }

    /// The first iteration of which there is something.
    pub(crate) fn first(&self) -> Option<u64> {
        let whole = self.iterations.ranges().first().map(|range| range.start);
        whole.into_iter().chain(self.parts.keys().next().copied()).min()
    }

    /// The sets of pixels of an iteration that are missing.
    pub(crate) fn missing(&self, iteration: u64) -> Range<u32> {
        let done = if self.iterations.contains(iteration) {
            SETS
        } else {
            self.parts.get(&iteration).map_or(0, |sets| sets.get().into())
        };
        done..SETS
    }

    /// The first iteration that this film and another have both, if only in part.
    pub(crate) fn overlap(&self, other: &Self) -> Option<Range<u64>> {
        let part = |a: &Self, b: &Self| {
            let common = |iteration: &&u64| b.missing(**iteration).start > 0;
            a.parts.keys().find(common).map(|iteration| *iteration..iteration + 1)
        };
        let parts = part(self, other).into_iter().chain(part(other, self));
        parts.chain(self.iterations.overlap(&other.iterations)).min_by_key(|range| range.start)
    }

    /// Adds an iteration as [`add_part`](Self::add_part) does its parts.
    #[cfg(test)]
    pub(crate) fn add(&mut self, iteration: u64, pixels: &[Pixel]) -> u64 {
        self.add_part(iteration, 0..SETS, pixels, &[])
    }

    /// Adds the pixels of some sets: those that follow on what is there of the iteration. Features count if
    /// the film keeps them. Returns how many of the values were not finite or negative; they count as zero.
    ///
    /// # Panics
    /// If `pixels` has another size than the film, or the film holds these sets of the iteration already, or
    /// its index is not below [`MAX_ITERATIONS`].
    pub(crate) fn add_part(
        &mut self,
        iteration: u64,
        sets: Range<u32>,
        pixels: &[Pixel],
        features: &[Features],
    ) -> u64 {
        assert_eq!(pixels.len(), self.even.len(), "an iteration has the film's size");
        assert!(iteration < MAX_ITERATIONS, "iteration {iteration}");
        assert_eq!(self.missing(iteration).start, sets.start, "iteration {iteration} is added once");
        let width = self.rect.width as usize;
        let half = half(iteration).0;
        let dropped =
            self.rows(half, pixels).into_par_iter().enumerate().map(|(y, row)| row.add(y, &sets)).sum();
        if let Some(sums) = &mut self.features {
            sums.add(width, &sets, features);
        }
        if let Ok(done) = u8::try_from(sets.end) {
            self.parts.extend(NonZeroU8::new(done).map(|done| (iteration, done)));
        } else {
            // All 256.
            self.parts.remove(&iteration);
            self.iterations.insert(iteration);
        }
        dropped
    }

    /// The rows of an iteration's pixels with those of the sums that they belong to.
    fn rows<'a>(&'a mut self, half: usize, pixels: &'a [Pixel]) -> Vec<Row<'a>> {
        let width = self.rect.width as usize;
        let Self { layers, even, seen, squares, .. } = self;
        let mut layers: Vec<_> =
            layers.iter_mut().map(|(layer, sums)| (*layer, sums.chunks_mut(width))).collect();
        let mut even = if half == 0 { even.as_mut_slice() } else { &mut [] }.chunks_mut(width);
        let others = seen[half].chunks_mut(width).zip(squares.chunks_mut(width));
        let row = |(pixels, (seen, squares))| Row {
            pixels,
            layers: layers.iter_mut().filter_map(|(layer, rows)| Some((*layer, rows.next()?))).collect(),
            even: even.next(),
            seen,
            squares,
        };
        pixels.chunks(width).zip(others).map(row).collect()
    }

    /// Adds another film of the same size and layers that holds other iterations.
    pub(crate) fn merge(&mut self, other: &Self) {
        debug_assert_eq!(self.rect, other.rect);
        debug_assert!(self.layers().eq(other.layers()));
        debug_assert_eq!(self.overlap(other), None);
        for (own, others) in self.all_mut().zip(other.all()) {
            own.par_iter_mut().zip(others).for_each(|(own, other)| exact_sum::merge(own, other));
        }
        self.iterations.union(&other.iterations);
        self.parts.extend(&other.parts);
    }

    /// All lists of sums: those of each layer, of the even iterations, of what is seen directly in even and
    /// in odd ones, of the squares, of features.
    fn all(&self) -> impl Iterator<Item = &Vec<Sum3>> {
        let [even, odd] = &self.seen;
        let features = self.features.iter().flat_map(FeatureSums::all);
        self.layers.iter().map(|(_, sums)| sums).chain([&self.even, even, odd, &self.squares]).chain(features)
    }

    /// As [`all`](Self::all), to be filled in row by row.
    pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut Vec<Sum3>> {
        let [even, odd] = &mut self.seen;
        let others = [&mut self.even, even, odd, &mut self.squares];
        let features = self.features.iter_mut().flat_map(FeatureSums::all_mut);
        self.layers.iter_mut().map(|(_, sums)| sums).chain(others).chain(features)
    }

    /// The sums of a row of pixels, list by list.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = &Sum3> {
        let width = self.rect.width as usize;
        self.all().flat_map(move |sums| &sums[row * width..(row + 1) * width])
    }

    /// A film without its sums, for which [there is room](Self::all_mut).
    pub(crate) fn without_sums(
        rect: PixelRect,
        techniques: TechniqueSet,
        features: bool,
        iterations: IterationSet,
        parts: Parts,
    ) -> Self {
        Self { iterations, parts, ..Self::of(rect, techniques, features, Vec::new) }
    }

    /// The mean of all iterations, all layers together: radiance in W m⁻² sr⁻¹, linear Rec. 709.
    #[must_use]
    pub fn image(&self) -> Image {
        self.picture(|i, [even, odd]| self.total(i).map(|v| v / (even + odd)))
    }

    /// The mean of one layer, `None` if it is not kept.
    #[must_use]
    pub fn layer(&self, layer: Layer) -> Option<Image> {
        let (_, sums) = self.layers.iter().find(|(own, _)| *own == layer)?;
        Some(self.picture(|i, [even, odd]| exact_sum::values(&sums[i]).map(|v| v / (even + odd))))
    }

    /// Albedo, normal and depth of what the camera sees first, `None` if they are not kept.
    #[must_use]
    pub fn features(&self) -> Option<FeatureImages> {
        let sums = self.features.as_ref()?;
        Some(FeatureImages {
            albedo: self.picture(|i, [even, odd]| sums.albedo(i, even + odd)),
            normal: self.picture(|i, [even, odd]| sums.normal(i, even + odd)),
            depth: self.collect(|i, _| sums.depth(i) as f32),
        })
    }

    /// Number of samples of each pixel.
    #[must_use]
    pub(crate) fn sample_counts(&self) -> Vec<f32> {
        let (counts, width) = (self.counts(), self.rect.width as usize);
        let count = |i: usize| counts[set_of(i % width, i / width) as usize];
        (0..self.len()).map(|i| count(i).iter().sum::<f64>() as f32).collect()
    }

    /// The means of the even and of the odd iterations, which are independent of each other. `None` while
    /// some pixel has samples of one half only.
    #[must_use]
    pub fn halves(&self) -> Option<[Image; 2]> {
        /// Part of a sum above all that cutting off leaves, which is some 2⁻³⁵.
        const CUT: f64 = 1.0 / (1_u64 << 30) as f64;
        if self.counts().as_flattened().contains(&0.0) {
            return None;
        }
        let even = self.picture(|i, [even, _]| exact_sum::values(&self.even[i]).map(|v| v / even));
        let odd = self.picture(|i, [_, odd]| {
            let (total, even) = (self.total(i), exact_sum::values(&self.even[i]));
            // The layers and their total are cut off at different digits: a remainder as small as that may be
            // of either sign, and is no light that the odd iterations have seen.
            std::array::from_fn(|c| {
                let rest = total[c] - even[c];
                if rest > CUT * total[c] { rest / odd } else { 0.0 }
            })
        });
        Some([even, odd])
    }

    /// The variance of the mean, from the spread of the iterations; infinite with fewer than two. Overstates
    /// what stratified random numbers leave of it, evenly among neighbours; [`error_map`](Self::error_map)
    /// does not.
    #[must_use]
    pub fn variance(&self) -> Image {
        self.picture(|i, [even, odd]| {
            let n = even + odd;
            if n < 2.0 {
                return [f64::INFINITY; 3];
            }
            let (total, squares) = (self.total(i), exact_sum::values(&self.squares[i]));
            std::array::from_fn(|c| {
                let mean = total[c] / n;
                ((squares[c] / n - mean * mean) / (n - 1.0)).max(0.0)
            })
        })
    }

    /// Estimated error of every pixel, from the two halves. `None` while some pixel has samples of one half
    /// only.
    #[must_use]
    pub fn error_map(&self) -> Option<ErrorMap> {
        let halves = self.halves()?;
        // Those of the last set, which are some where there are two halves: other pixels may have more, of
        // parts.
        let iterations = self.counts()[SETS as usize - 1].map(|count| count as u64);
        let seen = [0, 1]
            .map(|h| self.picture(|i, counts| exact_sum::values(&self.seen[h][i]).map(|v| v / counts[h])));
        let half = |h: usize| HalfImage {
            image: &halves[h].pixels,
            seen: &seen[h].pixels,
            iterations: iterations[h],
        };
        Some(ErrorMap::new(self.rect.width as usize, [half(0), half(1)]))
    }

    /// Estimated error of the image, from the two halves.
    #[must_use]
    pub fn estimated_error(&self) -> ErrorEstimate {
        self.error_map().map_or(ErrorEstimate::UNKNOWN, |map| map.estimate())
    }

    /// Ratio of the [error over scales](Image::relative_mse_over_scales) to that of pixels, by the difference
    /// of the two halves: 1 where errors of neighbours are independent, less where they even out. `None`
    /// without two halves that differ.
    #[must_use]
    pub(crate) fn shared_error(&self) -> Option<f64> {
        let [even, odd] = self.halves()?;
        let image = self.image();
        let of = |sides: &[u32]| even.difference_over(sides, &odd, &image);
        let ratio = of(&BLOCK_SIDES) / of(&[1]);
        ratio.is_finite().then_some(ratio)
    }

    /// Mean over the image of each kept layer, relative to the whole, by luminance.
    #[must_use]
    pub fn shares(&self) -> Vec<(Layer, f64)> {
        let luminance = |sum: &Sum3| {
            let ([r, g, b], weights) = (exact_sum::values(sum), Spectrum::LUMINANCE);
            weights[0] * r + weights[1] * g + weights[2] * b
        };
        let sums: Vec<f64> =
            self.layers.iter().map(|(_, sums)| sums.iter().map(luminance).sum::<f64>()).collect();
        let total: f64 = sums.iter().sum();
        let relative = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
        self.layers().zip(sums).map(|(layer, sum)| (layer, relative(sum))).collect()
    }

    fn total(&self, pixel: usize) -> [f64; 3] {
        self.layers.iter().fold([0.0; 3], |total, (_, sums)| plus(total, exact_sum::values(&sums[pixel])))
    }

    /// Even and odd iterations of the pixels of each set.
    pub(crate) fn counts(&self) -> Vec<[f64; 2]> {
        let even = |end: u64| end.div_ceil(2);
        let whole = self.iterations.ranges().iter().fold([0, 0], |[evens, odds], range| {
            let more = even(range.end) - even(range.start);
            [evens + more, odds + range.end - range.start - more]
        });
        // Those of which just the first sets are done, by the last of these.
        let mut counts = vec![[0; 2]; SETS as usize];
        for (iteration, done) in &self.parts {
            counts[usize::from(done.get()) - 1][half(*iteration).0] += 1;
        }
        let mut all = whole;
        for counts in counts.iter_mut().rev() {
            all = [0, 1].map(|half| all[half] + counts[half]);
            *counts = all;
        }
        counts.into_iter().map(|counts| counts.map(|count| count as f64)).collect()
    }

    /// Picture of what `value` says of a pixel, in the way of [`collect`](Self::collect).
    fn picture(&self, value: impl Fn(usize, [f64; 2]) -> [f64; 3] + Sync) -> Image {
        let pixels = self.collect(|i, counts| value(i, counts).map(|v| v as f32));
        Image { width: self.rect.width, height: self.rect.height, pixels }
    }

    /// Values of all pixels, row by row, by the index of a pixel and the counts of its halves; the default,
    /// such as black, while there is nothing.
    fn collect<T: Default + Send>(&self, value: impl Fn(usize, [f64; 2]) -> T + Sync) -> Vec<T> {
        let (counts, width) = (self.counts(), self.rect.width as usize);
        let place = |i: usize| (i % width, i / width);
        let count = |(x, y)| counts[set_of(x, y) as usize];
        let has_samples = |place: &(usize, usize)| count(*place) != [0.0; 2];
        let pixel = |i| {
            let own = place(i);
            let shown = std::iter::once(own).chain(stand_ins(own.0, own.1)).find(has_samples);
            shown.map_or_else(T::default, |(x, y)| value(y * width + x, count((x, y))))
        };
        (0..self.even.len()).into_par_iter().with_min_len(1024).map(pixel).collect()
    }
}

/// A row of an iteration's pixels, with those of the sums that they belong to.
struct Row<'a> {
    pixels: &'a [Pixel],
    layers: Vec<(Layer, &'a mut [Sum3])>,
    /// None in odd iterations.
    even: Option<&'a mut [Sum3]>,
    seen: &'a mut [Sum3],
    squares: &'a mut [Sum3],
}

impl Row<'_> {
    /// Adds the pixels of some sets to the sums, in the `y`-th row. Returns how many values were left out.
    fn add(self, y: usize, sets: &Range<u32>) -> u64 {
        let Row { pixels, mut layers, mut even, seen, squares } = self;
        let mut dropped = 0;
        // All sums of a pixel at once: it is read from memory once.
        for (x, pixel) in pixels.iter().enumerate().filter(|(x, _)| sets.contains(&set_of(*x, y))) {
            let mut total = [0.0; 3];
            for (layer, sums) in &mut layers {
                let (value, left_out) = usable(pixel.layers[*layer as usize]);
                exact_sum::add(&mut sums[x], value);
                total = plus(total, value);
                dropped += left_out;
            }
            if let Some(sums) = &mut even {
                exact_sum::add(&mut sums[x], total);
            }
            exact_sum::add(&mut seen[x], usable(pixel.seen).0);
            exact_sum::add(&mut squares[x], total.map(|value| value * value));
        }
        dropped
    }
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// A radiance as numbers that a sum takes, and how many had to be left out.
fn usable(radiance: Spectrum) -> ([f64; 3], u64) {
    let mut dropped = 0;
    let values = radiance.to_array().map(|value| {
        let usable = value >= 0.0 && value.is_finite();
        dropped += u64::from(!usable);
        if usable { f64::from(value) } else { 0.0 }
    });
    (values, dropped)
}

#[cfg(test)]
mod tests;
