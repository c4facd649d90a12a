//! Rays, and the offset of a ray that leaves a surface.

use glam::Vec3;

/// A piece of a half-line: the points `origin + t·direction` with `t` between `t_min` and `t_max`.
///
/// Each query says whether the ends belong to the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, scene units.
    pub origin: Vec3,
    /// Unit vector; the caller guarantees the length.
    pub direction: Vec3,
    /// Lower end of the range, scene units.
    pub t_min: f32,
    /// Upper end of the range, scene units; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// The ray from `origin` along the unit vector `direction`, without an end.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The ray with another range of distances, scene units.
    #[must_use]
    pub fn with_range(self, t_min: f32, t_max: f32) -> Self {
        Self { t_min, t_max, ..self }
    }

    /// The point at distance `t`, scene units.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Distance of an [offset origin](offset_origin) from its surface, relative to the largest coordinate.
///
/// A point that is rounded once is off its surface by at most `√3/2` roundings, as is the sum that is
/// returned; 4 would do for the shapes of this crate. The rest is margin for hosts, whose own intersections
/// may be good to fewer digits, and for surfaces that coincide.
pub const RAY_OFFSET: f32 = 32.0 * f32::EPSILON;

/// Moves a surface point off its surface, to the side that `direction` points to.
///
/// `position` must be a point of the surface that is rounded once, as those of `SceneGeometry::surface` are;
/// `normal` is the geometric normal. A ray from the result along `direction` does not meet the same planar or
/// convex surface again on the near side. The offset is relative to the coordinates, so that it holds at any
/// scale and far from the origin.
///
/// After Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection" (Ray Tracing
/// Gems, 2019). Their absolute offset near the origin is not needed: the positions here are rounded only
/// once, so that their error vanishes with the coordinates.
#[must_use]
pub fn offset_origin(position: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    // Never zero: the scene's own origin may lie on a surface.
    let distance = (RAY_OFFSET * position.abs().max_element()).max(f32::MIN_POSITIVE);
    let side = if direction.dot(normal) < 0.0 { -distance } else { distance };
    position + normal * side
}
