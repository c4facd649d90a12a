//! Parallel light from infinitely far away.

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Parallel, disc_area, place};

/// A directional light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    /// Direction of propagation, a unit vector.
    pub direction: Vec3,
    /// Irradiance on a plane perpendicular to the direction, W m⁻².
    pub irradiance: Spectrum,
}

impl DirectionalLight {
    fn parallel(&self) -> Parallel {
        Parallel { direction: self.direction, radiance: self.irradiance, pdf: 1.0 }
    }
}

impl Emitter for DirectionalLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Directional
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        disc_area(bounds) * self.irradiance.mean()
    }

    fn sample_emission(&self, bounds: &BoundingSphere, u: [f32; 2], digits: [f32; 2]) -> Option<Emission> {
        Some(self.parallel().emission(bounds, u, digits))
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, _: [f32; 2]) -> Option<Incident> {
        Some(self.parallel().incident(bounds, receiver))
    }

    fn hit(&self, _: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        None
    }

    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        _: &EmitterPoint,
        _: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let position = place(bounds, self.parallel().direction, on_ray)?;
        Some(EmissionCoordinates { position: Some(position), direction: None })
    }
}
