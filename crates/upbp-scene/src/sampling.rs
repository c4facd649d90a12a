//! Maps from the unit square to discs, hemispheres, spheres and cones.
//!
//! Each map preserves area, so that a density is a constant over the area of the target. Sources: Shirley
//! and Chiu, "A Low Distortion Map Between Disk and Square", JGT 2(3), 1997, for the disc; Archimedes for the
//! rest: the area of a belt of the sphere is proportional to its height.

use std::f32::consts::{FRAC_PI_4, TAU};

use glam::{DVec3, Vec2, Vec3};
use upbp_accel::Sphere;
use upbp_media::orthonormal_basis;

/// The maps whose formulas both precisions have in common.
macro_rules! maps {
    ($real:ident, $Vec2:ident, $Vec3:ident) => {
        /// A point of the unit disc, uniform by area.
        pub(crate) fn disc(u: [$real; 2]) -> $Vec2 {
            use std::$real::consts::{FRAC_PI_2, FRAC_PI_4};
            let offset = $Vec2::from(u) * 2.0 - $Vec2::ONE;
            if offset == $Vec2::ZERO {
                return $Vec2::ZERO;
            }
            let (radius, phi) = if offset.x.abs() > offset.y.abs() {
                (offset.x, FRAC_PI_4 * (offset.y / offset.x))
            } else {
                (offset.y, FRAC_PI_2 - FRAC_PI_4 * (offset.x / offset.y))
            };
            radius * $Vec2::from_angle(phi)
        }

        /// A direction around z, uniform over the cone with `1 − cos θ_max = height`.
        fn cone_local(height: $real, u: [$real; 2]) -> $Vec3 {
            // The distance from the pole keeps its digits in a narrow cone, where the cosine has none.
            let below_pole = height * u[0];
            let sin_theta = (below_pole * (2.0 - below_pole)).max(0.0).sqrt();
            let (sin_phi, cos_phi) = (std::$real::consts::TAU * u[1]).sin_cos();
            $Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - below_pole)
        }
    };
}

maps!(f32, Vec2, Vec3);

/// The pair of numbers with which [`disc`] gives a point; `None` outside of the disc.
pub(crate) fn disc_inverse(point: Vec2) -> Option<[f32; 2]> {
    let radius = point.length();
    if radius == 0.0 {
        return Some([0.5; 2]);
    }
    let offset = if point.x.abs() > point.y.abs() {
        let x = radius.copysign(point.x);
        Vec2::new(x, x * (point.y / point.x).atan() / FRAC_PI_4)
    } else {
        let y = radius.copysign(point.y);
        Vec2::new(y * (point.x / point.y).atan() / FRAC_PI_4, y)
    };
    (radius <= 1.0).then(|| (0.5 * (offset + Vec2::ONE)).to_array())
}

/// A direction of the hemisphere around +z with density `cos θ / π`.
pub(crate) fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let p = disc(u);
    // On the rim the height would vanish, and with it the density that others divide by.
    Vec3::new(p.x, p.y, (1.0 - p.length_squared()).max(1e-10).sqrt()).normalize()
}

/// The pair of numbers with which [`cosine_hemisphere`] gives a direction; `None` below the hemisphere.
pub(crate) fn cosine_hemisphere_inverse(direction: Vec3) -> Option<[f32; 2]> {
    (direction.z > 0.0).then(|| disc_inverse(direction.truncate().clamp_length_max(1.0))).flatten()
}

/// The pair of numbers with which [`sphere`] gives a direction.
pub(crate) fn sphere_inverse(direction: Vec3) -> [f32; 2] {
    cone_local_inverse(2.0, direction)
}

/// The pair of numbers with which [`fine::cone`] gives a direction; the first is above 1 outside of the cone.
pub(crate) fn cone_inverse(axis: Vec3, height: f32, direction: Vec3) -> [f32; 2] {
    cone_local_inverse(height, to_local(axis, direction))
}

/// Whether `direction` is within the cone: whether the first number of [`cone_inverse`] is at most 1.
pub(crate) fn is_in_cone(axis: Vec3, height: f32, direction: Vec3) -> bool {
    below_pole(to_local(axis, direction)) / height <= 1.0
}

fn cone_local_inverse(height: f32, direction: Vec3) -> [f32; 2] {
    [below_pole(direction) / height, (direction.y.atan2(direction.x) / TAU).rem_euclid(1.0)]
}

/// `1 − cos θ` of a direction, with its digits around +z.
fn below_pole(direction: Vec3) -> f32 {
    if direction.z > 0.0 {
        direction.truncate().length_squared() / (1.0 + direction.z)
    } else {
        1.0 - direction.z
    }
}

