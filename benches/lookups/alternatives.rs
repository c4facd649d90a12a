//! Other structures that answer the questions, each with its own scalar test of an element.

use glam::{Vec3, Vec3A};
use kiddo::SquaredEuclidean;
use kiddo::immutable::float::kdtree::ImmutableKdTree;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::{Boundable, BvhBuildParams};
use upbp_accel::{ClosestApproach, Ray, Segment, closest_approach};

/// A k-d tree from a crate.
pub(crate) struct KdTree(ImmutableKdTree<f32, u32, 3, 32>);

impl KdTree {
    /// Builds for any radius.
    pub(crate) fn build(points: &[[f32; 3]]) -> Self {
        Self(ImmutableKdTree::new_from_slice(points))
    }

    /// Visits the points in a ball.
    pub(crate) fn in_ball(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let found = self.0.within_unsorted::<SquaredEuclidean>(&centre.to_array(), radius * radius);
        for neighbour in found {
            visit(neighbour.item, neighbour.distance);
        }
    }
}

/// Cells of a box and where their elements start in a list.
struct Cells {
    min: Vec3,
    width: Vec3,
    count: [i32; 3],
    starts: Vec<u32>,
}

impl Cells {
    fn new(min: Vec3, max: Vec3, wish: f32, most: usize) -> Self {
        let extent = (max - min).max(Vec3::splat(1e-6));
        let mut wish = wish;
        loop {
            let count = (extent / wish).ceil().max(Vec3::ONE);
            if count.as_dvec3().element_product() <= most as f64 {
                let width = extent * 1.000_01 / count;
                return Self { min, width, count: count.as_ivec3().to_array(), starts: Vec::new() };
            }
            wish *= 1.1;
        }
    }

    fn cell(&self, point: Vec3) -> [i32; 3] {
        let cell = ((point - self.min) / self.width).floor().as_ivec3().to_array();
        std::array::from_fn(|axis| cell[axis].clamp(0, self.count[axis] - 1))
    }

    fn index(&self, [x, y, z]: [i32; 3]) -> usize {
        ((z * self.count[1] + y) * self.count[0] + x) as usize
    }

    /// Sorts numbers by their cell; `of` calls back with every cell of a number.
    fn sort(&mut self, elements: usize, of: impl Fn(&Self, usize, &mut dyn FnMut(usize))) -> Vec<u32> {
        let cells = self.count.iter().product::<i32>() as usize;
        let mut starts = vec![0_u32; cells + 1];
        for element in 0..elements {
            of(self, element, &mut |cell| starts[cell] += 1);
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut sorted = vec![0; sum as usize];
        for element in (0..elements).rev() {
            of(self, element, &mut |cell| {
                starts[cell] -= 1;
                sorted[starts[cell] as usize] = element as u32;
            });
        }
        self.starts = starts;
        sorted
    }
}

/// Points sorted into the cells of a uniform grid.
pub(crate) struct PointGrid {
    cells: Cells,
    points: Vec<(Vec3, u32)>,
}

impl PointGrid {
    /// Builds with cells as wide as the balls to come, but no more than four cells per point.
    pub(crate) fn build(points: &[(Vec3, u32)], radius: f32) -> Self {
        let min = points.iter().fold(Vec3::INFINITY, |min, (p, _)| min.min(*p));
        let max = points.iter().fold(Vec3::NEG_INFINITY, |max, (p, _)| max.max(*p));
        let mut cells = Cells::new(min, max, 2.0 * radius, 4 * points.len());
        let order = cells.sort(points.len(), |cells, point, visit| {
            visit(cells.index(cells.cell(points[point].0)));
        });
        Self { cells, points: order.iter().map(|&index| points[index as usize]).collect() }
    }

    /// Visits the points in a ball.
    pub(crate) fn in_ball(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let [low, high] = [centre - radius, centre + radius].map(|corner| self.cells.cell(corner));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                // The cells of a row lie behind one another.
                let from = self.cells.starts[self.cells.index([low[0], y, z])];
                let to = self.cells.starts[self.cells.index([high[0], y, z]) + 1];
                for (point, payload) in &self.points[from as usize..to as usize] {
                    let distance2 = (*point - centre).length_squared();
                    if distance2 < radius * radius {
                        visit(*payload, distance2);
                    }
                }
            }
        }
    }
}

struct Item(Vec3, Vec3);

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        Aabb::new(Vec3A::from(self.0), Vec3A::from(self.1))
    }
}

fn items<E>(elements: &[E], radius: f32, bounds: impl Fn(&E) -> (Vec3, Vec3)) -> Vec<Item> {
    let inflated = |element| {
        let (min, max) = bounds(element);
        Item(min - radius, max + radius)
    };
    elements.iter().map(inflated).collect()
}

fn thin(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(Vec3A::from(ray.origin), Vec3A::from(ray.direction), ray.t_min, ray.t_max)
}

/// A library's binary tree over boxes inflated by the radius.
pub(crate) struct Binary(Bvh2);

