//! The primitives under the leaves of the hierarchy, and a ray's test against one.

use glam::Vec3;

use super::{Candidate, ShapeId};
use crate::ray::Ray;
use crate::shape::{AxisBox, Quad, RayShear, Shape, Sphere};

/// A primitive with what its test needs, so that a leaf is read in one go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    shape: ShapeId,
    primitive: u32,
    geometry: Geometry,
}

#[derive(Clone, Copy, Debug)]
enum Geometry {
    Sphere(Sphere),
    Quad(Quad),
    Box(AxisBox),
    Triangle([Vec3; 3]),
}

/// All primitives of a list of shapes, in its order.
pub(super) fn collect(shapes: &[Shape]) -> Vec<Item> {
    let mut items = Vec::new();
    for (index, shape) in shapes.iter().enumerate() {
        let id = ShapeId(index as u32);
        let mut push = |primitive, geometry| items.push(Item { shape: id, primitive, geometry });
        match shape {
            Shape::Sphere(sphere) => push(0, Geometry::Sphere(*sphere)),
            Shape::Quad(quad) => push(0, Geometry::Quad(*quad)),
            Shape::Box(axis_box) => push(0, Geometry::Box(*axis_box)),
            Shape::Mesh(mesh) => {
                for triangle in 0..mesh.triangles().len() as u32 {
                    push(triangle, Geometry::Triangle(mesh.corners(triangle)));
                }
            }
        }
    }
    items
}

impl Item {
    /// The least and the greatest coordinates.
    pub(super) fn aabb(&self) -> (Vec3, Vec3) {
        match &self.geometry {
            Geometry::Sphere(sphere) => sphere.aabb(),
            Geometry::Quad(quad) => quad.aabb(),
            Geometry::Box(axis_box) => axis_box.aabb(),
            Geometry::Triangle([a, b, c]) => (a.min(*b).min(*c), a.max(*b).max(*c)),
        }
    }
}

/// A ray, prepared for tests against primitives.
pub(super) struct Probe {
    origin: Vec3,
    direction: Vec3,
    /// Only where there are triangles.
    shear: Option<RayShear>,
}

impl Probe {
    pub(super) fn new(ray: &Ray, triangles: bool) -> Self {
        let shear = triangles.then(|| RayShear::new(ray.origin, ray.direction));
        Self { origin: ray.origin, direction: ray.direction, shear }
    }

    /// Where the line meets the primitive, whatever the range of the ray.
    #[inline]
    pub(super) fn intersect(&self, item: &Item) -> [Option<Candidate>; 2] {
        let at = |t: f64, primitive: u32, uv: [f32; 2]| {
            Some(Candidate { t: t as f32, shape: item.shape, primitive, uv })
        };
        match &item.geometry {
            Geometry::Triangle(corners) => {
                match self.shear.as_ref().and_then(|shear| shear.intersect(*corners)) {
                    Some(hit) => [at(hit.t, item.primitive, hit.weights), None],
                    None => [None, None],
                }
            }
            Geometry::Quad(quad) => match quad.intersect(self.origin, self.direction) {
                Some((t, uv)) => [at(t, 0, uv), None],
                None => [None, None],
            },
            Geometry::Sphere(sphere) => match sphere.intersect(self.origin, self.direction) {
                Some([entry, exit]) => [at(entry, 0, [0.0; 2]), at(exit, 1, [0.0; 2])],
                None => [None, None],
            },
            Geometry::Box(axis_box) => match axis_box.intersect(self.origin, self.direction) {
                Some([entry, exit]) => [at(entry.0, entry.1, [0.0; 2]), at(exit.0, exit.1, [0.0; 2])],
                None => [None, None],
            },
        }
    }
}
