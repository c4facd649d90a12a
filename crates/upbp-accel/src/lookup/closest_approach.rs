//! The closest approach of a ray and a segment.
//!
//! Two beams almost never meet. Estimators therefore blur along their common perpendicular: a segment counts
//! where the ray passes it within a radius. Source: `docs/theory.md`, section 2.6. Oracle:
//! `tests::agrees_with_double_precision`.

use glam::Vec3;

use crate::ray::Ray;

/// Below this `sin²θ` two beams count as parallel. Estimators carry `1/sin θ`, so the weights must
/// rule the technique out under the same threshold, or they stop summing to one.
pub const PARALLEL_SIN2: f32 = 1e-10;

/// A piece of a line: the points `origin + s·direction` with `s` in `[start, end)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The point from which distances are measured, scene units.
    pub origin: Vec3,
    /// Unit vector; the caller guarantees the length.
    pub direction: Vec3,
    /// Distance at which the segment starts, scene units.
    pub start: f32,
    /// Distance at which it ends, scene units; finite.
    pub end: f32,
}

impl Segment {
    /// The point at distance `s` from the origin.
    #[must_use]
    pub fn at(&self, s: f32) -> Vec3 {
        self.origin + self.direction * s
    }

    /// Whether all numbers are finite and there is anything between the ends.
    pub(super) fn is_usable(&self) -> bool {
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.start.is_finite()
            && self.end.is_finite()
            && self.start < self.end
    }
}

/// The nearest points of a ray and a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestApproach {
    /// Distance along the ray, scene units, in `[t_min, t_max)`.
    pub t_ray: f32,
    /// Distance along the segment from its origin, scene units, in `[start, end)`.
    pub t_segment: f32,
    /// Distance between the two points, scene units, in `[0, radius)`.
    pub distance: f32,
    /// Sine of the angle between the directions, in `(0, 1]`.
    pub sin_theta: f32,
}

