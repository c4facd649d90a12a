//! Primitives of one kind, eight at a time, and the test in single precision that rules most of them out.
//!
//! A test never rules out what the exact test of the shape accepts: it allows for all rounding of single
//! precision, and numbers that overflow or are no numbers rule nothing out. So results are those of the exact
//! tests alone.

use glam::{DVec3, Vec3};

use super::axis_box::AxisBox;
use super::lane_ray::{LaneRay, Planes, ROUNDING, SLAB_ROUNDING, SlabRay, Slabs as _};
use super::placement::Placement;
use super::quad::{Plane, Quad};
use super::sphere::Sphere;
use super::triangle::RayShear;
use crate::simd::{WIDTH, Wide};

/// Up to eight primitives of a kind. What unused lanes hold is of no matter.
pub(super) trait Block: Copy + Send {
    /// A primitive.
    type Primitive: Copy;
    /// Values of a ray that only tests of this kind need, computed once per ray.
    type Prepared;

    const EMPTY: Self;

    fn set(&mut self, lane: usize, primitive: Self::Primitive);

    /// The primitives that the ray may meet between its ends, one bit for each lane; the last number is the
    /// far end.
    fn may_meet<W: Wide>(&self, wide: W, ray: &LaneRay<W>, prepared: &Self::Prepared, t_max: f32) -> u32;
}

/// Eight triangles.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Triangles([[[f32; WIDTH]; 3]; 3]);

impl Triangles {
    #[inline(always)]
    pub(super) fn corners(&self, lane: usize) -> [Vec3; 3] {
        let [a, b, c] = &self.0;
        [a, b, c].map(|corner| Vec3::new(corner[0][lane], corner[1][lane], corner[2][lane]))
    }

    /// The triangles of a mesh where a copy of it has them.
    #[inline(always)]
    pub(super) fn placed<W: Wide>(&self, wide: W, placement: &Placement) -> Self {
        let mut placed = Self::EMPTY;
        let order = if placement.mirrors { [0, 2, 1] } else { [0, 1, 2] };
        for (corner, to) in order.into_iter().enumerate() {
            let points = placement.points(wide, wide.load3(&self.0[corner]));
            for (axis, lanes) in points.into_iter().enumerate() {
                placed.0[to][axis] = wide.store(lanes);
            }
        }
        placed
    }
}

/// A ray, prepared for triangles.
pub(super) struct TriangleRay {
    pub(super) shear: RayShear,
    /// Error of the distance of a corner along the ray, scene units.
    margin: f32,
}

impl TriangleRay {
    /// `extent`: the greatest sum of coordinate differences between the ray's origin and any triangle.
    #[inline(always)]
    pub(super) fn new(origin: Vec3, direction: Vec3, extent: f32) -> Self {
        Self { shear: RayShear::new(origin, direction), margin: ROUNDING * extent }
    }
}

impl Block for Triangles {
    type Primitive = [Vec3; 3];
    type Prepared = TriangleRay;

    const EMPTY: Self = Self([[[0.0; WIDTH]; 3]; 3]);

    fn set(&mut self, lane: usize, corners: [Vec3; 3]) {
        for (to, corner) in self.0.iter_mut().zip(corners) {
            for axis in 0..3 {
                to[axis][lane] = corner[axis];
            }
        }
    }

    /// The first part of the exact test as it is, operation by operation, and a range of distances that holds
    /// those of the corners.
    #[inline(always)]
    fn may_meet<W: Wide>(&self, wide: W, ray: &LaneRay<W>, prepared: &TriangleRay, t_max: f32) -> u32 {
        let axes = prepared.shear.axes();
        let slope = prepared.shear.slope();
        let slope = [wide.splat(slope.x), wide.splat(slope.y)];
        let origin = reorder(ray.origin, axes);
        let from_a = wide.sub3(load(wide, &self.0[0], axes), origin);
        let from_b = wide.sub3(load(wide, &self.0[1], axes), origin);
        let from_c = wide.sub3(load(wide, &self.0[2], axes), origin);
        let (a, b, c) =
            (project(wide, from_a, slope), project(wide, from_b, slope), project(wide, from_c, slope));
        let (u, v, w) = (perp_dot(wide, c, b), perp_dot(wide, a, c), perp_dot(wide, b, a));
        let zero = wide.splat(0.0);
        let outside = wide.less(wide.less_of(u, wide.less_of(v, w)), zero)
            & wide.less(zero, wide.greater_of(u, wide.greater_of(v, w)));
        if outside == 0xff {
            return 0;
        }
        let direction = reorder(ray.direction, axes);
        let (a, b, c) =
            (wide.dot(from_a, direction), wide.dot(from_b, direction), wide.dot(from_c, direction));
        let margin = wide.splat(prepared.margin);
        let nearest = wide.sub(wide.less_of(a, wide.less_of(b, c)), margin);
        let farthest = wide.add(wide.greater_of(a, wide.greater_of(b, c)), margin);
        let beyond = wide.less_equal(farthest, ray.t_min) | wide.less_equal(wide.splat(t_max), nearest);
        !(outside | beyond)
    }
}

