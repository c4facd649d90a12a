//! Points, looked up in a ball (PP3D, SURF) or around a ray (PB2D).

use glam::Vec3;
use rayon::prelude::*;

use super::boxes::{Boxes, Rounded};
use super::lanes::{WIDTH, Wide};
use super::query::{BallProbe, RayProbe, lanes};
use super::sort::Item;
use super::tree::{PackedTree, Query, WAITING};
use crate::ray::Ray;

/// Eight points; with small payloads two cache lines. An unused lane is NaN, which no comparison accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Block<P> {
    position: [[f32; WIDTH]; 3],
    payload: [P; WIDTH],
}

impl<P: Copy> Block<P> {
    /// Puts items into the first lanes.
    fn fill(&mut self, items: &[Item<P>]) {
        for (lane, &(position, payload)) in items.iter().enumerate() {
            self.payload[lane] = payload;
            for axis in 0..3 {
                self.position[axis][lane] = position[axis];
            }
        }
    }
}

/// Points with a payload each, for look-ups with any radius.
///
/// The same points give the same tree and the same order of visits, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct PointTree<P> {
    tree: PackedTree<Rounded>,
    blocks: Vec<Block<P>>,
    count: usize,
    dropped: usize,
}

impl<P: Copy + Send + Sync> PointTree<P> {
    /// Builds over points in scene units. Points that are not finite are dropped and
    /// [counted](PointTree::dropped).
    ///
    /// # Panics
    /// For more than `u32::MAX` points.
    #[must_use]
    pub fn build(mut points: Vec<(Vec3, P)>) -> Self {
        let count = points.len();
        if !points.par_iter().with_min_len(1 << 14).all(|(position, _)| position.is_finite()) {
            points.retain(|(position, _)| position.is_finite());
        }
        let dropped = count - points.len();
        let Some(&(_, payload)) = points.first() else {
            return Self { tree: PackedTree::EMPTY, blocks: Vec::new(), count: 0, dropped };
        };
        let empty = Block { position: [[f32::NAN; WIDTH]; 3], payload: [payload; WIDTH] };
        let bounds = |&(position, _): &Item<P>| (position, position);
        let (tree, blocks) = PackedTree::build(points, bounds, empty, Block::fill);
        Self { tree, blocks, count: count - dropped, dropped }
    }

    /// Visits every point nearer than `radius` to `centre`, with the squared distance.
    pub fn in_ball(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(P, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let visit = |payload, _, distance2| visit(payload, distance2);
        let probe = BallProbe::exact(centre, radius);
        self.tree.ask(InBall { points: self, probe, centre, radius2: radius * radius, visit });
    }

    /// Visits every point nearer than `radius` to the ray, with the distance `t` along the ray to the foot of
    /// the perpendicular and the squared distance from it. `t` is in `[t_min, t_max)`.
    pub fn around_ray(&self, ray: &Ray, radius: f32, visit: impl FnMut(P, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = RayProbe::new(ray, radius, self.tree.extent_from(ray.origin));
        self.tree.ask(AroundRay { points: self, probe, ray: *ray, radius2: radius * radius, visit });
    }
}

struct InBall<'a, P, V> {
    points: &'a PointTree<P>,
    probe: BallProbe,
    centre: Vec3,
    radius2: f32,
    visit: V,
}

impl<P: Copy, V: FnMut(P, f32, f32)> Query for InBall<'_, P, V> {
    #[inline(always)]
    fn boxes<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        self.probe.test(wide, boxes)
    }

    #[inline(always)]
    fn blocks<W: Wide>(&mut self, wide: W, blocks: &[u32]) {
        let centre = wide.splat3(self.centre.to_array());
        let radius2 = wide.splat(self.radius2);
        let mut inside = [0_u32; WAITING];
        let mut distances2 = [[0.0; WIDTH]; WAITING];
        for (slot, &block) in blocks.iter().enumerate() {
            let offset = wide.sub3(wide.load3(&self.points.blocks[block as usize].position), centre);
            let distance2 = wide.dot(offset, offset);
            inside[slot] = wide.less(distance2, radius2);
            distances2[slot] = wide.store(distance2);
        }
        for (slot, &block) in blocks.iter().enumerate() {
            let payload = &self.points.blocks[block as usize].payload;
            for lane in lanes(inside[slot]) {
                (self.visit)(payload[lane], 0.0, distances2[slot][lane]);
            }
        }
    }
}

struct AroundRay<'a, P, V> {
    points: &'a PointTree<P>,
    probe: RayProbe,
    ray: Ray,
    radius2: f32,
    visit: V,
}

impl<P: Copy, V: FnMut(P, f32, f32)> Query for AroundRay<'_, P, V> {
    #[inline(always)]
    fn boxes<W: Wide>(&self, wide: W, boxes: &impl Boxes) -> u32 {
        self.probe.test(wide, boxes)
    }

    #[inline(always)]
    fn blocks<W: Wide>(&mut self, wide: W, blocks: &[u32]) {
        for &block in blocks {
            self.block(wide, &self.points.blocks[block as usize]);
        }
    }
}

impl<P: Copy, V: FnMut(P, f32, f32)> AroundRay<'_, P, V> {
    #[inline(always)]
    fn block<W: Wide>(&mut self, wide: W, block: &Block<P>) {
        let direction = wide.splat3(self.ray.direction.to_array());
        // Differences first: dot products of positions cancel far from the origin.
        let offset = wide.sub3(wide.load3(&block.position), wide.splat3(self.ray.origin.to_array()));
        let t = wide.dot(offset, direction);
        let across = wide.sub3(offset, wide.scale3(direction, t));
        let distance2 = wide.dot(across, across);
        let inside = wide.less(distance2, wide.splat(self.radius2))
            & wide.less_equal(wide.splat(self.ray.t_min), t)
            & wide.less(t, wide.splat(self.ray.t_max));
        let (t, distance2) = (wide.store(t), wide.store(distance2));
        for lane in lanes(inside) {
            (self.visit)(block.payload[lane], t[lane], distance2[lane]);
        }
    }
}

impl<P> PointTree<P> {
    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The number of points that were not finite.
    #[must_use]
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// Memory in use, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes() + self.blocks.capacity() * size_of::<Block<P>>()
    }
}
