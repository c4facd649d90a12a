//! Regions of space that boxes are tested against, eight at once.

use glam::Vec3;

use super::boxes::Boxes;
use super::radius::RadiusAlong;
use crate::ray::Ray;
use crate::simd::Wide;

/// Rounding of the tests on items, as a multiple of the greatest distance in their computation: an item that
/// its own test accepts in single precision must not be lost by its box.
///
/// The distance of a point needs 3 ε of the greatest sum of coordinate differences between the query's origin
/// and anything in the box; that of a segment, unless nearly parallel, 9 ε of it and 7 ε of the distance
/// along the segment. So the margin of a box depends on what is in it: what is far away does not widen the
/// boxes of what is near.
pub(super) const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// A region that a traversal searches. Its test is compiled for the instruction set of the traversal.
pub(super) trait Region {
    /// The boxes that overlap the region, one bit per lane.
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32;
}

/// Distances of a point below and above each of eight boxes along each axis, negative inside.
struct Offsets<F> {
    below: [F; 3],
    above: [F; 3],
    /// The greatest sum of coordinate differences between the point and anything in the box.
    reach: F,
}

impl<F: Copy> Offsets<F> {
    #[inline(always)]
    fn new<W: Wide<F = F>>(wide: W, boxes: &impl Boxes, point: [f32; 3]) -> Self {
        let zero = wide.splat(0.0);
        let mut offsets = Self { below: [zero; 3], above: [zero; 3], reach: zero };
        for (axis, coordinate) in point.into_iter().enumerate() {
            let coordinate = wide.splat(coordinate);
            let below = wide.sub(boxes.min(wide, axis), coordinate);
            let above = wide.sub(coordinate, boxes.max(wide, axis));
            offsets.below[axis] = below;
            offsets.above[axis] = above;
            // Not of absolute values: boxes of unused lanes get −∞ and stay as they are.
            offsets.reach = wide.sub(offsets.reach, wide.less_of(below, above));
        }
        offsets.reach = wide.greater_of(offsets.reach, zero);
        offsets
    }

    /// Radii that are wider by the rounding of the tests on items.
    #[inline(always)]
    fn widened<W: Wide<F = F>>(&self, wide: W, radii: F) -> F {
        wide.add(wide.mul(radii, wide.splat(1.001)), wide.mul(self.reach, wide.splat(ROUNDING)))
    }
}

/// The points within a radius of a ray.
pub(super) struct ThickRay<R> {
    origin: [f32; 3],
    inverse: [f32; 3],
    negative: [bool; 3],
    t_min: f32,
    t_max: f32,
    radius: R,
}

impl<R: RadiusAlong> ThickRay<R> {
    pub(super) fn new(ray: &Ray, radius: R) -> Self {
        let inverse = ray.direction.recip().to_array();
        Self {
            origin: ray.origin.to_array(),
            inverse,
            negative: inverse.map(f32::is_sign_negative),
            t_min: ray.t_min,
            t_max: ray.t_max,
            radius,
        }
    }

    /// Distances along the ray between which it is in each box, widened by the radii.
    ///
    /// A zero component of the direction gives infinite distances, or NaN for a plane that holds the origin.
    /// The comparisons are written so that a NaN does not constrain.
    #[inline(always)]
    fn inside<W: Wide>(&self, wide: W, offsets: &Offsets<W::F>, radii: W::F) -> (W::F, W::F) {
        let mut near = wide.splat(self.t_min);
        let mut far = wide.splat(self.t_max);
        for axis in 0..3 {
            let inverse = wide.splat(self.inverse[axis]);
            let low = wide.sub(offsets.below[axis], radii);
            let high = wide.sub(radii, offsets.above[axis]);
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
        let offsets = Offsets::new(wide, boxes, self.origin);
        let largest = offsets.widened(wide, wide.splat(self.radius.largest()));
        let (mut near, mut far) = self.inside(wide, &offsets, largest);
        if !R::IS_CONSTANT {
            let radii = self.radius.within(wide, near, far);
            (near, far) = self.inside(wide, &offsets, offsets.widened(wide, radii));
        }
        wide.less_equal(near, far)
    }
}

/// The points within a radius of a point, `WIDENED` or not by the rounding of the tests on items.
pub(super) struct Ball<const WIDENED: bool> {
    centre: [f32; 3],
    radius: f32,
}

impl Ball<false> {
    /// A region for items whose test has no more rounding than that of their box.
    pub(super) fn exact(centre: Vec3, radius: f32) -> Self {
        Self { centre: centre.to_array(), radius }
    }
}

impl Ball<true> {
    /// Widened by the rounding of the tests on items.
    pub(super) fn widened(centre: Vec3, radius: f32) -> Self {
        Self { centre: centre.to_array(), radius }
    }
}

impl<const WIDENED: bool> Region for Ball<WIDENED> {
    #[inline(always)]
    fn overlaps<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        let offsets = Offsets::new(wide, boxes, self.centre);
        let (mut distance2, zero) = (wide.splat(0.0), wide.splat(0.0));
        for axis in 0..3 {
            let outside = wide.greater_of(offsets.below[axis], offsets.above[axis]);
            let outside = wide.greater_of(outside, zero);
            distance2 = wide.add(distance2, wide.mul(outside, outside));
        }
        let mut radii = wide.splat(self.radius);
        if WIDENED {
            radii = offsets.widened(wide, radii);
        }
        wide.less_equal(distance2, wide.mul(radii, radii))
    }
}
