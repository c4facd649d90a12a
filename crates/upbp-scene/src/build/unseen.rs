//! Notes about surfaces that are not seen, since others are met in their place: those of a body with the
//! index of refraction that is around it, inside of one that counts more, of walls too thin for their
//! coordinates, and in the plane of a surface that comes before them.

use glam::Vec3;
use upbp_accel::{AxisBox, BoxTree, Quad, SceneGeometry, Shape, ShapeId, offset_origin};

use super::bodies::{are_corners, centre, points_on, shapes_around, surrounds, touch};
use super::builder::Builder;
use super::notes::{and_others, too_thin};
use super::rooms::Places;
use super::surfaces::BoundaryDraft;
use crate::material::is_matched;
use crate::scene::{Body, COINCIDENT};

/// Pairs of shapes that are looked at: in a scene of more there are no notes about the others.
const MOST_PAIRS: usize = 1 << 20;

/// Pairs of a mesh and another shape for which rays tell whether they cross, up to 96 each.
const MOST_PAIRS_BY_RAYS: usize = 1 << 14;

/// Distance between what is meant to be in one place, relative to the largest coordinate there.
const ROUNDING: f32 = 2.0 * f32::EPSILON;

impl Builder<'_> {
    /// Notes quads that lie all in the plane of an opaque surface before them. Lamps are seen there.
    pub(super) fn note_quads_in_planes(&mut self, places: Places<'_>) {
        let Places { drafts, boxes, .. } = places;
        let is_opaque = |index: usize| matches!(drafts[index].boundary, BoundaryDraft::Opaque(_));
        let (mut hidden, mut left) = (Vec::new(), MOST_PAIRS);
        for (index, draft) in drafts.iter().enumerate() {
            let quad = places.shape(index);
            if !(matches!(quad, Shape::Quad(_)) && is_opaque(index) && draft.emission.is_black()) {
                continue;
            }
            let before = shapes_around(boxes, centre(quad), |other| {
                left = left.saturating_sub(1);
                other < index && is_opaque(other)
            });
            if left == 0 {
                break;
            }
            let first = before.into_iter().find(|first| is_in_plane(quad, places.shape(*first)));
            hidden.extend(first.map(|first| (index, first)));
        }
        if let [(index, first), others @ ..] = &hidden[..] {
            let message = format!(
                "lies in the plane of {}, which comes before it and hides it, in whole or in patches: move it \
                 a little off that plane{}",
                self.shape_item(*first),
                and_others(others.len(), ["does", "do"])
            );
            self.note(self.shape_item(*index), message);
        }
    }

    /// Notes bodies that refract nothing, since they lie in others of the same index, and bodies that leave
    /// too thin a wall of the other around them. `bodies` are in order, and `boxes` around each; `origin` is
    /// the point that has become the origin.
    pub(super) fn note_nested_bodies(
        &mut self,
        places: Places<'_>,
        bodies: &[Body],
        boxes: &BoxTree,
        origin: Vec3,
    ) {
        let is_refracting = |number: usize| is_refracting(places, &bodies[number]);
        let (mut matched, mut thin, mut left) = (Vec::new(), Vec::new(), MOST_PAIRS);
        for number in (0..bodies.len()).filter(|number| is_refracting(*number)) {
            let inner = &bodies[number];
            let shape = places.geometry.shape(inner.shape);
            let lower = shapes_around(boxes, centre(shape), |other| {
                left = left.saturating_sub(1);
                other < number
            });
            if left == 0 {
                break;
            }
            let is_around = |other: &&usize| surrounds(bodies[**other].shape, shape, places.geometry);
            let Some(outer) = lower.iter().rev().find(is_around).filter(|outer| is_refracting(**outer))
            else {
                continue;
            };
            let outer = &bodies[*outer];
            if is_matched([outer.interior.ior, inner.interior.ior]) {
                matched.push((inner.shape, outer.shape));
            }
            let around = places.geometry.shape(outer.shape);
            let (min, max) = around.aabb();
            let largest = min.abs().max(max.abs()).max_element();
            let across = COINCIDENT * largest;
            let is_lost = |wall: &f32| (ROUNDING * largest..across).contains(wall);
            if let Some(wall) = walls(shape, around).into_iter().filter(is_lost).reduce(f32::min) {
                thin.push((inner.shape, outer.shape, [wall, across, largest]));
            }
        }
        let item = |id: ShapeId| self.shape_item(id.0 as usize);
        let matched = matched.split_first().map(|((inner, outer), others)| {
            let message = format!(
                "has the index of refraction of {} around it, so that nothing is seen of its surface: air or \
                 gas inside of glass is `Dielectric(1)`, and what bounds a medium alone is `Null`{}",
                item(*outer),
                and_others(others.len(), ["has", "have"])
            );
            (item(*inner), message)
        });
        let thin = thin.split_first().map(|((inner, outer, sizes), others)| {
            let message = format!(
                "the wall of {} around it {}{}",
                item(*outer),
                too_thin(*sizes, origin),
                and_others(others.len(), ["is", "are"])
            );
            (item(*inner), message)
        });
        for (item, message) in matched.into_iter().chain(thin) {
            self.note(item, message);
        }
    }

    /// Notes bodies that refract and lose a part of their surface to an index-matched one that counts more
    /// and is in part inside of them, such as fog over water that is smaller than the water.
    pub(super) fn note_fog_in_water(&mut self, places: Places<'_>, bodies: &[Body]) {
        let (refracting, matched): (Vec<&Body>, Vec<&Body>) =
            bodies.iter().partition(|body| is_refracting(places, body));
        if refracting.len().saturating_mul(matched.len()) > MOST_PAIRS {
            return;
        }
        let shape = |body: &Body| places.geometry.shape(body.shape);
        let mut left = MOST_PAIRS_BY_RAYS;
        let mut covered = |fog: &Body| {
            refracting.iter().copied().find(|water| {
                let may_cross = water.interior.priority < fog.interior.priority
                    && touch(shape(water).aabb(), shape(fog).aabb());
                if may_cross && [shape(water), shape(fog)].iter().any(|shape| matches!(shape, Shape::Mesh(_)))
                {
                    left = left.saturating_sub(1);
                }
                may_cross && left > 0 && crosses(fog.shape, water.shape, places.geometry)
            })
        };
        let found: Vec<_> =
            matched.into_iter().filter_map(|fog| Some((fog.shape, covered(fog)?.shape))).collect();
        if let [(fog, water), others @ ..] = &found[..] {
            let message = format!(
                "reaches out of {} and counts more, so that the surface of that is not seen inside of it: fog \
                 over water has `priority: -1`{}",
                self.shape_item(water.0 as usize),
                and_others(others.len(), ["does", "do"])
            );
            self.note(self.shape_item(fog.0 as usize), message);
        }
    }
}

