//! Phase functions: the distribution of directions after a collision.
//!
//! All directions are directions of *propagation*, before and after the collision: equal vectors mean
//! straight on. The value is normalised over the sphere, and it is also the density that
//! [`PhaseFunction::sample`] draws with, so that the estimate of a bounce never needs the two apart.
//!
//! Source: `docs/theory.md`, sections 1.1 and 7. Oracles: quadrature over the sphere and histograms.

mod blend;
mod deflection;
mod henyey_greenstein;
mod rayleigh;
#[cfg(test)]
mod tests;

use glam::Vec3;

pub use self::blend::Blend;
use self::deflection::{Deflection, UNIFORM, isotropic};
pub use self::henyey_greenstein::Asymmetry;
use crate::MediaError;

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

    /// Draws the direction after a collision, for a unit direction `before` and two uniform numbers in `[0,
    /// 1)`.
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
            Self::Isotropic => isotropic(u_angle),
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
