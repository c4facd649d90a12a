//! Functions of local directions that materials share.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use upbp_estimators::scene::Interface;
use upbp_media::Spectrum;

use crate::sampling::cosine_hemisphere;

/// Floor of [`Bsdf::continuation`](upbp_estimators::scene::Bsdf::continuation): a path that survives a dark
/// surface gains at most a factor of 20.
const MIN_CONTINUATION: f32 = 0.05;

/// Probability of continuation by albedo: no path carries more after the roulette than before the surface.
pub(super) fn continuation_by_albedo(albedo: Spectrum) -> f32 {
    albedo.max_component().clamp(MIN_CONTINUATION, 1.0)
}

/// The indices of refraction on the side of `from` and on the other side.
pub(super) fn indices(from: Vec3, interface: Interface) -> [f32; 2] {
    if from.z > 0.0 { [interface.above, interface.below] } else { [interface.below, interface.above] }
}

/// The mirror image of a direction about z.
pub(super) fn mirrored(direction: Vec3) -> Vec3 {
    Vec3::new(-direction.x, -direction.y, direction.z)
}

/// Density of [`cosine_hemisphere`] on the side of `from`.
pub(super) fn cosine_pdf(from: Vec3, to: Vec3) -> f32 {
    if from.z * to.z > 0.0 { to.z.abs() * FRAC_1_PI } else { 0.0 }
}

/// Draws a direction with the density [`cosine_pdf`].
pub(super) fn sample_cosine(from: Vec3, u: [f32; 2]) -> Vec3 {
    let up = cosine_hemisphere(u);
    Vec3::new(up.x, up.y, up.z.copysign(from.z))
}
