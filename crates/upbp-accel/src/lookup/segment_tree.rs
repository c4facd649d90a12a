//! Segments, looked up around a ray (BB1D) or around a point (BP2D).

use std::cell::Cell;

use glam::Vec3;
use rayon::prelude::*;

use super::approach::{ClosestApproach, Segment, closest_approach};
use super::boxes::{Boxes, Exact};
use super::lanes::{WIDTH, Wide};
use super::query::{BallProbe, RayProbe, lanes};
use super::sort::Item;
use super::split::{Piece, SplitParams, split};
use super::tree::{PackedTree, Query};
use crate::ray::Ray;

/// Eight pieces; what most of them fail by is in three cache lines. An unused lane is NaN, which no comparison
/// accepts.
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

/// Segments with a payload each, for look-ups with any radius.
///
/// Long segments are split into pieces inside; a hit is reported once all the same. The same segments
/// give the same tree and the same order of visits, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct SegmentTree<P> {
    tree: PackedTree<Exact>,
    blocks: Vec<Block>,
    payloads: Vec<P>,
    /// The greatest distance from a segment to the point that it is measured from.
    reach: f32,
    pieces: usize,
    dropped: usize,
}

impl<P: Copy + Send + Sync> SegmentTree<P> {
    /// Builds over segments. Those that are empty or have numbers that are not finite are dropped and
    /// [counted](SegmentTree::dropped): clip a beam without an end to the scene first.
    ///
    /// # Panics
    /// For more than `u32::MAX` pieces.
    #[must_use]
    pub fn build(mut segments: Vec<(Segment, P)>, params: SplitParams) -> Self {
        let count = segments.len();
        segments.retain(|(segment, _)| segment.is_usable());
        let dropped = count - segments.len();
        let pieces = split(segments.iter().map(|(segment, _)| segment), params);
        let item = |index: usize| {
            let (min, max) = bounds(&segments[pieces[index].segment as usize].0, pieces[index]);
            (min * 0.5 + max * 0.5, index as u32)
        };
        let items: Vec<_> = (0..pieces.len()).into_par_iter().with_min_len(1024).map(item).collect();
        let piece_of = |&(_, index): &Item<u32>| {
            let piece = pieces[index as usize];
            (piece, &segments[piece.segment as usize].0)
        };
        let bounds = |item: &Item<u32>| {
            let (piece, segment) = piece_of(item);
            bounds(segment, piece)
        };
        let (tree, blocks) = PackedTree::build(items, bounds, Block::EMPTY, |block, items| {
            for (lane, item) in items.iter().enumerate() {
                let (piece, segment) = piece_of(item);
                block.set(lane, piece, segment);
            }
        });
        let ends = segments.iter().flat_map(|(segment, _)| [segment.start, segment.end]);
        let reach = ends.fold(0.0, |reach: f32, end| reach.max(end.abs()));
        let payloads = segments.into_iter().map(|(_, payload)| payload).collect();
        Self { tree, blocks, payloads, reach, pieces: pieces.len(), dropped }
    }

    /// Visits every segment that the ray passes within `radius`, see
    /// [`closest_approach`](crate::closest_approach).
    ///
    /// Among lines that are parallel within rounding, a hit at the very end of the ray's range may be missed.
    pub fn around_ray(&self, ray: &Ray, radius: f32, visit: impl FnMut(P, ClosestApproach)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = RayProbe::new(ray, radius, self.tree.extent_from(ray.origin) + self.reach);
        self.tree.ask(AroundRay { segments: self, probe, ray: *ray, radius, visit });
    }

    /// Visits every segment nearer than `radius` to `point`, with the distance along the segment, from its
    /// origin, to the foot of the perpendicular, and the squared distance from it. The foot is in
    /// `[start, end)`.
    pub fn around_point(&self, point: Vec3, radius: f32, visit: impl FnMut(P, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = BallProbe::widened(point, radius, self.tree.extent_from(point) + self.reach);
        self.tree.ask(AroundPoint { segments: self, probe, point, radius2: radius * radius, visit });
    }
}

impl SplitParams {
    /// Of so many segments, one is looked at.
    const SAMPLED: usize = 16;

    /// Segments that are looked at, at least and at most: fewer tell nothing, more tell nothing new.
    const SAMPLE: (usize, usize) = (64, 1024);

    /// Rays that ask among them.
    const RAYS: usize = 128;

    /// The default, or no split where that looks better: among beams through one place, whose pieces lie there together, and
    /// all the more the fewer they are.
    ///
    /// Decided by how many boxes and blocks some rays between segments have to look at, with and without a split of a sample;
    /// depends on nothing but the segments.
    #[must_use]
    pub fn choose<P>(segments: &[(Segment, P)]) -> Self {
        let (least, most) = Self::SAMPLE;
        let (split, whole) = (Self::default(), Self { pieces_per_segment: 1.0, ..Self::default() });
        let count = (segments.len() / Self::SAMPLED).min(most);
        if count < least {
            return split;
        }
        // Scattered: segments may repeat with a period.
        let scattered =
            |i: usize, count: usize| ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize % count;
        let stride = segments.len() / count;
        let sampled = |i: usize| (segments[i * stride + scattered(i, stride)].0, ());
        let sample: Vec<_> = (0..count).map(sampled).filter(|(segment, ())| segment.is_usable()).collect();
        let place = |i: usize| {
            let segment = sample.get(scattered(i, count))?.0;
            let part = (scattered(i + 1, 256) as f32 + 0.5) / 256.0;
            Some(segment.at(segment.start + (segment.end - segment.start) * part))
        };
        let ray = |i: usize| {
            let (a, b) = (place(2 * i)?, place(2 * i + 1)?);
            Some(Ray::new(a, (b - a).try_normalize()?).with_range(f32::NEG_INFINITY, f32::INFINITY))
        };
        let rays: Vec<_> = (0..Self::RAYS).filter_map(ray).collect();
        let effort = |params| SegmentTree::build(sample.clone(), params).effort(&rays) as f64;
        // Pieces gain about so much more among more segments, and have to gain so much as they take more memory.
        let more = (segments.len() as f64 / count as f64).powf(0.1);
        if effort(whole) * more >= effort(split) * 1.45 { split } else { whole }
    }
}

/// Counts what is in the way of rays without width.
struct Effort<'a> {
    probe: RayProbe,
    total: &'a Cell<u64>,
}

