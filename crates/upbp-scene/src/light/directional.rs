//! Parallel light from infinitely far away.

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::geometry::{beyond, disc_area, start_on_disc};

/// A directional light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Direction of propagation, a unit vector.
    pub direction: Vec3,
    /// Irradiance on a plane perpendicular to the direction, W m⁻².
    pub irradiance: Spectrum,
}

impl Emitter for DirectionalLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Directional
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        disc_area(bounds) * self.irradiance.mean()
    }

    fn sample_emission(
        &self,
        bounds: &BoundingSphere,
        u_position: [f32; 2],
        _: [f32; 2],
    ) -> Option<Emission> {
        let position = start_on_disc(bounds, self.direction, u_position);
        Some(Emission {
            point: EmitterPoint { position, normal: self.direction },
            direction: self.direction,
            radiance: self.irradiance,
            pdf_position: 1.0,
            pdf_direction: 1.0 / disc_area(bounds),
        })
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, _: [f32; 2]) -> Option<Incident> {
        let towards_light = -self.direction;
        Some(Incident {
            point: beyond(bounds, receiver, towards_light),
            towards_light,
            distance: f32::INFINITY,
            radiance: self.irradiance,
            pdf: 1.0,
            pdf_position: 1.0,
            pdf_direction: 1.0 / disc_area(bounds),
        })
    }

    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        None
    }
}
