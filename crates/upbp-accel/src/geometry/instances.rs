//! Copies of meshes: a hierarchy over them, above one of each mesh in coordinates of its own.
//!
//! A ray is carried over to the coordinates of a mesh only to find blocks of triangles that it may meet.
//! These are carried back, and tested where they are in the scene, so that it meets what it would meet if the
//! mesh were there itself, to the last bit. Boxes are taken to be wider than they are by what both ways round
//! off.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::build::{Boxed, Leaves, build};
use super::error::GeometryError;
use super::hierarchy::{BlockRef, Child, Hierarchy, MAX_INDEX, Visitor};
use super::hit::{Candidate, ShapeId, Visit};
use super::lane_ray::{LaneRay, ROUNDING, SLAB_ROUNDING, SlabRay, Widened};
use super::model::Model;
use super::placement::Placement;
use super::primitive_block::{Block as _, TriangleRay};
use super::shape::Shape;
use crate::ray::Ray;
use crate::simd::{Task, Wide, set_lanes};

/// The meshes of a scene that are copies.
#[derive(Clone, Debug)]
pub(super) struct Instances {
    hierarchy: Hierarchy,
    copies: Vec<Instance>,
}

/// A copy of a mesh.
#[derive(Clone, Debug)]
struct Instance {
    shape: u32,
    model: Arc<Model>,
    placement: Placement,
    bounds: (Vec3, Vec3),
    /// The largest number that adds to a coordinate of a corner.
    reach: f32,
}

impl Instance {
    /// The greatest sum of coordinate differences between a point and any of the copy.
    #[inline(always)]
    fn extent_from(&self, point: Vec3) -> f32 {
        (self.bounds.0 - point).abs().max((self.bounds.1 - point).abs()).element_sum()
    }
}

/// Error of a corner that is placed, and of a ray in the coordinates of the mesh, relative to the largest
/// number that adds to a coordinate: three products and a sum of four, and a rounding, twice over.
const PLACING: f32 = 16.0 * f32::EPSILON;

impl Instances {
    /// The placed meshes of a list of shapes.
    pub(super) fn of(shapes: &[Shape]) -> Result<Self, GeometryError> {
        let mut copies = Vec::new();
        for (shape, index) in shapes.iter().zip(0..) {
            let Shape::Mesh(mesh) = shape else { continue };
            let Some(placement) = mesh.placement() else { continue };
            let (min, max) = mesh.bounds_in_mesh();
            let reach = placement.reach(min.abs().max(max.abs()));
            let (model, placement, bounds) = (mesh.model().clone(), *placement, mesh.aabb());
            copies.push(Instance { shape: index, model, placement, bounds, reach });
        }
        if copies.len() > MAX_INDEX {
            return Err(GeometryError::TooManyPrimitives { count: copies.len() });
        }
        let boxes: Vec<_> = copies.iter().map(|copy| Boxed::copy(copy.bounds)).collect();
        let hierarchy =
            build(&boxes, Leaves::BOXES, &mut |kind, members| Child::block(kind, members[0] as usize, 1));
        Ok(Self { hierarchy, copies })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.copies.is_empty()
    }
}

/// A visitor of intersections in scenes with copies. Not a type parameter: a call costs little beside the way
/// into a copy, and the walks are compiled once instead of once per caller.
pub(super) type OnHit<'a> = &'a mut dyn FnMut(&Candidate) -> Visit;

/// A walk of a ray through the copies of meshes, with the nearer boxes first or in any order.
pub(super) struct InstanceSearch<'a, const IN_ORDER: bool> {
    pub(super) instances: &'a Instances,
    pub(super) ray: Ray,
    /// The greatest sum of coordinate differences between the ray's origin and any triangle.
    pub(super) extent: f32,
    pub(super) visit: OnHit<'a>,
}

impl<const IN_ORDER: bool> Task for InstanceSearch<'_, IN_ORDER> {
    #[inline(always)]
    fn run(self, wide: impl Wide) {
        let Self { instances, ray, extent, visit } = self;
        let lanes = LaneRay::new(wide, &ray);
        let triangle_ray = TriangleRay::new(ray.origin, ray.direction, extent);
        let mut t_max = ray.t_max;
        let mut each = EachInstance::<IN_ORDER> { instances, ray, triangle_ray, visit };
        // Nothing is left to do if it breaks off.
        let _ =
            instances.hierarchy.traverse::<IN_ORDER, SlabRay<_>, _>(wide, &lanes, (), &mut t_max, &mut each);
    }
}

