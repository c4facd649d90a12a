//! Points, looked up in a ball (PP3D, SURF) or around a ray (PB2D).

use glam::Vec3;
use rayon::prelude::*;

use super::boxes::Rounded;
use super::query::Query;
use super::radius::{GrowingAlong, RadiusAlong, SearchRadius};
use super::region::{Ball, ThickRay};
use super::sort::Item;
use super::tree::PackedTree;
use crate::ray::Ray;
use crate::simd::{WIDTH, Wide};

/// Eight points, in two cache lines. An unused lane is NaN, which no comparison accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Block {
    position: [[f32; WIDTH]; 3],
    payload: [u32; WIDTH],
}

impl Block {
    /// Puts items into the first lanes.
    fn fill(&mut self, items: &[Item<u32>]) {
        for (lane, &(position, payload)) in items.iter().enumerate() {
            self.payload[lane] = payload;
            for axis in 0..3 {
                self.position[axis][lane] = position[axis];
            }
        }
    }
}

/// Points with a payload each, searched with any radius. Payloads are numbers of one type, so that the build
/// is compiled once.
///
/// The same points give the same tree and the same order of visits, whatever the number of threads.
///
/// A query returns the number of groups of eight boxes or points that it looked at, the nodes, leaves and
/// blocks of the tree: a measure of its time, 0 if the radius is not positive.
#[derive(Clone, Debug)]
pub struct PointTree {
    tree: PackedTree<Rounded, Block>,
    count: usize,
}

impl PointTree {
    /// Builds the tree over points in scene units. Points that are not finite are dropped,
    /// and not [counted](PointTree::len).
    ///
    /// # Panics
    /// For more than `u32::MAX` points.
    #[must_use]
    pub fn build(mut points: Vec<(Vec3, u32)>) -> Self {
        if !points.par_iter().with_min_len(1 << 14).all(|(position, _)| position.is_finite()) {
            points.retain(|(position, _)| position.is_finite());
        }
        let count = points.len();
        if points.is_empty() {
            return Self { tree: PackedTree::EMPTY, count };
        }
        let empty = Block { position: [[f32::NAN; WIDTH]; 3], payload: [0; WIDTH] };
        let bounds = |&(position, _): &Item<u32>| (position, position);
        let tree = PackedTree::build(points, bounds, empty, Block::fill);
        Self { tree, count }
    }

    /// Visits every point nearer than `radius` to `centre`, in scene units; `visit` gets the payload and the
    /// squared distance.
    pub fn in_ball(&self, centre: Vec3, radius: f32, visit: impl FnMut(u32, f32)) -> u32 {
        self.in_ball_ahead(centre, radius, |_| {}, visit)
    }

    /// [`in_ball`](Self::in_ball) that says ahead what it will visit: `ahead` gets the payloads of a batch of
    /// points before the first of them is visited.
    ///
    /// Where payloads are indices, `ahead` may [read](std::hint::black_box) what they refer to: reads that
    /// miss the cache then wait together.
    pub fn in_ball_ahead(
        &self,
        centre: Vec3,
        radius: f32,
        ahead: impl Fn(u32),
        visit: impl FnMut(u32, f32),
    ) -> u32 {
        if !(radius > 0.0) {
            return 0;
        }
        let ball = Ball::exact(centre, radius);
        let query = InBall { centre, radius2: radius * radius, ahead, visit };
        self.tree.search(ball, query, |mut query| {
            self.in_ball_plainly(centre, radius, &query.ahead, &mut query.visit)
        })
    }

    /// As `in_ball_ahead`, with instructions that every processor has; compiled once.
    pub(super) fn in_ball_plainly(
        &self,
        centre: Vec3,
        radius: f32,
        ahead: &dyn Fn(u32),
        visit: &mut dyn FnMut(u32, f32),
    ) -> u32 {
        let query = InBall { centre, radius2: radius * radius, ahead, visit };
        self.tree.search_plainly(Ball::exact(centre, radius), query)
    }

    /// Visits every point nearer to the ray than `radius`, at the foot of the perpendicular.
    ///
    /// `visit` gets the payload, the distance along the ray to the foot of the perpendicular, in `[t_min,
    /// t_max)`, and the squared distance between foot and point, in scene units.
    pub fn around_ray(
        &self,
        ray: &Ray,
        radius: impl Into<SearchRadius>,
        visit: impl FnMut(u32, f32, f32),
    ) -> u32 {
        self.around_ray_ahead(ray, radius, |_| {}, visit)
    }

