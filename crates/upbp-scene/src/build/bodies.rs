//! The order of bodies, which decides the one that counts where bodies overlap.
//!
//! At load all bodies get a total order, so that the body that counts never depends on the way of a path: by
//! the given priority, then the smaller volume above the larger, then the later in the file above the
//! earlier. The second rule makes nested bodies work without any number: the inner one is smaller.

use std::cmp::Reverse;

use glam::Vec3;
use upbp_accel::{BoxTree, GeometryError, SceneGeometry, Shape, ShapeId, offset_origin};
use upbp_media::{BodyId, Interior};

use super::builder::Builder;
use super::surfaces::{Inside, ShapeDraft};
use crate::material::{Material, is_matched};
use crate::scene::{Body, Surface};

/// A body before it has its rank: the index of its shape in the scene, the shape and the inside.
type BodyDraft<'a> = (usize, &'a Shape, Inside);

/// Bodies among drafts, in their order.
fn drafts_of_bodies(drafts: &[ShapeDraft]) -> Vec<BodyDraft<'_>> {
    let drafts = drafts.iter().enumerate();
    drafts.filter_map(|(index, draft)| Some((index, &draft.shape, draft.boundary.inside()?))).collect()
}

/// Puts bodies in order, the lowest first: a body's [`Interior::priority`] is its place.
///
/// # Errors
/// Shapes without finite bounds, or too many.
pub(super) fn rank(drafts: &[ShapeDraft]) -> Result<Vec<Body>, GeometryError> {
    let mut drafts = drafts_of_bodies(drafts);
    // Stable, so that the later in the file comes last. No volume is negative, so that its bits are in order.
    drafts.sort_by_cached_key(|(_, shape, inside)| (inside.priority, Reverse(shape.volume().to_bits())));
    let boxes = BoxTree::new(drafts.iter().map(|(_, shape, _)| shape.aabb()))?;
    let mut bodies: Vec<Body> = Vec::with_capacity(drafts.len());
    for ((place, (index, shape, inside)), priority) in drafts.iter().enumerate().zip(0..) {
        let ior = inside.ior.unwrap_or_else(|| {
            let around = shapes_around(&boxes, centre(shape)).into_iter().rev();
            let mut lower = around.filter(|other| *other < place);
            let surrounding = lower.find(|other| surrounds(drafts[*other].1, shape));
            surrounding.map_or(1.0, |other| bodies[other].interior.ior)
        });
        let interior = Interior { body: BodyId(place as u32), medium: inside.medium, priority, ior };
        bodies.push(Body { shape: ShapeId(*index as u32), interior });
    }
    Ok(bodies)
}

/// Whether a rough surface may lie between equal indices of refraction, where it passes light straight: that
/// of its body and of vacuum, or of a body that may touch it.
pub(super) fn may_match(bodies: &[Body], surfaces: &[Surface], geometry: &SceneGeometry) -> bool {
    /// In a scene of more pairs the answer is the one that is always allowed.
    const MOST_PAIRS: usize = 1 << 24;
    let material = |body: &Body| surfaces[body.shape.0 as usize].boundary.bsdf();
    let refracting: Vec<&Body> = bodies.iter().filter(|body| material(body).is_some()).collect();
    let is_rough = |body: &&&Body| matches!(material(body), Some(Material::RoughDielectric(_)));
    let rough: Vec<&Body> = refracting.iter().filter(is_rough).copied().collect();
    let touch = |a: &Body, b: &Body| {
        let [(min, max), (other_min, other_max)] = [a, b].map(|body| geometry.shape(body.shape).aabb());
        let corners = [min, max, other_min, other_max].map(|corner| corner.abs().max_element());
        // Surfaces that coincide may differ by rounding.
        let rounding = Vec3::splat(1e-5 * corners.into_iter().fold(0.0, f32::max));
        min.cmple(other_max + rounding).all() && other_min.cmple(max + rounding).all()
    };
    let matches = |a: &Body, b: &Body| {
        a.shape != b.shape && is_matched([a.interior.ior, b.interior.ior]) && touch(a, b)
    };
    rough.iter().any(|body| is_matched([body.interior.ior, 1.0]))
        || rough.len().saturating_mul(refracting.len()) > MOST_PAIRS
        || rough.iter().any(|body| refracting.iter().any(|other| matches(body, other)))
}