impl Binary {
    /// Builds for one radius.
    pub(crate) fn build<E>(elements: &[E], radius: f32, bounds: impl Fn(&E) -> (Vec3, Vec3)) -> Self {
        let items = items(elements, radius, bounds);
        Self(build_bvh2(&items, BvhBuildParams::fast_build(), &mut std::time::Duration::default()))
    }

    /// Visits the places of elements whose box the ray meets.
    pub(crate) fn candidates(&self, ray: &Ray, mut visit: impl FnMut(usize)) {
        self.0.ray_traverse_anyhit(thin(ray), |_, place| visit(self.0.primitive_indices[place] as usize));
    }
}

/// A library's compressed 8-wide tree over boxes inflated by the radius.
pub(crate) struct Wide(CwBvh);

impl Wide {
    /// Builds for one radius.
    pub(crate) fn build<E>(elements: &[E], radius: f32, bounds: impl Fn(&E) -> (Vec3, Vec3)) -> Self {
        let items = items(elements, radius, bounds);
        Self(build_cwbvh(&items, BvhBuildParams::fast_build(), &mut std::time::Duration::default()))
    }

    /// Visits the places of elements whose box the ray meets.
    pub(crate) fn candidates(&self, ray: &Ray, mut visit: impl FnMut(usize)) {
        self.0.ray_traverse_anyhit(thin(ray), |_, place| visit(self.0.primitive_indices[place] as usize));
    }
}

/// References to beams in the cells of a uniform grid.
pub(crate) struct BeamGrid {
    cells: Cells,
    beams: Vec<u32>,
}

impl BeamGrid {
    /// Builds for one radius. `resolution` is in cells along the widest side.
    pub(crate) fn build(beams: &[(Segment, u32)], radius: f32, resolution: f32) -> Self {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (beam, _) in beams {
            for end in [beam.at(beam.start), beam.at(beam.end)] {
                (min, max) = (min.min(end - radius), max.max(end + radius));
            }
        }
        let mut cells = Cells::new(min, max, (max - min).max_element() / resolution, usize::MAX);
        let beams =
            cells.sort(beams.len(), |cells, beam, visit| cells_of(cells, &beams[beam].0, radius, visit));
        Self { cells, beams }
    }

    /// Visits the beams around a ray.
    pub(crate) fn around_ray(
        &self,
        beams: &[(Segment, u32)],
        ray: &Ray,
        radius: f32,
        mut visit: impl FnMut(u32, ClosestApproach),
    ) {
        let (low, inverse) = (self.cells.min, ray.direction.recip());
        let high = low + self.cells.width * Vec3::from(self.cells.count.map(|n| n as f32));
        let (a, b) = ((low - ray.origin) * inverse, (high - ray.origin) * inverse);
        let mut t = a.min(b).max_element().max(ray.t_min);
        let end = a.max(b).min_element().min(ray.t_max);
        if t >= end {
            return;
        }
        let mut cell = self.cells.cell(ray.at(t));
        let step: [i32; 3] = ray.direction.to_array().map(|d| if d < 0.0 { -1 } else { 1 });
        loop {
            let planes = std::array::from_fn(|axis| (cell[axis] + i32::from(step[axis] > 0)) as f32);
            let leaves = (low + self.cells.width * Vec3::from(planes) - ray.origin) * inverse;
            let axis = leaves.min_position();
            let (next, last) = (leaves[axis].max(t), leaves[axis] >= end);
            let index = self.cells.index(cell);
            let (from, to) = (self.cells.starts[index], self.cells.starts[index + 1]);
            // A beam is in several cells; a hit belongs to the one in which it lies on the ray.
            let part = ray.with_range(t, if last { end } else { next });
            for &beam in &self.beams[from as usize..to as usize] {
                let (segment, payload) = &beams[beam as usize];
                if let Some(approach) = closest_approach(&part, segment, radius) {
                    visit(*payload, approach);
                }
            }
            t = next;
            cell[axis] += step[axis];
            if last || cell[axis] < 0 || cell[axis] >= self.cells.count[axis] {
                return;
            }
        }
    }
}

/// The cells within the radius of a beam, layer by layer along its steepest axis.
fn cells_of(cells: &Cells, beam: &Segment, radius: f32, visit: &mut dyn FnMut(usize)) {
    let axis = (beam.direction.abs() / cells.width).max_position();
    let [a, b] = [beam.at(beam.start), beam.at(beam.end)];
    let margin = Vec3::splat(radius * 1.001 + 1e-5);
    let (first, last) = (cells.cell(a.min(b) - margin)[axis], cells.cell(a.max(b) + margin)[axis]);
    let inverse = 1.0 / beam.direction[axis];
    for layer in first..=last {
        let plane = |n: i32| cells.min[axis] + cells.width[axis] * n as f32;
        let [s, t] = [plane(layer) - margin[axis], plane(layer + 1) + margin[axis]]
            .map(|plane| ((plane - beam.origin[axis]) * inverse).clamp(beam.start, beam.end));
        let (a, b) = (beam.at(s), beam.at(t));
        let (mut low, mut high) = (cells.cell(a.min(b) - margin), cells.cell(a.max(b) + margin));
        (low[axis], high[axis]) = (layer, layer);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    visit(cells.index([x, y, z]));
                }
            }
        }
    }
}
