//! Surfaces all around bodies, which every way into or out of them meets.

use glam::Vec3;
use upbp_accel::{Ray, SceneGeometry, Shape, ShapeId};
use upbp_estimators::scene::{Boundary, Emitter as _, EmitterId, EmitterKind};
use upbp_media::{BodyId, MediumId};

use super::bodies::touch;
use crate::camera::PerspectiveCamera;
use crate::light::Light;
use crate::scene::{Body, Enclosures, Ends, Surface};

/// In a scene of more pairs of a body with another one or a light nothing is known, which is always allowed.
const MOST_PAIRS: usize = 1 << 22;

/// Of a mesh with more triangles, times the lights and the lens, it is not known what is all inside of it.
const MOST_TRIANGLES: usize = 1 << 24;

/// Part of the coordinates of a shape by which starts of sub-paths may be off.
const OFF: f32 = 1e-5;

/// A box around a shape.
type Aabb = (Vec3, Vec3);

/// Where a light is.
#[derive(Clone, Copy)]
enum Place {
    Infinity,
    Within(Aabb),
    /// Where a body counts.
    Body(BodyId),
}

/// The enclosures of bodies, which are in order, the lowest first.
///
/// A body that refracts has no surface where a stronger, index-matched one reaches into it: light goes on
/// through that one. Boxes decide, so that a body may be taken for open that is not, and a light beside a
/// body for one that may be within. A film that is too thin to be a body of its own, between equal indices,
/// is left out.
///
/// A sub-path that starts in the surface of a body may go on as if from the other side of it: what starts
/// there, and what ends there, is hidden by nothing.
pub(super) fn find(
    bodies: &[Body],
    surfaces: &[Surface],
    geometry: &SceneGeometry,
    lights: &[Light],
    camera: &PerspectiveCamera,
) -> Enclosures {
    let aabb = |body: &Body| geometry.shape(body.shape).aabb();
    let boundary = |body: &Body| &surfaces[body.shape.0 as usize].boundary;
    let matched: Vec<(usize, Aabb)> = bodies
        .iter()
        .enumerate()
        .filter(|(_, body)| matches!(boundary(body), Boundary::Null(_)))
        .map(|(place, body)| (place, aabb(body)))
        .collect();
    if bodies.len().saturating_mul(matched.len() + lights.len() + 1) > MOST_PAIRS {
        return Enclosures::default();
    }
    let mut places: Vec<Place> = lights.iter().map(place).collect();
    for (surface, shape) in surfaces.iter().zip(geometry.shapes()) {
        if let Some(EmitterId(light)) = surface.emitter {
            places[light as usize] = Place::Within(shape.aabb());
        }
    }
    let radius = Vec3::splat(camera.lens_radius());
    let lens = (camera.origin() - radius, camera.origin() + radius);

    let is_enclosed = |place: usize, body: &Body| {
        let own = aabb(body);
        matches!(boundary(body), Boundary::Refracting(..))
            && !matched.iter().any(|(other, aabb)| *other > place && touch(own, *aabb))
    };
    let is_in_surface =
        |body: &Body, end: Aabb| touch(aabb(body), end) && meets(geometry, body.shape, end, off(aabb(body)));
    let is_lens_in_surface: Vec<bool> = bodies.iter().map(|body| is_in_surface(body, lens)).collect();
    let is_lamp_in_surface: Vec<bool> = bodies
        .iter()
        .map(|body| {
            places.iter().any(|place| matches!(place, Place::Within(lamp) if is_in_surface(body, *lamp)))
        })
        .collect();
    let ids = || (0_u32..).map(EmitterId).zip(&places);
    let ends_within = |(number, body): (usize, &Body)| {
        let may_be_within = |place: &Place| match *place {
            _ if is_lens_in_surface[number] => true,
            Place::Infinity => false,
            Place::Within(lamp) => touch(aabb(body), lamp),
            Place::Body(other) => other.0 as usize == number,
        };
        is_enclosed(number, body).then(|| Ends {
            lights: ids().filter(|(_, place)| may_be_within(place)).map(|(id, _)| id).collect(),
            lens: touch(aabb(body), lens) || is_lamp_in_surface[number],
        })
    };
    let within: Vec<Option<Ends>> = bodies.iter().enumerate().map(ends_within).collect();

    let body_around = |end: Aabb| {
        let number = bodies.iter().rposition(|body| touch(aabb(body), end))?;
        let shape = geometry.shape(bodies[number].shape);
        let triangles = if let Shape::Mesh(mesh) = shape { mesh.triangle_count() as usize } else { 0 };
        let is_small = triangles.saturating_mul(lights.len() + 1) <= MOST_TRIANGLES;
        (is_small && is_all_inside(end, shape)).then_some(number)
    };
    let body_of = |place: &Place| {
        let number = match *place {
            Place::Infinity => None,
            Place::Within(end) => body_around(end),
            Place::Body(BodyId(body)) => Some(body as usize),
        }?;
        within[number].is_some().then_some(BodyId(number as u32))
    };
    // A sub-path with the wrong bodies may pass the surfaces of others, too.
    let (are_views_sound, are_lamps_sound) =
        (!is_lens_in_surface.contains(&true), !is_lamp_in_surface.contains(&true));
    let body_of_lights = places.iter().map(|place| body_of(place).filter(|_| are_views_sound)).collect();
    let body_of_lens = body_of(&Place::Within(lens)).filter(|_| are_lamps_sound);
    Enclosures::new(within, body_of_lights, body_of_lens)
}

