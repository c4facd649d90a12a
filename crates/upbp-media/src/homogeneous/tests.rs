//! Homogeneous media against quadrature and counting.

use proptest::prelude::*;

use super::*;
use crate::testing::{Random, assert_fits, integrate, integrate_towards_zero};

const LARGEST_BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

fn medium(sigma_a: [f32; 3], sigma_s: [f32; 3]) -> Homogeneous {
    Homogeneous::new(sigma_a.into(), sigma_s.into(), PhaseFunction::Isotropic).unwrap()
}

/// The probabilities with which a medium chooses its channels.
fn alpha(medium: &Homogeneous) -> [f64; 3] {
    match medium.sampling {
        Sampling::Chromatic { alpha, .. } => alpha,
        _ => [1.0 / 3.0; 3],
    }
}

fn segment(start: f32, end: f32) -> RaySegment {
    RaySegment { origin: Vec3::new(1.0, 2.0, 3.0), direction: Vec3::Y, start, end }
}

/// Grey, chromatic, with a clear channel, with three channels of very different size, absorbing
/// in one channel only.
fn scattering_media() -> [Homogeneous; 5] {
    [
        medium([0.1; 3], [0.9; 3]),
        medium([0.5, 0.1, 0.0], [1.0, 2.0, 4.0]),
        medium([0.5, 0.0, 0.1], [1.0, 0.0, 0.2]),
        medium([0.0; 3], [1e-3, 1.0, 30.0]),
        medium([2.0, 0.0, 0.0], [0.0, 0.5, 0.5]),
    ]
}

#[test]
fn stops_somewhere_or_passes() {
    for medium in scattering_media() {
        for length in [1e-3, 0.1, 1.0, 20.0] {
            let density = |length| match medium.sampling {
                Sampling::Grey => grey_density(f64::from(medium.sigma_t.r()), length),
                _ => chromatic_density(&alpha(&medium), medium.sigma_t, length),
            };
            let stops = integrate(|t| density(t).stop_at_end, 0.0, length, 2000);
            let total = stops + density(length).pass_probability;
            assert!((total - 1.0).abs() < 1e-12, "{medium:?}, {length}: {total}");
            let public = medium.segment(&segment(3.0, 3.0 + length as f32));
            assert!((public.pass_probability - density(length).pass_probability).abs() < 1e-4);
            assert_eq!(public.stop_at_start, public.stop_at_end);
        }
    }
}

#[test]
fn public_densities_integrate_to_one() {
    for medium in scattering_media() {
        let at = |t: f64| medium.segment(&segment(0.0, t as f32));
        let total = integrate(|t| at(t).stop_at_end, 0.0, 4.0, 500) + at(4.0).pass_probability;
        assert!((total - 1.0).abs() < 1e-6, "{medium:?}: {total}");
        // A walk in lanes stops or passes by one of them.
        let at = |t: f64| medium.segment_lanes(&segment(0.0, t as f32));
        for lane in 0..3 {
            let stops = integrate(|t| at(t).stop_at_end[lane], 0.0, 4.0, 500);
            let total = stops + at(4.0).pass_probability[lane];
            assert!((total - 1.0).abs() < 1e-6, "{medium:?}, lane {lane}: {total}");
        }
    }
}

#[test]
fn sampled_distances_fit_the_density() {
    const SAMPLES: u32 = 200_000;
    const CELLS: usize = 40;
    let mut random = Random(1);
    for medium in scattering_media() {
        let (start, end) = (2.0, 3.5);
        let mut observed = [0_u32; CELLS + 1];
        for _ in 0..SAMPLES {
            let (u_channel, u_distance) = (random.uniform(), random.uniform());
            match medium.sample_distance(&segment(start, end), u_channel, u_distance) {
                None => observed[CELLS] += 1,
                Some(distance) => {
                    assert!((start..end).contains(&distance));
                    let cell = (distance - start) / (end - start) * CELLS as f32;
                    observed[(cell as usize).min(CELLS - 1)] += 1;
                }
            }
        }
        let pass_probability = |t: f32| medium.segment(&segment(start, t)).pass_probability;
        let border = |i: usize| start + (end - start) * i as f32 / CELLS as f32;
        let mut expected: Vec<f64> = (0..CELLS)
            .map(|i| f64::from(SAMPLES) * (pass_probability(border(i)) - pass_probability(border(i + 1))))
            .collect();
        expected.push(f64::from(SAMPLES) * pass_probability(end));
        assert_fits(&observed, &expected, &format!("{medium:?}"));
    }
}