#[inline(always)]
fn reorder<T: Copy>(v: [T; 3], axes: [usize; 3]) -> [T; 3] {
    [v[axes[0]], v[axes[1]], v[axes[2]]]
}

#[inline(always)]
fn load<W: Wide>(wide: W, corner: &[[f32; WIDTH]; 3], axes: [usize; 3]) -> [W::F; 3] {
    [wide.load(&corner[axes[0]]), wide.load(&corner[axes[1]]), wide.load(&corner[axes[2]])]
}

#[inline(always)]
fn project<W: Wide>(wide: W, [x, y, z]: [W::F; 3], slope: [W::F; 2]) -> [W::F; 2] {
    [wide.sub(x, wide.mul(slope[0], z)), wide.sub(y, wide.mul(slope[1], z))]
}

#[inline(always)]
fn perp_dot<W: Wide>(wide: W, a: [W::F; 2], b: [W::F; 2]) -> W::F {
    wide.sub(wide.mul(a[0], b[1]), wide.mul(a[1], b[0]))
}

/// Sum of the magnitudes of the components.
#[inline(always)]
fn extent<W: Wide>(wide: W, [x, y, z]: [W::F; 3]) -> W::F {
    wide.add(wide.add(wide.abs(x), wide.abs(y)), wide.abs(z))
}

/// Eight quads, as the maps from points relative to the corner to coordinates on the quad and to the height
/// above it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Quads {
    corner: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    to_uv: [[[f32; WIDTH]; 3]; 2],
    /// Twice the sum of the components of `to_uv`, per scene unit. Infinite for a quad that single precision
    /// cannot tell of.
    size: [[f32; WIDTH]; 2],
    /// Twice the sum of the components of both edges, scene units.
    diameter: [f32; WIDTH],
}

impl Block for Quads {
    type Primitive = Quad;
    type Prepared = ();

    const EMPTY: Self = Self {
        corner: [[0.0; WIDTH]; 3],
        normal: [[0.0; WIDTH]; 3],
        to_uv: [[[0.0; WIDTH]; 3]; 2],
        size: [[0.0; WIDTH]; 2],
        diameter: [0.0; WIDTH],
    };

    fn set(&mut self, lane: usize, quad: Quad) {
        let Plane { normal, to_uv } = *quad.plane();
        let put = |to: &mut [[f32; WIDTH]; 3], v: DVec3| {
            for axis in 0..3 {
                to[axis][lane] = v[axis] as f32;
            }
        };
        put(&mut self.corner, quad.origin().as_dvec3());
        put(&mut self.normal, normal.normalize());
        for (i, row) in to_uv.into_iter().enumerate() {
            put(&mut self.to_uv[i], row);
            // Denormal components have lost their digits.
            let size = row.abs().element_sum();
            let known = (1e-30..1e30).contains(&size);
            self.size[i][lane] = if known { 2.0 * size as f32 } else { f32::INFINITY };
        }
        let edges = quad.edge_u().as_dvec3().abs() + quad.edge_v().as_dvec3().abs();
        self.diameter[lane] = 2.0 * edges.element_sum() as f32;
    }

    /// Tests `t·cos` and the coordinates of the point in the plane, times `cos`, with `cos` made positive: a
    /// quotient would have no bound of its error.
    #[inline(always)]
    fn may_meet<W: Wide>(&self, wide: W, ray: &LaneRay<W>, (): &(), t_max: f32) -> u32 {
        let to_corner = wide.sub3(wide.load3(&self.corner), ray.origin);
        let normal = wide.load3(&self.normal);
        let signed = wide.dot(normal, ray.direction);
        let cosine = wide.abs(signed);
        let height = wide.flip_sign(wide.dot(normal, to_corner), signed);
        let distance = extent(wide, to_corner);
        let rounding = wide.splat(ROUNDING);
        let tiny = wide.splat(f32::MIN_POSITIVE);

        let farthest = wide.add(distance, wide.load(&self.diameter));
        let margin = wide.add(wide.mul(farthest, rounding), tiny);
        let last = wide.mul(wide.less_of(wide.splat(t_max), farthest), cosine);
        let first = wide.mul(ray.t_min, cosine);
        let mut beyond =
            wide.less(wide.add(height, margin), first) | wide.less(last, wide.sub(height, margin));
        for i in 0..2 {
            let to_uv = wide.load3(&self.to_uv[i]);
            let along = wide.mul(wide.dot(to_uv, ray.direction), height);
            let from = wide.mul(wide.dot(to_uv, to_corner), cosine);
            let coordinate = wide.sub(along, from);
            let size = wide.add(wide.mul(wide.load(&self.size[i]), distance), wide.splat(1.0));
            let margin = wide.mul(size, rounding);
            beyond |= wide.less(wide.add(coordinate, margin), wide.splat(0.0))
                | wide.less(wide.add(cosine, margin), coordinate);
        }
        !beyond
    }
}