/// Turns a direction of the world into one of the frame in which `axis` is z.
pub(crate) fn to_local(axis: Vec3, direction: Vec3) -> Vec3 {
    let (tangent, bitangent) = orthonormal_basis(axis);
    Vec3::new(direction.dot(tangent), direction.dot(bitangent), direction.dot(axis))
}

/// A direction, uniform over the sphere: density `1 / 4π`.
pub(crate) fn sphere(u: [f32; 2]) -> Vec3 {
    cone_local(2.0, u)
}

/// The cone of directions in which `receiver` sees a sphere: its axis, and one minus the cosine of its half
/// angle. `None` if it is inside, or so near that the cone is almost a hemisphere, or too far for a density
/// in single precision.
pub(crate) fn cone_of(sphere: &Sphere, receiver: Vec3) -> Option<(DVec3, f64)> {
    /// Least distance from the centre, in radii, squared.
    const NEAR: f64 = 1.001;
    let to_centre = sphere.centre().as_dvec3() - receiver.as_dvec3();
    let sin2 = f64::from(sphere.radius()).powi(2) / to_centre.length_squared();
    if sin2 * NEAR >= 1.0 {
        return None;
    }
    // 1 − cos without cancellation for a small sphere.
    let height = sin2 / (1.0 + (1.0 - sin2).sqrt());
    (height as f32).is_normal().then_some((to_centre.try_normalize()?, height))
}

/// Turns a direction of the frame in which `axis` is z into a direction of the world.
pub(crate) fn to_world(axis: Vec3, local: Vec3) -> Vec3 {
    let (tangent, bitangent) = orthonormal_basis(axis);
    (local.x * tangent + local.y * bitangent + local.z * axis).normalize()
}

/// Maps in double precision, for light that starts at one point or in one direction: random numbers of 24
/// bits would light a small thing far away by the same few rays in all iterations.
pub(crate) mod fine {
    use glam::{DVec2, DVec3, Vec3};
    use upbp_media::orthonormal_basis;

    /// The numbers `u`, with digits beyond their last ones by numbers that have no other use.
    pub(crate) fn numbers(u: [f32; 2], digits: [f32; 2]) -> [f64; 2] {
        /// Random numbers are multiples of this.
        const LAST_BIT: f64 = 1.0 / 16_777_216.0;
        [0, 1].map(|i| f64::from(u[i]) + f64::from(digits[i]) * LAST_BIT)
    }

    maps!(f64, DVec2, DVec3);

    /// A direction, as by [`sphere`](super::sphere).
    pub(crate) fn sphere(u: [f64; 2]) -> Vec3 {
        cone_local(2.0, u).as_vec3().normalize()
    }

    /// A direction around `axis`, uniform over the cone with `1 − cos θ_max = height`: density
    /// `1 / (2π height)`.
    pub(crate) fn cone(axis: DVec3, height: f64, u: [f64; 2]) -> DVec3 {
        let (tangent, bitangent) = orthonormal_basis(axis.as_vec3());
        let local = cone_local(height, u);
        (local.x * tangent.as_dvec3() + local.y * bitangent.as_dvec3() + local.z * axis).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fine_maps_are_those_of_single_precision() {
        const LAST: u32 = (1 << 24) - 1;
        let middle = 1 << 23;
        let mut numbers: Vec<u32> = (0..1024).map(|i| i * 16_381 % LAST).collect();
        numbers.extend([0, 1, 2, 77, middle - 1, middle, middle + 1, LAST - 1, LAST]);
        let number = |i: usize| numbers[i % numbers.len()] as f32 / 16_777_216.0;
        let axis = Vec3::new(0.3, -0.8, 0.52).normalize();
        for i in 0..20_000 {
            let [u, digits] = [[number(i), number(i / 7 + 3 * i)], [number(5 * i), number(i / 3)]];
            // At a pole the square root is taken of steps.
            let bound = if u[0] > 1e-5 && u[0] < 1.0 - 1e-5 { 1e-4 } else { 2e-3 };
            let precise = fine::numbers(u, digits);
            assert!(
                (0..2).all(|i| (0.0..6e-8).contains(&(precise[i] - f64::from(u[i])))),
                "{u:?} {digits:?}"
            );
            assert!(precise.iter().all(|u| *u < 1.0), "{u:?} {digits:?}");
            assert!(fine::disc(precise).as_vec2().distance(disc(u)) < 1e-6, "{u:?} {digits:?}");
            assert!(fine::sphere(precise).distance(sphere(u)) < bound, "{u:?} {digits:?}");
            let in_cone = fine::cone(axis.as_dvec3(), 0.01, precise).as_vec3();
            assert!(in_cone.distance(to_world(axis, cone_local(0.01, u))) < bound, "{u:?} {digits:?}");
        }
    }
}
