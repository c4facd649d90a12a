//! The primitives under the leaves of the hierarchy, and a ray's exact test against one.

use std::ops::ControlFlow;

use super::axis_box::AxisBox;
use super::build::Boxed;
use super::hierarchy::{BlockRef, Child, Kind};
use super::hit::{Candidate, ShapeId};
use super::lane_ray::LaneRay;
use super::primitive_block::{AxisBoxes, Block, Quads, Spheres, TriangleRay, Triangles};
use super::quad::Quad;
use super::shape::Shape;
use super::sphere::Sphere;
use crate::ray::Ray;
use crate::simd::{WIDTH, Wide, set_lanes};

/// The name of a primitive: a shape, and its triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Name {
    pub(super) shape: u32,
    pub(super) triangle: u32,
}

impl Name {
    /// All primitives of a list of shapes, in its order, without those of meshes that are copies.
    pub(super) fn all(shapes: &[Shape]) -> Vec<Self> {
        let triangles = |shape: &Shape| match shape {
            Shape::Mesh(mesh) if mesh.placement().is_some() => 0,
            Shape::Mesh(mesh) => mesh.triangle_count(),
            Shape::Sphere(_) | Shape::Quad(_) | Shape::Box(_) => 1,
        };
        let mut names = Vec::with_capacity(shapes.iter().map(|shape| triangles(shape) as usize).sum());
        for (shape, index) in shapes.iter().zip(0..) {
            names.extend((0..triangles(shape)).map(|triangle| Self { shape: index, triangle }));
        }
        names
    }

    /// Kind and box of the primitive.
    pub(super) fn boxed(self, shapes: &[Shape]) -> Boxed {
        let shape = &shapes[self.shape as usize];
        let (kind, (min, max)) = match shape {
            Shape::Sphere(sphere) => (Kind::Sphere, sphere.aabb()),
            Shape::Quad(quad) => (Kind::Quad, quad.aabb()),
            Shape::Box(axis_box) => (Kind::Box, axis_box.aabb()),
            Shape::Mesh(mesh) => return Boxed::triangle(mesh.corners(self.triangle)),
        };
        Boxed { min, max, kind }
    }
}

/// Up to eight primitives of a kind with their names: whoever meets one asks for its name at once.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Named<B> {
    pub(super) block: B,
    pub(super) names: [Name; WIDTH],
}

/// Blocks of a kind.
#[derive(Clone, Debug)]
pub(super) struct Blocks<B>(pub(super) Vec<Named<B>>);

impl<B: Block> Blocks<B> {
    pub(super) const EMPTY: Self = Self(Vec::new());

    /// Adds a block of up to eight primitives, returns its place.
    pub(super) fn push(&mut self, primitives: impl Iterator<Item = (Name, B::Primitive)>) -> usize {
        let mut named = Named { block: B::EMPTY, names: [Name::default(); WIDTH] };
        for (lane, (name, primitive)) in primitives.enumerate() {
            named.block.set(lane, primitive);
            named.names[lane] = name;
        }
        self.0.push(named);
        self.0.len() - 1
    }
}

/// The primitives of a scene, in blocks.
#[derive(Clone, Debug)]
pub(super) struct Primitives {
    triangles: Blocks<Triangles>,
    quads: Blocks<Quads>,
    spheres: Blocks<Spheres>,
    boxes: Blocks<AxisBoxes>,
}

impl Primitives {
    pub(super) const EMPTY: Self =
        Self { triangles: Blocks::EMPTY, quads: Blocks::EMPTY, spheres: Blocks::EMPTY, boxes: Blocks::EMPTY };

    /// Makes a block of up to eight primitives of a kind.
    pub(super) fn pack(
        &mut self,
        shapes: &[Shape],
        kind: Kind,
        names: impl ExactSizeIterator<Item = Name>,
    ) -> Child {
        let count = names.len();
        let shape = |name: Name| &shapes[name.shape as usize];
        let index = match kind {
            Kind::Triangle => self.triangles.push(names.filter_map(|name| match shape(name) {
                Shape::Mesh(mesh) => Some((name, mesh.corners(name.triangle))),
                _ => None,
            })),
            Kind::Quad => self.quads.push(names.filter_map(|name| match shape(name) {
                Shape::Quad(quad) => Some((name, *quad)),
                _ => None,
            })),
            Kind::Sphere => self.spheres.push(names.filter_map(|name| match shape(name) {
                Shape::Sphere(sphere) => Some((name, *sphere)),
                _ => None,
            })),
            Kind::Box => self.boxes.push(names.filter_map(|name| match shape(name) {
                Shape::Box(axis_box) => Some((name, *axis_box)),
                _ => None,
            })),
        };
        Child::block(kind, index, count)
    }
}

