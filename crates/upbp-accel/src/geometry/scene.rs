//! All surfaces of a scene behind one hierarchy.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::axis_box::AxisBox;
use super::build::{Leaves, build};
use super::error::GeometryError;
use super::hierarchy::{BlockRef, Hierarchy, MAX_INDEX, Visitor};
use super::hit::{Candidate, ShapeId, SurfacePoint, Visit};
use super::instances::{InstanceSearch, Instances, OnHit};
use super::lane_ray::{LaneRay, SlabRay};
use super::primitive::{Name, Packing, Primitives, Probe};
use super::shape::Shape;
use super::sphere::Sphere;
use crate::ray::Ray;
use crate::simd::{Instructions, Plain, Task, Wide, best, run_or};

/// The shapes of a scene, ready for rays.
#[derive(Clone, Debug)]
pub struct SceneGeometry {
    shapes: Vec<Shape>,
    bounds: (Vec3, Vec3),
    hierarchy: Hierarchy,
    primitives: Primitives,
    instances: Instances,
}

impl SceneGeometry {
    /// Builds the hierarchy over all primitives, and those over meshes that are
    /// [placed](super::TriangleMesh::placed). No shapes at all are allowed.
    pub fn build(shapes: Vec<Shape>) -> Result<Self, GeometryError> {
        let names = Name::all(&shapes);
        if names.len() > MAX_INDEX {
            return Err(GeometryError::TooManyPrimitives { count: names.len() });
        }
        let boxes: Vec<_> = names.par_iter().with_min_len(1024).map(|name| name.boxed(&shapes)).collect();
        let mut packing = Packing::default();
        let hierarchy = build(&boxes, Leaves::PRIMITIVES, &mut |kind, members| packing.add(kind, members));
        let primitives = Primitives::new(&shapes, &names, &packing);
        let each = shapes.iter().map(Shape::aabb);
        let bounds = each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let instances = Instances::of(&shapes)?;
        Ok(Self { shapes, bounds, hierarchy, primitives, instances })
    }

    /// The least and the greatest coordinates; both zero for an empty scene.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
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

    /// Whether `point` lies strictly inside of a shape; `None` if the shape is not closed.
    ///
    /// Costs up to two rays for a mesh, where [`Shape::contains`] tests all of its triangles for each.
    ///
    /// # Panics
    /// If `id` does not belong to this scene.
    #[must_use]
    pub fn contains(&self, id: ShapeId, point: Vec3) -> Option<bool> {
        let Shape::Mesh(mesh) = self.shape(id) else { return self.shape(id).contains(point) };
        mesh.contains_by(point, |ray| {
            let mut crossings = 0;
            self.search::<false>(ray, |candidate| {
                crossings += usize::from(candidate.shape == id);
                Visit::Continue
            });
            crossings
        })
    }

    /// Calls `visit` for every intersection with `t` in the open interval `(t_min, t_max)`, in no particular
    /// but always the same order. `t_min` must not be negative.
    ///
    /// Spheres and boxes report where the line enters and where it leaves. The visitor may shorten the ray
    /// or stop.
    pub fn for_each_hit(&self, ray: Ray, visit: impl FnMut(&Candidate) -> Visit) {
        self.search::<true>(ray, visit);
    }

    /// The nearest intersection in `(t_min, t_max)`; of several at the same distance, that of the earliest
    /// shape.
    #[must_use]
    pub fn closest(&self, ray: Ray) -> Option<Candidate> {
        let mut nearest: Option<Candidate> = None;
        self.for_each_hit(ray, |candidate| {
            let key = |candidate: &Candidate| (candidate.t, candidate.shape, candidate.primitive);
            if nearest.is_none_or(|nearest| key(candidate) < key(&nearest)) {
                nearest = Some(*candidate);
            }
            Visit::ShrinkTo(candidate.t.next_up())
        });
        nearest
    }

    /// Whether there is any intersection in `(t_min, t_max)`.
    #[must_use]
    pub fn any(&self, ray: Ray) -> bool {
        self.any_where(ray, |_| true)
    }

    /// Whether `accept` takes any intersection in `(t_min, t_max)`; it is asked until it does, in no
    /// particular order, which is always the same for processors with the same instructions.
    ///
    /// Cheaper than [`for_each_hit`](Self::for_each_hit) where the nearest intersection is of no interest.
    pub fn any_where(&self, ray: Ray, mut accept: impl FnMut(&Candidate) -> bool) -> bool {
        let mut found = false;
        self.search::<false>(ray, |candidate| {
            found = accept(candidate);
            if found { Visit::Stop } else { Visit::Continue }
        });
        found
    }

    /// Calls `visit` for every intersection: nearer boxes first if `IN_ORDER`, copies of meshes last.
    #[inline]
    fn search<const IN_ORDER: bool>(&self, ray: Ray, mut visit: impl FnMut(&Candidate) -> Visit) {
        if self.instances.is_empty() {
            run_or(Search::<_, IN_ORDER> { scene: self, ray, visit }, |mut search| {
                self.search_plainly(ray, &mut search.visit);
            });
        } else {
            self.search_with_copies(IN_ORDER, ray, &mut visit);
        }
    }