/// Length whose square single precision cannot tell reliably from zero, scene units.
const NO_SQUARE: f32 = 1e-15;

/// Eight spheres.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Spheres {
    centre: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
}

impl Block for Spheres {
    type Primitive = Sphere;
    type Prepared = ();

    const EMPTY: Self = Self { centre: [[0.0; WIDTH]; 3], radius: [0.0; WIDTH] };

    fn set(&mut self, lane: usize, sphere: Sphere) {
        for axis in 0..3 {
            self.centre[axis][lane] = sphere.centre()[axis];
        }
        self.radius[lane] = sphere.radius();
    }

    /// Bounds half of the chord from both sides: a ray that starts and ends inside meets nothing.
    #[inline(always)]
    fn may_meet<W: Wide>(&self, wide: W, ray: &LaneRay<W>, (): &(), t_max: f32) -> u32 {
        let to_centre = wide.sub3(wide.load3(&self.centre), ray.origin);
        let [middle, distance2] = wide.perpendicular(to_centre, ray.direction);
        let radius = wide.load(&self.radius);
        let size = wide.add(extent(wide, to_centre), radius);
        let margin = wide.add(wide.mul(size, wide.splat(ROUNDING)), wide.splat(NO_SQUARE));
        let zero = wide.splat(0.0);
        let (outer, inner) = (wide.add(radius, margin), wide.greater_of(wide.sub(radius, margin), zero));
        let outer2 = wide.mul(outer, outer);
        // A lower bound even if the square is too large.
        let inner2 = wide.less_of(wide.mul(inner, inner), wide.splat(f32::MAX));
        let missed = wide.less(outer2, distance2);
        if missed == 0xff {
            return 0;
        }
        let most = wide.add(half_chord(wide, outer2, distance2), margin);
        let least = wide.sub(half_chord(wide, inner2, distance2), margin);
        let t_max = wide.splat(t_max);
        // Where the ray enters: before its start, or behind its end. So where it leaves.
        let no_entry =
            wide.less(wide.sub(middle, least), ray.t_min) | wide.less(t_max, wide.sub(middle, most));
        let no_exit =
            wide.less(wide.add(middle, most), ray.t_min) | wide.less(t_max, wide.add(middle, least));
        !(missed | (no_entry & no_exit))
    }
}

/// Half of the chord of a sphere at a distance from its centre, of squared lengths; NaN stays NaN.
#[inline(always)]
fn half_chord<W: Wide>(wide: W, radius2: W::F, distance2: W::F) -> W::F {
    wide.sqrt(wide.greater_of(wide.splat(0.0), wide.sub(radius2, distance2)))
}

/// Eight boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct AxisBoxes(Planes);

impl Block for AxisBoxes {
    type Primitive = AxisBox;
    type Prepared = ();

    const EMPTY: Self = Self([[[0.0; WIDTH]; 2]; 3]);

    fn set(&mut self, lane: usize, axis_box: AxisBox) {
        for axis in 0..3 {
            self.0[axis][0][lane] = axis_box.min()[axis];
            self.0[axis][1][lane] = axis_box.max()[axis];
        }
    }

    #[inline(always)]
    fn may_meet<W: Wide>(&self, wide: W, ray: &LaneRay<W>, (): &(), t_max: f32) -> u32 {
        let (start, end) = (wide.splat(f32::NEG_INFINITY), wide.splat(f32::INFINITY));
        let [entry, exit] = SlabRay::new(wide, ray, ()).slabs(wide, &self.0, start, end);
        let (less, more) = (wide.splat(1.0 - SLAB_ROUNDING), wide.splat(1.0 + SLAB_ROUNDING));
        let (tiny, t_max) = (wide.splat(f32::MIN_POSITIVE), wide.splat(t_max));
        // Least and greatest distances, for such as are not negative.
        let (entry_low, entry_high) =
            (wide.sub(wide.mul(entry, less), tiny), wide.add(wide.mul(entry, more), tiny));
        let (exit_low, exit_high) =
            (wide.sub(wide.mul(exit, less), tiny), wide.add(wide.mul(exit, more), tiny));
        let no_entry = wide.less(entry_high, ray.t_min) | wide.less(t_max, entry_low);
        let no_exit = wide.less(exit_high, ray.t_min) | wide.less(t_max, exit_low);
        !(wide.less(exit_high, entry_low) | (no_entry & no_exit))
    }
}