#[test]
fn collisions_in_thin_media_are_as_rare_as_they_should_be() {
    // Below the resolution of one random number. Pairs of the smallest numbers of a lattice: their part of
    // all.
    let pairs = |medium: &Homogeneous, length: f32| {
        let steps = 256;
        let collides = |channel: u32, distance: u32| {
            let u_channel = (channel as f32 + 0.5) / steps as f32;
            let u_distance = distance as f32 * LAST_BIT as f32;
            medium.sample_distance(&segment(0.0, length), u_channel, u_distance).is_some()
        };
        let count = (0..steps).map(|c| (0..64).filter(|&d| collides(c, d)).count()).sum::<usize>();
        count as f64 / f64::from(steps) * LAST_BIT
    };
    for medium in [medium([0.1; 3], [0.9; 3]), medium([0.1; 3], [0.9, 0.8, 0.7])] {
        for length in [1e-6, 1e-7, 3e-8] {
            let expected = 1.0 - medium.segment(&segment(0.0, length)).pass_probability;
            let found = pairs(&medium, length);
            assert!((found / expected - 1.0).abs() < 0.02, "{length}: {found} of {expected}");
        }
    }
}

#[test]
fn a_fixed_channel_draws_from_that_channel_alone() {
    let medium = medium([0.0; 3], [0.5, 1.0, 2.0]);
    for channel in 0..3 {
        let before: f64 = alpha(&medium)[..channel].iter().sum();
        let u_channel = (before + 0.5 * alpha(&medium)[channel]) as f32;
        let free_path = medium.sample_distance(&segment(0.0, 100.0), u_channel, 0.5).unwrap();
        let expected = std::f32::consts::LN_2 / medium.sigma_t[channel];
        assert!((free_path / expected - 1.0).abs() < 1e-6);
    }
}

#[test]
fn grey_equals_the_mixture_of_three_equal_channels() {
    let mut random = Random(2);
    for sigma in [1e-12_f32, 1e-3, 0.7, 40.0] {
        let grey = medium([0.25 * sigma; 3], [0.75 * sigma; 3]);
        assert_eq!(grey.sampling, Sampling::Grey);
        let mixed = Homogeneous {
            sampling: Sampling::Chromatic { alpha: [1.0 / 3.0; 3], lanes: grey.sigma_t },
            ..grey.clone()
        };
        for optical_depth in [0.0, 1e-12, 1e-3, 1.0, 30.0] {
            let segment = segment(0.0, optical_depth / sigma);
            let (one, other) = (grey.segment(&segment), mixed.segment(&segment));
            assert_eq!(one.transmittance, other.transmittance);
            assert!((one.pass_probability / other.pass_probability - 1.0).abs() < 1e-15);
            assert!((one.stop_at_end / other.stop_at_end - 1.0).abs() < 1e-15);
            assert!((one.stop_at_start / other.stop_at_start - 1.0).abs() < 1e-15);
            for _ in 0..100 {
                let (channel, distance) = (random.uniform(), random.uniform());
                // The choice of the channel leaves less of the number that goes below the last bit.
                let passed = |medium: &Homogeneous| {
                    medium
                        .sample_distance(&segment, channel, distance)
                        .map_or(2.0, |t| (-f64::from(sigma) * f64::from(t)).exp())
                };
                assert!((passed(&grey) - passed(&mixed)).abs() < 2.5e-7);
            }
        }
    }
}

#[test]
fn a_channel_without_extinction_passes_an_infinite_segment() {
    let medium = medium([0.5, 0.0, 0.0], [0.5, 0.0, 1e-12]);
    let density = medium.segment(&segment(0.0, f32::INFINITY));
    assert_eq!(density.transmittance, Spectrum::new(0.0, 1.0, 0.0));
    let [first, clear, _] = alpha(&medium);
    assert_eq!((density.pass_probability, density.stop_at_end, density.stop_at_start), (clear, 0.0, 0.0));
    let in_clear = (first + 0.5 * clear) as f32;
    for u_distance in [0.0, 0.5, LARGEST_BELOW_ONE] {
        assert_eq!(medium.sample_distance(&segment(0.0, f32::INFINITY), in_clear, u_distance), None);
        assert!(medium.sample_distance(&segment(0.0, f32::INFINITY), 0.1, u_distance).is_some());
    }
}

