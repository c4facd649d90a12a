//! The same coefficients everywhere.
//!
//! Distances are drawn from a mixture of the channels' exponentials, anew on every segment:
//! `S = Σ α_c e^{−σ_c ℓ}`, `p = Σ α_c σ_c e^{−σ_c ℓ}`. The estimate divides by the mixture, so that the
//! throughput of a segment never exceeds `1/α_c`, whatever the ratio of the channels. The probabilities `α` are
//! those of `mixture.rs`. A purely absorbing medium is passed with probability one.
//!
//! Source: `docs/theory.md`, section 1.4, policy B. Oracles: quadrature and
//! `tests::grey_equals_the_mixture_of_three_equal_channels`.

use glam::Vec3;

use crate::error::check_non_negative;
use crate::mixture::channel_probabilities;
use crate::{MediaError, Medium, PhaseFunction, RaySegment, SegmentDensity, Spectrum};

/// Floor of [`Medium::continuation`]: keeps the probability positive where hardly anything scatters. A
/// walk that survives never gains energy by it, since the albedo is then below the probability.
const MIN_CONTINUATION: f32 = 0.01;

/// Distance between neighbouring random numbers: 2⁻²⁴.
const LAST_BIT: f64 = 1.0 / 16_777_216.0;

/// How distances are drawn; follows from the coefficients.
#[derive(Copy, Clone, Debug, PartialEq)]
enum Sampling {
    /// No channel scatters: walks always pass.
    Never,
    /// All channels have the same extinction: one exponential, the same densities as the mixture of three.
    Grey,
    /// The mixture of the channels, each with its probability.
    Chromatic([f64; 3]),
}

/// A medium with the same coefficients everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Homogeneous {
    sigma_a: Spectrum,
    sigma_s: Spectrum,
    sigma_t: Spectrum,
    emission: Spectrum,
    phase: PhaseFunction,
    sampling: Sampling,
}

impl Homogeneous {
    /// A medium that absorbs with `sigma_a` and scatters with `sigma_s`, both in inverse scene units.
    ///
    /// # Errors
    ///
    /// If a channel of either coefficient, or of their sum, is negative or not finite.
    pub fn new(sigma_a: Spectrum, sigma_s: Spectrum, phase: PhaseFunction) -> Result<Self, MediaError> {
        check_non_negative("the absorption coefficient", sigma_a)?;
        check_non_negative("the scattering coefficient", sigma_s)?;
        let sigma_t = check_non_negative("the extinction coefficient", sigma_a + sigma_s)?;
        let sampling = if sigma_s.is_black() {
            Sampling::Never
        } else if sigma_t == Spectrum::splat(sigma_t.r()) {
            Sampling::Grey
        } else {
            Sampling::Chromatic(channel_probabilities(sigma_s, sigma_t))
        };
        Ok(Self { sigma_a, sigma_s, sigma_t, emission: Spectrum::ZERO, phase, sampling })
    }

    /// The same medium glowing with radiance `L_e`, in W m⁻² sr⁻¹: the source term per length is
    /// `σ_a L_e`, and an opaque stretch without scattering shows `L_e`.
    ///
    /// A channel without absorption does not glow.
    ///
    /// # Errors
    ///
    /// If a channel of `radiance` is negative or not finite.
    pub fn with_emission(mut self, radiance: Spectrum) -> Result<Self, MediaError> {
        self.emission = check_non_negative("the emitted radiance", radiance)?;
        Ok(self)
    }

    /// Absorption coefficient in inverse scene units.
    #[must_use]
    pub const fn absorption(&self) -> Spectrum {
        self.sigma_a
    }

    /// Scattering coefficient in inverse scene units.
    #[must_use]
    pub const fn scattering(&self) -> Spectrum {
        self.sigma_s
    }

    /// Extinction coefficient in inverse scene units: absorption plus scattering.
    #[must_use]
    pub const fn extinction(&self) -> Spectrum {
        self.sigma_t
    }

