//! The bounds of a scene, and its origin.

use glam::{DVec3, Vec3};
use upbp_accel::Shape;
use upbp_estimators::scene::BoundingSphere;

use super::surfaces::{BoundaryDraft, SurfaceDraft};
use crate::camera::PerspectiveCamera;
use crate::light::Light;

/// Moves a scene that is much farther from its origin than it is large near it, exactly; returns the point of
/// the description that has become the origin.
pub(super) fn move_near_origin(
    shapes: &mut Vec<Shape>,
    lights: &mut [Light],
    camera: &mut PerspectiveCamera,
) -> Vec3 {
    let origin = origin_near(&bounds(shapes, lights, camera));
    if origin != Vec3::ZERO {
        *shapes = std::mem::take(shapes).into_iter().map(|shape| shape.translated(-origin)).collect();
        for light in lights {
            light.translate(-origin);
        }
        *camera = camera.translated(-origin);
    }
    origin
}

/// The point near a scene that becomes the origin, so that positions have all their digits where the scene is
/// (`docs/theory.md`, section 7); zero if the scene is near enough to the origin already.
///
/// A multiple of a power of two that is greater than any rounding in the file: moving is exact.
fn origin_near(bounds: &BoundingSphere) -> Vec3 {
    let step = f64::from(16.0 * bounds.radius).log2().ceil().exp2();
    let near = (bounds.centre.as_dvec3() / step).to_array().map(|steps| {
        // Nearer than a step, coordinates beyond half of one would lose a digit.
        if steps.abs() < 1.0 { 0.0 } else { steps.round() * step }
    });
    let near = DVec3::from(near);
    // A scene as small as the rounding of its coordinates has no digits to save.
    if near.is_finite() { near.as_vec3() } else { Vec3::ZERO }
}

/// A sphere around all shapes and finite lights, around the centre of their common box and as small as their
/// own boxes allow.
pub(super) fn bounds(shapes: &[Shape], lights: &[Light], camera: &PerspectiveCamera) -> BoundingSphere {
    let positions = lights.iter().filter_map(Light::position);
    // Without shapes, how far the camera is from the lights tells best how large things are.
    let positions = positions.chain(shapes.is_empty().then(|| camera.origin()));
    let boxes = shapes.iter().map(Shape::aabb).chain(positions.clone().map(|position| (position, position)));
    let (min, max) = boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
    let centre = 0.5 * min + 0.5 * max;
    let farthest_of_shapes = shapes.iter().map(|shape| match shape {
        Shape::Sphere(sphere) => sphere.centre().distance(centre) + sphere.radius(),
        shape => {
            let (min, max) = shape.aabb();
            (min - centre).abs().max((max - centre).abs()).length()
        }
    });
    let radius =
        farthest_of_shapes.chain(positions.map(|position| position.distance(centre))).fold(0.0, f32::max);
    // A sphere must have an extent even around a single point.
    let radius = if radius > 0.0 { radius } else { 1.0 };
    // The roundings of the sums above.
    BoundingSphere { centre, radius: radius * (1.0 + 1e-5) + 1e-6 * centre.abs().max_element() }
}

/// The most that is [rounded](upbp_accel::TriangleMesh::rounded) for corners of meshes that refract, in any
/// direction; zero if there are none.
pub(super) fn most_rounded(shapes: &[Shape], drafts: &[SurfaceDraft]) -> f32 {
    let refracting =
        |(_, draft): &(_, &SurfaceDraft)| matches!(draft.boundary, BoundaryDraft::Refracting(..));
    let refracting = shapes.iter().zip(drafts).filter(refracting);
    let meshes = refracting.filter_map(|(shape, _)| match shape {
        Shape::Mesh(mesh) => Some(mesh.most_rounded().length()),
        Shape::Sphere(_) | Shape::Box(_) | Shape::Quad(_) => None,
    });
    meshes.fold(0.0, f32::max)
}
