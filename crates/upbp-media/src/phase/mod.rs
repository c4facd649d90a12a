//! Phase functions: the distribution of directions after a collision.
//!
//! All directions are directions of *propagation*, before and after the collision: equal vectors mean
//! straight on. The value is normalised over the sphere, and it is also the density that
//! [`PhaseFunction::sample`] draws with, so that the estimate of a bounce never needs the two apart.
//!
//! Source: `docs/theory.md`, sections 1.1 and 7. Oracles: quadrature over the sphere and histograms.

mod blend;
mod henyey_greenstein;
mod rayleigh;
#[cfg(test)]
mod tests;

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

pub use self::blend::Blend;
pub use self::henyey_greenstein::Asymmetry;
use crate::{MediaError, orthonormal_basis};

/// The density of the uniform distribution of directions, per steradian.
const UNIFORM: f32 = 0.25 * FRAC_1_PI;

/// A phase function, symmetric about the direction of propagation.
#[derive(Clone, Debug, PartialEq)]
pub enum PhaseFunction {
    /// Equal in all directions: `1 / 4π` per steradian.
    Isotropic,
    /// One lobe, forward for positive asymmetry and backward for negative.
    HenyeyGreenstein(Asymmetry),
    /// Scattering by particles much smaller than the wavelength, unpolarised.
    Rayleigh,
    /// A weighted sum of others.
    Blend(Blend),
}

/// A direction drawn from a phase function.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct PhaseSample {
    /// Unit direction of propagation after the collision.
    pub after: Vec3,
    /// Density of the draw per steradian; also the value of the phase function.
    pub pdf: f32,
}

/// The angle of a collision as `1 − cos θ` and `1 + cos θ`, both in `[0, 2]`: the peaks of a phase
/// function need the one that is small there with all its digits.
#[derive(Copy, Clone, Debug)]
struct Deflection<T> {
    one_minus_cos: T,
    one_plus_cos: T,
}

impl Deflection<f32> {
    /// Between two unit vectors. Since `|a ∓ b|² / 2 = 1 ∓ a·b`, no digits cancel; an error of length of
    /// either vector enters squared.
    #[inline]
    fn between(before: Vec3, after: Vec3) -> Self {
        Self {
            one_minus_cos: 0.5 * (before - after).length_squared(),
            one_plus_cos: 0.5 * (before + after).length_squared(),
        }
    }

    /// From the cosine, which is clamped to `[-1, 1]`.
    #[inline]
    fn from_cosine(cos_theta: f32) -> Self {
        let cos_theta = cos_theta.clamp(-1.0, 1.0);
        Self { one_minus_cos: 1.0 - cos_theta, one_plus_cos: 1.0 + cos_theta }
    }
}

impl Deflection<f64> {
    /// The unit direction at this angle from `before`, at azimuth `2π · u`.
    #[inline]
    fn direction(self, before: Vec3, u: f32) -> Vec3 {
        // The product keeps the sine where the cosine rounds to ±1.
        let sin_theta = (self.one_minus_cos * self.one_plus_cos).max(0.0).sqrt();
        let cos_theta = 0.5 * (self.one_plus_cos - self.one_minus_cos);
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        let (tangent, bitangent) = orthonormal_basis(before);
        let across = (cos_phi * tangent + sin_phi * bitangent).as_dvec3();
        // Rounded to single precision once, at the end: a peak of g = 0.99999 is only some 100 roundings
        // wide.
        let after = cos_theta * before.as_dvec3() + sin_theta * across;
        (after * after.length_recip()).as_vec3()
    }
}

impl PhaseFunction {
    /// The Henyey-Greenstein phase function with asymmetry (mean cosine) `g`.
    ///
    /// # Errors
    ///
    /// Unless `-1 < g < 1`.
    pub fn henyey_greenstein(g: f32) -> Result<Self, MediaError> {
        Ok(Self::HenyeyGreenstein(Asymmetry::new(g)?))
    }

    /// A sum of phase functions, with weights that are scaled to add up to one. Blends among the parts
    /// are taken apart; parts below the range of `f32` beside the others are left out.
    ///
    /// # Errors
    ///
    /// If there is no part, or a weight is not finite and positive.
    pub fn blend(parts: Vec<(f32, PhaseFunction)>) -> Result<Self, MediaError> {
        Ok(Self::Blend(Blend::new(parts)?))
    }

    /// The value per steradian between two unit directions of propagation.
    ///
    /// Keeps its digits at the tip of a narrow peak, where a cosine in single precision has none left.
    /// Symmetric in its arguments.
    #[inline]
    #[must_use]
    pub fn eval(&self, before: Vec3, after: Vec3) -> f32 {
        self.value(Deflection::between(before, after))
    }

    /// The value per steradian at the cosine of the angle between the directions of propagation.
    ///
    /// Only as exact as the cosine: prefer [`eval`](Self::eval) for narrow peaks.
    #[inline]
    #[must_use]
    pub fn eval_cosine(&self, cos_theta: f32) -> f32 {
        self.value(Deflection::from_cosine(cos_theta))
    }

    /// Draws the direction after a collision, for a unit direction `before` and two uniform numbers in `[0, 1)`.
    #[inline]
    #[must_use]
    pub fn sample(&self, before: Vec3, u: [f32; 2]) -> PhaseSample {
        let after = self.sample_direction(before, u);
        // From the direction as it was rounded, not from `u`: in a narrow peak the two differ by percents,
        // and whoever evaluates the density later only has the direction.
        PhaseSample { after, pdf: self.eval(before, after) }
    }

    /// Mean cosine of the angle between the directions of propagation, in `(-1, 1)`.
    #[must_use]
    pub fn mean_cosine(&self) -> f32 {
        match self {
            Self::Isotropic | Self::Rayleigh => 0.0,
            Self::HenyeyGreenstein(g) => g.get(),
            Self::Blend(blend) => blend.mean_cosine(),
        }
    }

    #[inline]
    fn value(&self, deflection: Deflection<f32>) -> f32 {
        match self {
            Self::Isotropic => UNIFORM,
            Self::HenyeyGreenstein(g) => henyey_greenstein::value(*g, deflection),
            Self::Rayleigh => rayleigh::value(deflection),
            Self::Blend(blend) => blend.value(deflection),
        }
    }

    #[inline]
    fn sample_direction(&self, before: Vec3, [u_angle, u_azimuth]: [f32; 2]) -> Vec3 {
        let deflection = match self {
            Self::Isotropic => isotropic_deflection(u_angle),
            Self::HenyeyGreenstein(g) => henyey_greenstein::sample(*g, u_angle),
            Self::Rayleigh => rayleigh::sample(u_angle),
            Self::Blend(blend) => {
                let (part, u_azimuth) = blend.choose(u_azimuth);
                return part.sample_direction(before, [u_angle, u_azimuth]);
            }
        };
        deflection.direction(before, u_azimuth)
    }
}

/// The angle at the fraction `u` of the uniform distribution, counted from straight back.
#[inline]
fn isotropic_deflection(u: f32) -> Deflection<f64> {
    let one_plus_cos = 2.0 * f64::from(u);
    Deflection { one_minus_cos: 2.0 - one_plus_cos, one_plus_cos }
}
