//! Segments, looked up around a ray (BB1D) or around a point (BP2D).

use glam::Vec3;
use rayon::prelude::*;

use super::approach::{ClosestApproach, Lines, PARALLEL_SIN2, Segment, closest_approach};
use super::packed::{PackedTree, WIDTH};
use super::probe::{BallProbe, RayProbe, bits};
use super::split::{Piece, SplitParams, split};
use crate::ray::Ray;

/// Eight pieces. An unused lane is NaN, which no comparison accepts.
#[derive(Clone, Copy, Debug)]
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
    tree: PackedTree,
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
        let (tree, order) = PackedTree::build(pieces.len(), |index| {
            let piece = pieces[index];
            bounds(&segments[piece.segment as usize].0, piece)
        });
        let blocks = order
            .par_chunks(WIDTH)
            .with_min_len(1024)
            .map(|items| {
                let mut block = Block::EMPTY;
                for (lane, &index) in items.iter().enumerate() {
                    let piece = pieces[index as usize];
                    block.set(lane, piece, &segments[piece.segment as usize].0);
                }
                block
            })
            .collect();
        let ends = segments.iter().flat_map(|(segment, _)| [segment.start, segment.end]);
        let reach = ends.fold(0.0, |reach: f32, end| reach.max(end.abs()));
        let payloads = segments.into_iter().map(|(_, payload)| payload).collect();
        Self { tree, blocks, payloads, reach, pieces: pieces.len(), dropped }
    }

    /// Visits every segment that the ray passes within `radius`, see
    /// [`closest_approach`](crate::closest_approach).
    ///
    /// Among lines that are parallel within rounding, a hit at the very end of the ray's range may be missed.
    #[expect(clippy::needless_bitwise_bool, reason = "branches would keep the loop from being vectorised")]
    pub fn around_ray(&self, ray: &Ray, radius: f32, mut visit: impl FnMut(P, ClosestApproach)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = RayProbe::new(ray, radius, self.tree.extent_from(ray.origin) + self.reach);
        // Squares lose the last bits; the decision is made once more below.
        let radius2 = radius * radius * 1.000_01;
        let (o, d) = (ray.origin, ray.direction.to_array());
        self.tree.traverse(
            |boxes| probe.test(boxes),
            |index| {
                let block = &self.blocks[index];
                let mut inside = [false; WIDTH];
                for (lane, inside) in inside.iter_mut().enumerate() {
                    let between = [
                        block.origin[0][lane] - o.x,
                        block.origin[1][lane] - o.y,
                        block.origin[2][lane] - o.z,
                    ];
                    let direction =
                        [block.direction[0][lane], block.direction[1][lane], block.direction[2][lane]];
                    let lines = Lines::solve(d, direction, between);
                    *inside = (lines.volume * lines.volume * lines.inverse_sin2 <= radius2)
                        & (lines.t_segment >= block.start[lane])
                        & (lines.t_segment < block.end[lane])
                        & (lines.t_ray >= ray.t_min)
                        & (lines.t_ray < ray.t_max)
                        & (lines.sin2 >= PARALLEL_SIN2);
                }
                for lane in lanes(bits(inside)) {
                    if let Some(approach) = closest_approach(ray, &block.piece(lane), radius) {
                        visit(self.payloads[block.segment[lane] as usize], approach);
                    }
                }
            },
        );
    }

    /// Visits every segment nearer than `radius` to `point`, with the distance along the segment, from its
    /// origin, to the foot of the perpendicular, and the squared distance from it. The foot is in
    /// `[start, end)`.
    #[expect(clippy::needless_bitwise_bool, reason = "branches would keep the loop from being vectorised")]
    pub fn around_point(&self, point: Vec3, radius: f32, mut visit: impl FnMut(P, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = BallProbe::widened(point, radius, self.tree.extent_from(point) + self.reach);
        let radius2 = radius * radius;
        self.tree.traverse(
            |boxes| probe.test(boxes),
            |index| {
                let block = &self.blocks[index];
                let ([ox, oy, oz], [dx, dy, dz]) = (&block.origin, &block.direction);
                let mut t = [0.0; WIDTH];
                let mut distance2 = [0.0; WIDTH];
                let mut inside = [false; WIDTH];
                for lane in 0..WIDTH {
                    let (x, y, z) = (point.x - ox[lane], point.y - oy[lane], point.z - oz[lane]);
                    t[lane] = x * dx[lane] + y * dy[lane] + z * dz[lane];
                    let (x, y, z) = (x - t[lane] * dx[lane], y - t[lane] * dy[lane], z - t[lane] * dz[lane]);
                    distance2[lane] = x * x + y * y + z * z;
                    inside[lane] = (distance2[lane] < radius2)
                        & (t[lane] >= block.start[lane])
                        & (t[lane] < block.end[lane]);
                }
                for lane in lanes(bits(inside)) {
                    visit(self.payloads[block.segment[lane] as usize], t[lane], distance2[lane]);
                }
            },
        );
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

/// The lanes whose bit is set.
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}

/// The box of a piece, rounded outwards: far from the origin the ends are coarser than a radius may be.
fn bounds(segment: &Segment, piece: Piece) -> (Vec3, Vec3) {
    let at = |s: f32| segment.origin.as_dvec3() + segment.direction.as_dvec3() * f64::from(s);
    let (a, b) = (at(piece.start), at(piece.end));
    (a.min(b).as_vec3().map(f32::next_down), a.max(b).as_vec3().map(f32::next_up))
}
