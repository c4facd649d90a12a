//! The order of bodies, which decides the one that counts where bodies overlap.
//!
//! At load all bodies get a total order, so that the body that counts never depends on the way of a path: by
//! the given priority, then the smaller volume above the larger, then the later in the file above the
//! earlier. The second rule makes nested bodies work without any number: the inner one is smaller.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::iter;

use glam::Vec3;
use upbp_accel::{BoxTree, GeometryError, SceneGeometry, Shape, ShapeId, offset_origin};
use upbp_media::{BodyId, Interior};

use super::builder::Builder;
use super::rooms::Places;
use super::surfaces::{Inside, SurfaceDraft};
use crate::material::{Material, is_matched};
use crate::scene::{Body, Surface};

/// A body before it has its rank: its shape and its inside.
type BodyDraft = (ShapeId, Inside);

/// Bodies among drafts, in their order.
fn drafts_of_bodies(drafts: &[SurfaceDraft]) -> Vec<BodyDraft> {
    let drafts = drafts.iter().zip(0..);
    drafts.filter_map(|(draft, id)| Some((ShapeId(id), draft.boundary.inside()?))).collect()
}

/// Puts bodies in order, the lowest first: a body's [`Interior::priority`] is its place.
///
/// # Errors
/// Shapes without finite bounds, or too many.
pub(super) fn rank(drafts: &[SurfaceDraft], geometry: &SceneGeometry) -> Result<Vec<Body>, GeometryError> {
    let mut drafts = drafts_of_bodies(drafts);
    // Stable, so that the later in the file comes last. No volume is negative, so that its bits are in order.
    drafts.sort_by_cached_key(|(id, inside)| {
        (inside.priority, Reverse(geometry.shape(*id).volume().to_bits()))
    });
    let boxes = BoxTree::new(drafts.iter().map(|(id, _)| geometry.shape(*id).aabb()))?;
    let mut bodies: Vec<Body> = Vec::with_capacity(drafts.len());
    for ((place, &(shape, inside)), priority) in drafts.iter().enumerate().zip(0..) {
        let ior = inside.ior.unwrap_or_else(|| {
            let centre = centre(geometry.shape(shape));
            // Hardly more than the first is looked at: a heap is made faster than an order.
            let mut lower = BinaryHeap::from(any_around(&boxes, centre, |other| other < place));
            let surrounding = iter::from_fn(|| lower.pop())
                .find(|other| surrounds(drafts[*other].0, geometry.shape(shape), geometry));
            surrounding.map_or(1.0, |other| bodies[other].interior.ior)
        });
        let interior = Interior { body: BodyId(place as u32), medium: inside.medium, priority, ior };
        bodies.push(Body { shape, interior });
    }
    Ok(bodies)
}

/// Whether a rough surface may lie between equal indices of refraction, where it is as good as smooth: that
/// of its body and of vacuum, or of a body that may touch it.
pub(super) fn may_match(bodies: &[Body], surfaces: &[Surface], geometry: &SceneGeometry) -> bool {
    /// In a scene of more pairs the answer is the one that is always allowed.
    const MOST_PAIRS: usize = 1 << 24;
    let material = |body: &Body| surfaces[body.shape.0 as usize].boundary.bsdf();
    let refracting: Vec<&Body> = bodies.iter().filter(|body| material(body).is_some()).collect();
    let is_rough = |body: &&&Body| matches!(material(body), Some(Material::RoughDielectric(_)));
    let rough: Vec<&Body> = refracting.iter().filter(is_rough).copied().collect();
    let aabb = |body: &Body| geometry.shape(body.shape).aabb();
    let matches = |a: &Body, b: &Body| {
        a.shape != b.shape && is_matched([a.interior.ior, b.interior.ior]) && touch(aabb(a), aabb(b))
    };
    rough.iter().any(|body| is_matched([body.interior.ior, 1.0]))
        || rough.len().saturating_mul(refracting.len()) > MOST_PAIRS
        || rough.iter().any(|body| refracting.iter().any(|other| matches(body, other)))
}

