//! The point light, which shines equally in all directions.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::finite::direction_and_distance;
use crate::sampling;

/// An isotropic point light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Position of the light, scene units.
    pub position: Vec3,
    /// Radiant intensity, W sr⁻¹.
    pub intensity: Spectrum,
}

/// Density of a uniform direction, sr⁻¹.
const PDF_DIRECTION: f32 = 0.25 * FRAC_1_PI;

impl Emitter for PointLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Point
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        4.0 * PI * self.intensity.mean()
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        Some(EmitterBounds::all_around(self.position, self.position))
    }

    fn sample_emission(
        &self,
        _: &BoundingSphere,
        digits: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        let direction = sampling::fine::sphere(sampling::fine::numbers(u_direction, digits));
        Some(Emission {
            point: EmitterPoint { position: self.position, normal: direction },
            direction,
            radiance: self.intensity,
            pdf_position: 1.0,
            pdf_direction: PDF_DIRECTION,
        })
    }

    fn sample_incident(&self, _: &BoundingSphere, receiver: Vec3, _: [f32; 2]) -> Option<Incident> {
        let (towards_light, distance) = direction_and_distance(receiver, self.position)?;
        Some(Incident {
            point: EmitterPoint { position: self.position, normal: -towards_light },
            towards_light,
            distance,
            radiance: self.intensity,
            pdf: 1.0,
            pdf_position: 1.0,
            pdf_direction: PDF_DIRECTION,
        })
    }

    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        None
    }

    fn emission_coordinates(
        &self,
        _: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<EmissionCoordinates> {
        Some(EmissionCoordinates { position: None, direction: Some(sampling::sphere_inverse(direction)) })
    }
}