/// The shapes whose boxes hold a point, in their order: whatever lies inside of a shape has the centre of its
/// box in that of the shape. In a scene of a million there is no time to ask each about each.
pub(super) fn shapes_around(boxes: &BoxTree, point: Vec3) -> Vec<usize> {
    let mut around = Vec::new();
    boxes.for_each_around(point, |index| around.push(index));
    around.sort_unstable();
    around
}

/// The centre of a shape's box.
fn centre(shape: &Shape) -> Vec3 {
    let (min, max) = shape.aabb();
    0.5 * min + 0.5 * max
}

impl Builder<'_> {
    /// Reports surfaces that shine all inside of an opaque shape that the camera is not in.
    pub(super) fn check_lamps_are_free(&mut self, rooms: &[usize], drafts: &[ShapeDraft], boxes: &BoxTree) {
        for (index, lamp) in drafts.iter().enumerate().filter(|(_, draft)| !draft.emission.is_black()) {
            let is_around = |outer: &usize| {
                let draft = &drafts[*outer];
                let is_opaque = draft.boundary.inside().is_none() && !rooms.contains(outer);
                is_opaque && is_buried(&lamp.shape, &draft.shape)
            };
            if let Some(outer) = shapes_around(boxes, centre(&lamp.shape)).into_iter().find(is_around) {
                self.problem(self.shape_item(index), self.message_of_room(outer));
            }
        }
    }

    /// Reports bodies that lie all inside of an opaque shape that the camera is not in, or of a body with a
    /// higher priority: they would be nowhere.
    pub(super) fn check_bodies_count(&mut self, rooms: &[usize], drafts: &[ShapeDraft], boxes: &BoxTree) {
        let mut bodies = drafts_of_bodies(drafts);
        let around = |shape: &Shape| -> Vec<_> {
            let around = shapes_around(boxes, centre(shape)).into_iter();
            around.filter(|outer| is_inside(shape, &drafts[*outer].shape)).collect()
        };
        for (index, shape, _) in &bodies {
            let is_opaque =
                |outer: &usize| drafts[*outer].boundary.inside().is_none() && !rooms.contains(outer);
            if let Some(outer) = around(shape).into_iter().find(is_opaque) {
                let outer = self.shape_item(outer);
                let message = format!(
                    "lies inside of the opaque {outer}: it would be nowhere (a basin is made of quads)"
                );
                self.problem(self.shape_item(*index), message);
            }
        }
        bodies.sort_by_key(|(.., inside)| inside.priority);
        for (index, shape, Inside { priority, .. }) in &bodies {
            let priority_of = |outer: usize| Some((drafts[outer].boundary.inside()?.priority, outer));
            let outer = around(shape).into_iter().filter_map(priority_of);
            if let Some((other, outer)) = outer.filter(|(other, _)| other > priority).min() {
                let message = format!(
                    "lies inside of {}, whose priority {other} is higher than its own {priority}: it would be nowhere",
                    self.shape_item(outer)
                );
                self.problem(self.shape_item(*index), message);
            }
        }
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
fn points_on(shape: &Shape) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
    (0..16_u8).map(|i| shape.sample_area([(f32::from(i % 4) + 0.5) / 4.0, (f32::from(i / 4) + 0.5) / 4.0]))
}

/// Whether a surface is all inside of another closed shape and does not touch it, as far as points on it
/// tell.
fn is_buried(shape: &Shape, other: &Shape) -> bool {
    let [(min, max), (outer_min, outer_max)] = [shape, other].map(Shape::aabb);
    let boxed = outer_min.cmplt(min).all() && max.cmplt(outer_max).all();
    boxed && points_on(shape).all(|(point, _)| other.contains(point) == Some(true))
}

/// Whether a body contains points all over the surface of an index-matched one, which has the index of
/// refraction of the highest that does: a cloud in a glass block has that of the glass, or a bubble in the
/// cloud would refract wrongly.
fn surrounds(outer: &Shape, shape: &Shape) -> bool {
    let [(min, max), (outer_min, outer_max)] = [shape, outer].map(Shape::aabb);
    let boxed = outer_min.cmple(min).all() && max.cmple(outer_max).all();
    // By points just inside of it, so that a body that fills another is surrounded by it.
    boxed
        && points_on(shape)
            .all(|(point, normal)| outer.contains(offset_origin(point, normal, -normal)) == Some(true))
}
