//! Rooms: opaque closed shapes, which part what is inside of them from what is not.

use glam::Vec3;
use upbp_accel::{BoxTree, Shape};
use upbp_media::{Homogeneous, Medium as _};

use super::bodies::shapes_around;
use super::builder::Builder;
use super::lights;
use super::surfaces::ShapeDraft;
use crate::description::{Camera, Light};

/// The opaque shapes that a point is inside of, in their order.
fn rooms_around(point: Vec3, drafts: &[Option<ShapeDraft>], boxes: &BoxTree) -> Vec<usize> {
    let is_room = |index: &usize| {
        let Some(draft) = &drafts[*index] else { return false };
        draft.boundary.inside().is_none() && draft.shape.contains(point) == Some(true)
    };
    shapes_around(boxes, point).into_iter().filter(is_room).collect()
}

/// Whether the boxes of two shapes overlap.
fn boxes_meet(a: &Shape, b: &Shape) -> bool {
    let [(min, max), (other_min, other_max)] = [a, b].map(Shape::aabb);
    min.cmple(other_max).all() && other_min.cmple(max).all()
}

/// Something that shines.
enum Source {
    Point(Vec3),
    /// The shape of that index, or the body inside of it.
    Shape(usize),
    /// The medium around everything, which fills rooms, too.
    Outside,
}

impl Builder<'_> {
    /// The opaque shapes that the camera is inside of.
    pub(super) fn rooms_of_camera(&self, drafts: &[Option<ShapeDraft>], boxes: &BoxTree) -> Vec<usize> {
        let Camera::Perspective { origin, .. } = &self.description.camera;
        rooms_around(origin.get(), drafts, boxes)
    }

    /// Reports a camera in a room without light. What shines from infinity is in none.
    pub(super) fn check_camera_is_lit(
        &mut self,
        rooms: &[usize],
        drafts: &[Option<ShapeDraft>],
        media: &[Homogeneous],
        outside: Option<&Homogeneous>,
    ) {
        let [first, ..] = rooms else { return };
        let lights = self.description.lights.iter().filter(|light| lights::shines(light));
        let points = lights.filter_map(|light| match light {
            Light::Point { position, .. } | Light::Spot { position, .. } => Some(position.get()),
            Light::Directional { .. } | Light::Constant(_) | Light::Image { .. } => None,
        });
        let shines = |draft: &ShapeDraft| {
            let medium = draft.boundary.inside().and_then(|inside| media.get(inside.medium?.0 as usize));
            !draft.emission.is_black() || medium.is_some_and(Homogeneous::emits)
        };
        let shapes = drafts.iter().enumerate().filter(|(_, draft)| draft.as_ref().is_some_and(shines));
        let sources: Vec<Source> = (points.map(Source::Point))
            .chain(shapes.map(|(index, _)| Source::Shape(index)))
            .chain(outside.filter(|medium| medium.emits()).map(|_| Source::Outside))
            .collect();
        // A shape is taken to be in a room if it may be.
        let is_in = |source: &Source, room: usize| match (source, &drafts[room]) {
            (Source::Outside, _) | (_, None) => true,
            (Source::Point(position), Some(draft)) => draft.shape.contains(*position) == Some(true),
            // A room may shine into itself.
            (Source::Shape(index), Some(draft)) if *index == room => {
                matches!(&draft.shape, Shape::Mesh(mesh) if mesh.signed_volume() < 0.0)
            }
            (Source::Shape(index), Some(draft)) => {
                drafts[*index].as_ref().is_some_and(|source| boxes_meet(&source.shape, &draft.shape))
            }
        };
        if sources.iter().any(|source| rooms.iter().all(|room| is_in(source, *room))) {
            return;
        }
        let is_dark = |room: &&usize| !sources.iter().any(|source| is_in(source, **room));
        let room = self.shape_item(*rooms.iter().find(is_dark).unwrap_or(first));
        self.problem("camera", format!("lies inside of the opaque {room}, and nothing that shines does"));
    }

    /// Reports lights in rooms that the camera is not in.
    pub(super) fn check_lights_are_free(
        &mut self,
        rooms: &[usize],
        drafts: &[Option<ShapeDraft>],
        boxes: &BoxTree,
    ) {
        for (index, light) in self.description.lights.iter().enumerate() {
            let (Light::Point { position, .. } | Light::Spot { position, .. }) = light else { continue };
            for room in rooms_around(position.get(), drafts, boxes) {
                if !rooms.contains(&room) {
                    let message = self.message_of_room(room);
                    self.problem(lights::item(index, light), message);
                }
            }
        }
    }

    /// The message about a light in a room that the camera is not in.
    pub(super) fn message_of_room(&self, room: usize) -> String {
        format!("lies inside of the opaque {}, and the camera does not", self.shape_item(room))
    }
}
