//! Lights: surfaces, points, spots, and light from infinitely far away.
//!
//! One file per light. Contract and measures: [`Emitter`] and `docs/theory.md`, section 2.8; oracle:
//! [`check_emitter`](upbp_estimators::check::check_emitter).

mod area;
mod constant;
mod directional;
mod finite;
mod image;
mod infinite;
mod point;
mod spot;
mod sun;
mod volume;

use glam::Vec3;
use upbp_estimators::scene::{
    BoundingSphere, Emission, EmissionCoordinates, Emitter, EmitterBounds, EmitterKind, EmitterPoint,
    HitDensities, Incident,
};

pub use self::area::AreaLight;
pub use self::constant::ConstantEnvironment;
pub use self::directional::DirectionalLight;
pub use self::image::{EnvironmentImage, EnvironmentImageError, ImageEnvironment};
pub use self::point::PointLight;
pub use self::spot::{SpotCone, SpotLight};
pub use self::sun::SunLight;
pub use self::volume::VolumeLight;

/// A light of a ready-made scene.
#[derive(Clone, Debug)]
pub enum Light {
    /// A surface that shines.
    Area(AreaLight),
    /// A point that shines equally in all directions.
    Point(PointLight),
    /// A point that shines into a cone.
    Spot(SpotLight),
    /// Parallel light.
    Directional(DirectionalLight),
    /// A small disc of the sky.
    Sun(SunLight),
    /// Equal light from all directions.
    Constant(ConstantEnvironment),
    /// Light from all directions, by an image.
    Image(ImageEnvironment),
    /// The inside of a body that emits.
    Volume(VolumeLight),
}

impl Light {
    /// The position of a point or spot light.
    pub(crate) const fn position(&self) -> Option<Vec3> {
        match self {
            Self::Point(light) => Some(light.position),
            Self::Spot(light) => Some(light.position),
            _ => None,
        }
    }

    /// Moves a point or spot light. A surface or volume that shines is made of a shape that has been moved
    /// already.
    pub(crate) fn translate(&mut self, by: Vec3) {
        match self {
            Self::Point(light) => light.position += by,
            Self::Spot(light) => light.position += by,
            Self::Area(_)
            | Self::Directional(_)
            | Self::Sun(_)
            | Self::Constant(_)
            | Self::Image(_)
            | Self::Volume(_) => {}
        }
    }
}

macro_rules! dispatch {
    ($self:expr, $light:ident => $call:expr) => {
        match $self {
            Light::Area($light) => $call,
            Light::Point($light) => $call,
            Light::Spot($light) => $call,
            Light::Directional($light) => $call,
            Light::Sun($light) => $call,
            Light::Constant($light) => $call,
            Light::Image($light) => $call,
            Light::Volume($light) => $call,
        }
    };
}

impl Emitter for Light {
    fn kind(&self) -> EmitterKind {
        dispatch!(self, light => light.kind())
    }

    fn power(&self, bounds: &BoundingSphere) -> f32 {
        dispatch!(self, light => light.power(bounds))
    }

    fn bounds(&self, scene: &BoundingSphere) -> Option<EmitterBounds> {
        dispatch!(self, light => light.bounds(scene))
    }

    fn sample_emission(
        &self,
        bounds: &BoundingSphere,
        u_position: [f32; 2],
        u_direction: [f32; 2],
    ) -> Option<Emission> {
        dispatch!(self, light => light.sample_emission(bounds, u_position, u_direction))
    }

    fn sample_incident(&self, bounds: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident> {
        dispatch!(self, light => light.sample_incident(bounds, receiver, u))
    }

    fn hit(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
    ) -> Option<HitDensities> {
        dispatch!(self, light => light.hit(bounds, point, direction, receiver))
    }

    fn pdf_passage(&self, point: &EmitterPoint) -> f32 {
        dispatch!(self, light => light.pdf_passage(point))
    }

    fn emission_coordinates(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        on_ray: Vec3,
    ) -> Option<EmissionCoordinates> {
        dispatch!(self, light => light.emission_coordinates(bounds, point, direction, on_ray))
    }

    fn pdf_incident(
        &self,
        bounds: &BoundingSphere,
        point: &EmitterPoint,
        direction: Vec3,
        receiver: Vec3,
        pdf_position: f32,
    ) -> f32 {
        dispatch!(self, light => light.pdf_incident(bounds, point, direction, receiver, pdf_position))
    }
}

#[cfg(test)]
mod tests;
