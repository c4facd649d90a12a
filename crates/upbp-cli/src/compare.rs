//! `upbp compare`: the distance of an image from a reference.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use upbp_core::{Image, check_outputs, read_exr};

use crate::exit::{Failure, Failures, say};
use crate::files::{self, Images};

/// Side of a block in pixels.
const BLOCK: usize = 8;

#[derive(Debug, Args)]
pub(crate) struct Options {
    /// Image (OpenEXR)
    #[arg(value_name = "IMAGE.exr", value_hint = ValueHint::FilePath)]
    image: PathBuf,
    /// Image to compare with (OpenEXR), of the same size
    #[arg(value_name = "REFERENCE.exr", value_hint = ValueHint::FilePath)]
    reference: PathBuf,
    /// Picture of the error to write: OpenEXR with the relative error of each pixel, and a PNG of the same
    /// name beside it, red where the image is too bright, blue where it is too dark, green where it cannot be
    /// compared; or OUT.png, a PNG alone
    #[arg(short, long, value_name = "OUT.exr", value_parser = files::path(Images::named), value_hint = ValueHint::FilePath)]
    output: Option<Images>,
    /// Exposure of the PNG in stops, -20 to 20: without it, a relative error of 1 has the full colour
    #[arg(long, value_name = "STOPS", value_parser = files::stops, default_value_t = 0.0, requires = "output", allow_negative_numbers = true)]
    exposure: f32,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    let paths = [&options.image, &options.reference];
    if let Some(images) = &options.output {
        let outputs: Vec<_> = images.outputs().collect();
        let inputs = [("the image to compare", paths[0].as_path()), ("the reference", paths[1].as_path())];
        check_outputs(&outputs, &inputs).map_err(Failure::input)?;
    }
    let [image, reference] = paths.map(|path| read_exr(path).map_err(Failure::input));
    let pair = Pair { image: image?, reference: reference? };
    let comparison = pair.compare().map_err(|reason| {
        Failure::Input(format!("{} and {}: {reason}", options.image.display(), options.reference.display()))
    })?;
    let mut failures = Failures::default();
    if let Some(images) = &options.output {
        let error = pair.error();
        images.write(&error, &in_colour(&error, options.exposure), &mut failures);
    }
    let said = say(&comparison.text(&options.image, &options.reference));
    failures.all()?;
    said?;
    match &options.output {
        Some(images) => say(&format!("wrote {}", images.names())),
        None => Ok(()),
    }
}

/// An image and what it is compared with.
struct Pair {
    image: Image,
    reference: Image,
}

impl Pair {
    /// The values of a pixel in both images, if all are finite.
    fn pixel(&self, index: usize) -> Option<[[f64; 3]; 2]> {
        let pixels = [self.image.pixels[index], self.reference.pixels[index]];
        pixels
            .iter()
            .flatten()
            .all(|value| value.is_finite())
            .then(|| pixels.map(|pixel| pixel.map(f64::from)))
    }

    /// Compares all pixels and all blocks.
    fn compare(&self) -> Result<Comparison, String> {
        let (width, height) = (self.image.width, self.image.height);
        if (width, height) != (self.reference.width, self.reference.height) {
            return Err(format!(
                "the sizes differ: {width} x {height} and {} x {} pixels",
                self.reference.width, self.reference.height
            ));
        }
        let across = (width as usize).div_ceil(BLOCK);
        let mut blocks = vec![Sums::default(); across * (height as usize).div_ceil(BLOCK)];
        let mut pixels = Errors::default();
        for index in 0..self.image.pixels.len() {
            let Some(pair) = self.pixel(index) else { continue };
            pixels.add(1.0, pair);
            let (column, row) = (index % width as usize / BLOCK, index / width as usize / BLOCK);
            blocks[row * across + column].add(pair);
        }
        if pixels.weight == 0.0 {
            return Err("there is no pixel that is finite in both".to_owned());
        }
        let mut means = Errors::default();
        for block in blocks.iter().filter(|block| block.count > 0.0) {
            means.add(block.count, block.sums.map(|sum| sum.map(|value| value / block.count)));
        }
        let bad =
            |image: &Image| image.pixels.iter().filter(|pixel| !pixel.iter().all(|v| v.is_finite())).count();
        let not_finite = [bad(&self.image), bad(&self.reference)];
        Ok(Comparison { width, height, pixels, blocks: means, not_finite })
    }

    /// The relative error of each pixel, signed: the mean of its square is the relMSE.
    fn error(&self) -> Image {
        let pixel = |index| match self.pixel(index) {
            Some([image, reference]) => {
                std::array::from_fn(|c| ((image[c] - reference[c]) / scale2(reference[c]).sqrt()) as f32)
            }
            None => [f32::NAN; 3],
        };
        let pixels = (0..self.image.pixels.len()).map(pixel).collect();
        Image { width: self.image.width, height: self.image.height, pixels }
    }
}

