//! Rooms: opaque closed shapes, which part what is inside of them from what is not.

use glam::Vec3;
use upbp_accel::{BoxTree, SceneGeometry, Shape, ShapeId};
use upbp_media::{Homogeneous, Medium};

use super::bodies::{shapes_around, touch};
use super::builder::Builder;
use super::enclosures::meets;
use super::lights;
use super::surfaces::SurfaceDraft;
use crate::light::Light;
use crate::scene::IN_PLANE;

/// The shapes of a scene behind the hierarchies that tell which of them are around a point.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    pub(super) drafts: &'a [SurfaceDraft],
    pub(super) geometry: &'a SceneGeometry,
    /// The boxes of the shapes.
    pub(super) boxes: &'a BoxTree,
}

impl Places<'_> {
    pub(super) fn shape(&self, index: usize) -> &Shape {
        &self.geometry.shapes()[index]
    }

    /// Whether a point lies strictly inside of a shape.
    fn is_in(&self, point: Vec3, index: usize) -> bool {
        self.geometry.contains(ShapeId(index as u32), point) == Some(true)
    }

    /// Whether a point lies in the surface of a shape, as a lamp in a ceiling, but for rounding.
    fn is_on(&self, point: Vec3, index: usize) -> bool {
        /// Part of the extent of a shape that is well inside of it: a lamp amid a small housing is not on it.
        const INSIDE: f32 = 0.01;
        let (min, max) = self.shape(index).aabb();
        let largest = min.abs().max(max.abs()).max_element();
        let off = (IN_PLANE * largest).min(INSIDE * (max - min).max_element());
        meets(self.geometry, ShapeId(index as u32), (point, point), off)
    }

    /// Whether the front of a closed shape is that towards its inside, where its emission is then.
    fn shines_inwards(&self, index: usize) -> bool {
        matches!(self.shape(index), Shape::Mesh(mesh) if mesh.signed_volume() < 0.0)
    }

    /// The opaque shapes that a point is inside of, in their order.
    pub(super) fn rooms_around(&self, point: Vec3) -> Vec<usize> {
        let is_room =
            |index: usize| self.drafts[index].boundary.inside().is_none() && self.is_in(point, index);
        shapes_around(self.boxes, point, is_room)
    }
}

/// The end of a message about a lamp around the camera: light that may have been meant instead.
const OUTWARDS: &str =
    "shines outwards only: light from all around is a `Constant`, or a mesh whose normals point inwards";

/// Something that shines.
enum Source {
    Point(Vec3),
    /// The shape of that index, or the body inside of it.
    Shape(usize),
    /// The medium around everything, which fills rooms, too.
    Outside,
}

impl Builder<'_> {
    /// Reports a camera in a room without light. What shines from infinity is in none.
    pub(super) fn check_camera_is_lit(
        &mut self,
        rooms: &[usize],
        places: Places<'_>,
        lights: &[Light],
        media: &[Homogeneous],
        outside: Option<&Homogeneous>,
    ) {
        let [first, ..] = rooms else { return };
        let lights = self.description.lights.iter().zip(lights);
        let points =
            lights.filter(|(light, _)| lights::shines(light)).filter_map(|(_, light)| light.position());
        let shines = |draft: &SurfaceDraft| {
            let medium = draft.boundary.inside().and_then(|inside| media.get(inside.medium?.0 as usize));
            !draft.emission.is_black() || medium.is_some_and(Homogeneous::emits)
        };
        let shapes = places.drafts.iter().enumerate().filter(|(_, draft)| shines(draft));
        let sources: Vec<Source> = (points.map(Source::Point))
            .chain(shapes.map(|(index, _)| Source::Shape(index)))
            .chain(outside.filter(Medium::emits).map(|_| Source::Outside))
            .collect();
        // A shape is taken to be in a room if it may be.
        let is_in = |source: &Source, room: usize| match source {
            Source::Outside => true,
            Source::Point(position) => places.is_in(*position, room) || places.is_on(*position, room),
            Source::Shape(index) if *index == room => places.shines_inwards(room),
            Source::Shape(index) => touch(places.shape(*index).aabb(), places.shape(room).aabb()),
        };
        let shines_outwards =
            |room: usize| !places.drafts[room].emission.is_black() && !places.shines_inwards(room);
        if sources.iter().any(|source| rooms.iter().all(|room| is_in(source, *room))) {
            for &room in rooms.iter().filter(|room| shines_outwards(**room)) {
                self.note(self.shape_item(room), format!("is around the camera, and {OUTWARDS}"));
            }
            return;
        }
        let is_dark = |room: &&usize| !sources.iter().any(|source| is_in(source, **room));
        let room = *rooms.iter().find(is_dark).unwrap_or(first);
        let outwards = if shines_outwards(room) { format!(": that {OUTWARDS}") } else { String::new() };
        let room = self.shape_item(room);
        self.problem(
            "camera",
            format!("lies inside of the opaque {room}, and nothing that shines does{outwards}"),
        );
    }

    /// Reports lights in rooms that the camera is not in.
    pub(super) fn check_lights_are_free(&mut self, rooms: &[usize], places: Places<'_>, lights: &[Light]) {
        for (index, (description, light)) in self.description.lights.iter().zip(lights).enumerate() {
            let Some(position) = light.position() else { continue };
            for room in places.rooms_around(position) {
                if rooms.binary_search(&room).is_err() && !places.is_on(position, room) {
                    let message = self.message_of_room(room);
                    self.problem(lights::item(index, description), message);
                }
            }
        }
    }

    /// The message about a light in a room that the camera is not in.
    pub(super) fn message_of_room(&self, room: usize) -> String {
        format!("lies inside of the opaque {}, and the camera does not", self.shape_item(room))
    }
}