/// Finds the nearest points of `ray` and `segment`, if they are less than `radius` apart and inside both.
///
/// `None` for parallel lines ([`PARALLEL_SIN2`]) and for closest points beyond an end. The half-open ranges
/// make the pieces of a split beam add up: a point between two pieces belongs to exactly one.
#[must_use]
#[inline]
pub fn closest_approach(ray: &Ray, segment: &Segment, radius: f32) -> Option<ClosestApproach> {
    let (a, b) = (ray.direction, segment.direction);
    // The difference first: both origins may be far from the origin of the scene.
    let between = segment.origin - ray.origin;
    // The cross-product form: the one that divides by the product of the directions fails for perpendicular
    // lines.
    let normal = a.cross(b);
    let sin2 = normal.length_squared();
    let inverse_sin2 = sin2.recip();
    let t_ray = between.cross(b).dot(normal) * inverse_sin2;
    let t_segment = between.cross(a).dot(normal) * inverse_sin2;
    let distance = between.dot(normal).abs() * inverse_sin2.sqrt();
    let inside = (ray.t_min..ray.t_max).contains(&t_ray) && (segment.start..segment.end).contains(&t_segment);
    // Parallel lines gave infinite numbers or NaN.
    (sin2 >= PARALLEL_SIN2 && inside && distance < radius).then(|| ClosestApproach {
        t_ray,
        t_segment,
        distance,
        sin_theta: sin2.sqrt().min(1.0),
    })
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

    use super::*;

    /// Uniform in `[−1, 1)`.
    fn uniform(random: &mut Xoshiro256PlusPlus) -> f32 {
        (random.next_u64() >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    }

    fn cube(random: &mut Xoshiro256PlusPlus) -> Vec3 {
        Vec3::new(uniform(random), uniform(random), uniform(random))
    }

    fn line(origin: Vec3, direction: Vec3) -> (Ray, Segment) {
        let ray = Ray::new(origin, direction).with_range(-1e9, 1e9);
        (ray, Segment { origin, direction, start: -1e9, end: 1e9 })
    }

    /// Normal equations in double precision; needs no cross products.
    fn oracle(ray: &Ray, segment: &Segment) -> (f64, f64, f64, f64) {
        let (a, b) = (ray.direction.as_dvec3(), segment.direction.as_dvec3());
        let w = segment.origin.as_dvec3() - ray.origin.as_dvec3();
        let (aa, bb, ab) = (a.dot(a), b.dot(b), a.dot(b));
        let determinant = aa * bb - ab * ab;
        let t = (w.dot(a) * bb - w.dot(b) * ab) / determinant;
        let s = (w.dot(a) * ab - w.dot(b) * aa) / determinant;
        let between: DVec3 = w + b * s - a * t;
        (t, s, between.length(), (determinant / (aa * bb)).sqrt())
    }

    #[test]
    fn agrees_with_double_precision() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(31);
        for angle in [std::f32::consts::FRAC_PI_2, 1.5, 1.0, 0.1, 1e-2, 1e-3] {
            for offset in [0.0, 1e2, 1e5] {
                for _ in 0..2000 {
                    let place = Vec3::splat(offset);
                    let direction = cube(&mut random).normalize_or(Vec3::X);
                    let turned = Quat::from_axis_angle(direction.any_orthonormal_vector(), angle) * direction;
                    let (ray, _) = line(place + cube(&mut random), direction);
                    let (_, segment) = line(place + cube(&mut random), turned.normalize());
                    let (t, s, distance, sin) = oracle(&ray, &segment);
                    let found = closest_approach(&ray, &segment, 10.0).unwrap();
                    // One rounding turns a direction by ε and the common perpendicular by ε/sin θ.
                    let tolerance = 1e-6 * ((1.0 + t.abs()) / sin + distance / (sin * sin));
                    assert!((f64::from(found.t_ray) - t).abs() < tolerance, "{} {t}", found.t_ray);
                    assert!((f64::from(found.t_segment) - s).abs() < tolerance, "{} {s}", found.t_segment);
                    assert!((f64::from(found.distance) - distance).abs() < 1e-6 / sin);
                    assert!((f64::from(found.sin_theta) - sin).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn is_the_nearest_pair() {
        let (ray, _) = line(Vec3::new(0.0, 0.0, -2.0), Vec3::Z);
        let (_, segment) = line(Vec3::new(-3.0, 0.25, 1.0), Vec3::X);
        let found = closest_approach(&ray, &segment, 0.5).unwrap();
        let expected = ClosestApproach { t_ray: 3.0, t_segment: 3.0, distance: 0.25, sin_theta: 1.0 };
        assert_eq!(found, expected);
        assert!(closest_approach(&ray, &segment, 0.25).is_none(), "the radius is excluded");
        let ends = |start, end| closest_approach(&ray, &Segment { start, end, ..segment }, 0.5).is_some();
        assert!(ends(3.0, 4.0) && !ends(2.0, 3.0), "half open");
        assert!(closest_approach(&ray.with_range(3.0, 4.0), &segment, 0.5).is_some());
        assert!(closest_approach(&ray.with_range(2.0, 3.0), &segment, 0.5).is_none());
    }

    #[test]
    fn parallel_lines_have_none() {
        let direction = Vec3::new(0.6, 0.0, 0.8);
        let (ray, segment) = line(Vec3::ZERO, direction);
        assert!(closest_approach(&ray, &segment, 1.0).is_none());
        let (_, opposite) = line(Vec3::Y * 0.5, -direction);
        assert!(closest_approach(&ray, &opposite, 1.0).is_none());
        // Those that meet at less than the threshold count as parallel, however far apart.
        let (_, almost) = line(Vec3::Y * 0.5, (direction + Vec3::X * 8e-6).normalize());
        assert!(ray.direction.cross(almost.direction).length_squared() > 0.0);
        assert!(closest_approach(&ray, &almost, 1.0).is_none());
        // Just above the threshold there is one, and it is finite.
        let (_, tilted) = line(Vec3::Y * 0.5, (direction + Vec3::X * 4e-5).normalize());
        let found = closest_approach(&ray, &tilted, 1.0).unwrap();
        assert!(found.t_ray.is_finite() && found.distance <= 1.0 && found.sin_theta > 1e-5);
    }
}