    /// Radiance `L_e` of an opaque stretch in W m⁻² sr⁻¹.
    #[must_use]
    pub const fn emission(&self) -> Spectrum {
        self.emission
    }
}

/// Length as the exponentials take it: an infinite one becomes the largest number, so that a channel
/// without extinction passes it (0 · ∞ is not a number).
#[inline]
fn finite_length(segment: &RaySegment) -> f64 {
    segment.length_f64().min(f64::MAX)
}

/// `e^{−σ ℓ}` per channel. In double precision: an edge multiplies many of them.
#[inline]
fn attenuation(sigma: Spectrum, length: f64) -> [f64; 3] {
    sigma.to_array().map(|sigma| (-f64::from(sigma) * length).exp())
}

#[inline]
fn to_spectrum(channels: [f64; 3]) -> Spectrum {
    Spectrum::from_array(channels.map(|value| value as f32))
}

/// One exponential with extinction `sigma`.
#[inline]
fn grey_density(sigma: f64, length: f64) -> SegmentDensity {
    let reach = (-sigma * length).exp();
    let stop = sigma * reach;
    SegmentDensity {
        transmittance: Spectrum::splat(reach as f32),
        reach,
        stop_at_end: stop,
        stop_at_start: stop,
    }
}

/// The mixture of three exponentials.
#[inline]
fn chromatic_density(alpha: &[f64; 3], sigma: Spectrum, length: f64) -> SegmentDensity {
    let channels = attenuation(sigma, length);
    let (mut reach, mut stop) = (0.0, 0.0);
    for c in 0..3 {
        let share = alpha[c] * channels[c];
        reach += share;
        stop += share * f64::from(sigma[c]);
    }
    SegmentDensity { transmittance: to_spectrum(channels), reach, stop_at_end: stop, stop_at_start: stop }
}

impl Medium for Homogeneous {
    #[inline]
    fn scatters(&self) -> bool {
        self.sampling != Sampling::Never
    }

    #[inline]
    fn segment(&self, segment: &RaySegment) -> SegmentDensity {
        let length = finite_length(segment);
        match self.sampling {
            Sampling::Never => SegmentDensity::passing(to_spectrum(attenuation(self.sigma_t, length))),
            Sampling::Grey => grey_density(f64::from(self.sigma_t.r()), length),
            Sampling::Chromatic(alpha) => chromatic_density(&alpha, self.sigma_t, length),
        }
    }

    #[inline]
    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32> {
        let u_channel = f64::from(u_channel);
        // The extinction, and what the choice of it leaves of the random number, again in [0, 1).
        let (sigma, rest) = match self.sampling {
            Sampling::Never => return None,
            Sampling::Grey => (self.sigma_t.r(), u_channel),
            Sampling::Chromatic([r, g, b]) => {
                if u_channel < r {
                    (self.sigma_t.r(), u_channel / r)
                } else if u_channel < r + g {
                    (self.sigma_t.g(), (u_channel - r) / g)
                } else {
                    (self.sigma_t.b(), (u_channel - (r + g)) / b)
                }
            }
        };
        // Random numbers are multiples of 2⁻²⁴: in a medium of optical thickness 10⁻⁸, the smallest of them alone would make
        // six times as many collisions as there are. The rest goes below their last bit.
        let u_distance = f64::from(u_distance) + rest * LAST_BIT;
        // 1 − u is in (0, 1], so that the logarithm is finite. A channel without extinction gives ∞, or 0/0
        // for u = 0: both fail the comparison and pass.
        let free_path = -f64::ln_1p(-u_distance) / f64::from(sigma);
        if free_path < segment.length_f64() {
            // Whether the walk stops is decided above, in double precision, as `segment` reports it; the
            // rounding of the position must not undo it on a short segment far from the origin.
            let distance = (f64::from(segment.start) + free_path) as f32;
            Some(distance.min(segment.end.next_down()))
        } else {
            None
        }
    }

