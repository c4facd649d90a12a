//! A rough metal: mirrors with Trowbridge-Reitz normals that reflect by Fresnel's equations.
//!
//! `f = F D G / (4 |l_z| |c_z|)`, one bounce between the small mirrors. Source: Walter et al. 2007,
//! equation 20.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::fresnel;
use super::local::{continuation_by_albedo, indices};
use super::trowbridge_reitz::TrowbridgeReitz;

/// The reflectance of the small mirrors of a metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MetalFresnel {
    /// From the complex index of refraction `eta + i k`, per channel, in vacuum.
    Indices {
        /// Real part of the index.
        eta: Spectrum,
        /// Imaginary part of the index.
        k: Spectrum,
    },
    /// Schlick's approximation from the reflectance at normal incidence.
    Schlick(Spectrum),
}

impl MetalFresnel {
    fn reflectance(self, cos_incident: f32, eta_outside: f32) -> Spectrum {
        match self {
            Self::Indices { eta, k } => {
                let channel =
                    |c: usize| fresnel::metal(cos_incident, eta[c] / eta_outside, k[c] / eta_outside);
                Spectrum::new(channel(0), channel(1), channel(2))
            }
            Self::Schlick(normal) => normal.map(|normal| fresnel::schlick(cos_incident, normal)),
        }
    }
}

/// Rough metal. Both sides reflect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// The normals of the small mirrors.
    pub normals: TrowbridgeReitz,
    /// The reflectance of the small mirrors.
    pub fresnel: MetalFresnel,
}

impl Conductor {
    /// Normal of the mirrors that reflect between the two directions, above the surface.
    fn half_vector(from: Vec3, to: Vec3) -> Option<Vec3> {
        if from.z * to.z <= 0.0 {
            return None;
        }
        let half = (from + to).try_normalize()?;
        Some(half * half.z.signum())
    }
}

impl Bsdf for Conductor {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let Some(half) = Self::half_vector(towards_light, towards_camera) else {
            return Spectrum::ZERO;
        };
        let [eta_outside, _] = indices(towards_light, interface);
        let reflectance = self.fresnel.reflectance(towards_light.dot(half).abs().min(1.0), eta_outside);
        let value = self.normals.density(half)
            * self.normals.shadowing_masking(towards_light, towards_camera)
            / (4.0 * towards_light.z * towards_camera.z);
        reflectance * value
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        // D_visible / (4 |from·h|), written out: the dot product cancels.
        Self::half_vector(from, to).map_or(0.0, |half| {
            self.normals.masking(from) * self.normals.density(half) / (4.0 * from.z.abs())
        })
    }

    fn sample(&self, from: Vec3, _: Walk, interface: Interface, _: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        let side = Vec3::new(1.0, 1.0, from.z.signum());
        let above = from * side;
        let normal = self.normals.sample_visible(above, u)?;
        let to = (2.0 * above.dot(normal) * normal - above).normalize() * side;
        let pdf = self.pdf(from, to, interface);
        if pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        let [eta_outside, _] = indices(from, interface);
        let reflectance = self.fresnel.reflectance(above.dot(normal).clamp(0.0, 1.0), eta_outside);
        let unmasked = self.normals.shadowing_masking(from, to) / self.normals.masking(from);
        Some(BsdfSample {
            to,
            weight: reflectance * unmasked,
            pdf,
            pdf_reverse: self.pdf(to, from, interface),
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        true
    }

    fn albedo(&self, from: Vec3) -> Spectrum {
        self.fresnel.reflectance(from.z.abs().min(1.0), 1.0)
    }

    fn continuation(&self, from: Vec3) -> f32 {
        continuation_by_albedo(self.fresnel.reflectance(from.z.abs().min(1.0), 1.0))
    }
}
