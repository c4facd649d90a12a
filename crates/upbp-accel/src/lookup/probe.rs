//! What a query tests eight boxes with.

use glam::Vec3;

use super::packed::{Boxes, WIDTH};
use crate::ray::Ray;

/// Rounding of the tests on items, as a multiple of the greatest distance in their computation: what an
/// item's test accepts in single precision, its box must not lose.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Collects one bit per lane.
#[inline]
pub(super) fn bits(lanes: [bool; WIDTH]) -> u32 {
    let mut bits = 0;
    for (lane, &set) in lanes.iter().enumerate() {
        bits |= u32::from(set) << lane;
    }
    bits
}

/// A ray with a radius.
pub(super) struct RayProbe {
    origin: [f32; 3],
    inverse: [f32; 3],
    negative: [bool; 3],
    t_min: f32,
    t_max: f32,
    radius: f32,
}

impl RayProbe {
    /// `extent` bounds the distances that the tests on items compute with.
    pub(super) fn new(ray: &Ray, radius: f32, extent: f32) -> Self {
        let inverse = ray.direction.recip().to_array();
        Self {
            origin: ray.origin.to_array(),
            inverse,
            negative: inverse.map(f32::is_sign_negative),
            t_min: ray.t_min,
            t_max: ray.t_max,
            radius: radius * 1.001 + ROUNDING * extent,
        }
    }

    /// The boxes that the ray meets, each widened by the radius.
    ///
    /// A zero component of the direction gives infinite distances, or NaN for a plane that holds the origin.
    /// The comparisons are written so that a NaN does not constrain.
    #[inline]
    pub(super) fn test(&self, boxes: &Boxes) -> u32 {
        let mut near = [self.t_min; WIDTH];
        let mut far = [self.t_max; WIDTH];
        for axis in 0..3 {
            let negative = self.negative[axis];
            let (enter, exit) = if negative {
                (&boxes.max[axis], &boxes.min[axis])
            } else {
                (&boxes.min[axis], &boxes.max[axis])
            };
            let outwards = if negative { self.radius } else { -self.radius };
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            for lane in 0..WIDTH {
                let from = (enter[lane] - origin + outwards) * inverse;
                let to = (exit[lane] - origin - outwards) * inverse;
                near[lane] = if from > near[lane] { from } else { near[lane] };
                far[lane] = if to < far[lane] { to } else { far[lane] };
            }
        }
        let mut met = [false; WIDTH];
        for lane in 0..WIDTH {
            met[lane] = near[lane] <= far[lane];
        }
        bits(met)
    }
}

/// A ball.
pub(super) struct BallProbe {
    centre: [f32; 3],
    radius2: f32,
}

impl BallProbe {
    /// For items whose test has no more rounding than that of their box.
    pub(super) fn exact(centre: Vec3, radius: f32) -> Self {
        Self { centre: centre.to_array(), radius2: radius * radius }
    }

    /// For items whose test rounds more; `extent` bounds the distances that it computes with.
    pub(super) fn widened(centre: Vec3, radius: f32, extent: f32) -> Self {
        Self::exact(centre, radius * 1.001 + ROUNDING * extent)
    }

    /// The boxes that overlap the ball.
    #[inline]
    pub(super) fn test(&self, boxes: &Boxes) -> u32 {
        let mut distance2 = [0.0_f32; WIDTH];
        for axis in 0..3 {
            let centre = self.centre[axis];
            let (min, max) = (&boxes.min[axis], &boxes.max[axis]);
            for ((sum, min), max) in distance2.iter_mut().zip(min).zip(max) {
                let (below, above) = (min - centre, centre - max);
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                *sum += outside * outside;
            }
        }
        bits(distance2.map(|distance2| distance2 <= self.radius2))
    }
}
