//! The constant environment: equal light from all directions, infinitely far away.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Parallel, disc_area};
use crate::sampling;

/// A constant environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantEnvironment {
    /// Radiance from every direction, W m⁻² sr⁻¹.
    pub radiance: Spectrum,
}

/// Density of a uniform direction, sr⁻¹.
const PDF_UNIFORM: f32 = 0.25 * FRAC_1_PI;

impl ConstantEnvironment {
    /// The light that goes in a direction.
    fn along(&self, direction: Vec3) -> Parallel {
        Parallel { direction, radiance: self.radiance, pdf: PDF_UNIFORM }
    }
}

impl Emitter for ConstantEnvironment {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Environment
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        disc_area(bounds) * 4.0 * PI * self.radiance.mean()
    }

    fn sample_emission(
        &self,
        bounds: &BoundingSphere,
        u: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        Some(self.along(sampling::sphere(u_direction)).emission(bounds, u, [0.5; 2]))
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        Some(self.along(-sampling::sphere(u)).incident(bounds, receiver))
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<HitDensities> {
        Some(self.along(direction).hit(bounds))
    }

    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let position = self.along(direction).place(bounds, on_ray)?;
        Some(EmissionCoordinates {
            position: Some(position),
            direction: Some(sampling::sphere_inverse(direction)),
        })
    }
}
