//! A picture, and its errors against another one.

/// A picture: three values per pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue of each pixel, linear Rec. 709: radiance in W m⁻² sr⁻¹ where nothing else is said.
    pub pixels: Vec<[f32; 3]>,
}

/// Sides in pixels of the square blocks whose errors count alike, where neighbours may share errors.
pub(crate) const BLOCK_SIDES: [u32; 4] = [1, 4, 8, 16];

impl Image {
    /// Added to the square of the converged value in relative errors, so that dark pixels do not count
    /// without bound.
    pub const DARK: f64 = 0.01;

    /// Whether there are as many pixels as the size says.
    pub(crate) fn is_whole(&self) -> bool {
        u64::from(self.width) * u64::from(self.height) == self.pixels.len() as u64
    }

    /// relMSE against a reference: mean over pixels and channels of `(x − r)² / (r² + 0.01)`; NaN if it has
    /// another size.
    #[must_use]
    pub fn relative_mse(&self, reference: &Self) -> f64 {
        self.mean_of(reference, |x, r| (x - r).powi(2) / (r * r + Self::DARK))
    }

    /// relMSE of the means of square blocks of pixels times their pixels, mean over blocks of 1, 4, 8 and 16
    /// pixels a side: the relMSE where errors of pixels are independent, more where neighbours share them,
    /// as blotches and streaks do, less where they even out. Blocks that the picture cuts count by their
    /// pixels. NaN if the reference has another size.
    #[must_use]
    pub fn relative_mse_over_scales(&self, reference: &Self) -> f64 {
        if !self.is_as_large_as(reference) {
            return f64::NAN;
        }
        self.difference_over(&BLOCK_SIDES, reference, reference)
    }

    /// Squared differences of the means of blocks times their pixels, relative to another image, mean over
    /// sides of blocks.
    pub(super) fn difference_over(&self, sides: &[u32], other: &Self, reference: &Self) -> f64 {
        let of_side = |side: &u32| {
            let [x, y, r] = [self, other, reference].map(|image| image.block_sums(*side as usize));
            let term = |((x, y), r): (([f64; 4], [f64; 4]), [f64; 4])| {
                let n = x[3];
                let squares = (0..3).map(|c| ((x[c] - y[c]) / n).powi(2) / ((r[c] / n).powi(2) + Self::DARK));
                n * n * squares.sum::<f64>()
            };
            let sum: f64 = x.zip(y).zip(r).map(term).sum();
            sum / (3 * self.pixels.len().max(1)) as f64
        };
        sides.iter().map(of_side).sum::<f64>() / sides.len() as f64
    }

    /// Sums over square blocks of pixels, with the number of pixels behind: row by row of blocks, so that
    /// there is no second picture in memory.
    fn block_sums(&self, side: usize) -> impl Iterator<Item = [f64; 4]> + '_ {
        let width = (self.width as usize).max(1);
        self.pixels.chunks(width * side).flat_map(move |rows| {
            let mut sums = vec![[0.0; 4]; width.div_ceil(side)];
            for row in rows.chunks(width) {
                for (sum, block) in sums.iter_mut().zip(row.chunks(side)) {
                    for pixel in block {
                        for (sum, value) in sum.iter_mut().zip(pixel.iter().chain(&[1.0])) {
                            *sum += f64::from(*value);
                        }
                    }
                }
            }
            sums
        })
    }

    /// Root of the mean squared difference to a reference; NaN if it has another size.
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

    fn is_as_large_as(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height) && self.is_whole() && other.is_whole()
    }

    fn mean_of(&self, reference: &Self, term: impl Fn(f64, f64) -> f64) -> f64 {
        if !self.is_as_large_as(reference) {
            return f64::NAN;
        }
        let pairs = self.pixels.iter().flatten().zip(reference.pixels.iter().flatten());
        let sum: f64 = pairs.map(|(x, r)| term(f64::from(*x), f64::from(*r))).sum();
        sum / (3 * self.pixels.len().max(1)) as f64
    }
}
