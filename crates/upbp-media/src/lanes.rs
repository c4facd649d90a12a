//! Lanes: the distributions that a walk may draw all its distances from.
//!
//! With one lane (`f64`) every segment draws its distance from the medium's own distribution, in a chromatic
//! medium from a mixture of the channels, anew on each segment. With three lanes (`[f64; 3]`, a lane per
//! channel) a walk draws one lane at its start, its hero, and all its distances from it. What it meets is
//! divided by the density that a walk with any hero has, so no channel's throughput exceeds one over the
//! probability of its lane, however long the walk.
//!
//! Nobody needs to know the hero after the fact: the density of a path is a mixture over heroes of products,
//! and each factor of it is a mean over the lanes with [shares](LaneValues::Shares), the probabilities of the
//! heroes given what the walk has done so far.
//!
//! Source: `docs/theory.md`, sections 1.4 and 6.13. Oracle:
//! `tests::means_by_shares_are_the_mixture_of_products`.

use crate::{LaneValues, Medium, RaySegment, SegmentDensity, Spectrum};

/// The lanes of a walk through media: `f64` for one, `[f64; 3]` for a lane per channel.
pub trait Lanes: LaneValues {
    /// The densities of a segment in `medium`.
    fn segment<M: Medium>(medium: &M, segment: &RaySegment) -> SegmentDensity<Self>;

    /// Draws the distance at which a walk with this hero stops, as [`Medium::sample_distance`].
    fn sample_distance<M: Medium>(
        medium: &M,
        segment: &RaySegment,
        hero: Self::Hero,
        u: [f32; 2],
    ) -> Option<f32>;
}

impl Lanes for f64 {
    #[inline]
    fn segment<M: Medium>(medium: &M, segment: &RaySegment) -> SegmentDensity {
        medium.segment(segment)
    }

    #[inline]
    fn sample_distance<M: Medium>(medium: &M, segment: &RaySegment, (): (), u: [f32; 2]) -> Option<f32> {
        medium.sample_distance(segment, u[0], u[1])
    }
}

impl Lanes for [f64; 3] {
    #[inline]
    fn segment<M: Medium>(medium: &M, segment: &RaySegment) -> SegmentDensity<Self> {
        medium.segment_lanes(segment)
    }

    #[inline]
    fn sample_distance<M: Medium>(medium: &M, segment: &RaySegment, hero: usize, u: [f32; 2]) -> Option<f32> {
        medium.sample_lane(segment, hero, u)
    }
}

/// Ratio of the lanes of a medium from which on they are worth their time: with less the second moment of the
/// mixture that is drawn anew on each segment hardly grows. Not tuned.
const LEAST_RATIO: f32 = 1.25;

/// Factor by which the second moment may grow per segment without lanes, and be of no account.
const LEAST_GROWTH: f64 = 1.01;

