//! The oracle: radiance of a ball in a furnace, by walks in double precision that share nothing with the
//! renderer.
//!
//! Every escaping walk brings radiance 1 times the albedo to the power of its collisions, for each channel on
//! its own.

use std::f64::consts::TAU;

use glam::DVec3;

use super::case::{EYE, FIELD_OF_VIEW};
use crate::statistics::Estimate;

/// A small generator: Steele et al., "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
struct Random(u64);

impl Random {
    /// Uniform in `(0, 1)`, with 52 bits.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
    }
}

/// A direction at an angle to `before`, by Henyey and Greenstein.
fn scatter(before: DVec3, g: f64, random: &mut Random) -> DVec3 {
    let (u, phi) = (random.next(), TAU * random.next());
    // Inversion for 1 − cos and 1 + cos, neither of which cancels.
    let root = 1.0 - g + 2.0 * g * u;
    let below = 2.0 * ((1.0 - g) / root).powi(2) * (1.0 - u) * (1.0 + g * u);
    let above = 2.0 * ((1.0 + g) / root).powi(2) * u * (1.0 - g * (1.0 - u));
    let (tangent, bitangent) = before.any_orthonormal_pair();
    let across = phi.cos() * tangent + phi.sin() * bitangent;
    (0.5 * (above - below) * before + (above * below).sqrt() * across).normalize()
}

/// Mean radiance of the film that sees a unit ball of medium of this optical thickness (along a diameter),
/// with paths of at most `max_length` edges.
pub(crate) fn furnace(tau: f64, albedo: f64, g: f64, max_length: u32, walks: u32) -> Estimate {
    let sigma = 0.5 * tau;
    let mut random = Random(17);
    let half = (0.5 * FIELD_OF_VIEW).to_radians().tan();
    let values: Vec<f64> = (0..walks)
        .map(|_| {
            let [x, y] = [0, 1].map(|_| half * (2.0 * random.next() - 1.0));
            let mut direction = DVec3::new(x, y, -1.0).normalize();
            let eye = DVec3::new(0.0, 0.0, EYE);
            let nearest = eye - direction * eye.dot(direction);
            let discriminant = 1.0 - nearest.length_squared();
            if discriminant <= 0.0 {
                return 1.0;
            }
            let mut position = nearest - direction * discriminant.sqrt();
            let mut weight = 1.0;
            for _ in 1..=max_length {
                let half_b = position.dot(direction);
                // Inside of the ball but for rounding.
                let c = (position.length_squared() - 1.0).min(0.0);
                let exit = -half_b + (half_b * half_b - c).max(0.0).sqrt();
                let free = -random.next().ln() / sigma;
                if !(free < exit) {
                    return weight;
                }
                position += free * direction;
                weight *= albedo;
                direction = scatter(direction, g, &mut random);
            }
            0.0
        })
        .collect();
    Estimate::of(&values)
}