#[test]
fn an_infinite_segment_of_scattering_medium_is_never_passed() {
    let density = medium([0.0; 3], [0.5; 3]).segment(&segment(5.0, f32::INFINITY));
    assert_eq!(density.transmittance, Spectrum::ZERO);
    assert_eq!((density.pass_probability, density.stop_at_end, density.stop_at_start), (0.0, 0.0, 0.0));
}

#[test]
fn a_segment_without_length_is_passed() {
    for medium in scattering_media() {
        for (start, end) in [(2.0, 2.0), (3.0, 2.0), (f32::NAN, 1.0)] {
            let density = medium.segment(&segment(start, end));
            let sigmas = medium.sigma_t.to_array().map(f64::from);
            let mean: f64 = alpha(&medium).iter().zip(sigmas).map(|(a, sigma)| a * sigma).sum();
            assert_eq!((density.transmittance, density.pass_probability), (Spectrum::ONE, 1.0));
            assert!((density.stop_at_end / mean - 1.0).abs() < 1e-14);
            assert_eq!(density.stop_at_end, density.stop_at_start);
            assert_eq!(medium.sample_distance(&segment(start, end), 0.9, 0.0), None);
        }
    }
}

#[test]
fn a_medium_that_only_absorbs_is_never_sampled() {
    let medium = medium([0.5, 0.0, 1.0], [0.0; 3]);
    assert!(!medium.scatters());
    let density = medium.segment(&segment(1.0, 3.0));
    assert_eq!((density.pass_probability, density.stop_at_end, density.stop_at_start), (1.0, 0.0, 0.0));
    for (channel, expected) in [(-1.0_f32).exp(), 1.0, (-2.0_f32).exp()].into_iter().enumerate() {
        assert!((density.transmittance[channel] / expected - 1.0).abs() < 1e-6);
    }
    assert_eq!(medium.sample_distance(&segment(0.0, f32::INFINITY), 0.0, 0.999), None);
}

