//! A rough metal: mirrors with Trowbridge-Reitz normals that reflect by Fresnel's equations.
//!
//! `f = F D G / (4 |l_z| |c_z|)`, one bounce between the small mirrors. Source: Walter et al. 2007,
//! equation 20.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfEvaluation, BsdfSample, Interface, Walk};
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

/// The small mirrors that reflect between two directions.
struct Mirrors {
    /// Their normal, above the surface.
    normal: Vec3,
    /// Value of the metal if they reflected all light.
    value: f32,
    /// Density of the second direction after arriving from the first.
    pdf: f32,
    /// Density of the first direction after arriving from the second.
    pdf_reverse: f32,
}

impl Conductor {
    /// The small mirrors that reflect between two directions, if these are on the same side.
    fn between(self, from: Vec3, to: Vec3) -> Option<Mirrors> {
        if from.z * to.z <= 0.0 {
            return None;
        }
        let half = (from + to).try_normalize()?;
        let normal = half * half.z.signum();
        // The density of normals that are seen over 4 |from·h|, written out: the dot product cancels.
        let density = 0.25 * self.normals.density(normal);
        let visibility = self.normals.visibility(from, to);
        Some(Mirrors {
            normal,
            value: density * visibility.both,
            pdf: density * visibility.from,
            pdf_reverse: density * visibility.to,
        })
    }

    fn reflected(self, from: Vec3, interface: Interface, mirrors: &Mirrors) -> Spectrum {
        let [eta_outside, _] = indices(from, interface);
        let cos_incident = from.dot(mirrors.normal).abs().min(1.0);
        self.fresnel.reflectance(cos_incident, eta_outside) * mirrors.value
    }
}

impl Bsdf for Conductor {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let found = self.between(towards_light, towards_camera);
        found.map_or(Spectrum::ZERO, |found| self.reflected(towards_light, interface, &found))
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        self.between(from, to).map_or(0.0, |found| found.pdf)
    }

    fn evaluate(&self, from: Vec3, to: Vec3, _: Walk, interface: Interface) -> Option<BsdfEvaluation> {
        let found = self.between(from, to)?;
        let value = self.reflected(from, interface, &found);
        (!value.is_black()).then(|| BsdfEvaluation {
            value,
            pdf: found.pdf,
            pdf_reverse: found.pdf_reverse,
            continuation: self.continuation(from),
            continuation_reverse: self.continuation(to),
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
        let Mirrors { value, pdf, pdf_reverse, .. } = self.between(from, to)?;
        if pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        let [eta_outside, _] = indices(from, interface);
        let reflectance = self.fresnel.reflectance(above.dot(normal).clamp(0.0, 1.0), eta_outside);
        let weight = reflectance * (value * to.z.abs() / pdf);
        Some(BsdfSample { to, weight, pdf, pdf_reverse, delta: false })
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
