//! The test of a ray against triangles, without cracks between neighbours.
//!
//! The vertices are sheared so that the ray becomes an axis; what remains is a point-in-triangle test in the
//! plane, in which neighbours compute the same number for their common edge (Woop, Benthin, Wald,
//! "Watertight Ray/Triangle Intersection", JCGT 2013). A point exactly on an edge or a corner is decided by
//! symbolic perturbation: it counts as moved by (ε, ε²). So a line crosses a closed surface an even
//! number of times, always, which is what lets a stack of media trust it.

use glam::{DVec2, DVec3, Vec2, Vec3};

/// A ray, prepared for tests against triangles.
pub(super) struct RayShear {
    origin: Vec3,
    direction: DVec3,
    axes: [usize; 3],
    slope: Vec2,
}

/// The point in which a line meets a triangle.
pub(super) struct TriangleHit {
    /// Distance along the ray; may be negative.
    pub(super) t: f64,
    /// Weights of the second and third corner.
    pub(super) weights: [f32; 2],
}

impl RayShear {
    /// The axes of the sheared space; the last is the one along which the direction is longest.
    pub(super) fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// Shift of the first two axes per unit along the last.
    pub(super) fn slope(&self) -> Vec2 {
        self.slope
    }

    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let slope = Vec2::new(direction[axes[0]], direction[axes[1]]) / direction[z];
        Self { origin, direction: direction.as_dvec3(), axes, slope }
    }

    /// Projects a vertex, relative to the origin, along the ray.
    #[inline]
    fn project(&self, from_origin: Vec3) -> Vec2 {
        let [x, y, z] = self.axes;
        Vec2::new(from_origin[x], from_origin[y]) - self.slope * from_origin[z]
    }

    /// Finds the point in which the line meets the triangle, from either side.
    #[inline]
    pub(super) fn intersect(&self, corners: [Vec3; 3]) -> Option<TriangleHit> {
        let [a, b, c] = corners;
        let (a, b, c) =
            (self.project(a - self.origin), self.project(b - self.origin), self.project(c - self.origin));
        // Rounding is monotonic: a product of two differences can come out as zero, but not with the
        // wrong sign. So mixed signs are certain already in single precision.
        let (u, v, w) = (c.perp_dot(b), a.perp_dot(c), b.perp_dot(a));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        self.confirm(corners, [a, b, c])
    }

    /// Decides in double precision, where signs are exact, what single precision did not exclude.
    fn confirm(&self, corners: [Vec3; 3], projected: [Vec2; 3]) -> Option<TriangleHit> {
        let [a, b, c] = projected;
        let (a, b, c) = (a.as_dvec2(), b.as_dvec2(), c.as_dvec2());
        let (u, v, w) = (c.perp_dot(b), a.perp_dot(c), b.perp_dot(a));
        let side = is_positive(u, c, b);
        if is_positive(v, a, c) != side || is_positive(w, b, a) != side {
            return None;
        }
        let sum = u + v + w;

        // The distance from the plane rather than from the sheared depths: its sign tells reliably on which
        // side the origin is, however slanted the triangle.
        let origin = self.origin.as_dvec3();
        let [p, q, r] = corners;
        let (p, q, r) = (p.as_dvec3() - origin, q.as_dvec3() - origin, r.as_dvec3() - origin);
        let normal = (q - p).cross(r - p);
        let height = p.dot(normal);
        let cosine = self.direction.dot(normal);
        let zero = 1e-26 * p.length_squared() * normal.length_squared();
        if sum == 0.0 || cosine == 0.0 || height * height <= zero {
            return None;
        }
        // Seen edge-on the quotient may leave the triangle. Not `clamp`, which panics on NaN.
        let length2 = self.direction.length_squared();
        let (p, q, r) = (p.dot(self.direction), q.dot(self.direction), r.dot(self.direction));
        let nearest = p.min(q).min(r) / length2;
        let farthest = p.max(q).max(r) / length2;
        let t = (height / cosine).max(nearest).min(farthest);
        Some(TriangleHit { t, weights: [(v / sum) as f32, (w / sum) as f32] })
    }
}

/// The sign of the edge function `from × to`, with ties broken as if the point were moved by (ε, ε²).
fn is_positive(value: f64, from: DVec2, to: DVec2) -> bool {
    if value != 0.0 {
        value > 0.0
    } else if from.y != to.y {
        from.y > to.y
    } else {
        to.x > from.x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Octahedron with corners on integers, so that rays along the grid meet corners and edges exactly.
    fn octahedron() -> Vec<[Vec3; 3]> {
        let mut triangles = Vec::new();
        for x in [-1.0, 1.0] {
            for y in [-1.0, 1.0] {
                for z in [-1.0, 1.0] {
                    let mut corners = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
                    if x * y * z < 0.0 {
                        corners.swap(0, 1);
                    }
                    triangles.push(corners);
                }
            }
        }
        triangles
    }

    #[test]
    fn lines_through_edges_and_corners_cross_an_even_number_of_times() {
        let triangles = octahedron();
        let directions = [
            Vec3::X,
            -Vec3::Y,
            Vec3::Z,
            Vec3::ONE.normalize(),
            Vec3::new(1.0, 1.0, 0.0).normalize(),
            Vec3::new(0.0, -1.0, 1.0).normalize(),
            Vec3::new(0.3, 0.2, -0.9).normalize(),
        ];
        for direction in directions {
            for i in -8..=8_i8 {
                for j in -8..=8_i8 {
                    for k in [-3.0, 3.0] {
                        let origin = Vec3::new(f32::from(i) / 4.0, f32::from(j) / 4.0, k);
                        let shear = RayShear::new(origin, direction);
                        let hits = triangles.iter().filter_map(|&corners| shear.intersect(corners)).count();
                        assert!(hits == 0 || hits == 2, "{hits} crossings from {origin} along {direction}");
                    }
                }
            }
        }
    }

    #[test]
    fn weights_and_distance_agree() {
        let corners = [Vec3::new(0.0, 0.0, 2.0), Vec3::new(4.0, 0.0, 2.0), Vec3::new(0.0, 4.0, 6.0)];
        let hit = RayShear::new(Vec3::new(1.0, 1.0, 0.0), Vec3::Z).intersect(corners).unwrap();
        assert!((hit.t - 3.0).abs() < 1e-6);
        assert!((hit.weights[0] - 0.25).abs() < 1e-6 && (hit.weights[1] - 0.25).abs() < 1e-6);
    }
}