impl Query for Effort<'_> {
    #[inline(always)]
    fn boxes<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        self.total.set(self.total.get() + 1);
        self.probe.test(wide, boxes)
    }

    #[inline(always)]
    fn blocks<W: Wide>(&mut self, _: W, blocks: &[u32]) {
        self.total.set(self.total.get() + 2 * blocks.len() as u64);
    }
}

impl<P> SegmentTree<P> {
    /// The number of nodes and leaves that rays without width have to look at, and twice that of blocks.
    fn effort(&self, rays: &[Ray]) -> u64 {
        let total = Cell::new(0);
        for ray in rays {
            self.tree.ask(Effort { probe: RayProbe::new(ray, 0.0, 0.0), total: &total });
        }
        total.get()
    }
}

struct AroundRay<'a, P, V> {
    segments: &'a SegmentTree<P>,
    probe: RayProbe,
    ray: Ray,
    radius: f32,
    visit: V,
}

impl<P: Copy, V: FnMut(P, ClosestApproach)> Query for AroundRay<'_, P, V> {
    #[inline(always)]
    fn boxes<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        self.probe.test(wide, boxes)
    }

    #[inline(always)]
    fn blocks<W: Wide>(&mut self, wide: W, blocks: &[u32]) {
        for &block in blocks {
            self.block(wide, &self.segments.blocks[block as usize]);
        }
    }
}

impl<P: Copy, V: FnMut(P, ClosestApproach)> AroundRay<'_, P, V> {
    #[inline(always)]
    fn block<W: Wide>(&mut self, wide: W, block: &Block) {
        let direction = wide.load3(&block.direction);
        let between = wide.sub3(wide.load3(&block.origin), wide.splat3(self.ray.origin.to_array()));
        let normal = wide.cross(wide.splat3(self.ray.direction.to_array()), direction);
        let volume = wide.dot(between, normal);
        let sin2 = wide.dot(normal, normal);
        // The distance between the lines, without a division. Squares lose the last bits, or vanish; the decision
        // is made once more below.
        let radius2 = wide.splat(self.radius * self.radius * 1.000_01);
        let limit = wide.add(wide.mul(radius2, sin2), wide.splat(f32::MIN_POSITIVE));
        let near = wide.less_equal(wide.mul(volume, volume), limit);
        for lane in lanes(near) {
            if let Some(approach) = closest_approach(&self.ray, &block.piece(lane), self.radius) {
                (self.visit)(self.segments.payloads[block.segment[lane] as usize], approach);
            }
        }
    }
}

struct AroundPoint<'a, P, V> {
    segments: &'a SegmentTree<P>,
    probe: BallProbe,
    point: Vec3,
    radius2: f32,
    visit: V,
}

impl<P: Copy, V: FnMut(P, f32, f32)> Query for AroundPoint<'_, P, V> {
    #[inline(always)]
    fn boxes<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        self.probe.test(wide, boxes)
    }

    #[inline(always)]
    fn blocks<W: Wide>(&mut self, wide: W, blocks: &[u32]) {
        for &block in blocks {
            self.block(wide, &self.segments.blocks[block as usize]);
        }
    }
}

impl<P: Copy, V: FnMut(P, f32, f32)> AroundPoint<'_, P, V> {
    #[inline(always)]
    fn block<W: Wide>(&mut self, wide: W, block: &Block) {
        let direction = wide.load3(&block.direction);
        let offset = wide.sub3(wide.splat3(self.point.to_array()), wide.load3(&block.origin));
        let t = wide.dot(offset, direction);
        let across = wide.sub3(offset, wide.scale3(direction, t));
        let distance2 = wide.dot(across, across);
        let inside = wide.less(distance2, wide.splat(self.radius2))
            & wide.less_equal(wide.load(&block.start), t)
            & wide.less(t, wide.load(&block.end));
        let (t, distance2) = (wide.store(t), wide.store(distance2));
        for lane in lanes(inside) {
            (self.visit)(self.segments.payloads[block.segment[lane] as usize], t[lane], distance2[lane]);
        }
    }
}

impl<P> SegmentTree<P> {
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

    /// The number of segments that were empty or not finite.
    #[must_use]
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// Memory in use, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes()
            + self.blocks.capacity() * size_of::<Block>()
            + self.payloads.capacity() * size_of::<P>()
    }
}

/// The box of a piece, rounded outwards: far from the origin the ends are coarser than a radius may be.
fn bounds(segment: &Segment, piece: Piece) -> (Vec3, Vec3) {
    let at = |s: f32| segment.origin.as_dvec3() + segment.direction.as_dvec3() * f64::from(s);
    let (a, b) = (at(piece.start), at(piece.end));
    (a.min(b).as_vec3().map(f32::next_down), a.max(b).as_vec3().map(f32::next_up))
}
