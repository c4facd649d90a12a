//! Points, looked up in a ball (PP3D, SURF) or around a ray (PB2D).

use glam::Vec3;
use rayon::prelude::*;

use super::packed::{PackedTree, WIDTH};
use super::probe::{BallProbe, RayProbe, bits};
use crate::ray::Ray;

/// Eight points. An unused lane is NaN, which no comparison accepts.
type Block = [[f32; WIDTH]; 3];

/// Points with a payload each, for look-ups with any radius.
///
/// The same points give the same tree and the same order of visits, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct PointTree<P> {
    tree: PackedTree,
    blocks: Vec<Block>,
    /// In the order of the blocks.
    payloads: Vec<P>,
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
        points.retain(|(position, _)| position.is_finite());
        let dropped = count - points.len();
        let (tree, order) = PackedTree::build(points.len(), |index| (points[index].0, points[index].0));
        let blocks = order
            .par_chunks(WIDTH)
            .with_min_len(1024)
            .map(|items| {
                let mut block = [[f32::NAN; WIDTH]; 3];
                for (lane, &index) in items.iter().enumerate() {
                    for (axis, x) in points[index as usize].0.to_array().into_iter().enumerate() {
                        block[axis][lane] = x;
                    }
                }
                block
            })
            .collect();
        let payloads = order.par_iter().with_min_len(8192).map(|&index| points[index as usize].1).collect();
        Self { tree, blocks, payloads, dropped }
    }

    /// Visits every point nearer than `radius` to `centre`, with the squared distance.
    pub fn in_ball(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(P, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = BallProbe::exact(centre, radius);
        let radius2 = radius * radius;
        self.tree.traverse(
            |boxes| probe.test(boxes),
            |index| {
                let [x, y, z] = &self.blocks[index];
                let mut distance2 = [0.0; WIDTH];
                let mut inside = [false; WIDTH];
                for lane in 0..WIDTH {
                    let (dx, dy, dz) = (x[lane] - centre.x, y[lane] - centre.y, z[lane] - centre.z);
                    distance2[lane] = dx * dx + dy * dy + dz * dz;
                    inside[lane] = distance2[lane] < radius2;
                }
                self.report(index, bits(inside), |payload, lane| visit(payload, distance2[lane]));
            },
        );
    }

    /// Visits every point nearer than `radius` to the ray, with the distance `t` along the ray to the foot of
    /// the perpendicular and the squared distance from it. `t` is in `[t_min, t_max)`.
    #[expect(clippy::needless_bitwise_bool, reason = "branches would keep the loop from being vectorised")]
    pub fn around_ray(&self, ray: &Ray, radius: f32, mut visit: impl FnMut(P, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let probe = RayProbe::new(ray, radius, self.tree.extent_from(ray.origin));
        let radius2 = radius * radius;
        let (origin, direction) = (ray.origin, ray.direction);
        self.tree.traverse(
            |boxes| probe.test(boxes),
            |index| {
                let [x, y, z] = &self.blocks[index];
                let mut t = [0.0; WIDTH];
                let mut distance2 = [0.0; WIDTH];
                let mut inside = [false; WIDTH];
                for lane in 0..WIDTH {
                    // Differences first: dot products of positions cancel far from the origin.
                    let (dx, dy, dz) = (x[lane] - origin.x, y[lane] - origin.y, z[lane] - origin.z);
                    t[lane] = dx * direction.x + dy * direction.y + dz * direction.z;
                    let (dx, dy, dz) =
                        (dx - t[lane] * direction.x, dy - t[lane] * direction.y, dz - t[lane] * direction.z);
                    distance2[lane] = dx * dx + dy * dy + dz * dz;
                    inside[lane] =
                        (distance2[lane] < radius2) & (t[lane] >= ray.t_min) & (t[lane] < ray.t_max);
                }
                self.report(index, bits(inside), |payload, lane| visit(payload, t[lane], distance2[lane]));
            },
        );
    }

    #[inline]
    fn report(&self, block: usize, mut lanes: u32, mut visit: impl FnMut(P, usize)) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            visit(self.payloads[block * WIDTH + lane], lane);
        }
    }
}

impl<P> PointTree<P> {
    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.payloads.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.payloads.is_empty()
    }

    /// The number of points that were not finite.
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
