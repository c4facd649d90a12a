//! What a query tests eight boxes with.

use glam::Vec3;

use super::boxes::Boxes;
use super::lanes::Wide;
use crate::ray::Ray;

/// Rounding of the tests on items, as a multiple of the greatest distance in their computation: what an
/// item's test accepts in single precision, its box must not lose.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// The lanes whose bit is set.
#[inline(always)]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
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
    #[inline(always)]
    pub(super) fn test<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        let mut near = wide.splat(self.t_min);
        let mut far = wide.splat(self.t_max);
        for axis in 0..3 {
            let negative = self.negative[axis];
            let (enter, exit) = if negative {
                (boxes.max(wide, axis), boxes.min(wide, axis))
            } else {
                (boxes.min(wide, axis), boxes.max(wide, axis))
            };
            let outwards = wide.splat(if negative { self.radius } else { -self.radius });
            let (origin, inverse) = (wide.splat(self.origin[axis]), wide.splat(self.inverse[axis]));
            let from = wide.mul(wide.add(wide.sub(enter, origin), outwards), inverse);
            let to = wide.mul(wide.sub(wide.sub(exit, origin), outwards), inverse);
            near = wide.greater_of(from, near);
            far = wide.less_of(to, far);
        }
        wide.less_equal(near, far)
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
    #[inline(always)]
    pub(super) fn test<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        let (mut distance2, zero) = (wide.splat(0.0), wide.splat(0.0));
        for axis in 0..3 {
            let centre = wide.splat(self.centre[axis]);
            let below = wide.sub(boxes.min(wide, axis), centre);
            let above = wide.sub(centre, boxes.max(wide, axis));
            let outside = wide.greater_of(wide.greater_of(below, above), zero);
            distance2 = wide.add(distance2, wide.mul(outside, outside));
        }
        wide.less_equal(distance2, wide.splat(self.radius2))
    }
}
