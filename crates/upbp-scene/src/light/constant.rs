//! The constant environment: equal light from all directions, infinitely far away.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::geometry::{beyond, disc_area, start_on_disc};
use crate::sampling;

/// A constant environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantEnvironment {
    /// Radiance from every direction, W m⁻² sr⁻¹.
    pub radiance: Spectrum,
}

/// Density of a uniform direction, sr⁻¹.
const PDF_UNIFORM: f32 = 0.25 * FRAC_1_PI;

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
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        let direction = sampling::sphere(u_direction);
        let position = start_on_disc(bounds, direction, u_position);
        Some(Emission {
            point: EmitterPoint { position, normal: direction },
            direction,
            radiance: self.radiance,
            pdf_position: PDF_UNIFORM,
            pdf_direction: 1.0 / disc_area(bounds),
        })
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        let towards_light = sampling::sphere(u);
        Some(Incident {
            point: beyond(bounds, receiver, towards_light),
            towards_light,
            distance: f32::INFINITY,
            radiance: self.radiance,
            pdf: PDF_UNIFORM,
            pdf_position: PDF_UNIFORM,
            pdf_direction: 1.0 / disc_area(bounds),
        })
    }

    fn hit(&self, bounds: &BoundingSphere, _: &EmitterPoint, _: Vec3, _: Vec3) -> Option<HitDensities> {
        Some(HitDensities {
            radiance: self.radiance,
            pdf_incident: PDF_UNIFORM,
            pdf_position: PDF_UNIFORM,
            pdf_direction: 1.0 / disc_area(bounds),
        })
    }
}
