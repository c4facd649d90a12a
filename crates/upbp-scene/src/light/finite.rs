//! The way from a point to a light that is somewhere.

use glam::Vec3;

/// Unit direction and distance from one point to another; none if they coincide.
pub(super) fn direction_and_distance(from: Vec3, to: Vec3) -> Option<(Vec3, f32)> {
    let between = to - from;
    let distance = between.length();
    (distance > 0.0 && distance.is_finite()).then(|| (between / distance, distance))
}
