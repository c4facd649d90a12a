//! Rough surfaces as many small mirrors: the distribution of their normals (GGX).
//!
//! Sources: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, for the
//! distribution; Heitz, "Understanding the Masking-Shadowing Function", JCGT 3(2), 2014, for masking; Dupuy
//! and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023, for sampling.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// The isotropic Trowbridge-Reitz distribution of normals, with Smith's masking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrowbridgeReitz {
    /// Width of the distribution, positive: the root mean square slope of the small mirrors is of this order.
    pub alpha: f32,
}

impl TrowbridgeReitz {
    /// Density of normals `D`, per steradian of the normal and area of the surface; `normal.z > 0`.
    pub(super) fn density(self, normal: Vec3) -> f32 {
        let alpha2 = self.alpha * self.alpha;
        // tan² θ / α² in terms of sin², which keeps its digits near the pole.
        let sum = (normal.x * normal.x + normal.y * normal.y) / alpha2 + normal.z * normal.z;
        1.0 / (PI * alpha2 * sum * sum)
    }

    /// Smith's Λ: the ratio of masked to visible area.
    fn lambda(self, direction: Vec3) -> f32 {
        let cos2 = direction.z * direction.z;
        let tan2 = (direction.x * direction.x + direction.y * direction.y) / cos2;
        // (√(1 + x) − 1) / 2 without cancellation for small x; the limit of ∞/∞ at the horizon is ∞.
        let x = self.alpha * self.alpha * tan2;
        if x.is_finite() { 0.5 * x / ((1.0 + x).sqrt() + 1.0) } else { f32::INFINITY }
    }

    /// Share of the small mirrors that `direction` sees.
    pub(super) fn masking(self, direction: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(direction))
    }

    /// Share of the small mirrors that both directions see; their heights are correlated.
    pub(super) fn shadowing_masking(self, a: Vec3, b: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(a) + self.lambda(b))
    }

    /// Density of [`sample_visible`](Self::sample_visible): the small mirrors as `from` sees them.
    pub(super) fn visible_density(self, from: Vec3, normal: Vec3) -> f32 {
        self.masking(from) * self.density(normal) * from.dot(normal).abs() / from.z.abs()
    }

    /// Draws a normal that faces `from`, which is above the surface.
    pub(super) fn sample_visible(self, from: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let stretched = Vec3::new(from.x * self.alpha, from.y * self.alpha, from.z).try_normalize()?;
        // A cap of the sphere, uniform by area.
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u[0]).sin_cos();
        let half = Vec3::new(sin * cos_phi, sin * sin_phi, z) + stretched;
        Vec3::new(half.x * self.alpha, half.y * self.alpha, half.z.max(0.0)).try_normalize()
    }
}