    /// As [`search`](Self::search), compiled once instead of once per caller.
    fn search_with_copies(&self, in_order: bool, ray: Ray, visit: OnHit) {
        match best() {
            Some(best) if in_order => self.search_by::<true>(best, ray, visit),
            Some(best) => self.search_by::<false>(best, ray, visit),
            None => self.search_plainly(ray, visit),
        }
    }

    /// As [`search`](Self::search), with instructions that all processors have. Few need them: they are
    /// compiled for one order alone.
    fn search_plainly(&self, ray: Ray, visit: OnHit) {
        self.search_by::<true>(Plain, ray, visit);
    }

    fn search_by<const IN_ORDER: bool>(&self, instructions: impl Instructions, ray: Ray, visit: OnHit) {
        let (mut rest, mut is_done) = (ray, false);
        let visit_first: OnHit = &mut |candidate| {
            let answer = visit(candidate);
            is_done = answer.apply(&mut rest.t_max).is_break();
            answer
        };
        instructions.run(Search::<_, IN_ORDER> { scene: self, ray, visit: visit_first });
        if !is_done && !self.instances.is_empty() {
            let (instances, extent) = (&self.instances, self.extent_from(rest.origin));
            instructions.run(InstanceSearch::<IN_ORDER> { instances, ray: rest, extent, visit });
        }
    }

    /// The greatest sum of coordinate differences between a point and any of a shape.
    #[inline(always)]
    fn extent_from(&self, point: Vec3) -> f32 {
        (self.bounds.0 - point).abs().max((self.bounds.1 - point).abs()).element_sum()
    }

    /// Surface data of an intersection of `ray` with this scene.
    ///
    /// # Panics
    /// If the candidate does not belong to this scene.
    #[inline]
    #[must_use]
    pub fn surface(&self, ray: &Ray, candidate: &Candidate) -> SurfacePoint {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let along = origin + direction * f64::from(candidate.t);
        // Where the ray meets the plane of a shape: a point by coordinates on the shape would be as coarse as
        // the shape is wide, and one by the distance as coarse as the ray is long.
        let in_plane = |point: DVec3, across: DVec3| {
            let step = (point - along).dot(across) / direction.dot(across);
            // No more than the rounding of the distance, but where that was cut to a shape that is seen
            // edge-on.
            let is_small = step.abs() <= 1e-6 * f64::from(candidate.t);
            if is_small { along + direction * step } else { point }.as_vec3()
        };
        match self.shape(candidate.shape) {
            Shape::Sphere(sphere) => {
                let roots = sphere.intersect(ray.origin, ray.direction);
                let point =
                    roots.map_or(along, |roots| origin + direction * roots[candidate.primitive as usize]);
                let outwards = (point - sphere.centre().as_dvec3()).normalize();
                flat(sphere.on_surface(outwards), outwards.as_vec3())
            }
            Shape::Quad(quad) => flat(in_plane(quad.point(candidate.uv), quad.across()), quad.normal()),
            Shape::Box(axis_box) => {
                let normal = AxisBox::face_normal(candidate.primitive);
                let point =
                    in_plane(axis_box.on_face(candidate.primitive, Vec3::ZERO).as_dvec3(), normal.as_dvec3());
                flat(axis_box.on_face(candidate.primitive, point), normal)
            }
            Shape::Mesh(mesh) => {
                let [b, c] = candidate.uv;
                let across = mesh.across(candidate.primitive);
                let geometric_normal = across.normalize_or_zero().as_vec3();
                SurfacePoint {
                    position: in_plane(mesh.point(candidate.primitive, b as f64, c as f64), across),
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
    #[inline]
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

/// A walk of a ray through a scene, with the nearer boxes first or in any order.
struct Search<'a, V, const IN_ORDER: bool> {
    scene: &'a SceneGeometry,
    ray: Ray,
    visit: V,
}

impl<V: FnMut(&Candidate) -> Visit, const IN_ORDER: bool> Task for Search<'_, V, IN_ORDER> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        let Self { scene, ray, visit } = self;
        let probe = Probe::new(&scene.shapes, &scene.primitives, &ray, scene.extent_from(ray.origin));
        let lanes = LaneRay::new(wide, &ray);
        let mut t_max = ray.t_max;
        let mut blocks = Blocks { probe, visit };
        // Nothing is left to do if it breaks off.
        let _ =
            scene.hierarchy.traverse::<IN_ORDER, SlabRay<_>, _>(wide, &lanes, (), &mut t_max, &mut blocks);
    }
}

struct Blocks<'a, V> {
    probe: Probe<'a>,
    visit: V,
}

impl<V: FnMut(&Candidate) -> Visit> Visitor for Blocks<'_, V> {
    #[inline(always)]
    fn visit<W: Wide>(
        &mut self,
        wide: W,
        ray: &LaneRay<W>,
        block: BlockRef,
        t_max: &mut f32,
    ) -> ControlFlow<()> {
        let Self { probe, visit } = self;
        probe.intersect(wide, ray, block, t_max, |candidate, t_max| visit(candidate).apply(t_max))
    }
}

/// A point of a surface that is shaded as it is.
fn flat(position: Vec3, normal: Vec3) -> SurfacePoint {
    SurfacePoint { position, geometric_normal: normal, shading_normal: normal }
}

#[cfg(test)]
mod tests;