fn is_refracting(places: Places<'_>, body: &Body) -> bool {
    matches!(places.drafts[body.shape.0 as usize].boundary, BoundaryDraft::Refracting(..))
}

/// Whether the corners of a quad lie in a face of another shape, but for rounding.
fn is_in_plane(quad: &Shape, face: &Shape) -> bool {
    let largest = [quad.aabb(), face.aabb()].map(|(min, max)| min.abs().max(max.abs()).max_element());
    let rounding = ROUNDING * largest[0].max(largest[1]);
    match face {
        Shape::Quad(face) => are_corners(quad, |corner| is_on_quad(corner, face, rounding)),
        Shape::Box(face) => {
            (0..6).any(|side| are_corners(quad, |corner| is_on_side(corner, face, side, rounding)))
        }
        Shape::Sphere(_) | Shape::Mesh(_) => false,
    }
}

fn is_on_quad(point: Vec3, quad: &Quad, rounding: f32) -> bool {
    /// Part of an edge by which coordinates on a quad may be off.
    const OFF: f32 = 1e-5;
    let height = (point - quad.origin()).dot(quad.normal());
    let is_within = |coordinate: f32| (-OFF..=1.0 + OFF).contains(&coordinate);
    height.abs() <= rounding && quad.area_coordinates(point).into_iter().all(is_within)
}

/// Whether a point is on one of the sides of a box: the lower one of each axis is followed by the upper one.
fn is_on_side(point: Vec3, axis_box: &AxisBox, side: usize, rounding: f32) -> bool {
    let (min, max) = axis_box.aabb();
    let height = point[side / 2] - if side.is_multiple_of(2) { min } else { max }[side / 2];
    height.abs() <= rounding && (min - rounding).cmple(point).all() && point.cmple(max + rounding).all()
}

/// Distances between the surfaces of a sphere in a sphere, the least, or of a box in a box, on each side.
fn walls(inner: &Shape, outer: &Shape) -> Vec<f32> {
    match (inner, outer) {
        (Shape::Sphere(inner), Shape::Sphere(outer)) => {
            vec![outer.radius() - inner.radius() - outer.centre().distance(inner.centre())]
        }
        (Shape::Box(inner), Shape::Box(outer)) => {
            [inner.min() - outer.min(), outer.max() - inner.max()].map(|walls| walls.to_array()).concat()
        }
        _ => Vec::new(),
    }
}

/// Whether one body is in part inside of another one, by points on both. Bodies that share faces, or of which
/// one is all inside of the other, do not cross.
fn crosses(body: ShapeId, other: ShapeId, geometry: &SceneGeometry) -> bool {
    let is_in = |id: ShapeId, point| geometry.contains(id, point) == Some(true);
    let is_covered = |(point, normal): (Vec3, Vec3)| {
        let sides = [normal, -normal].map(|side| offset_origin(point, normal, side));
        sides.into_iter().all(|side| is_in(body, side))
    };
    let mut inside = points_on(geometry.shape(body))
        .map(|(point, normal)| is_in(other, offset_origin(point, normal, -normal)));
    let first = inside.next();
    points_on(geometry.shape(other)).any(is_covered) || inside.any(|is_inside| Some(is_inside) != first)
}