    #[inline]
    fn sigma_s(&self, _position: Vec3) -> Spectrum {
        self.sigma_s
    }

    #[inline]
    fn sigma_t(&self, _position: Vec3) -> Spectrum {
        self.sigma_t
    }

    #[inline]
    fn phase(&self) -> &PhaseFunction {
        &self.phase
    }

    #[inline]
    fn emits(&self) -> bool {
        !(self.sigma_a * self.emission).is_black()
    }

    fn emitted(&self, segment: &RaySegment) -> Spectrum {
        let length = finite_length(segment);
        let channel = |channel: usize| {
            let sigma_t = f64::from(self.sigma_t[channel]);
            if sigma_t == 0.0 {
                // No extinction, hence no absorption, hence no emission.
                return 0.0;
            }
            // ∫₀^ℓ σ_a L_e e^{−σ_t t} dt. With `exp_m1`, a thin stretch keeps all its digits.
            let share = f64::from(self.sigma_a[channel]) / sigma_t;
            (f64::from(self.emission[channel]) * share * -f64::exp_m1(-sigma_t * length)) as f32
        };
        Spectrum::new(channel(0), channel(1), channel(2))
    }

    #[inline]
    fn continuation(&self, _position: Vec3) -> f32 {
        let mut albedo = 0.0_f32;
        for channel in 0..3 {
            if self.sigma_t[channel] > 0.0 {
                albedo = albedo.max(self.sigma_s[channel] / self.sigma_t[channel]);
            }
        }
        albedo.clamp(MIN_CONTINUATION, 1.0)
    }

    fn mean_free_path(&self) -> f32 {
        // Zero extinction divides to +∞.
        1.0 / self.sigma_t.mean()
    }
}

