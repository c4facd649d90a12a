//! A surface that shines: the same radiance in all directions on the side of its geometric normal.
//!
//! Points are uniform by area, except that a receiver outside of a sphere chooses uniformly by solid angle
//! among the points that it sees.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec3, Vec3};
use upbp_accel::{Shape, Sphere};
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::finite::{direction_and_distance, incident};
use crate::sampling;

/// A surface that shines on one side.
#[derive(Clone, Debug)]
pub struct AreaLight {
    shape: Shape,
    area: f32,
    radiance: Spectrum,
}

impl AreaLight {
    /// A light of the given radiance, W m⁻² sr⁻¹, on `shape`, which should be the very shape of the scene.
    /// `None` if its area is zero, or too small or large to be inverted.
    #[must_use]
    pub fn new(shape: Shape, radiance: Spectrum) -> Option<Self> {
        let area = shape.area();
        (area.is_normal() && area > 0.0 && (1.0 / area).is_finite()).then_some(Self { shape, area, radiance })
    }

    /// Radiance of the shining side, W m⁻² sr⁻¹.
    #[must_use]
    pub const fn radiance(&self) -> Spectrum {
        self.radiance
    }

    /// The sphere that the light is, with the cone of directions in which `receiver` sees it, if points are
    /// chosen by it.
    fn cone(&self, receiver: Vec3) -> Option<(&Sphere, DVec3, f64)> {
        let Shape::Sphere(sphere) = &self.shape else { return None };
        let (axis, height) = sampling::cone_of(sphere, receiver)?;
        Some((sphere, axis, height))
    }

    fn sample_point(&self, receiver: Vec3, u: [f32; 2]) -> Option<EmitterPoint> {
        let Some((sphere, axis, height)) = self.cone(receiver) else {
            let (position, normal) = self.shape.sample_area(u);
            return Some(EmitterPoint { position, normal });
        };
        // In double precision: a small sphere far away is narrower than the last digits of a direction.
        let towards = sampling::fine::cone(axis, height, u.map(f64::from));
        // Where that ray enters the sphere; a ray on the rim may miss by rounding, and touches.
        let to_centre = sphere.centre().as_dvec3() - receiver.as_dvec3();
        let across = to_centre - towards * to_centre.dot(towards);
        let radius = f64::from(sphere.radius());
        let half_chord = (radius * radius - across.length_squared()).max(0.0).sqrt();
        let normal = (towards * -half_chord - across).try_normalize()?;
        let position = (sphere.centre().as_dvec3() + normal * radius).as_vec3();
        Some(EmitterPoint { position, normal: normal.as_vec3() })
    }
}

impl Emitter for AreaLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Area
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        PI * self.area * self.radiance.mean()
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        let (min, max) = self.shape.aabb();
        let around = EmitterBounds::all_around(min, max);
        Some(match &self.shape {
            Shape::Quad(quad) => EmitterBounds { axis: quad.normal(), cos_normals: 1.0, ..around },
            Shape::Mesh(mesh) => mesh.normal_cone().map_or(around, |(axis, cos_normals)| EmitterBounds {
                axis,
                cos_normals,
                ..around
            }),
            Shape::Sphere(_) | Shape::Box(_) => around,
        })
    }

    fn sample_emission(
        &self,
        _: &BoundingSphere,
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        let (position, normal) = self.shape.sample_area(u_position);
        let direction = sampling::to_world(normal, sampling::cosine_hemisphere(u_direction));
        let cosine = direction.dot(normal);
        (cosine > 0.0).then(|| Emission {
            point: EmitterPoint { position, normal },
            direction,
            radiance: self.radiance,
            pdf_position: 1.0 / self.area,
            pdf_direction: cosine * FRAC_1_PI,
        })
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let point = self.sample_point(receiver, u)?;
        let (towards_light, distance) = direction_and_distance(receiver, point.position)?;
        let seen = self.hit(bounds, &point, -towards_light, receiver)?;
        incident(point, towards_light, distance, &seen)
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        let cosine = direction.dot(point.normal);
        let pdf_position = 1.0 / self.area;
        (cosine > 0.0).then(|| HitDensities {
            radiance: self.radiance,
            pdf_incident: self.pdf_incident(bounds, point, direction, receiver, pdf_position),
            pdf_position,
            pdf_direction: cosine.min(1.0) * FRAC_1_PI,
        })
    }

    fn pdf_incident(
        &self,
        _: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        let Some((_, _, height)) = self.cone(receiver) else { return pdf_position };
        // p_area = p_ω cos θ / d²: zero on the far side, which the receiver does not see.
        let pdf_solid_angle = 1.0 / (TAU * height as f32);
        let pdf = pdf_solid_angle * direction.dot(point.normal).max(0.0)
            / receiver.distance_squared(point.position);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    fn emission_coordinates(
        &self,
        _: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<EmissionCoordinates> {
        let local = sampling::to_local(point.normal, direction);
        let direction = Some(sampling::cosine_hemisphere_inverse(local)?);
        Some(EmissionCoordinates { position: self.shape.area_coordinates(point.position), direction })
    }
}
