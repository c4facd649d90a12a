//! Segments, looked up around a ray (BB1D) or around a point (BP2D).

use glam::Vec3;
use rayon::prelude::*;

use super::boxes::{Bounds, Exact};
use super::closest_approach::{ClosestApproach, Segment, closest_approach};
use super::query::Query;
use super::radius::{GrowingAlong, RadiusAlong, SearchRadius};
use super::region::{Ball, ROUNDING, ThickRay};
use super::sort::Item;
use super::split::{Piece, SplitParams, split};
use super::tree::PackedTree;
use crate::ray::Ray;
use crate::simd::{WIDTH, Wide};

/// Eight pieces. The data by which most pieces fail is in the first three cache lines. An unused lane is NaN,
/// which no comparison accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Block {
    origin: [[f32; WIDTH]; 3],
    direction: [[f32; WIDTH]; 3],
    start: [f32; WIDTH],
    end: [f32; WIDTH],
    segment: [u32; WIDTH],
}

impl Block {
    const EMPTY: Self = Self {
        origin: [[f32::NAN; WIDTH]; 3],
        direction: [[f32::NAN; WIDTH]; 3],
        start: [f32::NAN; WIDTH],
        end: [f32::NAN; WIDTH],
        segment: [0; WIDTH],
    };

    fn set(&mut self, lane: usize, piece: Piece, segment: &Segment) {
        for axis in 0..3 {
            self.origin[axis][lane] = segment.origin[axis];
            self.direction[axis][lane] = segment.direction[axis];
        }
        self.start[lane] = piece.start;
        self.end[lane] = piece.end;
        self.segment[lane] = piece.segment;
    }

    fn piece(&self, lane: usize) -> Segment {
        Segment {
            origin: Vec3::from(self.origin.map(|axis| axis[lane])),
            direction: Vec3::from(self.direction.map(|axis| axis[lane])),
            start: self.start[lane],
            end: self.end[lane],
        }
    }
}

/// Segments with a payload each, searched with any radius.
///
/// Long segments are split into pieces inside; each hit is still reported once. The same segments give the
/// same tree and the same order of visits, whatever the number of threads.
///
/// A query returns the number of groups of eight boxes or pieces of segments that it looked at, the nodes,
/// leaves and blocks of the tree: a measure of its time, 0 if the radius is not positive.
#[derive(Clone, Debug)]
pub struct SegmentTree {
    tree: PackedTree<Exact, Block>,
    payloads: Vec<u32>,
    pieces: usize,
}

impl SegmentTree {
    /// Builds the tree. Segments that are empty or not finite are dropped, and
    /// not [counted](SegmentTree::len): clip a beam without an end to the scene first.
    ///
    /// # Panics
    /// For more than `u32::MAX` pieces.
    #[must_use]
    pub fn build(mut segments: Vec<(Segment, u32)>, params: SplitParams) -> Self {
        segments.retain(|(segment, _)| segment.is_usable());
        let pieces = split(segments.iter().map(|(segment, _)| segment), params);
        // Without what widens boxes, which must not change the order.
        let item = |index: usize| {
            let (min, max) = bounds(&segments[pieces[index].segment as usize].0, pieces[index], 0.0);
            (min * 0.5 + max * 0.5, index as u32)
        };
        let items: Vec<_> = (0..pieces.len()).into_par_iter().with_min_len(1024).map(item).collect();
        let piece_of = |&(_, index): &Item<u32>| {
            let piece = pieces[index as usize];
            (piece, &segments[piece.segment as usize].0)
        };
        let bounds = |item: &Item<u32>| {
            let (piece, segment) = piece_of(item);
            bounds(segment, piece, ROUNDING)
        };
        let tree = PackedTree::build(items, bounds, Block::EMPTY, |block, items| {
            for (lane, item) in items.iter().enumerate() {
                let (piece, segment) = piece_of(item);
                block.set(lane, piece, segment);
            }
        });
        let payloads = segments.into_iter().map(|(_, payload)| payload).collect();
        Self { tree, payloads, pieces: pieces.len() }
    }

    /// Visits every segment that the ray passes within `radius`, at its closest approach to it, see
    /// [`closest_approach`](crate::closest_approach).
    ///
    /// If the ray and a segment are nearly parallel, a hit at the very end of the ray's range, or of the
    /// radius, may be missed.
    pub fn around_ray(
        &self,
        ray: &Ray,
        radius: impl Into<SearchRadius>,
        visit: impl FnMut(u32, ClosestApproach),
    ) -> u32 {
        let radius = radius.into();
        match radius {
            SearchRadius::Constant(constant) => self.within(ray, constant, radius, visit),
            SearchRadius::Growing(growing) => {
                self.within(ray, GrowingAlong::new(&growing, ray), radius, visit)
            }
        }
    }

    fn within(
        &self,
        ray: &Ray,
        along: impl RadiusAlong,
        radius: SearchRadius,
        visit: impl FnMut(u32, ClosestApproach),
    ) -> u32 {
        if !(along.largest() > 0.0) {
            return 0;
        }
        let query = AroundRay { payloads: &self.payloads, ray: *ray, radius: along, visit };
        self.tree.search(ThickRay::new(ray, along), query, |mut query| {
            self.around_ray_plainly(ray, radius, &mut query.visit)
        })
    }

    /// As `around_ray`, with instructions that every processor has; compiled once.
    pub(super) fn around_ray_plainly(
        &self,
        ray: &Ray,
        radius: SearchRadius,
        visit: &mut dyn FnMut(u32, ClosestApproach),
    ) -> u32 {
        let payloads = &self.payloads;
        match radius {
            SearchRadius::Constant(radius) => {
                let query = AroundRay { payloads, ray: *ray, radius, visit };
                self.tree.search_plainly(ThickRay::new(ray, radius), query)
            }
            SearchRadius::Growing(radius) => {
                let radius = GrowingAlong::new(&radius, ray);
                let query = AroundRay { payloads, ray: *ray, radius, visit };
                self.tree.search_plainly(ThickRay::new(ray, radius), query)
            }
        }
    }

