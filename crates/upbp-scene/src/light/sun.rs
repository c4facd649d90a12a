//! The sun: light from a small disc of the sky, infinitely far away.

use std::f32::consts::TAU;

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterKind, EmitterPoint, HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::infinite::{Parallel, disc_area};
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
    /// radians, in `(0, π]`. The radiance is `E / (π sin² α)`, with α half of the diameter.
    #[must_use]
    pub fn new(direction: Vec3, irradiance: Spectrum, diameter: f32) -> Self {
        let sine = |angle: f32| f64::from(angle).sin();
        let projected = std::f64::consts::PI * sine(0.5 * diameter).powi(2);
        let height = 2.0 * sine(0.25 * diameter).powi(2);
        Self { direction, radiance: irradiance * projected.recip() as f32, height: height as f32 }
    }

    /// The light that goes in a direction, if it comes from the disc.
    fn along(&self, direction: Vec3) -> Option<Parallel> {
        let pdf = 1.0 / (TAU * self.height);
        (self.place_on_disc(direction)[0] <= 1.0).then_some(Parallel {
            direction,
            radiance: self.radiance,
            pdf,
        })
    }

    /// Draws a direction; none in the rare case that rounding moves it beside the disc.
    fn sample(&self, u: [f32; 2]) -> Option<Parallel> {
        let (axis, height) = (self.direction.as_dvec3(), f64::from(self.height));
        self.along(sampling::fine::cone(axis, height, u.map(f64::from)).as_vec3().normalize())
    }

    /// The random numbers that a direction is drawn by; the first is above 1 beside the disc.
    fn place_on_disc(&self, direction: Vec3) -> [f32; 2] {
        sampling::cone_inverse(self.direction, self.height, direction)
    }
}

impl Emitter for SunLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Environment
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        disc_area(bounds) * TAU * self.height * self.radiance.mean()
    }

    fn sample_emission(
        &self,
        bounds: &BoundingSphere,
        u: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        Some(self.sample(u_direction)?.emission(bounds, u, [0.5; 2]))
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        Some(self.sample(u)?.incident(bounds, receiver))
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        _: Vec3,
    ) -> Option<HitDensities> {
        Some(self.along(direction)?.hit(bounds))
    }

    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        _: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        let position = self.along(direction)?.place(bounds, on_ray)?;
        Some(EmissionCoordinates { position: Some(position), direction: Some(self.place_on_disc(direction)) })
    }
}
