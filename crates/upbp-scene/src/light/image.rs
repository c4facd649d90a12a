//! Light from all directions by a latitude-longitude image.
//!
//! The radiance is constant over each pixel, and directions are drawn with a density in proportion to its
//! luminance, by tables in single precision: by row, then by column, then uniformly by solid angle within
//! the pixel. With the polar angle θ from +y, a pixel of an image of w columns covers
//! `(2π/w) (cos θ₀ − cos θ₁)` steradians.
//!
//! Oracle: `tests::the_density_of_an_image_integrates_to_one`.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use glam::{Mat3, Vec3};
use upbp_core::{open_exr, open_file};
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Environment, Parallel, disc_area, environment, place};
use crate::description::Fnv1a;

/// The most pixels that an environment may have: 16384 × 8192.
const MAX_PIXELS: usize = 1 << 27;

/// The reason for which an image cannot serve as an environment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentImageError {
    /// The file is no readable `OpenEXR` image with channels R, G and B.
    #[error("cannot be read as an OpenEXR image with channels R, G, B")]
    Unreadable(#[source] exr::error::Error),
    /// The file is a picture in the Radiance format.
    #[error("is a Radiance picture, and skies are OpenEXR images: convert it to .exr first")]
    Radiance,
    /// More pixels than an environment may have.
    #[error("has {width} x {height} pixels, expected at most {MAX_PIXELS} in all")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The pixels are a part of a picture: a sky of a part would be stretched over all directions.
    #[error("has {width} x {height} pixels of a picture of {of_width} x {of_height}, expected all of them")]
    Part {
        /// Columns that there are.
        width: usize,
        /// Rows that there are.
        height: usize,
        /// Columns of the whole picture.
        of_width: usize,
        /// Rows of the whole picture.
        of_height: usize,
    },
    /// The pixels are the six sides of a cube.
    #[error("shows the six sides of a cube, expected a latitude-longitude image: convert it")]
    Cube,
    /// No pixels, or not as many as the size says.
    #[error("has {pixels} pixels for {width} x {height}, expected all of them, at least 1")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels.
        pixels: usize,
    },
    /// A pixel that is no radiance.
    #[error("pixel ({x}, {y}) is {value:?}, expected finite values of at least zero")]
    Pixel {
        /// Column, from 0 at the left.
        x: usize,
        /// Row, from 0 at the top.
        y: usize,
        /// Channels of the pixel.
        value: [f32; 3],
    },
    /// Every pixel is black.
    #[error("is black everywhere")]
    Black,
}

/// Pixels of an environment with the tables to sample them.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentImage {
    width: usize,
    height: usize,
    pixels: Vec<Spectrum>,
    /// `∫ luminance dω` up to the end of each row, relative to the whole.
    rows: Vec<f32>,
    /// `∫ luminance dω` within each row up to the end of each column, relative to the row.
    columns: Vec<f32>,
    /// One minus the cosine of the angle between the edges of rows and the top, and the bottom.
    edges: Vec<[f64; 2]>,
    /// `∫ luminance dω` over all directions.
    total_luminance: f64,
    /// `∫ mean of the channels dω` over all directions.
    total_mean: f64,
    /// The number of pixels that were infinite in a channel.
    infinite_pixels: usize,
}

