//! The homogeneous medium: coefficients that are the same everywhere.
//!
//! Distances are drawn from a mixture of the channels' exponentials, anew on every segment: `S = Σ α_c
//! e^{−σ_c ℓ}`, `p = Σ α_c σ_c e^{−σ_c ℓ}`. The estimate divides by the mixture, so that the throughput of a
//! segment never exceeds `1/α_c`, whatever the ratio of the channels. The probabilities `α` are those of
//! `mixture.rs`. A purely absorbing medium is passed with probability one.
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

/// The distribution of distances, which follows from the coefficients.
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

    /// Makes the medium glow with radiance `L_e`, in W m⁻² sr⁻¹: the source term per length is `σ_a L_e`, and
    /// an opaque stretch without scattering shows `L_e`.
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

/// The length of a segment in scene units, at most the largest number: an infinite length times an extinction
/// of zero would not be a number.
#[inline]
fn finite_length(segment: &RaySegment) -> f64 {
    segment.length_f64().min(f64::MAX)
}

/// Transmittance `e^{−σ ℓ}` per channel, in double precision: an edge multiplies the factors of all its
/// segments.
#[inline]
fn attenuation(sigma: Spectrum, length: f64) -> [f64; 3] {
    sigma.to_array().map(|sigma| (-f64::from(sigma) * length).exp())
}

#[inline]
fn to_spectrum(channels: [f64; 3]) -> Spectrum {
    Spectrum::from_array(channels.map(|value| value as f32))
}

/// The densities of one exponential with extinction `sigma`.
#[inline]
fn grey_density(sigma: f64, length: f64) -> SegmentDensity {
    let passes = (-sigma * length).exp();
    SegmentDensity::symmetric(Spectrum::splat(passes as f32), passes, sigma * passes)
}

/// The densities of a mixture of three exponentials.
#[inline]
fn chromatic_density(alpha: &[f64; 3], sigma: Spectrum, length: f64) -> SegmentDensity {
    let channels = attenuation(sigma, length);
    let (mut passes, mut stops) = (0.0, 0.0);
    for c in 0..3 {
        let share = alpha[c] * channels[c];
        passes += share;
        stops += share * f64::from(sigma[c]);
    }
    SegmentDensity::symmetric(to_spectrum(channels), passes, stops)
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
        // The extinction of the drawn channel, and the rest of the random number, again in [0, 1).
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
        // Random numbers are multiples of 2⁻²⁴: in a medium of optical thickness 10⁻⁸, zero alone would make
        // six times the right number of collisions. The rest goes below the last bit.
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
mod tests;