/// Whether boxes overlap or touch, where surfaces that coincide may differ by rounding.
pub(super) fn touch((min, max): (Vec3, Vec3), (other_min, other_max): (Vec3, Vec3)) -> bool {
    let corners = [min, max, other_min, other_max].map(|corner| corner.abs().max_element());
    let rounding = Vec3::splat(1e-5 * corners.into_iter().fold(0.0, f32::max));
    min.cmple(other_max + rounding).all() && other_min.cmple(max + rounding).all()
}

/// Those of some shapes whose boxes hold a point, in their order: whatever lies inside of a shape has the
/// centre of its box in that of the shape. In a scene of a million there is no time to ask each about each.
pub(super) fn shapes_around(boxes: &BoxTree, point: Vec3, is_one: impl FnMut(usize) -> bool) -> Vec<usize> {
    let mut around = any_around(boxes, point, is_one);
    around.sort_unstable();
    around
}

/// As [`shapes_around`], in any order.
fn any_around(boxes: &BoxTree, point: Vec3, mut is_one: impl FnMut(usize) -> bool) -> Vec<usize> {
    let mut around = Vec::new();
    boxes.for_each_around(point, |index| {
        if is_one(index) {
            around.push(index);
        }
    });
    around
}

/// The centre of a shape's box.
pub(super) fn centre(shape: &Shape) -> Vec3 {
    let (min, max) = shape.aabb();
    0.5 * min + 0.5 * max
}

impl Builder<'_> {
    /// Reports surfaces that shine all inside of an opaque shape that the camera is not in.
    pub(super) fn check_lamps_are_free(&mut self, rooms: &[usize], places: Places<'_>) {
        let Places { drafts, geometry, boxes } = places;
        for (index, _) in drafts.iter().enumerate().filter(|(_, draft)| !draft.emission.is_black()) {
            let lamp = places.shape(index);
            let is_opaque = |outer: usize| drafts[outer].boundary.inside().is_none();
            let is_around = |outer: &usize| {
                rooms.binary_search(outer).is_err() && is_buried(lamp, ShapeId(*outer as u32), geometry)
            };
            let mut opaque = shapes_around(boxes, centre(lamp), is_opaque).into_iter();
            if let Some(outer) = opaque.find(is_around) {
                self.problem(self.shape_item(index), self.message_of_room(outer));
            }
        }
    }

    /// Reports bodies that lie all inside of an opaque shape that the camera is not in, or of a body with a
    /// higher priority: they would be nowhere.
    ///
    /// # Errors
    /// Shapes without finite bounds, or too many.
    pub(super) fn check_bodies_count(
        &mut self,
        rooms: &[usize],
        places: Places<'_>,
    ) -> Result<(), GeometryError> {
        let Places { drafts, geometry, .. } = places;
        let inside = |index: usize| drafts[index].boundary.inside();
        let mut bodies = drafts_of_bodies(drafts);
        let is_opaque = |index: usize| inside(index).is_none() && rooms.binary_search(&index).is_err();
        let opaque = Solids::of(places, is_opaque)?;
        for &(id, _) in &bodies {
            if let Some(&outer) = opaque.around(geometry.shape(id)).first() {
                let outer = self.shape_item(outer);
                let message = format!(
                    "lies inside of the opaque {outer}: it would be nowhere (a basin is made of quads)"
                );
                self.problem(self.shape_item(id.0 as usize), message);
            }
        }
        bodies.sort_by_key(|(_, inside)| inside.priority);
        let Some((_, lowest)) = bodies.first() else { return Ok(()) };
        let priority_of = |index: usize| inside(index).map(|inside| inside.priority);
        let higher = Solids::of(places, |index| priority_of(index) > Some(lowest.priority))?;
        for &(id, Inside { priority, .. }) in &bodies {
            let around = higher.around(geometry.shape(id)).into_iter();
            let around = around.filter_map(|outer| Some((priority_of(outer)?, outer)));
            if let Some((other, outer)) = around.filter(|(other, _)| *other > priority).min() {
                let message = format!(
                    "lies inside of {}, whose priority {other} is higher than its own {priority}: it would be nowhere",
                    self.shape_item(outer)
                );
                self.problem(self.shape_item(id.0 as usize), message);
            }
        }
        Ok(())
    }
}