/// The probability of each lane to be the hero of a walk through `media`: equal shares for all lanes that
/// differ in any of them, so that no channel's throughput exceeds the number of lanes. `None` if in all media
/// lanes differ by a small factor only, or the [second moment](Medium::mixture_growth) of walks without them
/// hardly grows.
#[must_use]
pub fn lane_probabilities<M: Medium>(media: &[M]) -> Option<[f64; 3]> {
    let largest = |lanes: &Spectrum| (0..3).map(|lane| lanes[lane]).fold(0.0, f32::max);
    let least = |lanes: &Spectrum| (0..3).map(|lane| lanes[lane]).fold(f32::INFINITY, f32::min);
    let profits = |medium: &M| {
        let differ = |lanes| largest(&lanes) >= LEAST_RATIO * least(&lanes);
        medium.lane_extinctions().is_some_and(differ) && medium.mixture_growth() > LEAST_GROWTH
    };
    if !media.iter().any(profits) {
        return None;
    }
    let lanes: Vec<_> = media.iter().filter_map(Medium::lane_extinctions).collect();
    let is_new =
        |lane: usize| (0..lane).all(|earlier| lanes.iter().any(|medium| medium[lane] != medium[earlier]));
    let drawn = [0, 1, 2].map(is_new);
    let count = drawn.iter().filter(|is_drawn| **is_drawn).count();
    (count > 1).then(|| drawn.map(|is_drawn| if is_drawn { 1.0 / count as f64 } else { 0.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EdgeDensity, Homogeneous, PhaseFunction};
    use glam::Vec3;

    fn medium(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> Homogeneous {
        Homogeneous::new(sigma_a.into(), sigma_s.into(), PhaseFunction::Isotropic).expect("in range")
    }

    fn segment(length: f32) -> RaySegment {
        RaySegment { origin: Vec3::ZERO, direction: Vec3::X, start: 0.0, end: length }
    }

    /// Factors of a path whose edges stop or pass: means by shares, and the mixture of the products.
    #[test]
    fn means_by_shares_are_the_mixture_of_products() {
        let media = [medium([0.0; 3], [0.5, 4.0, 15.0]), medium([2.0, 0.0, 0.0], [0.0, 1.0, 0.3])];
        let probabilities = lane_probabilities(&media).expect("lanes differ");
        let mut shares = <[f64; 3]>::prior(&probabilities);
        let (mut by_shares, mut products) = (1.0, [1.0; 3]);
        for (i, length) in [0.1, 0.7, 0.02, 1.5, 0.3, 0.3].into_iter().enumerate() {
            let density = media[i % 2].segment_lanes(&segment(length));
            let step = EdgeDensity::EMPTY.with(&density).forward(i % 3 > 0);
            let mean = step.mean(&shares);
            shares = step.given(&shares, mean);
            by_shares *= mean;
            products = products.times(step);
        }
        let mixture = products.mean(&probabilities);
        assert!((by_shares / mixture - 1.0).abs() < 1e-14, "{by_shares}, {mixture}");
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{shares:?}");
    }

    /// A lane passes at least what its channel passes, and stops at least where it scatters: so no throughput
    /// exceeds one over the probability of the lane.
    #[test]
    fn every_channel_has_a_lane_that_bounds_its_throughput() {
        for (sigma_a, sigma_s) in [
            ([0.0; 3], [0.5, 4.0, 15.0]),
            ([0.0, 0.0, 3.0], [1.0, 2.0, 0.0]),
            ([0.1, 0.1, 0.0], [1.0, 2.0, 0.0]),
            ([5.0, 0.0, 0.5], [0.0, 2.0, 0.0]),
        ] {
            let medium = medium(sigma_a, sigma_s);
            for length in [0.0, 0.01, 0.3, 4.0] {
                let density = medium.segment_lanes(&segment(length));
                for (lane, sigma_s) in sigma_s.into_iter().enumerate() {
                    let transmittance = f64::from(density.transmittance[lane]);
                    let scatters = f64::from(sigma_s) * transmittance;
                    assert!(density.pass_probability[lane] >= transmittance * (1.0 - 1e-6));
                    assert!(density.stop_at_end[lane] >= scatters * (1.0 - 1e-6));
                }
            }
        }
    }

    #[test]
    fn lanes_that_are_equal_share_one() {
        let of = |media: &[Homogeneous]| lane_probabilities(media);
        let third = 1.0 / 3.0;
        assert_eq!(of(&[medium([0.0; 3], [2.0; 3])]), None);
        assert_eq!(of(&[medium([1.0, 2.0, 3.0], [0.0; 3])]), None, "nothing scatters");
        assert_eq!(of(&[medium([0.0; 3], [1.0, 1.1, 1.2])]), None, "hardly any difference");
        assert_eq!(of(&[medium([0.0; 3], [1.0, 4.0, 15.0])]), Some([third; 3]));
        assert_eq!(of(&[medium([0.0; 3], [1.0, 4.0, 1.0])]), Some([0.5, 0.5, 0.0]));
        assert_eq!(of(&[medium([0.5, 0.1, 0.1], [0.1, 0.1, 0.2])]), None, "roulette ends walks sooner");
        // Red passes for ever, but the mixture hardly ever draws its channel.
        assert_eq!(of(&[medium([0.0, 1.0, 4.0], [0.0, 0.5, 0.5])]), Some([third; 3]));
        // What only absorbs passes by the lane that gets farthest, if that is far enough.
        assert_eq!(of(&[medium([0.0, 0.0, 3.0], [1.0, 4.0, 0.0])]), Some([0.5, 0.5, 0.0]));
        assert_eq!(of(&[medium([0.0, 0.0, 0.5], [1.0, 4.0, 0.0])]), Some([third; 3]));
        // Equal in one medium, not in another.
        let media = [medium([0.0; 3], [1.0, 4.0, 1.0]), medium([0.0; 3], [1.0, 4.0, 2.0])];
        assert_eq!(of(&media), Some([third; 3]));
    }
}
