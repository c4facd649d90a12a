//! The primitives under the leaves of the hierarchy, and a ray's test against one.

use std::ops::ControlFlow;

use glam::Vec3;

use super::axis_box::AxisBox;
use super::hit::{Candidate, ShapeId};
use super::quad::Quad;
use super::shape::Shape;
use super::sphere::Sphere;
use super::triangle::RayShear;
use crate::ray::Ray;

/// A primitive together with the geometry for its test, so that a leaf is read in one go.
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
    /// `None` in a scene without triangles.
    shear: Option<RayShear>,
}

impl Probe {
    pub(super) fn new(ray: &Ray, triangles: bool) -> Self {
        let shear = triangles.then(|| RayShear::new(ray.origin, ray.direction));
        Self { origin: ray.origin, direction: ray.direction, shear }
    }

    /// Calls `found` with the intersections of the line and the primitive that lie in the open interval
    /// `(t_min, t_max)`, where `found` may lower `t_max`.
    #[inline]
    pub(super) fn intersect(
        &self,
        item: &Item,
        t_min: f32,
        t_max: &mut f32,
        mut found: impl FnMut(&Candidate, &mut f32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut at = |t: f64, primitive: u32, uv: [f32; 2]| {
            let t = t as f32;
            if t > t_min && t < *t_max {
                found(&Candidate { t, shape: item.shape, primitive, uv }, t_max)
            } else {
                ControlFlow::Continue(())
            }
        };
        match &item.geometry {
            Geometry::Triangle(corners) => {
                if let Some(hit) = self.shear.as_ref().and_then(|shear| shear.intersect(*corners)) {
                    at(hit.t, item.primitive, hit.weights)?;
                }
            }
            Geometry::Quad(quad) => {
                if let Some((t, uv)) = quad.intersect(self.origin, self.direction) {
                    at(t, 0, uv)?;
                }
            }
            Geometry::Sphere(sphere) => {
                if let Some([entry, exit]) = sphere.intersect(self.origin, self.direction) {
                    at(entry, 0, [0.0; 2])?;
                    at(exit, 1, [0.0; 2])?;
                }
            }
            Geometry::Box(axis_box) => {
                if let Some([entry, exit]) = axis_box.intersect(self.origin, self.direction) {
                    at(entry.0, entry.1, [0.0; 2])?;
                    at(exit.0, exit.1, [0.0; 2])?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}
