//! Regions of space that boxes are tested against, eight at once.

use glam::Vec3;

use super::boxes::Boxes;
use super::radius::RadiusAlong;
use crate::ray::Ray;
use crate::simd::Wide;

/// Rounding of the tests on items, as a multiple of the greatest distance in their computation: an item that
/// its own test accepts in single precision must not be lost by its box.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A region that a traversal searches. Its test is compiled for the instruction set of the traversal.
pub(super) trait Region {
    /// The boxes that overlap the region, one bit per lane.
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32;
}

/// The points within a radius of a ray.
pub(super) struct ThickRay<R> {
    origin: [f32; 3],
    inverse: [f32; 3],
    negative: [bool; 3],
    t_min: f32,
    t_max: f32,
    radius: R,
    /// Added to radii for the rounding of the tests on items.
    rounding: f32,
}

impl<R: RadiusAlong> ThickRay<R> {
    /// Widened by the rounding of the tests on items, whose distances are at most `extent`.
    pub(super) fn new(ray: &Ray, radius: R, extent: f32) -> Self {
        let inverse = ray.direction.recip().to_array();
        Self {
            origin: ray.origin.to_array(),
            inverse,
            negative: inverse.map(f32::is_sign_negative),
            t_min: ray.t_min,
            t_max: ray.t_max,
            radius,
            rounding: ROUNDING * extent,
        }
    }

    /// Distances along the ray between which it is in each box, widened by the radii.
    ///
    /// A zero component of the direction gives infinite distances, or NaN for a plane that holds the origin.
    /// The comparisons are written so that a NaN does not constrain.
    #[inline(always)]
    fn inside<W: Wide>(&self, wide: W, boxes: &impl Boxes, radii: W::F) -> (W::F, W::F) {
        let mut near = wide.splat(self.t_min);
        let mut far = wide.splat(self.t_max);
        for axis in 0..3 {
            let (origin, inverse) = (wide.splat(self.origin[axis]), wide.splat(self.inverse[axis]));
            let low = wide.sub(wide.sub(boxes.min(wide, axis), origin), radii);
            let high = wide.add(wide.sub(boxes.max(wide, axis), origin), radii);
            let (enter, exit) = if self.negative[axis] { (high, low) } else { (low, high) };
            near = wide.greater_of(wide.mul(enter, inverse), near);
            far = wide.less_of(wide.mul(exit, inverse), far);
        }
        (near, far)
    }
}

impl<R: RadiusAlong> Region for ThickRay<R> {
    /// Intersects the ray with each box, widened by the greatest radius, then by that where it may be inside.
    #[inline(always)]
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        let (mut near, mut far) =
            self.inside(wide, boxes, wide.splat(self.radius.largest() * 1.001 + self.rounding));
        if !R::IS_CONSTANT {
            let radii = self.radius.within(wide, near, far);
            let widened = wide.add(wide.mul(radii, wide.splat(1.001)), wide.splat(self.rounding));
            (near, far) = self.inside(wide, boxes, widened);
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
    /// A region for items whose test has no more rounding than that of their box.
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
