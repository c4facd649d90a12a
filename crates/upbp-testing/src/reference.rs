//! A render against a reference image: whole picture, tiles, pixels, in standard errors.
//!
//! Errors of a render come from the spread of its iterations, which are independent; pixels of one iteration
//! are not, since they share light sub-paths.

use std::path::Path;

use exr::prelude::{ReadChannels as _, ReadLayers as _, read};
use upbp_core::{Film, Image, open_exr};

use crate::statistics::Estimate;

/// Side of a tile, pixels.
const TILE: usize = 8;

/// A converged picture and its standard error per pixel. The channels of a pixel share their noise.
#[derive(Debug)]
pub struct Reference {
    width: usize,
    pixels: Vec<[f64; 3]>,
    errors: Vec<[f64; 3]>,
}

/// Errors that a perfect render seems to have, due to the noise of the reference; 0 where it is not known.
#[derive(Clone, Copy, Debug, Default)]
pub struct Floor {
    /// Mean of `σ² / (r² + 0.01)`.
    pub relative_mse: f64,
    /// Root of the mean of `σ²`.
    pub rmse: f64,
}

impl Reference {
    /// Reads the channels `R`, `stderr.R` and so on; those that are not there are zero.
    pub fn read(path: &Path) -> Result<Self, exr::error::Error> {
        let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let layer = image.all_attributes().from_buffered(open_exr(path)?)?.layer_data;
        let width = layer.size.width();
        let count = width * layer.size.height();
        let mut reference = Self { width, pixels: vec![[0.0; 3]; count], errors: vec![[0.0; 3]; count] };
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let (to, name) = match name.strip_prefix("stderr.") {
                Some(rest) => (&mut reference.errors, rest.to_owned()),
                None => (&mut reference.pixels, name),
            };
            if let Some(c) = ["R", "G", "B"].iter().position(|known| *known == name) {
                for (pixel, value) in to.iter_mut().zip(channel.sample_data.values_as_f32()) {
                    pixel[c] = f64::from(value);
                }
            }
        }
        Ok(reference)
    }

    /// The picture alone.
    pub fn image(&self) -> Image {
        Image {
            width: self.width as u32,
            height: (self.pixels.len() / self.width) as u32,
            pixels: self.pixels.iter().map(|pixel| pixel.map(|v| v as f32)).collect(),
        }
    }

    /// Mean of the picture per channel. Its pixels are independent of each other.
    pub fn mean(&self) -> [Estimate; 3] {
        let n = self.pixels.len() as f64;
        std::array::from_fn(|c| Estimate {
            mean: self.pixels.iter().map(|pixel| pixel[c]).sum::<f64>() / n,
            error: self.errors.iter().map(|error| error[c].powi(2)).sum::<f64>().sqrt() / n,
        })
    }

    /// Errors of the reference itself, due to its noise.
    pub fn floor(&self) -> Floor {
        let pixels = self.pixels.iter().flatten().zip(self.errors.iter().flatten());
        let sums = pixels.fold([0.0; 2], |[relative, squares], (r, s)| {
            [relative + s * s / (r * r + Image::DARK), squares + s * s]
        });
        let [relative_mse, square] = sums.map(|sum| sum / (3 * self.pixels.len()) as f64);
        Floor { relative_mse, rmse: square.sqrt() }
    }
}

/// Difference of a render to a reference in standard errors.
fn sigmas(render: &Estimate, reference: &Estimate) -> f64 {
    let difference = render.mean - reference.mean;
    // What was the same in every iteration, such as an environment that is seen directly, is exact only up to
    // rounding and to what is too rare to have happened, such as the corner of a body in the corner of a
    // pixel.
    let unseen = 1e-4 * reference.mean.abs();
    difference / render.error.max(unseen).hypot(reference.error).max(f64::MIN_POSITIVE)
}

/// Means over tiles of [`TILE`] pixels, row by row. The last is the mean of the whole picture, gathered in
/// the same way.
fn tiles(image: &Image) -> Vec<[f64; 3]> {
    let (width, height) = (image.width as usize, image.height as usize);
    let (across, down) = (width / TILE, height / TILE);
    let mut sums = vec![[0.0; 3]; across * down + 1];
    for (index, pixel) in image.pixels.iter().enumerate() {
        let (column, row) = (index % width / TILE, index / width / TILE);
        for c in 0..3 {
            let value = f64::from(pixel[c]);
            if column < across && row < down {
                sums[row * across + column][c] += value / (TILE * TILE) as f64;
            }
            sums[across * down][c] += value / (width * height) as f64;
        }
    }
    sums
}

