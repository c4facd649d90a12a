//! The homogeneous medium: coefficients that are the same everywhere.
//!
//! Distances are drawn from a mixture of the channels' exponentials, anew on every segment: `S = Σ α_c
//! e^{−σ_c ℓ}`, `p = Σ α_c σ_c e^{−σ_c ℓ}`. The estimate divides by the mixture, so that the throughput of a
//! segment never exceeds `1/α_c`, whatever the ratio of the channels, nor in a channel that is not drawn that
//! of the one that gets farthest. The probabilities `α` are those of `channel_mixture.rs`. A purely absorbing
//! medium is passed with probability one.
//!
//! Source: `docs/theory.md`, section 1.4, policy B. Oracles: quadrature and
//! `tests::grey_equals_the_mixture_of_three_equal_channels`.

use glam::Vec3;

use crate::channel_mixture::{channel_probabilities, least_extinction, segment_growth};
use crate::error::check_non_negative;
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
    /// The mixture of the channels, each with its probability, and the lane of each channel.
    Chromatic {
        /// Probabilities of the channels.
        alpha: [f64; 3],
        /// Extinctions of the lanes, in inverse scene units.
        lanes: Spectrum,
    },
}

/// A medium with the same coefficients everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Homogeneous {
    sigma_a: Spectrum,
    sigma_s: Spectrum,
    sigma_t: Spectrum,
    emission: Spectrum,
    glow: Spectrum,
    /// `σ_a L_e` and the glow.
    source: Spectrum,
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
            Sampling::Chromatic {
                alpha: channel_probabilities(sigma_s, sigma_t),
                lanes: lane_extinctions(sigma_s, sigma_t),
            }
        };
        Ok(Self {
            sigma_a,
            sigma_s,
            sigma_t,
            emission: Spectrum::ZERO,
            glow: Spectrum::ZERO,
            source: Spectrum::ZERO,
            phase,
            sampling,
        })
    }

    /// Makes the medium emit what it absorbs, with radiance `L_e`, in W m⁻² sr⁻¹: the source term per length
    /// is `σ_a L_e`, and an opaque stretch without scattering shows `L_e`.
    ///
    /// A channel without absorption emits nothing.
    ///
    /// # Errors
    ///
    /// If a channel of `radiance` is negative or not finite, or of the source is not finite.
    pub fn with_emission(mut self, radiance: Spectrum) -> Result<Self, MediaError> {
        self.emission = check_non_negative("the emitted radiance", radiance)?;
        self.with_sum()
    }

    /// Makes the medium glow whether or not it absorbs, with `radiance` per length in W m⁻² sr⁻¹ per scene
    /// unit, on top of what it [emits by absorption](Self::with_emission): a stretch of length ℓ without
    /// extinction shows `radiance · ℓ`.
    ///
    /// # Errors
    ///
    /// If a channel of `radiance` is negative or not finite, or of the source is not finite.
    pub fn with_glow(mut self, radiance: Spectrum) -> Result<Self, MediaError> {
        self.glow = check_non_negative("the radiance of the glow per length", radiance)?;
        self.with_sum()
    }

    fn with_sum(mut self) -> Result<Self, MediaError> {
        let source = self.sigma_a * self.emission + self.glow;
        self.source = check_non_negative("the emitted radiance per length", source)?;
        Ok(self)
    }

    /// Extinction coefficient in inverse scene units: absorption plus scattering.
    #[must_use]
    pub const fn extinction(&self) -> Spectrum {
        self.sigma_t
    }

    /// Light of one channel that a stretch sends to its start, W m⁻² sr⁻¹: `∫₀^ℓ j e^{−σ_t t} dt`.
    fn emitted_in(&self, channel: usize, length: f64) -> f64 {
        let (source, sigma_t) = (f64::from(self.source[channel]), f64::from(self.sigma_t[channel]));
        match (source, sigma_t) {
            (0.0, _) => 0.0,
            (_, 0.0) => source * length,
            // With `exp_m1`, a thin stretch keeps all its digits.
            _ => source / sigma_t * -f64::exp_m1(-sigma_t * length),
        }
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

/// The extinction of each channel's lane. The lane of a channel that only absorbs need not stop: it is that
/// of the channel that gets farthest of those that scatter, or else one that always passes.
fn lane_extinctions(sigma_s: Spectrum, sigma_t: Spectrum) -> Spectrum {
    let farthest = least_extinction(sigma_s, sigma_t);
    Spectrum::from_array([0, 1, 2].map(|c| {
        if sigma_s[c] > 0.0 {
            sigma_t[c]
        } else if farthest <= sigma_t[c] {
            farthest
        } else {
            0.0
        }
    }))
}

/// Draws a distance in `segment` from the exponential with extinction `sigma`. Random numbers are multiples
/// of 2⁻²⁴: in a medium of optical thickness 10⁻⁸, zero alone would make six times the right number of
/// collisions. So `rest`, another one, goes below the last bit.
#[inline]
fn sample_exponential(segment: &RaySegment, sigma: f32, u_distance: f32, rest: f64) -> Option<f32> {
    let u_distance = f64::from(u_distance) + rest * LAST_BIT;
    // 1 − u is in (0, 1], so that the logarithm is finite. A channel without extinction gives ∞, or 0/0 for u
    // = 0: both fail the comparison and pass.
    let free_path = -f64::ln(1.0 - u_distance) / f64::from(sigma);
    (free_path < segment.length_f64()).then(|| {
        // Whether the walk stops is decided above, in double precision, as `segment` reports it; the rounding
        // of the position must not undo it on a short segment far from the origin.
        let distance = (f64::from(segment.start) + free_path) as f32;
        distance.min(segment.end.next_down())
    })
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
            Sampling::Chromatic { alpha, .. } => chromatic_density(&alpha, self.sigma_t, length),
        }
    }

    #[inline]
    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32> {
        let u_channel = f64::from(u_channel);
        // The extinction of the drawn channel, and the rest of the random number, again in [0, 1).
        let (sigma, rest) = match self.sampling {
            Sampling::Never => return None,
            Sampling::Grey => (self.sigma_t.r(), u_channel),
            Sampling::Chromatic { alpha: [r, g, b], .. } => {
                if u_channel < r {
                    (self.sigma_t.r(), u_channel / r)
                } else if u_channel < r + g {
                    (self.sigma_t.g(), (u_channel - r) / g)
                } else {
                    (self.sigma_t.b(), (u_channel - (r + g)) / b)
                }
            }
        };
        sample_exponential(segment, sigma, u_distance, rest)
    }

    fn lane_extinctions(&self) -> Option<Spectrum> {
        match self.sampling {
            Sampling::Chromatic { lanes, .. } => Some(lanes),
            Sampling::Never | Sampling::Grey => None,
        }
    }

    fn mixture_growth(&self) -> f64 {
        let alpha = match self.sampling {
            Sampling::Chromatic { alpha, .. } => alpha,
            Sampling::Grey => [1.0 / 3.0; 3],
            Sampling::Never => return 1.0,
        };
        let continuation = f64::from(self.continuation(Vec3::ZERO));
        segment_growth(&alpha, self.sigma_s, self.sigma_t, continuation, self.phase.turn_growth())
    }

    #[inline]
    fn segment_lanes(&self, segment: &RaySegment) -> SegmentDensity<[f64; 3]> {
        let length = finite_length(segment);
        let transmittance = attenuation(self.sigma_t, length);
        match self.sampling {
            Sampling::Never => SegmentDensity::passing(to_spectrum(transmittance)),
            Sampling::Grey => {
                let stops = f64::from(self.sigma_t.r()) * transmittance[0];
                SegmentDensity::symmetric(to_spectrum(transmittance), [transmittance[0]; 3], [stops; 3])
            }
            Sampling::Chromatic { lanes, .. } => {
                let passes = if lanes == self.sigma_t { transmittance } else { attenuation(lanes, length) };
                let stops = [0, 1, 2].map(|lane| f64::from(lanes[lane]) * passes[lane]);
                SegmentDensity::symmetric(to_spectrum(transmittance), passes, stops)
            }
        }
    }

    #[inline]
    fn sample_lane(&self, segment: &RaySegment, lane: usize, [u_rest, u_distance]: [f32; 2]) -> Option<f32> {
        let sigma = match self.sampling {
            Sampling::Never => return None,
            Sampling::Grey => self.sigma_t.r(),
            Sampling::Chromatic { lanes, .. } => lanes[lane],
        };
        sample_exponential(segment, sigma, u_distance, f64::from(u_rest))
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
        !self.source.is_black()
    }

    fn emitted(&self, segment: &RaySegment) -> Spectrum {
        let length = finite_length(segment);
        to_spectrum([0, 1, 2].map(|channel| self.emitted_in(channel, length)))
    }

    #[inline]
    fn source(&self, _position: Vec3) -> Spectrum {
        self.source
    }

    fn sample_emitted(&self, segment: &RaySegment, u: f32) -> Option<f32> {
        let length = segment.length_f64();
        let emitted = [0, 1, 2].map(|channel| self.emitted_in(channel, length));
        let total: f64 = emitted.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        // A channel by what it sends, and the rest of the random number for the distance.
        let mut rest = f64::from(u) * total;
        let channel = (0..2).find(|&channel| {
            let is_here = rest < emitted[channel];
            rest -= if is_here { 0.0 } else { emitted[channel] };
            is_here
        });
        let channel = channel.unwrap_or(2);
        let share = (rest / emitted[channel]).clamp(0.0, 1.0);
        let sigma_t = f64::from(self.sigma_t[channel]);
        let t = if sigma_t == 0.0 {
            share * length
        } else {
            -f64::ln_1p(share * f64::exp_m1(-sigma_t * length)) / sigma_t
        };
        let distance = (f64::from(segment.start) + t) as f32;
        t.is_finite().then(|| distance.min(segment.end.next_down()))
    }

    fn pdf_emitted(&self, segment: &RaySegment, distance: f32) -> f64 {
        let length = segment.length_f64();
        let t = f64::from(distance) - f64::from(segment.start);
        let (mut here, mut total) = (0.0, 0.0);
        for channel in 0..3 {
            let sigma_t = f64::from(self.sigma_t[channel]);
            here += f64::from(self.source[channel]) * (-sigma_t * t).exp();
            total += self.emitted_in(channel, length);
        }
        here / total
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
