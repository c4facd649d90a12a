//! The sun: light from a small disc of the sky, infinitely far away.

use std::f32::consts::TAU;

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Environment, Parallel, disc_area, environment, place};
use crate::sampling;

/// A disc of the sky of even radiance. Other than a [directional light](super::DirectionalLight) it is seen:
/// by itself, in mirrors and through glass; and shadows have soft edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunLight {
    /// Direction of propagation from the middle of the disc, a unit vector.
    direction: Vec3,
    /// Radiance of the disc, W m⁻² sr⁻¹.
    radiance: Spectrum,
    /// One minus the cosine of the angle from the middle of the disc to its rim.
    height: f32,
}

impl SunLight {
    /// A disc by its irradiance on a plane perpendicular to `direction`, W m⁻², and by its angular diameter,
    /// radians, in `[1.7e-4, π]`. The radiance is `E / (π sin² α)`, with α half of the diameter.
    ///
    /// Directions to a narrower disc miss it by rounding: half a per cent of them at 2e-5.
    #[must_use]
    pub fn new(direction: Vec3, irradiance: Spectrum, diameter: f32) -> Self {
        let sine = |angle: f32| f64::from(angle).sin();
        let projected = std::f64::consts::PI * sine(0.5 * diameter).powi(2);
        let height = 2.0 * sine(0.25 * diameter).powi(2);
        Self { direction, radiance: irradiance * projected.recip() as f32, height: height as f32 }
    }
}

impl Environment for SunLight {
    fn power_through(&self, area: f32) -> f32 {
        area * TAU * self.height * self.radiance.mean()
    }

    fn along(&self, direction: Vec3) -> Option<Parallel> {
        let pdf = 1.0 / (TAU * self.height);
        let is_in_disc = sampling::is_in_cone(self.direction, self.height, direction);
        is_in_disc.then_some(Parallel { direction, radiance: self.radiance, pdf })
    }

    fn sample(&self, u: [f32; 2]) -> Option<Parallel> {
        let (axis, height) = (self.direction.as_dvec3(), f64::from(self.height));
        self.along(sampling::fine::cone(axis, height, u.map(f64::from)).as_vec3().normalize())
    }

    fn coordinates(&self, direction: Vec3) -> Option<[f32; 2]> {
        let coordinates = sampling::cone_inverse(self.direction, self.height, direction);
        (coordinates[0] <= 1.0).then_some(coordinates)
    }
}

environment!(SunLight);
