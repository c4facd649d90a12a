//! Search radii that depend on the place along a ray.

use glam::Vec3;

use crate::ray::Ray;
use crate::simd::Wide;

/// The radius of a search around a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchRadius {
    /// One radius everywhere, scene units.
    Constant(f32),
    /// Growing with the distance from a point.
    Growing(GrowingRadius),
}

impl From<f32> for SearchRadius {
    fn from(radius: f32) -> Self {
        Self::Constant(radius)
    }
}

/// A radius that grows with the distance from a point, within bounds:
/// `clamp(offset + slope · |x − centre|, least, most)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowingRadius {
    /// The point.
    pub centre: Vec3,
    /// Radius at the point, scene units.
    pub offset: f32,
    /// Growth per scene unit, not negative.
    pub slope: f32,
    /// Least radius, scene units.
    pub least: f32,
    /// Greatest radius, scene units.
    pub most: f32,
}

/// A radius along the ray of a search.
pub(super) trait RadiusAlong: Copy {
    /// Whether it is the same everywhere.
    const IS_CONSTANT: bool;

    /// The greatest radius within the range of the ray.
    fn largest(&self) -> f32;
    /// The radius at a distance.
    fn at(&self, t: f32) -> f32;
    /// The radii at eight distances.
    fn at_each<W: Wide>(&self, wide: W, t: W::F) -> W::F;
    /// The greatest radii between two distances each.
    fn within<W: Wide>(&self, wide: W, near: W::F, far: W::F) -> W::F;
}

impl RadiusAlong for f32 {
    const IS_CONSTANT: bool = true;

    #[inline(always)]
    fn largest(&self) -> f32 {
        *self
    }

    #[inline(always)]
    fn at(&self, _: f32) -> f32 {
        *self
    }

    #[inline(always)]
    fn at_each<W: Wide>(&self, wide: W, _: W::F) -> W::F {
        wide.splat(*self)
    }

    #[inline(always)]
    fn within<W: Wide>(&self, wide: W, _: W::F, _: W::F) -> W::F {
        wide.splat(*self)
    }
}

/// A [`GrowingRadius`] along a ray.
#[derive(Clone, Copy)]
pub(super) struct GrowingAlong {
    radius: GrowingRadius,
    /// Distance along the ray to the place nearest to the centre.
    nearest: f32,
    /// Square of the distance of that place from the centre.
    height2: f32,
    largest: f32,
}

impl GrowingAlong {
    pub(super) fn new(radius: &GrowingRadius, ray: &Ray) -> Self {
        let to_centre = radius.centre - ray.origin;
        let nearest = to_centre.dot(ray.direction);
        let height2 = (to_centre - nearest * ray.direction).length_squared();
        let along = Self { radius: *radius, nearest, height2, largest: 0.0 };
        // Nothing in between is farther from the centre than both ends.
        Self { largest: along.at(ray.t_min).max(along.at(ray.t_max)), ..along }
    }
}

impl RadiusAlong for GrowingAlong {
    const IS_CONSTANT: bool = false;

    #[inline(always)]
    fn largest(&self) -> f32 {
        self.largest
    }

    #[inline(always)]
    fn at(&self, t: f32) -> f32 {
        let GrowingRadius { offset, slope, least, most, .. } = self.radius;
        let along = t - self.nearest;
        (offset + slope * (along * along + self.height2).sqrt()).min(most).max(least)
    }

    #[inline(always)]
    fn at_each<W: Wide>(&self, wide: W, t: W::F) -> W::F {
        let along = wide.sub(t, wide.splat(self.nearest));
        let distance = wide.sqrt(wide.add(wide.mul(along, along), wide.splat(self.height2)));
        let grown =
            wide.add(wide.splat(self.radius.offset), wide.mul(wide.splat(self.radius.slope), distance));
        wide.greater_of(wide.less_of(grown, wide.splat(self.radius.most)), wide.splat(self.radius.least))
    }

    #[inline(always)]
    fn within<W: Wide>(&self, wide: W, near: W::F, far: W::F) -> W::F {
        wide.greater_of(self.at_each(wide, near), self.at_each(wide, far))
    }
}