impl EnvironmentImage {
    /// An environment from pixels row by row, the first row around +y. Values are radiance in W m⁻² sr⁻¹.
    pub fn new(width: usize, height: usize, pixels: Vec<Spectrum>) -> Result<Self, EnvironmentImageError> {
        let expected = width.checked_mul(height).filter(|&count| count <= MAX_PIXELS);
        let expected = expected.ok_or(EnvironmentImageError::TooLarge { width, height })?;
        if expected == 0 || expected != pixels.len() {
            return Err(EnvironmentImageError::Size { width, height, pixels: pixels.len() });
        }
        if let Some(index) = pixels.iter().position(|pixel| !(pixel.is_finite() && pixel.is_non_negative())) {
            let value = pixels[index].to_array();
            return Err(EnvironmentImageError::Pixel { x: index % width, y: index / width, value });
        }
        let mut rows = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(width * height);
        let (mut total_luminance, mut total_mean) = (0.0_f64, 0.0_f64);
        for (y, row) in pixels.chunks_exact(width).enumerate() {
            let solid_angle = pixel_solid_angle(width, height, y);
            let row_luminance: f64 = row.iter().map(|pixel| f64::from(pixel.luminance())).sum();
            let mut sum = 0.0;
            columns.extend(
                row.iter()
                    .enumerate()
                    .map(|(x, pixel)| {
                        sum += f64::from(pixel.luminance());
                        // A row without light is never drawn; its table only has to be one.
                        if row_luminance > 0.0 { sum / row_luminance } else { (x + 1) as f64 / width as f64 }
                    })
                    .map(|share| share as f32),
            );
            total_luminance += row_luminance * solid_angle;
            total_mean += row.iter().map(|pixel| f64::from(pixel.mean())).sum::<f64>() * solid_angle;
            rows.push(total_luminance);
        }
        if total_luminance <= 0.0 {
            return Err(EnvironmentImageError::Black);
        }
        let rows = rows.into_iter().map(|sum| (sum / total_luminance) as f32).collect();
        let versine = |angle: f64| 2.0 * (0.5 * angle).sin().powi(2);
        let edges = (0..=height).map(|y| polar_angle(height, y));
        let edges = edges.map(|angle| [angle, std::f64::consts::PI - angle].map(versine)).collect();
        Ok(Self {
            width,
            height,
            pixels,
            rows,
            columns,
            edges,
            total_luminance,
            total_mean,
            infinite_pixels: 0,
        })
    }

    /// Reads an `OpenEXR` file: the first layer with channels R, G and B. Values below zero count as zero,
    /// and infinite ones as the largest finite value of their channel.
    pub fn load(path: &Path) -> Result<Self, EnvironmentImageError> {
        use exr::meta::attribute::EnvironmentMap;
        use exr::prelude::{ReadChannels, ReadLayers, read};
        struct Pixels {
            width: usize,
            height: usize,
            values: Vec<Spectrum>,
        }
        let unreadable = |error| {
            if is_radiance(path) {
                EnvironmentImageError::Radiance
            } else {
                EnvironmentImageError::Unreadable(error)
            }
        };
        let file = open_exr(path).map_err(|error| unreadable(error.into()))?;
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| {
                    // A larger image is refused below; its pixels are not stored.
                    let (width, height) = (size.width(), size.height());
                    let count = width.checked_mul(height).filter(|&count| count <= MAX_PIXELS);
                    Pixels { width, height, values: vec![Spectrum::ZERO; count.unwrap_or(0)] }
                },
                |pixels: &mut Pixels, at, (r, g, b): (f32, f32, f32)| {
                    if let Some(value) = pixels.values.get_mut(at.y() * pixels.width + at.x()) {
                        // What resampling and conversions of colours leave below zero is none.
                        let light = |v: f32| if v < 0.0 && v.is_finite() { 0.0 } else { v };
                        *value = Spectrum::new(light(r), light(g), light(b));
                    }
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(file)
            .map_err(unreadable)?;
        let whole = image.attributes.display_window;
        if image.layer_data.attributes.environment_map == Some(EnvironmentMap::Cube) {
            return Err(EnvironmentImageError::Cube);
        }
        let position = image.layer_data.attributes.layer_position;
        let mut pixels = image.layer_data.channel_data.pixels;
        let (width, height) = (pixels.width, pixels.height);
        let (of_width, of_height) = (whole.size.width(), whole.size.height());
        if (position, width, height) != (whole.position, of_width, of_height) {
            return Err(EnvironmentImageError::Part { width, height, of_width, of_height });
        }
        let infinite_pixels = limit_infinite(&mut pixels.values);
        let image = Self::new(pixels.width, pixels.height, pixels.values)?;
        Ok(Self { infinite_pixels, ..image })
    }

    /// The number of pixels of a file that were infinite in a channel, as the sun is in half precision.
    #[must_use]
    pub(crate) const fn infinite_pixels(&self) -> usize {
        self.infinite_pixels
    }

    /// A fingerprint, equal for equal pixels.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut hash = Fnv1a::default();
        hash.write(&(self.width as u64).to_le_bytes());
        for channel in self.pixels.iter().flat_map(|pixel| pixel.to_array()) {
            hash.write(&channel.to_le_bytes());
        }
        hash.0
    }

