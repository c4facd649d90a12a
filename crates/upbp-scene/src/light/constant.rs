//! The constant environment: equal light from all directions, infinitely far away.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Environment, Parallel, disc_area, environment, place};
use crate::sampling;

/// A constant environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantEnvironment {
    /// Radiance from every direction, W m⁻² sr⁻¹.
    pub radiance: Spectrum,
}

/// Density of a uniform direction, sr⁻¹.
const PDF_UNIFORM: f32 = 0.25 * FRAC_1_PI;

impl Environment for ConstantEnvironment {
    fn power_through(&self, area: f32) -> f32 {
        area * 4.0 * PI * self.radiance.mean()
    }

    fn along(&self, direction: Vec3) -> Option<Parallel> {
        Some(Parallel { direction, radiance: self.radiance, pdf: PDF_UNIFORM })
    }

    fn sample(&self, u: [f32; 2]) -> Option<Parallel> {
        self.along(sampling::sphere(u))
    }

    fn coordinates(&self, direction: Vec3) -> Option<[f32; 2]> {
        Some(sampling::sphere_inverse(direction))
    }
}

environment!(ConstantEnvironment);
