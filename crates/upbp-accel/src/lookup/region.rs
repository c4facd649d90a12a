//! Regions of space that boxes are tested against, eight at once.

use glam::Vec3;

use super::boxes::Boxes;
use crate::lanes::Wide;
use crate::ray::Ray;

/// Rounding of the tests on items, as a multiple of the greatest distance in their computation: an item that
/// its own test accepts in single precision must not be lost by its box.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A region that a traversal searches. Its test is compiled for the instruction set of the traversal.
pub(super) trait Region {
    /// The boxes that overlap the region, one bit per lane.
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32;
}

/// The points within a radius of a ray.
pub(super) struct ThickRay {
    origin: [f32; 3],
    inverse: [f32; 3],
    negative: [bool; 3],
    t_min: f32,
    t_max: f32,
    radius: f32,
}

impl ThickRay {
    /// Widened by the rounding of the tests on items, whose distances are at most `extent`.
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
}

impl Region for ThickRay {
    /// Intersects the ray with each box, widened by the radius.
    ///
    /// A zero component of the direction gives infinite distances, or NaN for a plane that holds the origin.
    /// The comparisons are written so that a NaN does not constrain.
    #[inline(always)]
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
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

/// The points within a radius of a point.
pub(super) struct Ball {
    centre: [f32; 3],
    radius2: f32,
}

impl Ball {
    /// For items whose test has no more rounding than that of their box.
    pub(super) fn exact(centre: Vec3, radius: f32) -> Self {
        Self { centre: centre.to_array(), radius2: radius * radius }
    }

    /// Widened by the rounding of the tests on items, whose distances are at most `extent`.
    pub(super) fn widened(centre: Vec3, radius: f32, extent: f32) -> Self {
        Self::exact(centre, radius * 1.001 + ROUNDING * extent)
    }
}

impl Region for Ball {
    #[inline(always)]
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
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