#[test]
fn thin_and_thick_media_keep_their_digits() {
    for sigma in [1e-12_f32, 1e-6, 1.0, 1e6] {
        for chromatic in [false, true] {
            let medium =
                if chromatic { medium([0.0; 3], [sigma, 0.0, 0.0]) } else { medium([0.0; 3], [sigma; 3]) };
            let share = if chromatic { alpha(&medium)[0] } else { 1.0 };
            for exponent in -12..=3 {
                let length = 10.0_f32.powi(exponent) / sigma;
                let depth = f64::from(sigma) * f64::from(length);
                let density = medium.segment(&segment(0.0, length));
                let expected = share * f64::from(sigma) * (-depth).exp();
                assert!((density.stop_at_end - expected).abs() <= 1e-14 * expected);
                assert!(density.transmittance.is_finite() && density.transmittance.is_non_negative());
                assert!((density.pass_probability - (1.0 - share) - share * (-depth).exp()).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn a_split_segment_attenuates_like_the_whole() {
    let (borders, grey) = ([0.0, 0.37, 1.1, 1.100_001, 7.3], medium([0.1; 3], [0.4; 3]));
    let product: f64 =
        borders.windows(2).map(|w| grey.segment(&segment(w[0], w[1])).pass_probability).product();
    let whole = grey.segment(&segment(0.0, 7.3)).pass_probability;
    assert!((product / whole - 1.0).abs() < 1e-14);
}

#[test]
fn the_throughput_of_a_segment_is_bounded_by_the_mixture() {
    for medium in scattering_media() {
        for exponent in -12..7 {
            let density = medium.segment(&segment(0.0, (exponent as f32).exp2()));
            let rarest = alpha(&medium).into_iter().filter(|a| *a > 0.0).fold(1.0, f64::min);
            let bound = (1.0 + 1e-6) / rarest;
            assert!(f64::from(density.transmittance.max_component()) <= bound * density.pass_probability);
            let collision = medium.sigma_s * density.transmittance;
            assert!(f64::from(collision.max_component()) <= bound * density.stop_at_end);
        }
    }
}

#[test]
fn a_stop_is_inside_even_where_the_segment_is_a_few_roundings_long() {
    let medium = medium([0.0; 3], [1e4; 3]);
    let (start, end) = (1000.0_f32, 1000.0_f32.next_up());
    let mut random = Random(3);
    let mut stops = 0;
    for _ in 0..20_000 {
        if let Some(distance) = medium.sample_distance(&segment(start, end), 0.5, random.uniform()) {
            assert_eq!(distance, start);
            stops += 1;
        }
    }
    // Expected 1 − e^{−0.61}, give or take five standard deviations of 70.
    let expected = 20_000.0 * (1.0 - medium.segment(&segment(start, end)).pass_probability);
    assert!((f64::from(stops) - expected).abs() < 350.0, "{stops} of {expected}");
}

#[test]
fn emission_is_the_integral_of_the_attenuated_source() {
    let radiance = Spectrum::new(3.0, 0.5, 20.0);
    for medium in scattering_media() {
        let medium = medium.with_emission(radiance).unwrap();
        for length in [1e-6_f32, 0.1, 1.0, 25.0] {
            let emitted = medium.emitted(&segment(0.0, length));
            for channel in 0..3 {
                let (sigma_a, sigma_t) =
                    (f64::from(medium.sigma_a[channel]), f64::from(medium.sigma_t[channel]));
                let source = |t: f64| sigma_a * f64::from(radiance[channel]) * (-sigma_t * t).exp();
                let expected = integrate_towards_zero(source, f64::from(length));
                let error = (f64::from(emitted[channel]) - expected).abs();
                assert!(error <= 1e-6 * expected, "{medium:?}, {length}: {emitted:?}, {expected}");
            }
        }
    }
}

#[test]
fn emission_has_its_limits() {
    let radiance = Spectrum::new(3.0, 0.5, 20.0);
    let glow = medium([1e-12, 0.0, 2.0], [0.0; 3]).with_emission(radiance).unwrap();
    assert!(glow.emits() && !glow.scatters());
    assert_eq!(glow.emitted(&segment(4.0, f32::INFINITY)), Spectrum::new(3.0, 0.0, 20.0));
    assert_eq!(glow.emitted(&segment(4.0, 4.0)), Spectrum::ZERO);
    // Thin: the source times the length, with all its digits.
    let thin = glow.emitted(&segment(0.0, 1e-3)).r();
    assert!((thin / 3e-15 - 1.0).abs() < 1e-6, "{thin}");
    // Pieces add up, each seen through those before it.
    let near = glow.emitted(&segment(0.0, 0.4));
    let through = glow.segment(&segment(0.0, 0.4)).transmittance;
    let whole = glow.emitted(&segment(0.0, 1.0));
    let sum = near + through * glow.emitted(&segment(0.4, 1.0));
    for channel in [0, 2] {
        assert!((sum[channel] / whole[channel] - 1.0).abs() < 1e-6);
    }
    let scattering_only = medium([0.0; 3], [1.0; 3]).with_emission(radiance).unwrap();
    assert!(!scattering_only.emits());
    assert_eq!(scattering_only.emitted(&segment(0.0, 1.0)), Spectrum::ZERO);
}

#[test]
fn a_glow_needs_no_absorption() {
    let radiance = Spectrum::new(3.0, 0.5, 0.0);
    let glow = medium([0.0; 3], [0.0; 3]).with_glow(radiance).unwrap();
    assert!(glow.emits() && !glow.scatters());
    assert_eq!(glow.emitted(&segment(1.0, 5.0)), 4.0 * radiance);
    assert_eq!(glow.emitted(&segment(1.0, 1.0)), Spectrum::ZERO);
    // It comes on top of what is emitted by absorption, in whichever order.
    let both = medium([2.0; 3], [0.0; 3]).with_glow(radiance).unwrap().with_emission(radiance).unwrap();
    assert_eq!(both.source(Vec3::ZERO), 3.0 * radiance);
    let opaque = both.emitted(&segment(0.0, f32::INFINITY));
    assert_eq!(opaque, 1.5 * radiance);
    assert!(medium([0.0; 3], [0.0; 3]).with_glow(Spectrum::new(0.0, -1.0, 0.0)).is_err());
    assert!(medium([1e30; 3], [0.0; 3]).with_emission(Spectrum::splat(1e30)).is_err());
}

#[test]
fn points_are_drawn_by_the_light_that_they_send() {
    let media = scattering_media().map(|medium| medium.with_emission(Spectrum::new(3.0, 0.5, 20.0)).unwrap());
    let thin = medium([0.0; 3], [0.0; 3]).with_glow(Spectrum::new(1.0, 0.0, 2.0)).unwrap();
    let mut random = Random(5);
    for medium in media.into_iter().filter(Homogeneous::emits).chain([thin]) {
        for length in [1e-6_f32, 0.1, 1.0, 25.0] {
            let segment = segment(2.0, 2.0 + length);
            let pdf = |t: f64| medium.pdf_emitted(&segment, (2.0 + t) as f32);
            let total = integrate_towards_zero(pdf, segment.length_f64());
            assert!((total - 1.0).abs() < 1e-3, "{medium:?}, {length}: {total}");
            let emitted = medium.emitted(&segment);
            let (mut sum, mut below, count) = (Spectrum::ZERO, 0_u32, 20_000);
            let middle = 2.0 + 0.3 * length;
            for _ in 0..count {
                let t = medium.sample_emitted(&segment, random.uniform()).unwrap();
                assert!((segment.start..segment.end).contains(&t));
                let through = medium.segment(&RaySegment { end: t, ..segment }).transmittance;
                sum += through * medium.source(Vec3::ZERO) / medium.pdf_emitted(&segment, t) as f32;
                below += u32::from(t < middle);
            }
            for channel in 0..3 {
                let (mean, expected) = (sum[channel] / count as f32, emitted[channel]);
                // No sample is more than the sum of the channels: five standard errors at most.
                let most = 5.0 * (expected * 3.0 * emitted.mean() / count as f32).sqrt();
                assert!((mean - expected).abs() <= most + 1e-3 * expected, "{mean} of {expected}, {length}");
            }
            let part = integrate_towards_zero(pdf, f64::from(middle - 2.0));
            let error = (part * (1.0 - part) / f64::from(count)).sqrt();
            let found = f64::from(below) / f64::from(count);
            assert!(length < 1e-3 || (found - part).abs() < 5.0 * error + 1e-4, "{found} of {part}");
        }
    }
}

#[test]
fn roulette_follows_the_largest_albedo() {
    let at = |medium: &Homogeneous| medium.continuation(Vec3::ZERO);
    assert!((at(&medium([0.5, 0.1, 0.0], [0.5, 0.4, 0.0])) - 0.8).abs() < 1e-6);
    assert_eq!(at(&medium([0.0; 3], [1e-20; 3])), 1.0);
    assert_eq!(at(&medium([1.0; 3], [1e-9; 3])), MIN_CONTINUATION);
    assert_eq!(at(&medium([0.0; 3], [0.0; 3])), MIN_CONTINUATION);
}

/// Squares of what a segment does to the throughput, by distances that are drawn.
#[test]
fn the_second_moment_grows_by_the_factor_that_is_told() {
    const DRAWS: u32 = 1 << 17;
    let mut random = Random(7);
    let mut moments = |medium: &Homogeneous, length: f32| {
        let whole = segment(0.0, length);
        let survives = f64::from(medium.continuation(Vec3::ZERO));
        let mut squares = [0.0; 3];
        for _ in 0..DRAWS {
            let stop = medium.sample_distance(&whole, random.uniform(), random.uniform());
            let density = medium.segment(&stop.map_or(whole, |t| segment(0.0, t)));
            for (c, sum) in squares.iter_mut().enumerate() {
                let transmittance = f64::from(density.transmittance[c]);
                *sum += match stop {
                    Some(_) => {
                        let scatters = f64::from(medium.sigma_s[c]) * transmittance;
                        (scatters / density.stop_at_end).powi(2) / survives
                    }
                    None => (transmittance / density.pass_probability).powi(2),
                };
            }
        }
        squares.into_iter().fold(0.0, f64::max) / f64::from(DRAWS)
    };
    for medium in [
        medium([0.1; 3], [0.9; 3]),
        medium([0.0; 3], [0.5, 4.0, 15.0]),
        medium([0.0, 1.0, 4.0], [0.0, 0.5, 0.5]),
        medium([0.3, 1.2, 4.0], [0.1; 3]),
        medium([0.4, 8.0, 7.0], [0.05, 0.5, 0.5]),
    ] {
        let told = medium.mixture_growth();
        let found = [1e-3, 0.1, 0.3, 1.0, 3.0, 30.0, 1e3].map(|length| moments(&medium, length));
        let largest = found.into_iter().fold(0.0, f64::max);
        assert!((largest / told - 1.0).abs() < 0.05, "{medium:?}: {found:?}, {told}");
    }
}

#[test]
fn mean_free_path_is_of_the_mean_extinction() {
    assert!((medium([0.5; 3], [0.5, 1.5, 2.5]).mean_free_path() - 0.5).abs() < 1e-6);
    assert_eq!(medium([0.0; 3], [0.0; 3]).mean_free_path(), f32::INFINITY);
}

#[test]
fn bad_coefficients_are_named() {
    let new = |sigma_a: [f32; 3], sigma_s: [f32; 3]| {
        Homogeneous::new(sigma_a.into(), sigma_s.into(), PhaseFunction::Isotropic)
    };
    assert_eq!(
        new([0.0, -1.0, 0.0], [1.0; 3]).unwrap_err().to_string(),
        "channel 1 of the absorption coefficient is -1, expected a finite number of at least zero",
    );
    assert!(new([0.0; 3], [0.0, 0.0, f32::NAN]).is_err());
    assert!(new([0.0; 3], [f32::INFINITY; 3]).is_err());
    assert!(new([f32::MAX; 3], [f32::MAX; 3]).is_err());
    let dark = Spectrum::new(0.0, 0.0, -1e-9);
    assert!(medium([1.0; 3], [0.0; 3]).with_emission(dark).is_err());
}

/// Anything from nothing to very dense, with exact zeros.
fn coefficient() -> impl Strategy<Value = f32> {
    prop_oneof![1 => Just(0.0_f32), 4 => (-40.0_f32..20.0).prop_map(f32::exp2)]
}

fn distance() -> impl Strategy<Value = f32> {
    prop_oneof![
        1 => Just(0.0_f32),
        1 => Just(f32::INFINITY),
        6 => (-40.0_f32..40.0).prop_map(f32::exp2),
    ]
}

proptest! {
    #[test]
    fn nothing_is_ever_out_of_range(
        sigma_a in [coefficient(), coefficient(), coefficient()],
        sigma_s in [coefficient(), coefficient(), coefficient()],
        start in (-40.0_f32..40.0).prop_map(f32::exp2),
        length in distance(),
        u_channel in prop_oneof![Just(0.0_f32), Just(LARGEST_BELOW_ONE), 0.0_f32..1.0],
        u_distance in prop_oneof![Just(0.0_f32), Just(LARGEST_BELOW_ONE), 0.0_f32..1.0],
    ) {
        let medium = medium(sigma_a, sigma_s).with_emission(Spectrum::splat(2.0)).unwrap();
        let segment = segment(start, start + length);
        let density = medium.segment(&segment);
        prop_assert!((0.0..=1.0).contains(&density.pass_probability));
        prop_assert!(density.stop_at_end.is_finite() && density.stop_at_end >= 0.0);
        prop_assert_eq!(density.stop_at_start, density.stop_at_end);
        for channel in 0..3 {
            prop_assert!((0.0..=1.0).contains(&density.transmittance[channel]));
            prop_assert!((0.0..=2.0).contains(&medium.emitted(&segment)[channel]));
        }
        let continuation = medium.continuation(segment.origin);
        prop_assert!(continuation > 0.0 && continuation <= 1.0);
        if let Some(distance) = medium.sample_distance(&segment, u_channel, u_distance) {
            prop_assert!(medium.scatters());
            prop_assert!((segment.start..segment.end).contains(&distance));
        }
    }
}
