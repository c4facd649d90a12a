//! The sphere.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec3, Vec3};

use super::error::{GeometryError, finite};

/// A sphere; its normal points away from the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    centre: Vec3,
    radius: f32,
}

impl Sphere {
    /// The sphere around `centre`; `radius` in scene units must be positive.
    pub fn new(centre: Vec3, radius: f32) -> Result<Self, GeometryError> {
        let centre = finite(centre, "the centre of a sphere")?;
        if !radius.is_finite() {
            return Err(GeometryError::NonFinite { what: "the radius of a sphere" });
        }
        if radius <= 0.0 {
            return Err(GeometryError::Degenerate { what: "a sphere" });
        }
        Ok(Self { centre, radius })
    }

    pub(super) fn translated(self, by: Vec3) -> Self {
        Self { centre: self.centre + by, ..self }
    }

    /// The centre.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// The radius, scene units.
    #[must_use]
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    /// Volume, cubic scene units.
    #[must_use]
    pub fn volume(&self) -> f32 {
        self.area() * self.radius / 3.0
    }

    /// A point distributed uniformly over the surface, and its normal; `u` in `[0, 1)²`.
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        let y = 1.0 - 2.0 * u[0];
        // Not 1 − y², which cancels at the poles.
        let ring = (4.0 * u[0] * (1.0 - u[0])).max(0.0).sqrt();
        let (sin, cos) = (TAU * u[1]).sin_cos();
        let normal = Vec3::new(ring * cos, y, ring * sin).normalize();
        (self.on_surface(normal.as_dvec3()), normal)
    }

    /// The random numbers with which [`sample_area`](Self::sample_area) draws the point in the direction of
    /// `point` from the centre.
    #[must_use]
    pub fn area_coordinates(&self, point: Vec3) -> [f32; 2] {
        let normal = (point.as_dvec3() - self.centre.as_dvec3()).normalize_or(DVec3::Y).as_vec3();
        let below_pole = 0.5 * (1.0 - normal.y);
        [below_pole, (normal.z.atan2(normal.x) / TAU).rem_euclid(1.0)]
    }

    /// Whether `point` lies strictly inside.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        let radius = f64::from(self.radius);
        (point.as_dvec3() - self.centre.as_dvec3()).length_squared() < radius * radius
    }

    /// The least and the greatest coordinates, rounded outwards.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        ((self.centre - self.radius).map(f32::next_down), (self.centre + self.radius).map(f32::next_up))
    }

    /// Distances at which the line enters and leaves the sphere, ascending.
    ///
    /// In double precision: with single precision a small sphere far away is missed, and the roots of a
    /// large one are off by more than the offset of secondary rays.
    #[inline(always)]
    pub(super) fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<[f64; 2]> {
        let direction = direction.as_dvec3();
        let from_centre = origin.as_dvec3() - self.centre.as_dvec3();
        let radius = f64::from(self.radius);
        let a = direction.length_squared();
        let half_b = -from_centre.dot(direction);
        // Distance of the line from the centre, instead of b² − 4ac, which cancels far away
        // (Haines, Günther, Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection").
        let nearest = from_centre + direction * (half_b / a);
        let discriminant = radius * radius - nearest.length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let q = half_b + (discriminant * a).sqrt().copysign(half_b);
        let length = from_centre.length();
        let c = (length - radius) * (length + radius);
        let (first, second) = (q / a, if q == 0.0 { 0.0 } else { c / q });
        Some([first.min(second), first.max(second)])
    }

    /// The point of the surface in the direction `normal`, rounded once.
    pub(super) fn on_surface(&self, normal: DVec3) -> Vec3 {
        (self.centre.as_dvec3() + normal.normalize() * f64::from(self.radius)).as_vec3()
    }

    /// Azimuth and polar angle around the y axis, both mapped to `[0, 1]`.
    pub(super) fn uv(normal: Vec3) -> [f32; 2] {
        let azimuth = normal.z.atan2(normal.x) * (0.5 * FRAC_1_PI);
        [azimuth.rem_euclid(1.0), normal.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI]
    }
}