/// Some of the spheres and boxes of a scene, which tell what is all inside of them.
struct Solids<'a> {
    places: Places<'a>,
    /// Their numbers as shapes.
    indices: Vec<usize>,
    boxes: BoxTree,
}

impl<'a> Solids<'a> {
    fn of(places: Places<'a>, is_one: impl Fn(usize) -> bool) -> Result<Self, GeometryError> {
        let is_solid = |index: &usize| matches!(places.shape(*index), Shape::Sphere(_) | Shape::Box(_));
        let indices = (0..places.drafts.len()).filter(|index| is_one(*index)).filter(is_solid);
        let indices: Vec<usize> = indices.collect();
        let boxes = BoxTree::new(indices.iter().map(|index| places.shape(*index).aabb()))?;
        Ok(Self { places, indices, boxes })
    }

    /// Those that a shape is all inside of, in their order.
    fn around(&self, shape: &Shape) -> Vec<usize> {
        let is_around = |place: usize| is_inside(shape, self.places.shape(self.indices[place]));
        let around = shapes_around(&self.boxes, centre(shape), is_around);
        around.into_iter().map(|place| self.indices[place]).collect()
    }
}

/// Whether a body is all inside of another sphere or box, as far as their own boxes tell.
fn is_inside(shape: &Shape, other: &Shape) -> bool {
    let (min, max) = shape.aabb();
    match (shape, other) {
        (_, Shape::Box(_)) => {
            let (outer_min, outer_max) = other.aabb();
            outer_min.cmple(min).all() && max.cmple(outer_max).all()
        }
        (Shape::Sphere(inner), Shape::Sphere(outer)) => {
            inner.centre().distance(outer.centre()) + inner.radius() <= outer.radius()
        }
        (_, Shape::Sphere(outer)) => {
            let farthest = (min - outer.centre()).abs().max((max - outer.centre()).abs());
            farthest.length() <= outer.radius()
        }
        _ => false,
    }
}

/// Points all over a shape, with their outward normals.
pub(super) fn points_on(shape: &Shape) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
    (0..16_u8).map(|i| shape.sample_area([(f32::from(i % 4) + 0.5) / 4.0, (f32::from(i / 4) + 0.5) / 4.0]))
}

/// Whether a surface is all inside of another closed shape and does not touch it, as far as its corners and
/// points on it tell.
fn is_buried(shape: &Shape, other: ShapeId, geometry: &SceneGeometry) -> bool {
    let [(min, max), (outer_min, outer_max)] = [shape, geometry.shape(other)].map(Shape::aabb);
    let boxed = outer_min.cmplt(min).all() && max.cmplt(outer_max).all();
    let is_inside = |point| geometry.contains(other, point) == Some(true);
    boxed && points_on(shape).all(|(point, _)| is_inside(point)) && are_corners(shape, is_inside)
}

/// Whether something is true of all corners of a shape.
pub(super) fn are_corners(shape: &Shape, is_so: impl Fn(Vec3) -> bool) -> bool {
    let corners = |origin: Vec3, edges: [Vec3; 3]| {
        (0..8_u8).map(move |corner| {
            let along = |axis: u8| if corner >> axis & 1 == 1 { edges[axis as usize] } else { Vec3::ZERO };
            origin + along(0) + along(1) + along(2)
        })
    };
    match shape {
        Shape::Sphere(_) => true,
        Shape::Box(shape) => {
            let size = shape.max() - shape.min();
            corners(shape.min(), [size * Vec3::X, size * Vec3::Y, size * Vec3::Z]).all(is_so)
        }
        Shape::Quad(quad) => corners(quad.origin(), [quad.edge_u(), quad.edge_v(), Vec3::ZERO]).all(is_so),
        Shape::Mesh(mesh) => {
            (0..mesh.triangle_count()).all(|triangle| mesh.corners(triangle).into_iter().all(&is_so))
        }
    }
}

