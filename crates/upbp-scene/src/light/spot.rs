//! A point that shines into a cone: full intensity up to the beam angle, then falling linearly with the angle
//! to zero at the cutoff.

use std::f32::consts::TAU;

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};
use upbp_media::Spectrum;

use super::finite::direction_and_distance;
use crate::sampling;

/// The cone of a [`SpotLight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotCone {
    /// Unit vector along the middle of the beam.
    pub axis: Vec3,
    /// Angle from the axis up to which the intensity is full, radians, in `[0, cutoff]`.
    pub beam: f32,
    /// Angle from the axis at which the intensity has fallen to zero, radians, in `(0, π]`.
    pub cutoff: f32,
}

impl SpotCone {
    /// Share of the full intensity in `direction`, in `[0, 1]`.
    #[must_use]
    pub fn falloff(&self, direction: Vec3) -> f32 {
        // The arc tangent keeps small angles, whose cosine is 1 to rounding.
        let angle = self.axis.cross(direction).length().atan2(self.axis.dot(direction));
        if angle <= self.beam {
            1.0
        } else if angle >= self.cutoff {
            0.0
        } else {
            (self.cutoff - angle) / (self.cutoff - self.beam)
        }
    }

    /// Solid angle weighted by the falloff, steradians: `∫ falloff dω = 2π (1 − (sin c − sin b) / (c − b))`,
    /// and `2π (1 − cos c)` in the limit of a hard edge.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        let (beam, cutoff) = (f64::from(self.beam), f64::from(self.cutoff));
        let width = cutoff - beam;
        // (sin c − sin b)/(c − b) = cos((c + b)/2) · sinc((c − b)/2), and 1 − cos x = 2 sin²(x/2).
        let half = 0.5 * width;
        let sinc_deficit = if half > 1e-3 { 1.0 - half.sin() / half } else { half * half / 6.0 };
        let middle = 0.5 * (cutoff + beam);
        let versine = 2.0 * (0.5 * middle).sin().powi(2);
        (std::f64::consts::TAU * (versine + middle.cos() * sinc_deficit)) as f32
    }

    /// `1 − cos` of the cutoff.
    fn height(&self) -> f32 {
        let sine = (0.5 * self.cutoff).sin();
        2.0 * sine * sine
    }
}

/// A spot light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// Position of the light, scene units.
    pub position: Vec3,
    /// Radiant intensity inside the beam, W sr⁻¹.
    pub intensity: Spectrum,
    /// Axis and angles of the beam.
    pub cone: SpotCone,
}

impl SpotLight {
    /// Density of directions, which are uniform within the cutoff, sr⁻¹.
    fn pdf_direction(&self) -> f32 {
        1.0 / (TAU * self.cone.height())
    }
}

impl Emitter for SpotLight {
    fn kind(&self) -> EmitterKind {
        EmitterKind::Point
    }

    fn power(&self, _: &BoundingSphere) -> f32 {
        self.cone.solid_angle() * self.intensity.mean()
    }

    fn bounds(&self, _: &BoundingSphere) -> Option<EmitterBounds> {
        Some(EmitterBounds {
            axis: self.cone.axis,
            cos_normals: 1.0,
            cos_emission: (1.0 - self.cone.height()).clamp(-1.0, 1.0_f32.next_down()),
            ..EmitterBounds::all_around(self.position, self.position)
        })
    }

    fn sample_emission(
        &self,
        _: &BoundingSphere,
        digits: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        let u = sampling::fine::numbers(u_direction, digits);
        let (axis, height) = (self.cone.axis.as_dvec3(), f64::from(self.cone.height()));
        let direction = sampling::fine::cone(axis, height, u).as_vec3().normalize();
        let falloff = self.cone.falloff(direction);
        (falloff > 0.0).then(|| Emission {
            point: EmitterPoint { position: self.position, normal: direction },
            direction,
            radiance: self.intensity * falloff,
            pdf_position: 1.0,
            pdf_direction: self.pdf_direction(),
        })
    }

    fn sample_incident(&self, _: &BoundingSphere, receiver: Vec3, _: [f32; 2]) -> Option<Incident> {
        let (towards_light, distance) = direction_and_distance(receiver, self.position)?;
        let falloff = self.cone.falloff(-towards_light);
        (falloff > 0.0).then(|| Incident {
            point: EmitterPoint { position: self.position, normal: -towards_light },
            towards_light,
            distance,
            radiance: self.intensity * falloff,
            pdf: 1.0,
            pdf_position: 1.0,
            pdf_direction: self.pdf_direction(),
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
        let at = sampling::cone_inverse(self.cone.axis, self.cone.height(), direction);
        (at[0] <= 1.0).then_some(EmissionCoordinates { position: None, direction: Some(at) })
    }
}
