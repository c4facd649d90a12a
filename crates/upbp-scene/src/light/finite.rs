//! The way from a point to a light that is somewhere.

use glam::Vec3;
use upbp_estimators::scene::{EmitterPoint, HitDensities, Incident};

/// Unit direction and distance from one point to another; none if they coincide.
pub(super) fn direction_and_distance(from: Vec3, to: Vec3) -> Option<(Vec3, f32)> {
    let between = to - from;
    let distance = between.length();
    (distance > 0.0 && distance.is_finite()).then(|| (between / distance, distance))
}

/// The connection of a receiver to a point of a light that can be hit, with the densities of a hit there;
/// none if the point would not be chosen.
pub(super) fn incident(
    point: EmitterPoint,
    towards_light: Vec3,
    distance: f32,
    seen: &HitDensities,
) -> Option<Incident> {
    (seen.pdf_incident > 0.0).then_some(Incident {
        point,
        towards_light,
        distance,
        radiance: seen.radiance,
        pdf: seen.pdf_incident,
        pdf_position: seen.pdf_position,
        pdf_direction: seen.pdf_direction,
    })
}
