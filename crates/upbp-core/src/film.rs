//! The film: running sums of all iterations, one layer per technique.

use rayon::prelude::*;
use upbp_estimators::scene::PixelRect;
use upbp_estimators::{Layer, Spectrum, TechniqueSet};

use crate::iterations::{IterationSet, MAX_ITERATIONS};
use crate::sum::Sum3;

/// A pixel of one iteration: radiance by layer.
pub type Pixel = [Spectrum; Layer::COUNT];

/// Sums over a set of iterations, to the last bit the same in whatever order they were added. A mean is too small by less than
/// 2⁻³⁶ of the largest iteration of that pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    rect: PixelRect,
    /// The layers that are kept, in order.
    layers: Vec<Layer>,
    /// Sums of radiance, `layers.len()` per pixel.
    sums: Vec<Sum3>,
    /// Sums of the squares of each iteration's whole radiance, one per pixel.
    squares: Vec<Sum3>,
    iterations: IterationSet,
}

/// A picture: three values per pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue of each pixel.
    pub pixels: Vec<[f32; 3]>,
}

impl Film {
    /// A black film for the layers of `techniques`.
    #[must_use]
    pub fn new(rect: PixelRect, techniques: TechniqueSet) -> Self {
        let layers = Self::layers_of(techniques);
        let pixels = rect.width as usize * rect.height as usize;
        Self {
            rect,
            sums: vec![Sum3::ZERO; pixels * layers.len()],
            squares: vec![Sum3::ZERO; pixels],
            layers,
            iterations: IterationSet::default(),
        }
    }

    /// The layers that `techniques` contribute to, in order.
    pub(crate) fn layers_of(techniques: TechniqueSet) -> Vec<Layer> {
        let mut layers: Vec<_> = techniques.iter().map(upbp_estimators::Technique::layer).collect();
        layers.dedup();
        layers
    }

    /// Bytes that a film takes, with the buffer of one iteration.
    #[must_use]
    pub fn memory_bytes(rect: PixelRect, techniques: TechniqueSet) -> u64 {
        let pixel = (Self::layers_of(techniques).len() + 1) * size_of::<Sum3>() + size_of::<Pixel>();
        u64::from(rect.width) * u64::from(rect.height) * pixel as u64
    }

    /// Bytes that writing a film as an image takes besides: the picture, the layers and the variance in single precision, and one
    /// more while it is copied or compressed.
    pub(crate) fn output_bytes(rect: PixelRect, techniques: TechniqueSet) -> u64 {
        let pixel = (Self::layers_of(techniques).len() + 3) * size_of::<[f32; 3]>();
        u64::from(rect.width) * u64::from(rect.height) * pixel as u64
    }

    /// The part of the camera's film that this is.
    #[must_use]
    pub const fn rect(&self) -> PixelRect {
        self.rect
    }