#[cfg(test)]
mod tests {
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
            Sampling::Chromatic(alpha) => alpha,
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
                let total = stops + density(length).reach;
                assert!((total - 1.0).abs() < 1e-12, "{medium:?}, {length}: {total}");
                let public = medium.segment(&segment(3.0, 3.0 + length as f32));
                assert!((public.reach - density(length).reach).abs() < 1e-4);
                assert_eq!(public.stop_at_start, public.stop_at_end);
            }
        }
    }

    #[test]
    fn public_densities_integrate_to_one() {
        for medium in scattering_media() {
            let at = |t: f64| medium.segment(&segment(0.0, t as f32));
            let total = integrate(|t| at(t).stop_at_end, 0.0, 4.0, 500) + at(4.0).reach;
            assert!((total - 1.0).abs() < 1e-6, "{medium:?}: {total}");
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
            let reach = |t: f32| medium.segment(&segment(start, t)).reach;
            let border = |i: usize| start + (end - start) * i as f32 / CELLS as f32;
            let mut expected: Vec<f64> =
                (0..CELLS).map(|i| f64::from(SAMPLES) * (reach(border(i)) - reach(border(i + 1)))).collect();
            expected.push(f64::from(SAMPLES) * reach(end));
            assert_fits(&observed, &expected, &format!("{medium:?}"));
        }
    }

    #[test]
    fn collisions_in_thin_media_are_as_rare_as_they_should_be() {
        // Below the resolution of one random number. Pairs of the smallest numbers of a lattice: their part of all.
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
                let expected = 1.0 - medium.segment(&segment(0.0, length)).reach;
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
            let mixed = Homogeneous { sampling: Sampling::Chromatic([1.0 / 3.0; 3]), ..grey.clone() };
            for optical_depth in [0.0, 1e-12, 1e-3, 1.0, 30.0] {
                let segment = segment(0.0, optical_depth / sigma);
                let (one, other) = (grey.segment(&segment), mixed.segment(&segment));
                assert_eq!(one.transmittance, other.transmittance);
                assert!((one.reach / other.reach - 1.0).abs() < 1e-15);
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
        assert_eq!((density.reach, density.stop_at_end, density.stop_at_start), (clear, 0.0, 0.0));
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
        assert_eq!((density.reach, density.stop_at_end, density.stop_at_start), (0.0, 0.0, 0.0));
    }

    #[test]
    fn a_segment_without_length_is_passed() {
        for medium in scattering_media() {
            for (start, end) in [(2.0, 2.0), (3.0, 2.0), (f32::NAN, 1.0)] {
                let density = medium.segment(&segment(start, end));
                let sigmas = medium.sigma_t.to_array().map(f64::from);
                let mean: f64 = alpha(&medium).iter().zip(sigmas).map(|(a, sigma)| a * sigma).sum();
                assert_eq!((density.transmittance, density.reach), (Spectrum::ONE, 1.0));
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
        assert_eq!((density.reach, density.stop_at_end, density.stop_at_start), (1.0, 0.0, 0.0));
        for (channel, expected) in [(-1.0_f32).exp(), 1.0, (-2.0_f32).exp()].into_iter().enumerate() {
            assert!((density.transmittance[channel] / expected - 1.0).abs() < 1e-6);
        }
        assert_eq!(medium.sample_distance(&segment(0.0, f32::INFINITY), 0.0, 0.999), None);
    }

    #[test]
    fn thin_and_thick_media_keep_their_digits() {
        for sigma in [1e-12_f32, 1e-6, 1.0, 1e6] {
            for chromatic in [false, true] {
                let medium = if chromatic {
                    medium([0.0; 3], [sigma, 0.0, 0.0])
                } else {
                    medium([0.0; 3], [sigma; 3])
                };
                let share = if chromatic { alpha(&medium)[0] } else { 1.0 };
                for exponent in -12..=3 {
                    let length = 10.0_f32.powi(exponent) / sigma;
                    let depth = f64::from(sigma) * f64::from(length);
                    let density = medium.segment(&segment(0.0, length));
                    let expected = share * f64::from(sigma) * (-depth).exp();
                    assert!((density.stop_at_end - expected).abs() <= 1e-14 * expected);
                    assert!(density.transmittance.is_finite() && density.transmittance.is_non_negative());
                    assert!((density.reach - (1.0 - share) - share * (-depth).exp()).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn a_split_segment_attenuates_like_the_whole() {
        let (borders, grey) = ([0.0, 0.37, 1.1, 1.100_001, 7.3], medium([0.1; 3], [0.4; 3]));
        let product: f64 = borders.windows(2).map(|w| grey.segment(&segment(w[0], w[1])).reach).product();
        let whole = grey.segment(&segment(0.0, 7.3)).reach;
        assert!((product / whole - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_throughput_of_a_segment_is_bounded_by_the_mixture() {
        for medium in scattering_media() {
            for exponent in -12..7 {
                let density = medium.segment(&segment(0.0, (exponent as f32).exp2()));
                let rarest = alpha(&medium).into_iter().fold(1.0, f64::min);
                let bound = (1.0 + 1e-6) / rarest;
                assert!(f64::from(density.transmittance.max_component()) <= bound * density.reach);
                let collision = medium.sigma_t * density.transmittance;
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
        let expected = 20_000.0 * (1.0 - medium.segment(&segment(start, end)).reach);
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
    fn roulette_follows_the_largest_albedo() {
        let at = |medium: &Homogeneous| medium.continuation(Vec3::ZERO);
        assert!((at(&medium([0.5, 0.1, 0.0], [0.5, 0.4, 0.0])) - 0.8).abs() < 1e-6);
        assert_eq!(at(&medium([0.0; 3], [1e-20; 3])), 1.0);
        assert_eq!(at(&medium([1.0; 3], [1e-9; 3])), MIN_CONTINUATION);
        assert_eq!(at(&medium([0.0; 3], [0.0; 3])), MIN_CONTINUATION);
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
            prop_assert!((0.0..=1.0).contains(&density.reach));
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
}
