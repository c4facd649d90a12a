//! The primitives under the leaves of the hierarchy, and a ray's exact test against one.

use std::ops::{ControlFlow, Range};

use rayon::prelude::*;

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

/// Primitives, by the blocks that they are going to be in.
#[derive(Default)]
pub(super) struct Packing {
    members: Vec<u32>,
    /// By kind.
    blocks: [Vec<Range<usize>>; 4],
}

impl Packing {
    /// Adds a block of up to eight primitives of a kind.
    pub(super) fn add(&mut self, kind: Kind, members: &[u32]) -> Child {
        let start = self.members.len();
        self.members.extend_from_slice(members);
        let blocks = &mut self.blocks[kind as usize];
        blocks.push(start..self.members.len());
        Child::block(kind, blocks.len() - 1, members.len())
    }

    /// Fills the blocks of a kind.
    pub(super) fn pack<B: Block>(
        &self,
        kind: Kind,
        primitive: impl Fn(u32) -> Option<(Name, B::Primitive)> + Sync,
    ) -> Blocks<B> {
        let block = |members: &Range<usize>| {
            let mut named = Named { block: B::EMPTY, names: [Name::default(); WIDTH] };
            let primitives = self.members[members.clone()].iter().filter_map(|&index| primitive(index));
            for (lane, (name, primitive)) in primitives.enumerate() {
                named.block.set(lane, primitive);
                named.names[lane] = name;
            }
            named
        };
        Blocks(self.blocks[kind as usize].par_iter().with_min_len(256).map(block).collect())
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
    /// The blocks of a packing of all `names`.
    pub(super) fn new(shapes: &[Shape], names: &[Name], packing: &Packing) -> Self {
        let find = |index: u32| (names[index as usize], &shapes[names[index as usize].shape as usize]);
        Self {
            triangles: packing.pack(Kind::Triangle, |index| match find(index) {
                (name, Shape::Mesh(mesh)) => Some((name, mesh.corners(name.triangle))),
                _ => None,
            }),
            quads: packing.pack(Kind::Quad, |index| match find(index) {
                (name, Shape::Quad(quad)) => Some((name, *quad)),
                _ => None,
            }),
            spheres: packing.pack(Kind::Sphere, |index| match find(index) {
                (name, Shape::Sphere(sphere)) => Some((name, *sphere)),
                _ => None,
            }),
            boxes: packing.pack(Kind::Box, |index| match find(index) {
                (name, Shape::Box(axis_box)) => Some((name, *axis_box)),
                _ => None,
            }),
        }
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
