//! Rayleigh scattering of unpolarised light.
//!
//! Sampling by inversion: Frisvad, "Importance sampling the Rayleigh phase function", JOSA A 28(12), 2011.

use std::f32::consts::FRAC_1_PI;

use super::deflection::Deflection;

/// `3 (1 + cos² θ) / 16π` per steradian.
#[inline]
pub(super) fn value(deflection: Deflection<f32>) -> f32 {
    let cos_theta = deflection.cosine();
    3.0 / 16.0 * FRAC_1_PI * (1.0 + cos_theta * cos_theta)
}

/// The angle at the fraction `u` of the distribution, counted from straight back.
#[inline]
pub(super) fn sample(u: f32) -> Deflection<f64> {
    // The distribution function is (μ³ + 3μ + 4) / 8; the cubic has one real root, by Cardano:
    let half = 4.0 * f64::from(u) - 2.0;
    let root = (half.abs() + (half * half + 1.0).sqrt()).cbrt();
    let cos_theta = (root - root.recip()).copysign(half).clamp(-1.0, 1.0);
    Deflection { one_minus_cos: 1.0 - cos_theta, one_plus_cos: 1.0 + cos_theta }
}