/// Whether a body contains points all over the surface of an index-matched one, which has the index of
/// refraction of the highest that does: a cloud in a glass block has that of the glass, or a bubble in the
/// cloud would refract wrongly.
pub(super) fn surrounds(outer: ShapeId, shape: &Shape, geometry: &SceneGeometry) -> bool {
    let [(min, max), (outer_min, outer_max)] = [shape, geometry.shape(outer)].map(Shape::aabb);
    let boxed = outer_min.cmple(min).all() && max.cmple(outer_max).all();
    // By points just inside of it, so that a body that fills another is surrounded by it.
    let is_around =
        |(point, normal): (Vec3, Vec3)| geometry.contains(outer, offset_origin(point, normal, -normal));
    boxed && points_on(shape).all(|sample| is_around(sample) == Some(true))
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Quat};
    use proptest::prelude::*;
    use upbp_accel::{AxisBox, Quad, Sphere, TriangleMesh};

    use super::*;

    /// A closed mesh of eight triangles with corners at these distances along the axes.
    fn octahedron(size: [f32; 6]) -> TriangleMesh {
        let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let positions = axes.iter().zip(size).map(|(axis, size)| *axis * size).collect();
        let triangle = |[x, y, z]: [u32; 3]| if (x + y + z) % 2 == 0 { [x, y, z] } else { [x, z, y] };
        let corners =
            [[0, 2, 4], [1, 2, 4], [0, 3, 4], [1, 3, 4], [0, 2, 5], [1, 2, 5], [0, 3, 5], [1, 3, 5]];
        TriangleMesh::new(positions, corners.map(triangle).to_vec(), None).unwrap()
    }

    /// Shapes of very different sizes around the origin, copies of meshes among them.
    fn shapes() -> impl Strategy<Value = Vec<Shape>> {
        let place = [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from);
        let sizes = prop::array::uniform6(0.3_f32..1.0);
        let part = (0..5, place.clone(), place, -2.0_f32..1.0, sizes.clone());
        (sizes, prop::collection::vec(part, 2..12)).prop_map(|(of_copies, parts)| {
            let model = octahedron(of_copies);
            let shape = |(kind, place, axis, exponent, sizes): (_, Vec3, Vec3, f32, [f32; 6])| {
                let size = 10_f32.powf(exponent);
                let turned = Quat::from_axis_angle(axis.normalize_or(Vec3::X), 9.0 * axis.x);
                let to_scene =
                    Affine3A::from_scale_rotation_translation(Vec3::splat(size), turned, 0.5 * place);
                match kind {
                    0 => Sphere::new(place, size).unwrap().into(),
                    1 => AxisBox::new(place - size, place + size).unwrap().into(),
                    2 => Quad::new(place, Vec3::X * size, Vec3::new(0.0, 1.0, 1.0) * size).unwrap().into(),
                    3 => octahedron(sizes).transformed(&to_scene).unwrap().into(),
                    _ => model.placed(&to_scene).unwrap().into(),
                }
            };
            parts.into_iter().map(shape).collect()
        })
    }

    proptest! {
        #[test]
        fn verdicts_by_rays_are_those_of_all_triangles(shapes in shapes()) {
            let geometry = SceneGeometry::build(shapes.clone()).unwrap();
            let boxed = |a: &Shape, b: &Shape, is_within: fn(Vec3, Vec3) -> bool| {
                let [(min, max), (outer_min, outer_max)] = [a, b].map(Shape::aabb);
                is_within(outer_min, min) && is_within(max, outer_max)
            };
            for shape in &shapes {
                for (outer, id) in shapes.iter().zip((0..).map(ShapeId)) {
                    let is_inside = |point| outer.contains(point) == Some(true);
                    let expected = boxed(shape, outer, |a, b| a.cmplt(b).all())
                        && points_on(shape).all(|(point, _)| is_inside(point))
                        && are_corners(shape, is_inside);
                    prop_assert_eq!(is_buried(shape, id, &geometry), expected);
                    let below = |(point, normal): (Vec3, Vec3)| offset_origin(point, normal, -normal);
                    let expected = boxed(shape, outer, |a, b| a.cmple(b).all())
                        && points_on(shape).all(|sample| outer.contains(below(sample)) == Some(true));
                    prop_assert_eq!(surrounds(id, shape, &geometry), expected);
                }
            }
        }
    }
}