/// Gathers the spread of a render's iterations.
#[derive(Debug, Default)]
pub struct Spread {
    iterations: u64,
    before: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
}

impl Spread {
    /// To be called after every iteration.
    pub fn add(&mut self, film: &Film) {
        let n = film.iterations();
        assert_eq!(n, self.iterations + 1, "every iteration is looked at");
        let mut sums = tiles(&film.image());
        sums.iter_mut().flatten().for_each(|v| *v *= n as f64);
        if n == 1 {
            self.before = vec![[0.0; 3]; sums.len()];
            self.squares = self.before.clone();
        }
        let values = sums.iter().flatten().zip(self.before.iter().flatten());
        for ((sum, before), square) in values.zip(self.squares.iter_mut().flatten()) {
            *square += (sum - before).powi(2);
        }
        self.before = sums;
        self.iterations = n;
    }

    /// Mean of the picture per channel.
    pub fn mean(&self) -> [Estimate; 3] {
        self.before.last().map_or([Estimate::default(); 3], |_| self.tile(self.before.len() - 1))
    }

    fn tile(&self, index: usize) -> [Estimate; 3] {
        let n = self.iterations as f64;
        std::array::from_fn(|c| Estimate::from_sums(n, self.before[index][c], self.squares[index][c]))
    }
}

/// A render and a reference, each value the worst of the three channels.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// Mean of the picture.
    pub mean: [Estimate; 3],
    /// Difference to the reference in standard errors.
    pub sigmas: [f64; 3],
    /// Difference of the means of the picture in percent.
    pub percent: [f64; 3],
    /// Mean square of the pixels' differences in standard errors, expected 1.
    pub chi_square: f64,
    /// Share of the pixels beyond 3.5 standard errors, `[0, 1]`.
    pub outliers: f64,
    /// Largest difference of a tile in standard errors.
    pub tile: f64,
    /// relMSE, over all channels.
    pub relative_mse: f64,
}

impl Comparison {
    /// Compares a film with a reference; `spread` has seen each of its iterations.
    pub fn new(film: &Film, spread: &Spread, reference: &Reference) -> Self {
        let (image, variance) = (film.image(), film.variance());
        assert_eq!(image.pixels.len(), reference.pixels.len(), "the reference has the film's size");
        let mean = spread.mean();
        let expected = reference.mean();
        let across = reference.width / TILE;
        let (mut chi_square, mut outliers, mut tile) = (0.0_f64, 0.0_f64, 0.0_f64);
        for c in 0..3 {
            let mut tile_sums = vec![(0.0, 0.0); spread.before.len() - 1];
            let (mut squares, mut far) = (0.0, 0.0);
            for (i, (r, s)) in reference.pixels.iter().zip(&reference.errors).enumerate() {
                let own = Estimate {
                    mean: f64::from(image.pixels[i][c]),
                    error: f64::from(variance.pixels[i][c]).sqrt(),
                };
                let sigmas = sigmas(&own, &Estimate { mean: r[c], error: s[c] });
                squares += sigmas * sigmas;
                far += f64::from(u8::from(sigmas.abs() > 3.5));
                let (column, row) = (i % reference.width / TILE, i / reference.width / TILE);
                if column < across && row * across + column < tile_sums.len() {
                    let sum = &mut tile_sums[row * across + column];
                    *sum = (sum.0 + r[c], sum.1 + s[c] * s[c]);
                }
            }
            let pixels = image.pixels.len() as f64;
            chi_square = chi_square.max(squares / pixels);
            outliers = outliers.max(far / pixels);
            let area = (TILE * TILE) as f64;
            for (index, (sum, square)) in tile_sums.into_iter().enumerate() {
                let expected = Estimate { mean: sum / area, error: square.sqrt() / area };
                tile = tile.max(sigmas(&spread.tile(index)[c], &expected).abs());
            }
        }
        Self {
            mean,
            sigmas: std::array::from_fn(|c| sigmas(&mean[c], &expected[c])),
            percent: std::array::from_fn(|c| mean[c].percent(&expected[c])),
            chi_square,
            outliers,
            tile,
            relative_mse: image.relative_mse(&reference.image()),
        }
    }

    /// Largest difference of the mean in standard errors.
    pub fn worst_sigmas(&self) -> f64 {
        worst(self.sigmas)
    }

    /// Largest difference of the mean in percent.
    pub fn worst_percent(&self) -> f64 {
        worst(self.percent)
    }
}

fn worst(values: [f64; 3]) -> f64 {
    values.into_iter().fold(0.0, |a, b| a.max(b.abs()))
}
