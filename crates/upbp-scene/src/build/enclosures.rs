//! Surfaces all around bodies, which every way into or out of them meets.

use glam::Vec3;
use upbp_accel::{Ray, SceneGeometry, ShapeId};
use upbp_estimators::scene::{Boundary, Enclosure};
use upbp_media::{Homogeneous, Medium as _, MediumId};

use super::bodies::touch;
use crate::camera::PerspectiveCamera;
use crate::light::Light;
use crate::scene::{Body, Surface};

/// In a scene of more pairs of bodies nothing is known, which is always allowed.
const MOST_PAIRS: usize = 1 << 22;

/// A box around a shape.
type Aabb = (Vec3, Vec3);

/// The enclosures of bodies, which are in order, the lowest first.
///
/// A body that refracts has no surface where a stronger, index-matched one reaches into it: light goes on
/// through that one. Boxes decide, so that a body may be taken for open that is not, and a light beside a
/// body for one within. A film that is too thin to be a body of its own, between equal indices, is left out.
pub(super) fn find(
    bodies: &[Body],
    surfaces: &[Surface],
    geometry: &SceneGeometry,
    media: &[Homogeneous],
    lights: &[Light],
    camera: &PerspectiveCamera,
) -> Vec<Option<Enclosure>> {
    let aabb = |body: &Body| geometry.shape(body.shape).aabb();
    let boundary = |body: &Body| &surfaces[body.shape.0 as usize].boundary;
    let matched: Vec<(usize, Aabb)> = bodies
        .iter()
        .enumerate()
        .filter(|(_, body)| matches!(boundary(body), Boundary::Null(_)))
        .map(|(place, body)| (place, aabb(body)))
        .collect();
    let surface_lamps =
        surfaces.iter().zip(geometry.shapes()).filter(|(surface, _)| surface.emitter.is_some());
    let points = lights.iter().filter_map(Light::position).map(|point| (point, point));
    let lamps: Vec<Aabb> = surface_lamps.map(|(_, shape)| shape.aabb()).chain(points).collect();
    let radius = Vec3::splat(camera.lens_radius());
    let lens = (camera.origin() - radius, camera.origin() + radius);
    if bodies.len().saturating_mul(matched.len() + lamps.len()) > MOST_PAIRS {
        return vec![None; bodies.len()];
    }
    let of_body = |(place, body): (usize, &Body)| {
        let own = aabb(body);
        let encloses = matches!(boundary(body), Boundary::Refracting(..))
            && !matched.iter().any(|(other, aabb)| *other > place && touch(own, *aabb));
        let emits = || body.interior.medium.is_some_and(|id| media[id.0 as usize].emits());
        // A sub-path that starts in the surface may go on as if from the other side of it.
        let is_in_surface = |end: Aabb| touch(own, end) && meets(geometry, body.shape, end);
        encloses.then(|| Enclosure {
            lights: emits() || lamps.iter().any(|lamp| touch(own, *lamp)) || is_in_surface(lens),
            lens: touch(own, lens) || lamps.iter().any(|lamp| is_in_surface(*lamp)),
        })
    };
    bodies.iter().enumerate().map(of_body).collect()
}

/// Whether the surface of a shape meets a box, or almost. That of a plane does if it meets a diagonal of the
/// box.
fn meets(geometry: &SceneGeometry, shape: ShapeId, (min, max): Aabb) -> bool {
    /// Part of the coordinates of the shape by which starts of sub-paths may be off.
    const OFF: f32 = 1e-5;
    let (low, high) = geometry.shape(shape).aabb();
    let off = Vec3::splat(OFF * low.abs().max(high.abs()).max_element());
    let (middle, half) = (0.5 * (min + max), 0.5 * (max - min) + off);
    let signs = [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)];
    signs.into_iter().map(|sign| half * sign).any(|corner| {
        let ray = Ray::new(middle - corner, corner.normalize()).with_range(0.0, 2.0 * corner.length());
        geometry.any_where(ray, |candidate| candidate.shape == shape)
    })
}

/// The largest coordinate of places in each medium, or the distance from which a ray may get into it without
/// a surface, whichever is more: the radius of the scene, but for media in bodies that are all enclosed.
pub(super) fn extents(
    bodies: &[Body],
    enclosures: &[Option<Enclosure>],
    geometry: &SceneGeometry,
    media: usize,
    outside: Option<MediumId>,
    radius: f32,
) -> Vec<f32> {
    let mut extents = vec![0.0_f32; media];
    if let Some(medium) = outside {
        extents[medium.0 as usize] = radius;
    }
    for (body, enclosure) in bodies.iter().zip(enclosures) {
        let Some(medium) = body.interior.medium else { continue };
        let (min, max) = geometry.shape(body.shape).aabb();
        let within = min.abs().max(max.abs()).max_element().max(min.distance(max));
        let extent = &mut extents[medium.0 as usize];
        *extent = extent.max(if enclosure.is_some() { within } else { radius });
    }
    extents
}