    /// Columns and rows.
    #[must_use]
    pub const fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Radiance from `direction` (of the image, unit vector) and the density of [`sample`](Self::sample)
    /// there.
    ///
    /// The middle of the image is at −z, its top at +y, and its right half, as seen from inside, at +x.
    pub(super) fn lookup(&self, direction: Vec3) -> (Spectrum, f32) {
        let Place { x, y, .. } = self.place_of(direction);
        let radiance = self.pixels[y * self.width + x];
        (radiance, (f64::from(radiance.luminance()) / self.total_luminance) as f32)
    }

    fn place_of(&self, direction: Vec3) -> Place {
        let longitude = direction.x.atan2(-direction.z);
        let column = (longitude / TAU + 0.5) * self.width as f32;
        // The arc tangent keeps the angle at the poles, where the arc cosine has no digits.
        let polar = direction.x.hypot(direction.z).atan2(direction.y);
        let row = polar * FRAC_1_PI * self.height as f32;
        let (x, y) = ((column as usize).min(self.width - 1), (row as usize).min(self.height - 1));
        Place { x, y, column, polar }
    }

    /// Draws a direction of the image, in proportion to the luminance.
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let (y, v) = invert(&self.rows, u[0]);
        let (x, u) = invert(&self.columns[y * self.width..(y + 1) * self.width], u[1]);
        // Uniform by solid angle: the versine is linear in it. From the nearer pole, for its digits.
        let (top, bottom) = (self.edges[y], self.edges[y + 1]);
        let [below, above] = [0, 1].map(|pole| top[pole] + (bottom[pole] - top[pole]) * f64::from(v));
        let sine = (below * above).max(0.0).sqrt();
        let cosine = 0.5 * (above - below);
        let longitude = ((x as f64 + f64::from(u)) / self.width as f64 - 0.5) * std::f64::consts::TAU;
        Vec3::new((sine * longitude.sin()) as f32, cosine as f32, (-sine * longitude.cos()) as f32)
            .normalize()
    }

    /// The random numbers with which [`sample`](Self::sample) draws a direction.
    fn coordinates(&self, direction: Vec3) -> [f32; 2] {
        let Place { x, y, column, polar } = self.place_of(direction);
        let (top, bottom) = (polar_angle(self.height, y), polar_angle(self.height, y + 1));
        let v = (belt(top, f64::from(polar)) / belt(top, bottom)).clamp(0.0, 1.0) as f32;
        let u = (column - x as f32).clamp(0.0, 1.0);
        let between = |ends: &[f32], step: usize, within: f32| {
            let start = if step == 0 { 0.0 } else { ends[step - 1] };
            start + within * (ends[step] - start)
        };
        let row = &self.columns[y * self.width..(y + 1) * self.width];
        [between(&self.rows, y, v), between(row, x, u)]
    }
}

/// The pixel of a direction.
struct Place {
    x: usize,
    y: usize,
    /// Columns from the left edge of the image.
    column: f32,
    /// Angle from the top.
    polar: f32,
}

/// `cos from − cos to`, as a product, which keeps its digits at the poles.
fn belt(from: f64, to: f64) -> f64 {
    2.0 * (0.5 * (from + to)).sin() * (0.5 * (to - from)).sin()
}

/// Whether a file begins as pictures of the Radiance format do, or is named so.
fn is_radiance(path: &Path) -> bool {
    let mut first = [0; 6];
    let read = open_file(path, u64::MAX).and_then(|mut file| file.read_exact(&mut first));
    let begins = read.is_ok() && (first == *b"#?RADI" || first == *b"#?RGBE");
    begins || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("hdr"))
}

/// Puts the largest finite value of each channel, if there is any, in place of infinite ones; returns how
/// many pixels had one.
fn limit_infinite(pixels: &mut [Spectrum]) -> usize {
    let is_infinite = |value: &f32| *value == f32::INFINITY;
    let count = pixels.iter().filter(|pixel| pixel.to_array().iter().any(is_infinite)).count();
    if count > 0 {
        let largest = [0, 1, 2].map(|channel| {
            let finite = pixels.iter().map(|pixel| pixel[channel]).filter(|value| value.is_finite());
            finite.reduce(f32::max).unwrap_or(f32::INFINITY)
        });
        for pixel in pixels {
            let [r, g, b] = pixel.to_array();
            let limited = |value: f32, channel: usize| {
                if is_infinite(&value) { largest[channel] } else { value }
            };
            *pixel = Spectrum::new(limited(r, 0), limited(g, 1), limited(b, 2));
        }
    }
    count
}

