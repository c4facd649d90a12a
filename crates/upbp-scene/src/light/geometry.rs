//! Points and directions that lights share.

use std::f32::consts::PI;

use glam::Vec3;
use upbp_estimators::scene::{BoundingSphere, EmitterPoint};
use upbp_media::orthonormal_basis;

use crate::sampling;

/// Area of the disc that parallel light starts from, square scene units.
pub(super) fn disc_area(bounds: &BoundingSphere) -> f32 {
    PI * bounds.radius * bounds.radius
}

/// Draws the start of a ray in `direction`, uniformly over a disc in front of the scene that is as wide as
/// its bounds.
pub(super) fn start_on_disc(bounds: &BoundingSphere, direction: Vec3, u: [f32; 2]) -> Vec3 {
    let across = sampling::disc(u) * bounds.radius;
    let (tangent, bitangent) = orthonormal_basis(direction);
    // Ten per cent outside, so that no rounding puts the start behind a surface on the bounds.
    let back = direction * (1.1 * bounds.radius);
    bounds.centre - back + tangent * across.x + bitangent * across.y
}

/// A point outside of the scene in the direction of an infinite light.
pub(super) fn beyond(bounds: &BoundingSphere, receiver: Vec3, towards_light: Vec3) -> EmitterPoint {
    let distance = 2.0 * bounds.radius + receiver.distance(bounds.centre);
    EmitterPoint { position: receiver + towards_light * distance, normal: -towards_light }
}

/// Unit direction and distance from one point to another; none if they coincide.
pub(super) fn direction_and_distance(from: Vec3, to: Vec3) -> Option<(Vec3, f32)> {
    let between = to - from;
    let distance = between.length();
    (distance > 0.0 && distance.is_finite()).then(|| (between / distance, distance))
}
