//! The angle of a collision.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use crate::orthonormal_basis;

/// The density of the uniform distribution of directions, per steradian.
pub(super) const UNIFORM: f32 = 0.25 * FRAC_1_PI;

/// The angle of a collision as `1 − cos θ` and `1 + cos θ`, both in `[0, 2]`: the peaks of a phase
/// function need the one that is small there with all its digits.
#[derive(Copy, Clone, Debug)]
pub(super) struct Deflection<T> {
    pub(super) one_minus_cos: T,
    pub(super) one_plus_cos: T,
}

impl Deflection<f32> {
    /// Between two unit vectors. Since `|a ∓ b|² / 2 = 1 ∓ a·b`, no digits cancel; an error of length of
    /// either vector enters squared.
    #[inline]
    pub(super) fn between(before: Vec3, after: Vec3) -> Self {
        Self {
            one_minus_cos: 0.5 * (before - after).length_squared(),
            one_plus_cos: 0.5 * (before + after).length_squared(),
        }
    }

    #[inline]
    pub(super) fn cosine(self) -> f32 {
        0.5 * (self.one_plus_cos - self.one_minus_cos)
    }
}

impl Deflection<f64> {
    /// The unit direction at this angle from `before`, at azimuth `2π · u`.
    #[inline]
    pub(super) fn direction(self, before: Vec3, u: f32) -> Vec3 {
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

/// The angle at the fraction `u` of the uniform distribution, counted from straight back.
#[inline]
pub(super) fn isotropic(u: f32) -> Deflection<f64> {
    let one_plus_cos = 2.0 * f64::from(u);
    Deflection { one_minus_cos: 2.0 - one_plus_cos, one_plus_cos }
}