    /// The layers that are kept.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Number of iterations.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.iterations.len()
    }

    /// Which iterations they are.
    #[must_use]
    pub const fn iteration_set(&self) -> &IterationSet {
        &self.iterations
    }

    /// Adds an iteration, one value per pixel. Returns how many of the values were not finite or negative; they count as zero.
    ///
    /// # Panics
    /// If `pixels` has another size than the film, or the film holds the iteration already, or its index is not below
    /// [`MAX_ITERATIONS`].
    pub fn add(&mut self, iteration: u64, pixels: &[Pixel]) -> u64 {
        assert_eq!(pixels.len(), self.squares.len(), "an iteration has the film's size");
        assert!(iteration < MAX_ITERATIONS, "iteration {iteration}");
        let range = iteration..iteration + 1;
        assert_eq!(self.iterations.count_in(&range), 0, "iteration {iteration} is added once");
        let Self { layers, sums, squares, .. } = self;
        let dropped = if layers.is_empty() {
            0
        } else {
            sums.par_chunks_mut(layers.len())
                .zip(squares)
                .zip(pixels)
                .with_min_len(256)
                .map(|((sums, square), pixel)| add_pixel(layers, sums, square, pixel))
                .sum()
        };
        self.iterations.insert(iteration);
        dropped
    }

    /// Adds another film of the same size and layers that holds other iterations.
    pub(crate) fn merge(&mut self, other: &Self) {
        debug_assert_eq!((self.rect, &self.layers), (other.rect, &other.layers));
        debug_assert_eq!(self.iterations.overlap(&other.iterations), None);
        self.sums.par_iter_mut().zip(&other.sums).for_each(|(own, sum)| own.merge(sum));
        self.squares.par_iter_mut().zip(&other.squares).for_each(|(own, sum)| own.merge(sum));
        self.iterations.union(&other.iterations);
    }

    /// The sums of a row of pixels: those of radiance, then those of squares.
    pub(crate) fn row(&self, row: usize) -> (&[Sum3], &[Sum3]) {
        let width = self.rect.width as usize;
        let pixels = row * width..(row + 1) * width;
        let n = self.layers.len();
        (&self.sums[pixels.start * n..pixels.end * n], &self.squares[pixels])
    }

    /// A film from its parts; sums as many as belong to the size.
    pub(crate) fn from_parts(
        rect: PixelRect,
        techniques: TechniqueSet,
        iterations: IterationSet,
        sums: Vec<Sum3>,
        squares: Vec<Sum3>,
    ) -> Self {
        Self { rect, layers: Self::layers_of(techniques), sums, squares, iterations }
    }

    /// The mean of all iterations, all layers together.
    #[must_use]
    pub fn image(&self) -> Image {
        let scale = 1.0 / self.iterations().max(1) as f64;
        self.collect(|i| self.total(i).map(|v| (v * scale) as f32))
    }

    /// The mean of one layer, `None` if it is not kept.
    #[must_use]
    pub fn layer(&self, layer: Layer) -> Option<Image> {
        let at = self.layers.iter().position(|l| *l == layer)?;
        let scale = 1.0 / self.iterations().max(1) as f64;
        Some(self.collect(|i| self.sums[i * self.layers.len() + at].values().map(|v| (v * scale) as f32)))
    }

    /// The variance of the mean, from the spread of the iterations; infinite with fewer than two.
    #[must_use]
    pub fn variance(&self) -> Image {
        self.collect(|i| self.variance_of_mean(i).map(|v| v as f32))
    }

    /// Estimated error of the image: mean over pixels and channels of `variance / (value² + 0.01)`, the relMSE that a
    /// comparison with the converged image would give. Does not see bias, and overstates what stratified random numbers
    /// leave of the variance. Infinite with fewer than two iterations.
    #[must_use]
    pub fn estimated_error(&self) -> f64 {
        if self.iterations() < 2 || self.squares.is_empty() {
            return f64::INFINITY;
        }
        let scale = 1.0 / self.iterations() as f64;
        // Pieces of fixed size, added in their order.
        let pieces: Vec<f64> = (0..self.squares.len())
            .into_par_iter()
            .chunks(1024)
            .map(|pixels| {
                let error = |i| {
                    let (total, variance) = (self.total(i), self.variance_of_mean(i));
                    (0..3).map(|c| variance[c] / ((total[c] * scale).powi(2) + 0.01)).sum::<f64>()
                };
                pixels.into_iter().map(error).sum()
            })
            .collect();
        pieces.into_iter().sum::<f64>() / (3 * self.squares.len()) as f64
    }

    /// Mean over the image of each kept layer, relative to the whole, by luminance.
    #[must_use]
    pub fn shares(&self) -> Vec<(Layer, f64)> {
        let mut sums = vec![0.0; self.layers.len()];
        for pixel in self.sums.chunks(self.layers.len().max(1)) {
            for (sum, value) in sums.iter_mut().zip(pixel.iter().map(Sum3::values)) {
                *sum += 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2];
            }
        }
        let total: f64 = sums.iter().sum();
        let relative = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
        self.layers.iter().zip(sums).map(|(layer, sum)| (*layer, relative(sum))).collect()
    }

    fn total(&self, pixel: usize) -> [f64; 3] {
        let n = self.layers.len();
        let mut total = [0.0; 3];
        for sum in &self.sums[pixel * n..(pixel + 1) * n] {
            for (total, value) in total.iter_mut().zip(sum.values()) {
                *total += value;
            }
        }
        total
    }

    fn variance_of_mean(&self, pixel: usize) -> [f64; 3] {
        if self.iterations() < 2 {
            return [f64::INFINITY; 3];
        }
        let n = self.iterations() as f64;
        let (total, squares) = (self.total(pixel), self.squares[pixel].values());
        std::array::from_fn(|c| {
            let mean = total[c] / n;
            ((squares[c] / n - mean * mean) / (n - 1.0)).max(0.0)
        })
    }

    fn collect(&self, value: impl Fn(usize) -> [f32; 3]) -> Image {
        let pixels = (0..self.squares.len()).map(value).collect();
        Image { width: self.rect.width, height: self.rect.height, pixels }
    }
}