/// The place of a light that is no surface.
fn place(light: &Light) -> Place {
    match light.kind() {
        EmitterKind::Volume(body) => Place::Body(body),
        _ => light.position().map_or(Place::Infinity, |point| Place::Within((point, point))),
    }
}

/// Whether a box is all inside of a closed shape, and does not touch its surface.
fn is_all_inside((min, max): Aabb, shape: &Shape) -> bool {
    let (low, high) = shape.aabb();
    let off = off((low, high));
    match shape {
        Shape::Sphere(sphere) => {
            let farthest = (min - sphere.centre()).abs().max((max - sphere.centre()).abs());
            farthest.length() + off < sphere.radius()
        }
        Shape::Box(_) => (low + off).cmplt(min).all() && (max + off).cmplt(high).all(),
        Shape::Mesh(mesh) => {
            let (middle, half) = (0.5 * (min + max), 0.5 * (max - min) + off);
            let touches = |[a, b, c]: [Vec3; 3]| {
                let normal = (b - a).cross(c - a);
                let is_off_plane = normal.dot(middle - a).abs() > normal.abs().dot(half);
                !is_off_plane && touch((a.min(b).min(c), a.max(b).max(c)), (min, max))
            };
            let mut triangles = (0..mesh.triangle_count()).map(|triangle| mesh.corners(triangle));
            mesh.contains(middle) == Some(true) && !triangles.any(touches)
        }
        Shape::Quad(_) => false,
    }
}

/// Distance by which starts of sub-paths may be off the surface of a shape in a box.
fn off((min, max): Aabb) -> f32 {
    OFF * min.abs().max(max.abs()).max_element()
}

/// Whether the surface of a shape meets a diagonal of a box that is wider by `off`, a distance above 0, on
/// each side: that of a plane does if it meets the box at all, unless it ends within.
pub(super) fn meets(geometry: &SceneGeometry, shape: ShapeId, (min, max): Aabb, off: f32) -> bool {
    let (middle, half) = (0.5 * (min + max), 0.5 * (max - min) + off);
    let signs = [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)];
    signs.into_iter().map(|sign| half * sign).any(|corner| {
        let ray = Ray::new(middle - corner, corner.normalize()).with_range(0.0, 2.0 * corner.length());
        geometry.any_where(ray, |candidate| candidate.shape == shape)
    })
}

/// The largest coordinate of places in each medium, or the distance from which a ray may get into it without
/// a surface, whichever is more: the largest coordinate `of_scene`, but for media in bodies that are all
/// enclosed.
pub(super) fn extents(
    bodies: &[Body],
    enclosures: &Enclosures,
    geometry: &SceneGeometry,
    media: usize,
    outside: Option<MediumId>,
    of_scene: f32,
) -> Vec<f32> {
    let mut extents = vec![0.0_f32; media];
    if let Some(medium) = outside {
        extents[medium.0 as usize] = of_scene;
    }
    for (id, body) in (0_u32..).map(BodyId).zip(bodies) {
        let Some(medium) = body.interior.medium else { continue };
        let (min, max) = geometry.shape(body.shape).aabb();
        let within = min.abs().max(max.abs()).max_element().max(min.distance(max));
        let extent = &mut extents[medium.0 as usize];
        *extent = extent.max(if enclosures.contains(id) { within } else { of_scene });
    }
    extents
}