    /// Visits every segment nearer than `radius` to `point`.
    ///
    /// `visit` gets the payload, the distance along the segment from its origin to the foot of the
    /// perpendicular, in `[start, end)`, and the squared distance between foot and point, in scene units.
    pub fn around_point(&self, point: Vec3, radius: f32, visit: impl FnMut(u32, f32, f32)) -> u32 {
        if !(radius > 0.0) {
            return 0;
        }
        let query = AroundPoint { payloads: &self.payloads, point, radius2: radius * radius, visit };
        self.tree.search(Ball::widened(point, radius), query, |mut query| {
            self.around_point_plainly(point, radius, &mut query.visit)
        })
    }

    /// As `around_point`, with instructions that every processor has; compiled once.
    pub(super) fn around_point_plainly(
        &self,
        point: Vec3,
        radius: f32,
        visit: &mut dyn FnMut(u32, f32, f32),
    ) -> u32 {
        let query = AroundPoint { payloads: &self.payloads, point, radius2: radius * radius, visit };
        self.tree.search_plainly(Ball::widened(point, radius), query)
    }
}

/// Segments that a ray passes within a radius.
struct AroundRay<'a, R, V> {
    payloads: &'a [u32],
    ray: Ray,
    radius: R,
    visit: V,
}

impl<R: RadiusAlong, V: FnMut(u32, ClosestApproach)> Query<Block> for AroundRay<'_, R, V> {
    type Found = ();

    /// Compares the distance between the lines with the radius, without a division if that is constant.
    /// Squares lose the last bits, or vanish: this keeps too many lanes rather than too few.
    #[inline(always)]
    fn test<W: Wide>(&self, wide: W, block: &Block) -> (u32, ()) {
        let direction = wide.load3(&block.direction);
        let between = wide.sub3(wide.load3(&block.origin), wide.splat3(self.ray.origin.to_array()));
        let normal = wide.cross(wide.splat3(self.ray.direction.to_array()), direction);
        let volume = wide.dot(between, normal);
        let sin2 = wide.dot(normal, normal);
        let radius = if R::IS_CONSTANT {
            wide.splat(self.radius.largest())
        } else {
            let along = wide.dot(wide.cross(between, direction), normal);
            self.radius.at_each(wide, wide.mul(along, wide.div(wide.splat(1.0), sin2)))
        };
        let radius2 = wide.mul(wide.mul(radius, radius), wide.splat(1.000_01));
        let limit = wide.add(wide.mul(radius2, sin2), wide.splat(f32::MIN_POSITIVE));
        (wide.less_equal(wide.mul(volume, volume), limit), ())
    }

    #[inline(always)]
    fn report(&mut self, block: &Block, (): &(), lane: usize) {
        if let Some(approach) = closest_approach(&self.ray, &block.piece(lane), self.radius.largest())
            && (R::IS_CONSTANT || approach.distance < self.radius.at(approach.t_ray))
        {
            (self.visit)(self.payloads[block.segment[lane] as usize], approach);
        }
    }
}

/// Segments nearer than a radius to a point; finds distances along them and squared distances from them.
struct AroundPoint<'a, V> {
    payloads: &'a [u32],
    point: Vec3,
    radius2: f32,
    visit: V,
}

impl<V: FnMut(u32, f32, f32)> Query<Block> for AroundPoint<'_, V> {
    type Found = [[f32; WIDTH]; 2];

    #[inline(always)]
    fn test<W: Wide>(&self, wide: W, block: &Block) -> (u32, Self::Found) {
        let offset = wide.sub3(wide.splat3(self.point.to_array()), wide.load3(&block.origin));
        let [t, distance2] = wide.perpendicular(offset, wide.load3(&block.direction));
        let inside = wide.less(distance2, wide.splat(self.radius2))
            & wide.less_equal(wide.load(&block.start), t)
            & wide.less(t, wide.load(&block.end));
        (inside, [t, distance2].map(|lanes| wide.store(lanes)))
    }

    #[inline(always)]
    fn report(&mut self, block: &Block, [t, distance2]: &Self::Found, lane: usize) {
        (self.visit)(self.payloads[block.segment[lane] as usize], t[lane], distance2[lane]);
    }
}

impl SegmentTree {
    /// The number of segments.
    #[must_use]
    pub fn len(&self) -> usize {
        self.payloads.len()
    }

    /// Whether there are no segments.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.payloads.is_empty()
    }

    /// The number of pieces that the segments were split into.
    #[must_use]
    pub fn pieces(&self) -> usize {
        self.pieces
    }

    /// Memory in use, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes() + self.payloads.capacity() * size_of::<u32>()
    }
}

/// The box of a piece, wider by `rounding` times the greatest distance along it, and rounded outwards: far
/// from the origin of the scene, ends are coarser than a radius may be.
fn bounds(segment: &Segment, piece: Piece, rounding: f32) -> Bounds {
    let at = |s: f32| segment.origin.as_dvec3() + segment.direction.as_dvec3() * f64::from(s);
    let (a, b) = (at(piece.start), at(piece.end));
    let margin = f64::from(rounding) * f64::from(piece.start.abs().max(piece.end.abs()));
    let (min, max) = (a.min(b) - margin, a.max(b) + margin);
    (min.as_vec3().map(f32::next_down), max.as_vec3().map(f32::next_up))
}