/// Polar angle of the upper edge of row `y`.
fn polar_angle(height: usize, y: usize) -> f64 {
    std::f64::consts::PI * y as f64 / height as f64
}

/// Solid angle of each pixel of row `y`: `(2π/w) (cos θ₀ − cos θ₁)`.
fn pixel_solid_angle(width: usize, height: usize, y: usize) -> f64 {
    let (top, bottom) = (polar_angle(height, y), polar_angle(height, y + 1));
    std::f64::consts::TAU / width as f64 * belt(top, bottom)
}

/// The step of a cumulative table that `u` falls on, and the place within the step, in `[0, 1)`.
fn invert(cumulative: &[f32], u: f32) -> (usize, f32) {
    let index = cumulative.partition_point(|&end| end <= u).min(cumulative.len() - 1);
    let start = if index == 0 { 0.0 } else { cumulative[index - 1] };
    let within = (u - start) / (cumulative[index] - start);
    (index, if within.is_finite() { within.clamp(0.0, 1.0 - f32::EPSILON) } else { 0.5 })
}

/// An environment given by an image.
#[derive(Clone, Debug)]
pub struct ImageEnvironment {
    image: Arc<EnvironmentImage>,
    scale: f32,
    rotation: Rotation,
    /// The rotation that follows, if any.
    turn: Option<Mat3>,
}

/// A rotation about +y by its sine and cosine.
#[derive(Clone, Copy, Debug)]
struct Rotation {
    sin: f32,
    cos: f32,
}

impl Rotation {
    fn apply(self, v: Vec3) -> Vec3 {
        Vec3::new(self.cos * v.x + self.sin * v.z, v.y, self.cos * v.z - self.sin * v.x)
    }

    fn inverse(self) -> Self {
        Self { sin: -self.sin, cos: self.cos }
    }
}

impl ImageEnvironment {
    /// The light of `image` times `scale`, which is finite and not negative, turned by `rotation` radians
    /// about +y, counter-clockwise as seen from above.
    #[must_use]
    pub fn new(image: Arc<EnvironmentImage>, scale: f32, rotation: f32) -> Self {
        let (sin, cos) = rotation.sin_cos();
        Self { image, scale, rotation: Rotation { sin, cos }, turn: None }
    }

    /// The same light, turned further by a rotation about any axis.
    #[must_use]
    pub fn turned(self, rotation: Mat3) -> Self {
        Self { turn: Some(self.turn.map_or(rotation, |turn| rotation * turn)), ..self }
    }

    /// The direction of the scene that a direction of the image has become.
    fn to_scene(&self, direction: Vec3) -> Vec3 {
        let direction = self.rotation.apply(direction);
        self.turn.map_or(direction, |turn| turn * direction)
    }

    /// The direction of the image that has become a direction of the scene.
    fn to_image(&self, direction: Vec3) -> Vec3 {
        let direction = self.turn.map_or(direction, |turn| turn.transpose() * direction);
        self.rotation.inverse().apply(direction)
    }

    /// Radiance from `towards_light`, a unit vector of the scene, and the density of choosing it, sr⁻¹.
    #[must_use]
    pub fn radiance_and_pdf(&self, towards_light: Vec3) -> (Spectrum, f32) {
        let (radiance, pdf) = self.image.lookup(self.to_image(towards_light));
        (radiance * self.scale, pdf)
    }
}

impl Environment for ImageEnvironment {
    fn sample(&self, u: [f32; 2]) -> Option<Parallel> {
        let light = self.along(-self.to_scene(self.image.sample(u)).normalize())?;
        (light.pdf > 0.0).then_some(light)
    }

    fn along(&self, direction: Vec3) -> Option<Parallel> {
        let (radiance, pdf) = self.radiance_and_pdf(-direction);
        Some(Parallel { direction, radiance, pdf })
    }

    fn coordinates(&self, direction: Vec3) -> Option<[f32; 2]> {
        Some(self.image.coordinates(self.to_image(-direction)))
    }

    fn power_through(&self, area: f32) -> f32 {
        let power = area * self.scale * self.image.total_mean as f32;
        // A scale that is no number is for the renderer to refuse.
        if power == f32::INFINITY && self.scale.is_finite() { f32::MAX } else { power }
    }
}

environment!(ImageEnvironment);
