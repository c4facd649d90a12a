//! Sums of features: albedo, normal and depth of what the camera sees first.

use std::ops::{Range, RangeInclusive};

use rayon::prelude::*;
use upbp_estimators::Features;

use super::Image;
use super::exact_sum::{self, Sum3};
use super::pixel_sets::set_of;

/// Means of what the camera sees first, on surfaces that are not mirrors or glass, and in media.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FeatureImages {
    /// Albedo, in `[0, 1]`, with light that is seen directly.
    pub albedo: Image,
    /// Normal in world space, with coordinates in `[-1, 1]`: zero in media and where nothing is, shorter than
    /// one where there are several.
    pub normal: Image,
    /// Length of the way from the lens of the samples that see something, row by row, in scene units.
    /// Infinite where none does.
    pub depth: Vec<f32>,
}

/// The sums, one per pixel and list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FeatureSums {
    albedo: Vec<Sum3>,
    /// Sums of `(normal + 1) / 2`, since sums have no sign.
    normal: Vec<Sum3>,
    /// Sums of distances, and of samples that have one.
    distance: Vec<Sum3>,
}

impl FeatureSums {
    /// Bytes per pixel.
    pub(super) const BYTES: usize = 3 * size_of::<Sum3>();

    pub(super) fn of(list: impl Fn() -> Vec<Sum3>) -> Self {
        Self { albedo: list(), normal: list(), distance: list() }
    }

    pub(super) fn all(&self) -> [&Vec<Sum3>; 3] {
        [&self.albedo, &self.normal, &self.distance]
    }

    pub(super) fn all_mut(&mut self) -> [&mut Vec<Sum3>; 3] {
        [&mut self.albedo, &mut self.normal, &mut self.distance]
    }

    /// Adds the features of the pixels of some sets. What is not finite counts as nothing seen.
    pub(super) fn add(&mut self, width: usize, sets: &Range<u32>, features: &[Features]) {
        let Self { albedo, normal, distance } = self;
        let sums = albedo.par_chunks_mut(width).zip(normal.par_chunks_mut(width));
        let rows = sums.zip(distance.par_chunks_mut(width)).zip(features.par_chunks(width)).enumerate();
        rows.for_each(|(y, (((albedo, normal), distance), features))| {
            for (x, features) in features.iter().enumerate().filter(|(x, _)| sets.contains(&set_of(*x, y))) {
                let plain = |values: [f32; 3], range: RangeInclusive<f32>| {
                    let usable = values.iter().all(|value| range.contains(value));
                    values.map(|value| if usable { f64::from(value) } else { 0.0 })
                };
                exact_sum::add(&mut albedo[x], plain(features.albedo.to_array(), 0.0..=1.0));
                let normals = plain(features.normal.to_array(), -1.001..=1.001);
                exact_sum::add(&mut normal[x], normals.map(|n| 0.5 * (n + 1.0).clamp(0.0, 2.0)));
                if let Some(seen) =
                    features.distance.filter(|distance| distance.is_finite() && *distance >= 0.0)
                {
                    exact_sum::add(&mut distance[x], [f64::from(seen), 1.0, 0.0]);
                }
            }
        });
    }

    pub(super) fn albedo(&self, pixel: usize, count: f64) -> [f64; 3] {
        exact_sum::values(&self.albedo[pixel]).map(|sum| sum / count)
    }

    pub(super) fn normal(&self, pixel: usize, count: f64) -> [f64; 3] {
        exact_sum::values(&self.normal[pixel]).map(|sum| (2.0 * sum / count - 1.0).clamp(-1.0, 1.0))
    }

    pub(super) fn depth(&self, pixel: usize) -> f64 {
        let [distance, count, _] = exact_sum::values(&self.distance[pixel]);
        if count > 0.0 { distance / count } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use upbp_estimators::Spectrum;
    use upbp_estimators::scene::PixelRect;

    use super::*;
    use crate::film::{Film, Pixel, pixel_sets};
    use upbp_estimators::TechniqueSet;

    const RECT: PixelRect = PixelRect { x: 0, y: 0, width: 2, height: 1 };

    #[test]
    fn means_are_those_of_the_samples() {
        let at = |albedo: f32, normal: Vec3, distance| Features {
            albedo: Spectrum::splat(albedo),
            normal,
            distance,
        };
        let iterations = [
            [at(0.5, Vec3::NEG_Z, Some(2.0)), Features::NONE],
            [at(1.0, Vec3::X, Some(4.0)), Features::NONE],
            [at(0.0, Vec3::ZERO, None), at(f32::NAN, Vec3::NAN, Some(f32::NAN))],
            [at(0.5, Vec3::NEG_Z, Some(3.0)), Features::NONE],
        ];
        let add = |film: &mut Film, i: usize| {
            film.add_part(i as u64, 0..pixel_sets::SETS, &[Pixel::BLACK; 2], &iterations[i]);
        };
        let film = || Film::new(RECT, TechniqueSet::BPT, true);
        let (mut whole, mut halves) = (film(), [film(), film()]);
        for i in 0..4 {
            add(&mut whole, i);
            add(&mut halves[i / 2], i);
        }
        let FeatureImages { albedo, normal, depth } = whole.features().unwrap();
        assert_eq!(albedo.pixels, [[0.5; 3], [0.0; 3]]);
        assert_eq!(normal.pixels[0], [0.25, 0.0, -0.5]);
        assert_eq!(depth, [3.0, f32::INFINITY]);
        assert_eq!(whole.sample_counts(), [4.0; 2]);
        // Merged in the other order, to the bit.
        let [first, mut second] = halves;
        second.merge(&first);
        assert_eq!(second, whole);
        assert_eq!(Film::new(RECT, TechniqueSet::BPT, false).features(), None);
    }
}