/// A ray in the forms that the tests of primitives ask for.
pub(super) struct Probe<'a> {
    shapes: &'a [Shape],
    primitives: &'a Primitives,
    ray: Ray,
    /// `None` in a scene without triangles.
    triangle_ray: Option<TriangleRay>,
}

impl<'a> Probe<'a> {
    /// `extent`: the greatest sum of coordinate differences between the ray's origin and any triangle.
    #[inline(always)]
    pub(super) fn new(shapes: &'a [Shape], primitives: &'a Primitives, ray: &Ray, extent: f32) -> Self {
        let triangles = !primitives.triangles.0.is_empty();
        let triangle_ray = triangles.then(|| TriangleRay::new(ray.origin, ray.direction, extent));
        Self { shapes, primitives, ray: *ray, triangle_ray }
    }

    /// Calls `found` with the intersections of the line and the primitives of a block that lie in the open
    /// interval `(t_min, t_max)`, where `found` may lower `t_max`.
    #[inline(always)]
    pub(super) fn intersect<W: Wide>(
        &self,
        wide: W,
        lanes: &LaneRay<W>,
        block: BlockRef,
        t_max: &mut f32,
        mut found: impl FnMut(&Candidate, &mut f32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Ray { origin, direction, t_min, .. } = self.ray;
        let mut at = |t: f64, name: Name, primitive: u32, uv: [f32; 2], t_max: &mut f32| {
            let t = t as f32;
            if t > t_min && t < *t_max {
                found(&Candidate { t, shape: ShapeId(name.shape), primitive, uv }, t_max)
            } else {
                ControlFlow::Continue(())
            }
        };
        let index = block.index;
        match block.kind {
            Kind::Triangle => {
                let Some(ray) = &self.triangle_ray else { return ControlFlow::Continue(()) };
                let Named { block: triangles, names } = &self.primitives.triangles.0[index];
                for lane in set_lanes(triangles.may_meet(wide, lanes, ray, *t_max) & block.used) {
                    if let Some(hit) = ray.shear.intersect(triangles.corners(lane)) {
                        let name = names[lane];
                        at(hit.t, name, name.triangle, hit.weights, t_max)?;
                    }
                }
            }
            Kind::Quad => {
                let Named { block: quads, names } = &self.primitives.quads.0[index];
                for lane in set_lanes(quads.may_meet(wide, lanes, &(), *t_max) & block.used) {
                    let name = names[lane];
                    if let Some((t, uv)) = self.quad(name).and_then(|quad| quad.intersect(origin, direction))
                    {
                        at(t, name, 0, uv, t_max)?;
                    }
                }
            }
            Kind::Sphere => {
                let Named { block: spheres, names } = &self.primitives.spheres.0[index];
                for lane in set_lanes(spheres.may_meet(wide, lanes, &(), *t_max) & block.used) {
                    let name = names[lane];
                    let sphere = self.sphere(name);
                    if let Some([entry, exit]) = sphere.and_then(|sphere| sphere.intersect(origin, direction))
                    {
                        at(entry, name, 0, [0.0; 2], t_max)?;
                        at(exit, name, 1, [0.0; 2], t_max)?;
                    }
                }
            }
            Kind::Box => {
                let Named { block: boxes, names } = &self.primitives.boxes.0[index];
                for lane in set_lanes(boxes.may_meet(wide, lanes, &(), *t_max) & block.used) {
                    let name = names[lane];
                    let axis_box = self.axis_box(name);
                    if let Some([entry, exit]) = axis_box.and_then(|b| b.intersect(origin, direction)) {
                        at(entry.0, name, entry.1, [0.0; 2], t_max)?;
                        at(exit.0, name, exit.1, [0.0; 2], t_max)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    fn quad(&self, name: Name) -> Option<&Quad> {
        if let Shape::Quad(quad) = &self.shapes[name.shape as usize] { Some(quad) } else { None }
    }

    fn sphere(&self, name: Name) -> Option<&Sphere> {
        if let Shape::Sphere(sphere) = &self.shapes[name.shape as usize] { Some(sphere) } else { None }
    }

    fn axis_box(&self, name: Name) -> Option<&AxisBox> {
        if let Shape::Box(axis_box) = &self.shapes[name.shape as usize] { Some(axis_box) } else { None }
    }
}