/// The divisor of a squared error in the relMSE, as in [`Image::relative_mse`].
fn scale2(reference: f64) -> f64 {
    reference * reference + Image::DARK
}

/// A picture of relative errors: the colour has the sign of the mean, and a larger error is brighter.
fn in_colour(error: &Image, exposure: f32) -> Image {
    const TOO_BRIGHT: [f32; 3] = [1.0, 0.25, 0.1];
    const TOO_DARK: [f32; 3] = [0.1, 0.3, 1.0];
    const UNKNOWN: [f32; 3] = [0.0, 1.0, 0.0];
    let colour = |pixel: &[f32; 3]| {
        let mean = pixel.iter().sum::<f32>() / 3.0;
        // Channels that differ in sign do not cancel.
        let size = (pixel.iter().map(|value| value * value).sum::<f32>() / 3.0).sqrt();
        let brightness = exposure.exp2() * size;
        match mean {
            _ if mean.is_nan() => UNKNOWN,
            _ if mean > 0.0 => TOO_BRIGHT.map(|value| value * brightness),
            _ => TOO_DARK.map(|value| value * brightness),
        }
    };
    Image { width: error.width, height: error.height, pixels: error.pixels.iter().map(colour).collect() }
}

/// Sums of the image and of the reference over the pixels of a block.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    sums: [[f64; 3]; 2],
}

impl Sums {
    fn add(&mut self, pair: [[f64; 3]; 2]) {
        self.count += 1.0;
        for (sum, value) in self.sums.as_flattened_mut().iter_mut().zip(pair.as_flattened()) {
            *sum += value;
        }
    }
}

/// Weighted sums over pixels or blocks, per channel.
#[derive(Clone, Copy, Default)]
struct Errors {
    weight: f64,
    /// Values of the image and of the reference.
    values: [[f64; 3]; 2],
    squares: [f64; 3],
    relative_squares: [f64; 3],
}

impl Errors {
    fn add(&mut self, weight: f64, [image, reference]: [[f64; 3]; 2]) {
        self.weight += weight;
        for c in 0..3 {
            let square = (image[c] - reference[c]).powi(2);
            self.values[0][c] += weight * image[c];
            self.values[1][c] += weight * reference[c];
            self.squares[c] += weight * square;
            self.relative_squares[c] += weight * square / scale2(reference[c]);
        }
    }

    /// The weighted mean of each channel, and the mean of the three.
    fn mean(&self, sums: [f64; 3]) -> [f64; 4] {
        let [r, g, b] = sums.map(|sum| sum / self.weight);
        [r, g, b, (r + g + b) / 3.0]
    }
}

/// Everything that `upbp compare` prints.
struct Comparison {
    width: u32,
    height: u32,
    pixels: Errors,
    blocks: Errors,
    /// Pixels that are not finite in the image and in the reference.
    not_finite: [usize; 2],
}

impl Comparison {
    fn text(&self, image: &Path, reference: &Path) -> String {
        let Self { pixels, blocks, .. } = self;
        let [mean, expected] = pixels.values.map(|sums| pixels.mean(sums));
        let rows = [
            ("mean", mean),
            ("mean of the reference", expected),
            ("ratio of the means", std::array::from_fn(|c| mean[c] / expected[c])),
            ("relMSE", pixels.mean(pixels.relative_squares)),
            ("RMSE", pixels.mean(pixels.squares).map(f64::sqrt)),
            ("relMSE of 8 x 8 blocks", blocks.mean(blocks.relative_squares)),
            ("RMSE of 8 x 8 blocks", blocks.mean(blocks.squares).map(f64::sqrt)),
        ];
        let mut lines = vec![
            format!(
                "{} against {}, {} x {} pixels",
                image.display(),
                reference.display(),
                self.width,
                self.height
            ),
            format!("{:24}{:>12}{:>12}{:>12}{:>12}", "", "R", "G", "B", "all"),
        ];
        lines.extend(rows.map(|(name, values)| {
            values.iter().fold(format!("{name:24}"), |line, value| line + &format!("{:>12}", number(*value)))
        }));
        if self.not_finite != [0, 0] {
            let [image, reference] = self.not_finite;
            lines.push(format!(
                "left out: pixels that are not finite, {image} of the image and {reference} of the reference"
            ));
        }
        lines.join("\n")
    }
}

/// A number with at least five digits; a dash for one that makes no sense.
fn number(value: f64) -> String {
    if !value.is_finite() {
        "-".to_owned()
    } else if value == 0.0 {
        "0".to_owned()
    } else if (0.1..1e5).contains(&value.abs()) {
        format!("{value:.5}")
    } else {
        format!("{value:.4e}")
    }
}
