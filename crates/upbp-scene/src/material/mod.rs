//! Materials: the scattering of light at surfaces.
//!
//! One file per material. Directions are local, z along the shading normal, and point away from the surface.
//! Contract and conventions: [`Bsdf`]; oracle: [`check_bsdf`](upbp_estimators::check::check_bsdf).

mod conductor;
mod dielectric;
mod energy_compensation;
mod facet;
mod fresnel;
mod lambert;
mod local;
mod mirror;
mod phong;
mod rough_dielectric;
mod trowbridge_reitz;

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfEvaluation, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

pub use self::conductor::{Conductor, MetalFresnel};
pub use self::dielectric::Dielectric;
pub use self::lambert::Lambert;
pub use self::mirror::Mirror;
pub use self::phong::Phong;
pub use self::rough_dielectric::RoughDielectric;
pub(crate) use self::rough_dielectric::is_matched;
pub use self::trowbridge_reitz::TrowbridgeReitz;

/// A material of a ready-made scene. Index-matched boundaries have none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Matt.
    Lambert(Lambert),
    /// Matt with a glossy lobe.
    Phong(Phong),
    /// Perfectly smooth metal.
    Mirror(Mirror),
    /// Smooth glass.
    Dielectric(Dielectric),
    /// Rough metal.
    Conductor(Conductor),
    /// Rough glass.
    RoughDielectric(RoughDielectric),
}

impl Material {
    /// Whether the material scatters light into single directions only. Rough glass does where the indices on
    /// both sides are the same, which the material does not know.
    #[must_use]
    pub(crate) const fn is_specular(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Dielectric(_))
    }
}

macro_rules! dispatch {
    ($self:expr, $material:ident => $call:expr) => {
        match $self {
            Material::Lambert($material) => $call,
            Material::Phong($material) => $call,
            Material::Mirror($material) => $call,
            Material::Dielectric($material) => $call,
            Material::Conductor($material) => $call,
            Material::RoughDielectric($material) => $call,
        }
    };
}

impl Bsdf for Material {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        dispatch!(self, material => material.eval(towards_light, towards_camera, interface))
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        dispatch!(self, material => material.pdf(from, to, interface))
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        dispatch!(self, material => material.sample(from, walk, interface, u_lobe, u))
    }

    fn evaluate(&self, from: Vec3, to: Vec3, walk: Walk, interface: Interface) -> Option<BsdfEvaluation> {
        dispatch!(self, material => material.evaluate(from, to, walk, interface))
    }

    fn is_connectible(&self) -> bool {
        dispatch!(self, material => material.is_connectible())
    }

    fn continuation(&self, from: Vec3) -> f32 {
        dispatch!(self, material => material.continuation(from))
    }

    fn albedo(&self, from: Vec3) -> Spectrum {
        dispatch!(self, material => material.albedo(from))
    }
}

#[cfg(test)]
mod tests;
