//! Light from infinitely far away, as it arrives along one direction.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use upbp_estimators::scene::{BoundingSphere, Emission, EmitterPoint, HitDensities, Incident};
use upbp_media::{Spectrum, orthonormal_basis};

use crate::sampling;

/// Light that arrives along one direction from infinitely far away.
pub(super) struct Parallel {
    /// Direction of propagation, a unit vector.
    pub(super) direction: Vec3,
    /// Radiance in W m⁻² sr⁻¹, or irradiance in W m⁻² of light with a single direction.
    pub(super) radiance: Spectrum,
    /// Density of the direction, sr⁻¹, or the probability 1 of a single one.
    pub(super) pdf: f32,
}

impl Parallel {
    /// Starts a ray; `digits` are random numbers that have no other use, if there are any.
    pub(super) fn emission(&self, bounds: &BoundingSphere, u: [f32; 2], digits: [f32; 2]) -> Emission {
        let position = start_on_disc(bounds, self.direction, u, digits);
        Emission {
            point: EmitterPoint { position, normal: self.direction },
            direction: self.direction,
            radiance: self.radiance,
            pdf_position: self.pdf,
            pdf_direction: 1.0 / disc_area(bounds),
        }
    }

    pub(super) fn incident(&self, bounds: &BoundingSphere, receiver: Vec3) -> Incident {
        let towards_light = -self.direction;
        Incident {
            point: beyond(bounds, receiver, towards_light),
            towards_light,
            distance: f32::INFINITY,
            radiance: self.radiance,
            pdf: self.pdf,
            pdf_position: self.pdf,
            pdf_direction: 1.0 / disc_area(bounds),
        }
    }

    pub(super) fn hit(&self, bounds: &BoundingSphere) -> HitDensities {
        HitDensities {
            radiance: self.radiance,
            pdf_incident: self.pdf,
            pdf_position: self.pdf,
            pdf_direction: 1.0 / disc_area(bounds),
        }
    }
}

/// Light that comes from many directions, infinitely far away.
pub(super) trait Environment {
    /// The power through a disc of an area that is turned towards each direction, W.
    fn power_through(&self, area: f32) -> f32;

    /// The light that goes in a direction, if there is any.
    fn along(&self, direction: Vec3) -> Option<Parallel>;

    /// Draws a direction; none in the rare case that rounding moves it to where no light comes from.
    fn sample(&self, u: [f32; 2]) -> Option<Parallel>;

    /// The random numbers that a direction is drawn by; `None` beside all that are drawn.
    fn coordinates(&self, direction: Vec3) -> Option<[f32; 2]>;
}

/// Implements [`Emitter`](upbp_estimators::scene::Emitter) for an [`Environment`].
macro_rules! environment {
    ($light:ty) => {
        impl Emitter for $light {
            fn kind(&self) -> EmitterKind {
                EmitterKind::Environment
            }

            fn power(&self, bounds: &BoundingSphere) -> f32 {
                self.power_through(disc_area(bounds))
            }

            fn sample_emission(
                &self,
                bounds: &BoundingSphere,
                u: [f32; 2],
                u_direction: [f32; 2],
            ) -> Option<Emission> {
                Some(self.sample(u_direction)?.emission(bounds, u, [0.5; 2]))
            }

            fn sample_incident(
                &self,
                bounds: &BoundingSphere,
                receiver: Vec3,
                u: [f32; 2],
            ) -> Option<Incident> {
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
                let position = place(bounds, direction, on_ray)?;
                let direction = self.coordinates(direction)?;
                Some(EmissionCoordinates { position: Some(position), direction: Some(direction) })
            }
        }
    };
}
pub(super) use environment;

/// The random numbers that start the ray of light in `direction` through a point; `None` beside the disc.
pub(super) fn place(bounds: &BoundingSphere, direction: Vec3, on_ray: Vec3) -> Option<[f32; 2]> {
    let (tangent, bitangent) = orthonormal_basis(direction);
    let offset = on_ray - bounds.centre;
    sampling::disc_inverse(Vec2::new(offset.dot(tangent), offset.dot(bitangent)) / bounds.radius)
}

/// Area of the disc that parallel light starts from, square scene units.
pub(super) fn disc_area(bounds: &BoundingSphere) -> f32 {
    PI * bounds.radius * bounds.radius
}

/// Draws the start of a ray in `direction`, uniformly over a disc in front of the scene that is as wide as
/// its bounds.
fn start_on_disc(bounds: &BoundingSphere, direction: Vec3, u: [f32; 2], digits: [f32; 2]) -> Vec3 {
    let radius = f64::from(bounds.radius);
    let across = radius * sampling::fine::disc(sampling::fine::numbers(u, digits));
    let (tangent, bitangent) = orthonormal_basis(direction);
    // Ten per cent outside, so that no rounding puts the start behind a surface on the bounds; and more or
    // less, so that roundings differ from ray to ray instead of putting all on a grid.
    let back = radius * (1.1 + 0.1 * f64::from(digits[0]));
    let [centre, direction, tangent, bitangent] =
        [bounds.centre, direction, tangent, bitangent].map(Vec3::as_dvec3);
    (centre - back * direction + tangent * across.x + bitangent * across.y).as_vec3()
}

/// A point outside of the scene in the direction of an infinite light.
fn beyond(bounds: &BoundingSphere, receiver: Vec3, towards_light: Vec3) -> EmitterPoint {
    let distance = 2.0 * bounds.radius + receiver.distance(bounds.centre);
    EmitterPoint { position: receiver + towards_light * distance, normal: -towards_light }
}
