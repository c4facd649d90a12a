//! A coordinate frame around a direction.
//!
//! Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.

use glam::Vec3;

/// Two unit vectors that form a right-handed orthonormal basis `(tangent, bitangent, n)` with the unit
/// vector `n`.
///
/// Continuous everywhere except across `n.z = 0`, and accurate for `n.z` close to −1, where the
/// formula without the sign divides by zero.
#[inline]
#[must_use]
pub fn orthonormal_basis(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let tangent = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let bitangent = Vec3::new(b, sign + n.y * n.y * a, -n.y);
    (tangent, bitangent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn assert_basis(n: Vec3) {
        let (tangent, bitangent) = orthonormal_basis(n);
        for (value, expected) in [
            (tangent.length(), 1.0),
            (bitangent.length(), 1.0),
            (tangent.dot(bitangent), 0.0),
            (tangent.dot(n), 0.0),
            (bitangent.dot(n), 0.0),
            (tangent.cross(bitangent).dot(n), 1.0),
        ] {
            assert!((value - expected).abs() < 1e-6, "{n}: {value}, expected {expected}");
        }
    }

    #[test]
    fn is_orthonormal_and_right_handed() {
        let mut random = Random(1);
        (0..10_000).for_each(|_| assert_basis(random.direction()));
        for n in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_basis(n);
            assert_basis(-n);
        }
    }

    #[test]
    fn holds_next_to_the_poles_and_the_equator() {
        for z in [1.0_f32, -1.0] {
            for offset in [1e-30_f32, 1e-7, 1e-5, 1e-4, 1e-3] {
                assert_basis(Vec3::new(offset, -offset, z).normalize());
            }
        }
        for z in [0.0_f32, -0.0, 1e-30, -1e-30, 1e-7, -1e-7] {
            assert_basis(Vec3::new(0.6, -0.8, z).normalize());
        }
    }
}
