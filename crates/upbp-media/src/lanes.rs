//! Lanes: the distributions that a walk may draw all its distances and directions from.
//!
//! With one lane (`f64`) every segment draws its distance from the medium's own distribution, in a chromatic
//! medium from a mixture of the channels, anew on each segment, and every collision its direction from the
//! mean of the channels' phase functions. With three lanes (`[f64; 3]`, a lane per channel) a walk draws one
//! lane at its start, its hero, and all its distances and directions from it. What it meets is
//! divided by the density that a walk with any hero has, so no channel's throughput exceeds one over the
//! probability of its lane, however long the walk.
//!
//! Nobody needs to know the hero after the fact: the density of a path is a mixture over heroes of products,
//! and each factor of it is a mean over the lanes with [shares](LaneValues::Shares), the probabilities of the
//! heroes given what the walk has done so far.
//!
//! Source: `docs/theory.md`, sections 1.4 and 6.13. Oracle:
//! `tests::means_by_shares_are_the_mixture_of_products`.

use crate::{LaneValues, Medium, PhaseValue, RaySegment, SegmentDensity, Spectrum};

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

    /// The channel whose phase function a walk with this hero draws its directions from, if it is only one.
    #[must_use]
    fn channel(hero: Self::Hero) -> Option<usize>;

    /// The density per steradian, in each lane, of a direction in which a phase function has this value.
    #[must_use]
    fn of_phase(value: &PhaseValue) -> Self;
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

    #[inline]
    fn channel((): ()) -> Option<usize> {
        None
    }

    #[inline]
    fn of_phase(value: &PhaseValue) -> Self {
        f64::from(value.pdf)
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

    #[inline]
    fn channel(hero: usize) -> Option<usize> {
        Some(hero)
    }

    #[inline]
    fn of_phase(value: &PhaseValue) -> Self {
        [0, 1, 2].map(|lane| f64::from(value.value[lane]))
    }
}

/// Ratio of the extinctions of a medium's lanes from which on they are worth their time: with less the second
/// moment of the mixture that is drawn anew on each segment hardly grows. Not tuned.
const LEAST_RATIO: f32 = 1.25;

/// Growth of the second moment per segment below which lanes are not worth their time.
const LEAST_GROWTH: f64 = 1.01;

/// The probability of each lane to be the hero of a walk through `media`: equal shares for all lanes that
/// differ in any of them, so that no channel's throughput exceeds the number of lanes. `None` if in all media
/// lanes differ by a small factor of extinction only, or the [second moment](Medium::mixture_growth) of walks
/// without them hardly grows.
#[must_use]
pub fn lane_probabilities<M: Medium>(media: &[M]) -> Option<[f64; 3]> {
    let largest = |lanes: &Spectrum| (0..3).map(|lane| lanes[lane]).fold(0.0, f32::max);
    let least = |lanes: &Spectrum| (0..3).map(|lane| lanes[lane]).fold(f32::INFINITY, f32::min);
    let profits = |medium: &M| {
        let far_apart = |lanes| largest(&lanes) >= LEAST_RATIO * least(&lanes);
        let differ = medium.lane_extinctions().is_some_and(far_apart)
            || [1, 2].into_iter().any(|lane| turns_differ(medium, 0, lane));
        differ && medium.mixture_growth() > LEAST_GROWTH
    };
    if !media.iter().any(profits) {
        return None;
    }
    let is_new = |lane: usize| (0..lane).all(|other| differ(media, lane, other));
    let drawn = [0, 1, 2].map(is_new);
    let count = drawn.iter().filter(|is_drawn| **is_drawn).count();
    (count > 1).then(|| drawn.map(|is_drawn| if is_drawn { 1.0 / count as f64 } else { 0.0 }))
}

/// Whether walks through `media` with lanes of these probabilities find what scatters in any channel: each
/// lane is drawn, or does not differ from one that is.
#[must_use]
pub fn lanes_cover<M: Medium>(media: &[M], probabilities: [f64; 3]) -> bool {
    let is_drawn = |lane: usize| probabilities[lane] > 0.0;
    (0..3).all(|lane| (0..3).any(|other| is_drawn(other) && (other == lane || !differ(media, lane, other))))
}

/// Whether two lanes differ in any of the media.
fn differ<M: Medium>(media: &[M], a: usize, b: usize) -> bool {
    media.iter().any(|medium| {
        turns_differ(medium, a, b) || medium.lane_extinctions().is_some_and(|lanes| lanes[a] != lanes[b])
    })
}

