//! Surfaces in closed form.

use std::f64::consts::PI;

use glam::DVec3;

/// A surface without thickness.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A sphere.
    Sphere {
        /// Centre.
        centre: DVec3,
        /// Radius.
        radius: f64,
    },
    /// `corner + u·edges[0] + v·edges[1]`, the edges perpendicular; the normal is their cross product.
    Rectangle {
        /// One corner.
        corner: DVec3,
        /// The two edges at the corner.
        edges: [DVec3; 2],
    },
}

impl Shape {
    /// A rectangle from a corner and the edges there.
    pub fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Self {
        Self::Rectangle { corner: corner.into(), edges: [u.into(), v.into()] }
    }

    /// A sphere.
    pub fn sphere(centre: [f64; 3], radius: f64) -> Self {
        Self::Sphere { centre: centre.into(), radius }
    }

    /// Geometric normal at a point of the surface, of unit length.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { centre, .. } => (point - centre).normalize(),
            Self::Rectangle { edges: [u, v], .. } => u.cross(*v).normalize(),
        }
    }

    /// Distances at which the line meets the surface.
    pub fn roots(&self, origin: DVec3, direction: DVec3) -> [Option<f64>; 2] {
        match self {
            Self::Sphere { centre, radius } => {
                let between = origin - centre;
                let half = between.dot(direction);
                // The discriminant from the distance to the line: nothing cancels for a far origin.
                let across = between - half * direction;
                let discriminant = radius * radius - across.length_squared();
                if discriminant < 0.0 {
                    return [None; 2];
                }
                let root = discriminant.sqrt();
                [Some(-half - root), Some(-half + root)]
            }
            Self::Rectangle { corner, edges } => {
                let normal = self.normal(*corner);
                let t = (corner - origin).dot(normal) / direction.dot(normal);
                let [u, v] = Self::coordinates(*corner, edges, origin + t * direction);
                let inside = t.is_finite() && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
                [inside.then_some(t), None]
            }
        }
    }

    /// Position of a point along the edges of a rectangle, in `[0, 1]²` inside.
    pub fn coordinates(corner: DVec3, edges: &[DVec3; 2], point: DVec3) -> [f64; 2] {
        edges.map(|edge| (point - corner).dot(edge) / edge.length_squared())
    }

    /// The nearest point of the surface's sphere or plane.
    pub fn snap(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { centre, radius } => centre + (point - centre).normalize() * *radius,
            Self::Rectangle { corner, .. } => {
                let normal = self.normal(point);
                point - (point - corner).dot(normal) * normal
            }
        }
    }

    /// Distance of a point from the surface.
    pub fn distance(&self, point: DVec3) -> f64 {
        match self {
            Self::Sphere { .. } => (point - self.snap(point)).length(),
            Self::Rectangle { corner, edges } => {
                let [u, v] = Self::coordinates(*corner, edges, point).map(|x| x.clamp(0.0, 1.0));
                (point - (corner + u * edges[0] + v * edges[1])).length()
            }
        }
    }

    /// Whether a point is inside of a sphere.
    pub fn contains(&self, point: DVec3) -> bool {
        matches!(self, Self::Sphere { centre, radius } if (point - centre).length() < *radius)
    }

    /// Area of the surface.
    pub fn area(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Rectangle { edges: [u, v], .. } => u.cross(*v).length(),
        }
    }
}
