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

/// Shares of the small mirrors that directions see, per area of the surface as they see it.
pub(super) struct Visibility {
    /// `G_1(from) / |from_z|`.
    pub(super) from: f32,
    /// `G_1(to) / |to_z|`.
    pub(super) to: f32,
    /// `G(from, to) / |from_z to_z|`: that which both see; their heights are correlated.
    pub(super) both: f32,
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

    /// All that is known of two directions.
    pub(super) fn visibility(self, from: Vec3, to: Vec3) -> Visibility {
        let [of_from, of_to] = [from, to].map(|direction| self.lambda(direction));
        Visibility {
            from: 1.0 / ((1.0 + of_from) * from.z.abs()),
            to: 1.0 / ((1.0 + of_to) * to.z.abs()),
            both: 1.0 / ((1.0 + of_from + of_to) * (from.z * to.z).abs()),
        }
    }

    /// Draws a normal that faces `from`, which is above the surface: with the density
    /// `D(normal) |from·normal|` times the [visibility](Self::visibility) of `from`.
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
