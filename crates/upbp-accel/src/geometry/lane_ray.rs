//! A ray, prepared for tests against eight boxes or primitives at once.

use glam::Vec3;

use crate::ray::Ray;
use crate::simd::Wide;

/// Rounding errors that the tests of primitives allow for, as a multiple of the greatest magnitude in a
/// computation: three to four times what sums of products of vectors can lose.
pub(super) const ROUNDING: f32 = 64.0 * f32::EPSILON;

/// Relative error of a slab's distance, twice over: the rounding of a difference, a reciprocal and a product.
pub(super) const SLAB_ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A ray in every lane.
pub(super) struct LaneRay<W: Wide> {
    pub(super) origin: [W::F; 3],
    pub(super) direction: [W::F; 3],
    pub(super) t_min: W::F,
}

/// A ray in every lane, prepared for the slabs of boxes.
pub(super) struct SlabRay<W: Wide> {
    origin: [W::F; 3],
    inverse: [W::F; 3],
    /// Axes along which the direction is negative, as 0 or 1.
    negative: [usize; 3],
}

/// The least and the greatest coordinates of eight boxes, by axis.
pub(super) type Planes = [[[f32; crate::simd::WIDTH]; 2]; 3];

impl<W: Wide> LaneRay<W> {
    #[inline(always)]
    pub(super) fn new(wide: W, ray: &Ray) -> Self {
        Self {
            origin: wide.splat3(ray.origin.to_array()),
            direction: wide.splat3(ray.direction.to_array()),
            t_min: wide.splat(ray.t_min),
        }
    }
}

/// A test of a ray against eight boxes.
pub(super) trait Slabs<W: Wide> {
    /// Widths by which boxes are wider on both sides than they are said to be.
    type Margins: Copy;

    fn new(wide: W, ray: &LaneRay<W>, margins: Self::Margins) -> Self;

    /// The distances at which the ray enters and leaves each box, or its ends where they are nearer, each
    /// with an error of [`SLAB_ROUNDING`].
    ///
    /// A zero component of the direction gives infinite distances to both planes of its axis, or NaN for a
    /// plane that holds the origin. The comparisons are written so that a NaN does not constrain: a ray that
    /// lies in a face, or in a box without thickness, meets it.
    fn slabs(&self, wide: W, planes: &Planes, t_min: W::F, t_max: W::F) -> [W::F; 2];
}

impl<W: Wide> SlabRay<W> {
    /// `origins` as they are for the planes by which the ray enters and leaves.
    #[inline(always)]
    fn between(
        &self,
        [enter_from, exit_from]: [&[W::F; 3]; 2],
        wide: W,
        planes: &Planes,
        [t_min, t_max]: [W::F; 2],
    ) -> [W::F; 2] {
        let (mut near, mut far) = (t_min, t_max);
        for (axis, planes) in planes.iter().enumerate() {
            let negative = self.negative[axis] & 1;
            let enter = wide.sub(wide.load(&planes[negative]), enter_from[axis]);
            let exit = wide.sub(wide.load(&planes[1 - negative]), exit_from[axis]);
            near = wide.greater_of(wide.mul(enter, self.inverse[axis]), near);
            far = wide.less_of(wide.mul(exit, self.inverse[axis]), far);
        }
        [near, far]
    }
}

impl<W: Wide> Slabs<W> for SlabRay<W> {
    type Margins = ();

    #[inline(always)]
    fn new(wide: W, ray: &LaneRay<W>, (): ()) -> Self {
        let (zero, one) = (wide.splat(0.0), wide.splat(1.0));
        let inverse = ray.direction.map(|x| wide.div(one, x));
        Self { origin: ray.origin, inverse, negative: inverse.map(|x| usize::from(wide.less(x, zero) != 0)) }
    }

    #[inline(always)]
    fn slabs(&self, wide: W, planes: &Planes, t_min: W::F, t_max: W::F) -> [W::F; 2] {
        self.between([&self.origin; 2], wide, planes, [t_min, t_max])
    }
}

/// A ray in every lane, prepared for the slabs of boxes that are wider than they are said to be.
pub(super) struct Widened<W: Wide> {
    ray: SlabRay<W>,
    /// For the planes by which the ray enters and leaves.
    origins: [[W::F; 3]; 2],
}

impl<W: Wide> Slabs<W> for Widened<W> {
    type Margins = Vec3;

    #[inline(always)]
    fn new(wide: W, ray: &LaneRay<W>, margins: Vec3) -> Self {
        let margins = wide.splat3(margins.to_array());
        // For the planes with the least and with the greatest coordinates.
        let [above, below] = [wide.add3(ray.origin, margins), wide.sub3(ray.origin, margins)];
        let mut origins = [above, below];
        let ray = SlabRay::new(wide, ray, ());
        for axis in 0..3 {
            if ray.negative[axis] == 1 {
                (origins[0][axis], origins[1][axis]) = (below[axis], above[axis]);
            }
        }
        Self { ray, origins }
    }

    #[inline(always)]
    fn slabs(&self, wide: W, planes: &Planes, t_min: W::F, t_max: W::F) -> [W::F; 2] {
        let [enter_from, exit_from] = &self.origins;
        self.ray.between([enter_from, exit_from], wide, planes, [t_min, t_max])
    }
}