/// Adds a pixel of an iteration; returns the number of values that had to be left out.
fn add_pixel(layers: &[Layer], sums: &mut [Sum3], square: &mut Sum3, pixel: &Pixel) -> u64 {
    let mut dropped = 0;
    let mut total = [0.0_f64; 3];
    for (sum, layer) in sums.iter_mut().zip(layers) {
        // A plan rarely has all techniques.
        if pixel[*layer as usize].is_black() {
            continue;
        }
        let values = pixel[*layer as usize].to_array().map(|value| {
            let usable = value >= 0.0 && value.is_finite();
            dropped += u64::from(!usable);
            if usable { f64::from(value) } else { 0.0 }
        });
        sum.add(values);
        for (total, value) in total.iter_mut().zip(values) {
            *total += value;
        }
    }
    square.add(total.map(|value| value * value));
    dropped
}

impl Image {
    /// relMSE against a reference of the same size: mean over pixels and channels of `(x − r)² / (r² + 0.01)`.
    #[must_use]
    pub fn relative_mse(&self, reference: &Self) -> f64 {
        self.mean_of(reference, |x, r| (x - r).powi(2) / (r * r + 0.01))
    }

    /// Root of the mean squared difference to a reference of the same size.
    #[must_use]
    pub fn rmse(&self, reference: &Self) -> f64 {
        self.mean_of(reference, |x, r| (x - r).powi(2)).sqrt()
    }

    /// Mean over all pixels, per channel.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let n = self.pixels.len().max(1) as f64;
        std::array::from_fn(|c| self.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
    }

    fn mean_of(&self, reference: &Self, term: impl Fn(f64, f64) -> f64) -> f64 {
        let pairs = self.pixels.iter().flatten().zip(reference.pixels.iter().flatten());
        let sum: f64 = pairs.map(|(x, r)| term(f64::from(*x), f64::from(*r))).sum();
        sum / (3 * self.pixels.len().max(1)) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECT: PixelRect = PixelRect { x: 3, y: 5, width: 2, height: 1 };

    fn pixel(bpt: f32, bb1d: f32) -> Pixel {
        let mut pixel = [Spectrum::ZERO; Layer::COUNT];
        pixel[Layer::Bpt as usize] = Spectrum::splat(bpt);
        pixel[Layer::Bb1d as usize] = Spectrum::splat(bb1d);
        pixel
    }

    #[test]
    fn means_and_variances_are_those_of_the_iterations() {
        let mut film = Film::new(RECT, TechniqueSet::default());
        assert!(film.estimated_error().is_infinite());
        for (i, value) in [(0, 1.0), (7, 2.0), (3, 6.0)] {
            assert_eq!(film.add(i, &[pixel(value, 1.0), pixel(0.0, 0.0)]), 0);
        }
        assert_eq!(film.iteration_set().to_string(), "0..1, 3..4, 7..8");
        assert_eq!(film.image().pixels[0], [4.0; 3]);
        assert_eq!(film.layer(Layer::Bpt).unwrap().pixels[0], [3.0; 3]);
        assert_eq!(film.layer(Layer::Bp2d), None);
        // Sample variance of {2, 3, 7} is 7; of their mean, a third of it.
        assert!((film.variance().pixels[0][0] - 7.0 / 3.0).abs() < 1e-6);
        assert_eq!(film.variance().pixels[1], [0.0; 3]);
        let shares = film.shares();
        assert_eq!(shares.iter().map(|(l, _)| *l).collect::<Vec<_>>(), film.layers());
        assert!((shares[0].1 - 0.75).abs() < 1e-12);
    }

    #[test]
    fn small_additions_do_not_stall() {
        let mut film = Film::new(PixelRect { x: 0, y: 0, width: 1, height: 1 }, TechniqueSet::BPT);
        for i in 0..200_000 {
            film.add(i, &[pixel(0.1, 0.0)]);
        }
        assert_eq!(film.image().pixels[0][0], 0.1);
    }

    #[test]
    fn what_is_no_radiance_is_left_out_and_counted() {
        let mut film = Film::new(RECT, TechniqueSet::default());
        assert_eq!(film.add(0, &[pixel(f32::INFINITY, 1.0), pixel(f32::NAN, -1.0)]), 9);
        assert_eq!(film.image().pixels, [[1.0; 3], [0.0; 3]]);
    }

    #[test]
    fn a_perfect_image_has_no_error() {
        let image = Image { width: 1, height: 1, pixels: vec![[0.3, 0.0, 1.0]] };
        assert_eq!(image.relative_mse(&image), 0.0);
        let brighter = Image { pixels: vec![[0.4, 0.0, 1.0]], ..image.clone() };
        assert!((brighter.rmse(&image) - (0.01_f64 / 3.0).sqrt()).abs() < 1e-6);
    }
}
