//! The parallelogram.

use glam::{DVec3, Vec3};

use super::error::{GeometryError, finite};

/// A parallelogram, the points `origin + u·edge_u + v·edge_v` with `u` and `v` in `[0, 1]`.
///
/// Its normal is `edge_u × edge_v`, normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    origin: Vec3,
    edge_u: Vec3,
    edge_v: Vec3,
    normal: Vec3,
    area: f32,
    plane: Plane,
}

/// The plane of a quad with its coordinates, in double precision, as intersections ask for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// `edge_u × edge_v`.
    pub(super) normal: DVec3,
    /// The map from points relative to the corner to coordinates on the quad, per scene unit.
    pub(super) to_uv: [DVec3; 2],
}

impl Quad {
    /// The parallelogram at `origin` with two edges, in scene units, which must not be parallel.
    pub fn new(origin: Vec3, edge_u: Vec3, edge_v: Vec3) -> Result<Self, GeometryError> {
        let origin = finite(origin, "the origin of a quad")?;
        let edge_u = finite(edge_u, "the first edge of a quad")?;
        let edge_v = finite(edge_v, "the second edge of a quad")?;
        // Double precision: the square of a small edge underflows in single precision.
        let cross = edge_u.as_dvec3().cross(edge_v.as_dvec3());
        let area = cross.length();
        if area <= 1e-7 * edge_u.as_dvec3().length() * edge_v.as_dvec3().length() {
            return Err(GeometryError::Degenerate { what: "a quad" });
        }
        let scale = cross.length_squared().recip();
        let to_uv = [edge_v.as_dvec3().cross(cross) * scale, cross.cross(edge_u.as_dvec3()) * scale];
        let plane = Plane { normal: cross, to_uv };
        Ok(Self { origin, edge_u, edge_v, normal: (cross / area).as_vec3(), area: area as f32, plane })
    }

    pub(super) fn translated(self, by: Vec3) -> Self {
        Self { origin: self.origin + by, ..self }
    }

    /// The corner with `u = v = 0`.
    #[must_use]
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// The edge along which `u` grows.
    #[must_use]
    pub fn edge_u(&self) -> Vec3 {
        self.edge_u
    }

    /// The edge along which `v` grows.
    #[must_use]
    pub fn edge_v(&self) -> Vec3 {
        self.edge_v
    }

    /// The unit normal.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    pub(super) fn plane(&self) -> &Plane {
        &self.plane
    }

    /// Surface area, square scene units.
    #[must_use]
    pub fn area(&self) -> f32 {
        self.area
    }

    /// A point distributed uniformly over the surface, and the normal; `u` in `[0, 1)²`.
    #[inline]
    #[must_use]
    pub fn sample_area(&self, u: [f32; 2]) -> (Vec3, Vec3) {
        (self.point(u).as_vec3(), self.normal)
    }

    /// The point with coordinates in `[0, 1]`.
    #[inline]
    pub(super) fn point(&self, [u, v]: [f32; 2]) -> DVec3 {
        self.origin.as_dvec3() + self.edge_u.as_dvec3() * u as f64 + self.edge_v.as_dvec3() * v as f64
    }

    /// A vector across the quad, along its unit normal.
    pub(super) fn across(&self) -> DVec3 {
        self.plane.normal
    }

    /// The random numbers with which [`sample_area`](Self::sample_area) draws `point`, a point of the quad.
    #[must_use]
    pub fn area_coordinates(&self, point: Vec3) -> [f32; 2] {
        let from_corner = point.as_dvec3() - self.origin.as_dvec3();
        self.plane.to_uv.map(|row| row.dot(from_corner) as f32)
    }

    /// The least and the greatest coordinates, rounded outwards.
    #[must_use]
    pub fn aabb(&self) -> (Vec3, Vec3) {
        let [u, v] = [self.edge_u, self.edge_v].map(Vec3::as_dvec3);
        let origin = self.origin.as_dvec3();
        let min = origin + u.min(v).min(u + v).min(DVec3::ZERO);
        let max = origin + u.max(v).max(u + v).max(DVec3::ZERO);
        (min.as_vec3().map(f32::next_down), max.as_vec3().map(f32::next_up))
    }

    /// The distance at which the line meets the quad, and the coordinates of that point on the quad.
    ///
    /// In double precision, so that neighbours have no gap beyond the difference of their corners.
    #[inline(always)]
    pub(super) fn intersect(&self, origin: Vec3, direction: Vec3) -> Option<(f64, [f32; 2])> {
        let Plane { normal, to_uv } = &self.plane;
        let direction = direction.as_dvec3();
        let to_corner = self.origin.as_dvec3() - origin.as_dvec3();
        let cosine = direction.dot(*normal);
        let height = to_corner.dot(*normal);
        // A ray that starts in the plane does not meet it.
        let zero = 1e-26 * to_corner.length_squared() * normal.length_squared();
        if cosine == 0.0 || height * height <= zero {
            return None;
        }
        let t = height / cosine;
        let from_corner = direction * t - to_corner;
        let [u, v] = to_uv.map(|row| row.dot(from_corner));
        let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
        inside.then_some((t, [u as f32, v as f32]))
    }
}