    /// [`around_ray`](Self::around_ray) that says ahead what it will visit, as
    /// [`in_ball_ahead`](Self::in_ball_ahead) does.
    pub fn around_ray_ahead(
        &self,
        ray: &Ray,
        radius: impl Into<SearchRadius>,
        ahead: impl Fn(u32),
        visit: impl FnMut(u32, f32, f32),
    ) -> u32 {
        let radius = radius.into();
        match radius {
            SearchRadius::Constant(constant) => self.within(ray, constant, radius, ahead, visit),
            SearchRadius::Growing(growing) => {
                self.within(ray, GrowingAlong::new(&growing, ray), radius, ahead, visit)
            }
        }
    }

    fn within(
        &self,
        ray: &Ray,
        along: impl RadiusAlong,
        radius: SearchRadius,
        ahead: impl Fn(u32),
        visit: impl FnMut(u32, f32, f32),
    ) -> u32 {
        if !(along.largest() > 0.0) {
            return 0;
        }
        let query = AroundRay { ray: *ray, radius: along, ahead, visit };
        self.tree.search(ThickRay::new(ray, along), query, |mut query| {
            self.around_ray_plainly(ray, radius, &query.ahead, &mut query.visit)
        })
    }

    /// As `around_ray`, with instructions that every processor has; compiled once.
    pub(super) fn around_ray_plainly(
        &self,
        ray: &Ray,
        radius: SearchRadius,
        ahead: &dyn Fn(u32),
        visit: &mut dyn FnMut(u32, f32, f32),
    ) -> u32 {
        match radius {
            SearchRadius::Constant(radius) => {
                let query = AroundRay { ray: *ray, radius, ahead, visit };
                self.tree.search_plainly(ThickRay::new(ray, radius), query)
            }
            SearchRadius::Growing(radius) => {
                let radius = GrowingAlong::new(&radius, ray);
                let query = AroundRay { ray: *ray, radius, ahead, visit };
                self.tree.search_plainly(ThickRay::new(ray, radius), query)
            }
        }
    }
}

/// Points nearer than a radius to a centre; finds squared distances.
struct InBall<A, V> {
    centre: Vec3,
    radius2: f32,
    ahead: A,
    visit: V,
}

impl<A: Fn(u32), V: FnMut(u32, f32)> Query<Block> for InBall<A, V> {
    type Found = [f32; WIDTH];

    #[inline(always)]
    fn test<W: Wide>(&self, wide: W, block: &Block) -> (u32, Self::Found) {
        let offset = wide.sub3(wide.load3(&block.position), wide.splat3(self.centre.to_array()));
        let distance2 = wide.dot(offset, offset);
        (wide.less(distance2, wide.splat(self.radius2)), wide.store(distance2))
    }

    const ANNOUNCES: bool = true;

    #[inline(always)]
    fn announce(&self, block: &Block, lane: usize) {
        (self.ahead)(block.payload[lane]);
    }

    #[inline(always)]
    fn report(&mut self, block: &Block, distance2: &Self::Found, lane: usize) {
        (self.visit)(block.payload[lane], distance2[lane]);
    }
}

/// Points nearer than a radius to a ray; finds distances along it and squared distances from it.
struct AroundRay<R, A, V> {
    ray: Ray,
    radius: R,
    ahead: A,
    visit: V,
}

impl<R: RadiusAlong, A: Fn(u32), V: FnMut(u32, f32, f32)> Query<Block> for AroundRay<R, A, V> {
    type Found = [[f32; WIDTH]; 2];

    #[inline(always)]
    fn test<W: Wide>(&self, wide: W, block: &Block) -> (u32, Self::Found) {
        // Differences first: dot products of positions cancel far from the origin.
        let offset = wide.sub3(wide.load3(&block.position), wide.splat3(self.ray.origin.to_array()));
        let [t, distance2] = wide.perpendicular(offset, wide.splat3(self.ray.direction.to_array()));
        let radius = self.radius.at_each(wide, t);
        let inside = wide.less(distance2, wide.mul(radius, radius))
            & wide.less_equal(wide.splat(self.ray.t_min), t)
            & wide.less(t, wide.splat(self.ray.t_max));
        (inside, [t, distance2].map(|lanes| wide.store(lanes)))
    }

    const ANNOUNCES: bool = true;

    #[inline(always)]
    fn announce(&self, block: &Block, lane: usize) {
        (self.ahead)(block.payload[lane]);
    }

    #[inline(always)]
    fn report(&mut self, block: &Block, [t, distance2]: &Self::Found, lane: usize) {
        (self.visit)(block.payload[lane], t[lane], distance2[lane]);
    }
}

impl PointTree {
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

    /// Memory in use, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.tree.memory_bytes()
    }
}