struct EachInstance<'a, const IN_ORDER: bool> {
    instances: &'a Instances,
    ray: Ray,
    triangle_ray: TriangleRay,
    visit: OnHit<'a>,
}

impl<const IN_ORDER: bool> Visitor for EachInstance<'_, IN_ORDER> {
    #[inline(always)]
    fn visit<W: Wide>(
        &mut self,
        wide: W,
        _: &LaneRay<W>,
        block: BlockRef,
        t_max: &mut f32,
    ) -> ControlFlow<()> {
        let Self { instances, ray, triangle_ray, visit } = self;
        let instance = &instances.copies[block.index];
        // What the exact test may be wrong by, and the corners and the ray in the coordinates of the mesh.
        let margin = ROUNDING * instance.extent_from(ray.origin) + PLACING * instance.reach;
        let Some(start) = entry(ray, instance.bounds, margin, *t_max) else {
            return ControlFlow::Continue(());
        };
        let at = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(start);
        let placement = &instance.placement;
        let own = Ray {
            origin: placement.point_in_mesh(at).as_vec3(),
            direction: placement.direction_in_mesh(ray.direction).as_vec3(),
            t_min: 0.0,
            t_max: f32::INFINITY,
        };
        let margins = placement.size_in_mesh(f64::from(margin)).as_vec3();
        let model = &*instance.model;
        let mut triangles =
            InstanceTriangles { ray, triangle_ray, instance, model, start, t_max: *t_max, visit };
        let mut own_t_max = triangles.own_t_max();
        let own = LaneRay::new(wide, &own);
        let hierarchy = &model.hierarchy;
        hierarchy.traverse::<IN_ORDER, Widened<W>, W>(wide, &own, margins, &mut own_t_max, &mut triangles)?;
        *t_max = triangles.t_max;
        ControlFlow::Continue(())
    }
}

/// Distance at which a ray enters a box that is wider by a margin, or starts in it; `None` if it does not
/// before `t_max`.
#[inline(always)]
fn entry(ray: &Ray, (min, max): (Vec3, Vec3), margin: f32, t_max: f32) -> Option<f32> {
    let margin = DVec3::splat(f64::from(margin));
    let (min, max) = (min.as_dvec3() - margin, max.as_dvec3() + margin);
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (mut near, mut far) = (f64::from(ray.t_min), f64::from(t_max));
    for axis in 0..3 {
        let inverse = 1.0 / direction[axis];
        let (a, b) = ((min[axis] - origin[axis]) * inverse, (max[axis] - origin[axis]) * inverse);
        // No number for rays in a plane of the box, which count as beside it: the margin is outside of all
        // that is to be found.
        near = a.min(b).max(near);
        far = a.max(b).min(far);
    }
    // A distance that is rounded to single precision must not be beyond the box's.
    (near <= far).then_some((near as f32).next_down().max(ray.t_min))
}

/// Triangles of a copy, tested where they are in the scene.
struct InstanceTriangles<'a, 'v> {
    ray: &'a Ray,
    triangle_ray: &'a TriangleRay,
    instance: &'a Instance,
    model: &'a Model,
    /// Distance at which the ray starts in the mesh.
    start: f32,
    t_max: f32,
    visit: &'a mut OnHit<'v>,
}

impl InstanceTriangles<'_, '_> {
    /// The end of the ray as it is counted in the mesh, or somewhat more.
    #[inline(always)]
    fn own_t_max(&self) -> f32 {
        (self.t_max - self.start) * (1.0 + SLAB_ROUNDING) + ROUNDING * self.t_max
    }
}

impl Visitor for InstanceTriangles<'_, '_> {
    #[inline(always)]
    fn visit<W: Wide>(
        &mut self,
        wide: W,
        _: &LaneRay<W>,
        block: BlockRef,
        own_t_max: &mut f32,
    ) -> ControlFlow<()> {
        let named = &self.model.triangles.0[block.index];
        let triangles = named.block.placed(wide, &self.instance.placement);
        let lanes = LaneRay::new(wide, self.ray);
        for lane in set_lanes(triangles.may_meet(wide, &lanes, self.triangle_ray, self.t_max) & block.used) {
            let Some(hit) = self.triangle_ray.shear.intersect(triangles.corners(lane)) else { continue };
            let t = hit.t as f32;
            if t > self.ray.t_min && t < self.t_max {
                let primitive = named.names[lane].triangle;
                let shape = ShapeId(self.instance.shape);
                let candidate = Candidate { t, shape, primitive, uv: hit.weights };
                (self.visit)(&candidate).apply(&mut self.t_max)?;
                *own_t_max = self.own_t_max();
            }
        }
        ControlFlow::Continue(())
    }
}
