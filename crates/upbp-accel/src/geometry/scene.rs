//! All surfaces of a scene behind one hierarchy.

use std::ops::ControlFlow;

use glam::Vec3;

use super::axis_box::AxisBox;
use super::error::GeometryError;
use super::hierarchy::Hierarchy;
use super::hit::{Candidate, ShapeId, SurfacePoint, Visit};
use super::primitive::{self, Item};
use super::shape::Shape;
use super::sphere::Sphere;
use crate::ray::Ray;

/// The shapes of a scene, ready for rays.
#[derive(Clone, Debug)]
pub struct SceneGeometry {
    shapes: Vec<Shape>,
    hierarchy: Hierarchy,
    /// Primitives in the order of the hierarchy's leaves.
    items: Vec<Item>,
    /// Whether there is any mesh: a ray is prepared for triangles only then.
    triangles: bool,
}

impl SceneGeometry {
    /// Builds the hierarchy over all primitives. No shapes at all are allowed.
    pub fn build(shapes: Vec<Shape>) -> Result<Self, GeometryError> {
        let items = primitive::collect(&shapes);
        if u32::try_from(items.len()).is_err() || u32::try_from(shapes.len()).is_err() {
            return Err(GeometryError::TooManyPrimitives { count: items.len().max(shapes.len()) });
        }
        let boxes: Vec<(Vec3, Vec3)> = items.iter().map(Item::aabb).collect();
        let (hierarchy, order) = Hierarchy::build(&boxes);
        let items = order.iter().map(|&index| items[index as usize]).collect();
        let triangles = shapes.iter().any(|shape| matches!(shape, Shape::Mesh(_)));
        Ok(Self { shapes, hierarchy, items, triangles })
    }

    /// The least and the greatest coordinates; both zero for an empty scene.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let each = self.shapes.iter().map(Shape::aabb);
        each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((Vec3::ZERO, Vec3::ZERO))
    }

    /// A shape.
    ///
    /// # Panics
    /// If `id` does not belong to this scene.
    #[must_use]
    pub fn shape(&self, id: ShapeId) -> &Shape {
        &self.shapes[id.0 as usize]
    }

    /// All shapes; the place in the list is the [`ShapeId`].
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Calls `visit` for every intersection with `t` in the open interval `(t_min, t_max)`, in no particular
    /// but always the same order. `t_min` must not be negative.
    ///
    /// Spheres and boxes report where the line enters and where it leaves. The visitor may shorten the ray
    /// or stop.
    pub fn for_each_hit(&self, ray: Ray, mut visit: impl FnMut(&Candidate) -> Visit) {
        let probe = primitive::Probe::new(&ray, self.triangles);
        self.hierarchy.traverse(&ray, |range, t_max| {
            for item in &self.items[range] {
                probe.intersect(item, ray.t_min, t_max, |candidate, t_max| {
                    match visit(candidate) {
                        Visit::Continue => {}
                        Visit::ShrinkTo(t) => *t_max = t_max.min(t),
                        Visit::Stop => return ControlFlow::Break(()),
                    }
                    ControlFlow::Continue(())
                })?;
            }
            ControlFlow::Continue(())
        });
    }

    /// The nearest intersection in `(t_min, t_max)`.
    #[must_use]
    pub fn closest(&self, ray: Ray) -> Option<Candidate> {
        let mut nearest = None;
        self.for_each_hit(ray, |candidate| {
            nearest = Some(*candidate);
            Visit::ShrinkTo(candidate.t)
        });
        nearest
    }

    /// Whether there is any intersection in `(t_min, t_max)`.
    #[must_use]
    pub fn any(&self, ray: Ray) -> bool {
        let mut found = false;
        self.for_each_hit(ray, |_| {
            found = true;
            Visit::Stop
        });
        found
    }

    /// Surface data of an intersection of `ray` with this scene.
    ///
    /// # Panics
    /// If the candidate does not belong to this scene.
    #[must_use]
    pub fn surface(&self, ray: &Ray, candidate: &Candidate) -> SurfacePoint {
        let along = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(candidate.t);
        match self.shape(candidate.shape) {
            Shape::Sphere(sphere) => {
                let outwards = (along - sphere.centre().as_dvec3()).normalize();
                flat(sphere.on_surface(outwards), outwards.as_vec3())
            }
            Shape::Quad(quad) => {
                let (position, normal) = quad.sample_area(candidate.uv);
                flat(position, normal)
            }
            Shape::Box(axis_box) => {
                let position = axis_box.on_face(candidate.primitive, along.as_vec3());
                flat(position, AxisBox::face_normal(candidate.primitive))
            }
            Shape::Mesh(mesh) => {
                let [b, c] = candidate.uv;
                let geometric_normal = mesh.geometric_normal(candidate.primitive);
                SurfacePoint {
                    position: mesh.point(candidate.primitive, b as f64, c as f64),
                    geometric_normal,
                    shading_normal: mesh.shading_normal(candidate.primitive, b, c, geometric_normal),
                }
            }
        }
    }

    /// Whether `ray` meets the surface of an intersection from its front, the side of the geometric normal:
    /// goes into a closed shape.
    ///
    /// # Panics
    /// If the candidate does not belong to this scene.
    #[must_use]
    pub fn is_entering(&self, ray: &Ray, candidate: &Candidate) -> bool {
        let normal = match self.shape(candidate.shape) {
            Shape::Sphere(_) => return candidate.primitive == 0,
            Shape::Quad(quad) => quad.normal(),
            Shape::Box(_) => AxisBox::face_normal(candidate.primitive),
            Shape::Mesh(mesh) => mesh.geometric_normal(candidate.primitive),
        };
        normal.dot(ray.direction) < 0.0
    }

    /// Coordinates of a point of a surface: azimuth and polar angle of a sphere around y, coordinates on a
    /// quad or on a box's face, all in `[0, 1]`; weights of the second and third corner of a triangle.
    ///
    /// # Panics
    /// If the candidate does not belong to this scene.
    #[must_use]
    pub fn uv(&self, candidate: &Candidate, point: &SurfacePoint) -> [f32; 2] {
        match self.shape(candidate.shape) {
            Shape::Sphere(_) => Sphere::uv(point.geometric_normal),
            Shape::Box(axis_box) => axis_box.uv(candidate.primitive, point.position),
            Shape::Quad(_) | Shape::Mesh(_) => candidate.uv,
        }
    }
}

/// A point of a surface that is shaded as it is.
fn flat(position: Vec3, normal: Vec3) -> SurfacePoint {
    SurfacePoint { position, geometric_normal: normal, shading_normal: normal }
}