/// Whether two channels of a medium scatter into other directions.
fn turns_differ<M: Medium>(medium: &M, a: usize, b: usize) -> bool {
    medium.scatters() && medium.phase().differs(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EdgeDensity, Homogeneous, PhaseFunction, PhaseSample};
    use glam::Vec3;

    fn medium(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> Homogeneous {
        Homogeneous::new(sigma_a.into(), sigma_s.into(), PhaseFunction::Isotropic).expect("in range")
    }

    fn lobe(g: f32) -> PhaseFunction {
        PhaseFunction::henyey_greenstein(g).expect("in range")
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
    fn directions_are_drawn_with_the_densities_of_their_lanes() {
        const DRAWS: u32 = 200_000;
        let colours = PhaseFunction::per_channel([lobe(0.9), lobe(0.2), PhaseFunction::Rayleigh]);
        let phase = PhaseFunction::blend(vec![(1.0, colours), (2.0, lobe(-0.4))]).expect("a blend");
        let shares = [0.2, 0.5, 0.3];
        for hero in 0..3 {
            // The mean of one lane's density over another's is one, and so is that of any other.
            let mut sums = [0.0; 3];
            for i in 0..DRAWS {
                let u = [(i as f32 + 0.5) / DRAWS as f32, (i as f32 * 0.618_034).fract()];
                let PhaseSample { after, weight, pdf } = phase.sample::<[f64; 3]>(Vec3::Y, hero, &shares, u);
                let value = phase.eval(Vec3::Y, after);
                assert!((pdf.iter().sum::<f64>() / 3.0 / f64::of_phase(&value) - 1.0).abs() < 1e-5);
                for lane in 0..3 {
                    sums[lane] += pdf[lane] / pdf[hero] / f64::from(DRAWS);
                    assert!(f64::from(weight[lane]) < 1.001 / shares[lane]);
                }
            }
            assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 0.02), "{hero}: {sums:?}");
        }
    }

    /// `∫ ρ_c² / p dω` by the angle.
    fn turn_growth(g: [f64; 3]) -> [f64; 3] {
        const STEPS: u32 = 200_000;
        let mut sums = [0.0; 3];
        for i in 0..STEPS {
            let theta = (f64::from(i) + 0.5) / f64::from(STEPS) * std::f64::consts::PI;
            let lobes = g
                .map(|g| 0.5 * (1.0 - g * g) / (1.0 + g * g - 2.0 * g * theta.cos()).powf(1.5) * theta.sin());
            let mean = lobes.iter().sum::<f64>() / 3.0;
            for (sum, lobe) in sums.iter_mut().zip(lobes) {
                *sum += lobe * lobe / mean * std::f64::consts::PI / f64::from(STEPS);
            }
        }
        sums
    }

    #[test]
    fn channels_that_scatter_into_other_directions_are_lanes() {
        for g in [[0.9, 0.7, 0.5], [0.7, 0.3, -0.4], [0.99, 0.9, 0.9]] {
            let growth = PhaseFunction::per_channel(g.map(|g| lobe(g as f32))).turn_growth();
            for (found, expected) in growth.into_iter().zip(turn_growth(g)) {
                assert!((found / expected - 1.0).abs() < 0.005, "{g:?}: {found}, {expected}");
            }
        }
        let of = |absorption: f32, g: [f32; 3]| {
            let phase = PhaseFunction::per_channel(g.map(lobe));
            let medium = Homogeneous::new([absorption; 3].into(), [1.0; 3].into(), phase).expect("in range");
            lane_probabilities(&[medium])
        };
        assert_eq!(of(0.0, [0.5; 3]), None);
        assert_eq!(of(0.0, [0.9, 0.7, 0.5]), Some([1.0 / 3.0; 3]));
        assert_eq!(of(0.0, [0.9, 0.5, 0.5]), Some([0.5, 0.5, 0.0]));
        assert_eq!(of(0.0, [0.5, 0.5, 0.9]), Some([0.5, 0.0, 0.5]));
        assert_eq!(of(0.0, [0.52, 0.5, 0.5]), None, "hardly any difference");
        assert_eq!(of(1.0, [0.9, 0.7, 0.5]), None, "roulette ends walks sooner");
        // Lobes apart triple the second moment of what scatters, the square of an albedo of one half, and
        // roulette doubles it.
        assert_eq!(of(1.0, [0.99, 0.0, -0.99]), Some([1.0 / 3.0; 3]));
    }

    #[test]
    fn lanes_that_are_not_drawn_are_like_one_that_is() {
        let (half, media) =
            ([0.5, 0.5, 0.0], |sigma_s| [medium([0.0; 3], [2.0; 3]), medium([0.0; 3], sigma_s)]);
        assert!(lanes_cover(&media([1.0, 4.0, 1.0]), half) && lanes_cover(&media([1.0, 4.0, 4.0]), half));
        assert!(!lanes_cover(&media([1.0, 4.0, 2.0]), half) && !lanes_cover(&media([0.0, 0.0, 1.0]), half));
        assert!(lanes_cover(&media([1.0, 4.0, 2.0]), [0.3, 0.3, 0.4]));
        assert!(!lanes_cover(&media([1.0, 4.0, 4.0]), [1.0, 0.0, 0.0]));
    }

    #[test]
    fn lanes_that_are_equal_share_one() {
        let of = |media: &[Homogeneous]| lane_probabilities(media);
        let third = 1.0 / 3.0;
        assert_eq!(of(&[medium([0.0; 3], [2.0; 3])]), None);
        assert_eq!(of(&[medium([1.0, 2.0, 3.0], [0.0; 3])]), None, "nothing scatters");
        assert_eq!(of(&[medium([0.0; 3], [1.0, 1.1, 1.2])]), None, "hardly any difference");
        let small = medium([0.0; 3], [1.0, 1.24, 1.24]);
        assert!(small.mixture_growth() > LEAST_GROWTH);
        assert_eq!(of(&[small]), None, "a small factor only");
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
