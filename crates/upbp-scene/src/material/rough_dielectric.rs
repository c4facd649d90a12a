//! The rough surface of a transparent body: small smooth interfaces with Trowbridge-Reitz normals, and the
//! light that they send to [each other](super::energy_compensation).
//!
//! Source: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, equations 20
//! and 21. Equation 21 compresses radiance: `f(l, c) / η_c² = f(c, l) / η_l²`.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::energy_compensation::Lobe;
use super::facet::scattered;
use super::fresnel::refraction;
use super::local::indices;
use super::trowbridge_reitz::TrowbridgeReitz;

/// Relative difference of indices below which the surface passes light straight, whatever its
/// roughness. The reflectance that is left out is below 10⁻⁶; the normal that would refract between two
/// given directions has no digits left there.
const MATCHED: f32 = 1e-3;

/// Rough glass. The indices come from the bodies on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// The small interfaces.
    pub normals: TrowbridgeReitz,
}

/// The small interface that scatters between two directions.
struct Facet {
    /// Normal on the side of the first direction.
    normal: Vec3,
    /// Share of the light that the facet reflects, seen from the first direction.
    reflectance: f32,
    /// Whether the directions lie on the same side.
    reflects: bool,
    /// `(η_from from·h + η_to to·h)²`, of use only for refraction.
    denominator: f32,
}

impl RoughDielectric {
    /// The facet that scatters from one direction to the other; none if its back would be seen.
    fn facet(from: Vec3, to: Vec3, [eta_from, eta_to]: [f32; 2]) -> Option<Facet> {
        let reflects = from.z * to.z > 0.0;
        let half = if reflects { from + to } else { eta_from * from + eta_to * to }.try_normalize()?;
        let normal = half * (half.z * from.z).signum();
        let (cos_from, cos_to) = (from.dot(normal), to.dot(normal));
        if cos_from <= 0.0 || (cos_to > 0.0) != reflects || cos_to == 0.0 {
            return None;
        }
        // At a refraction both cosines are known: from the denser side the share has no digits near the
        // critical angle.
        let reflectance = if reflects || eta_from < eta_to {
            refraction(cos_from.min(1.0), eta_from, eta_to).reflectance
        } else {
            refraction(cos_to.abs().min(1.0), eta_to, eta_from).reflectance
        };
        let sum = eta_from * cos_from + eta_to * cos_to;
        Some(Facet { normal, reflectance, reflects, denominator: sum * sum })
    }

    /// Value of single scattering, without the index that compresses radiance.
    fn single_value(self, from: Vec3, to: Vec3, facet: &Facet) -> f32 {
        let spread = self.normals.density(facet.normal) * self.normals.shadowing_masking(from, to)
            / (from.z * to.z).abs();
        if facet.reflects {
            0.25 * facet.reflectance * spread
        } else {
            let cosines = (from.dot(facet.normal) * to.dot(facet.normal)).abs();
            (1.0 - facet.reflectance) * spread * cosines / facet.denominator
        }
    }

    /// Density of single scattering.
    fn single_pdf(self, from: Vec3, to: Vec3, facet: &Facet, eta_to: f32) -> f32 {
        let visible = self.normals.visible_density(from, facet.normal);
        let cos_to = to.dot(facet.normal).abs();
        if facet.reflects {
            facet.reflectance * visible / (4.0 * cos_to)
        } else {
            (1.0 - facet.reflectance) * visible * eta_to * eta_to * cos_to / facet.denominator
        }
    }

    /// Value without the index that compresses radiance, and density; both zero at the horizon.
    fn value_and_pdf(self, from: Vec3, to: Vec3, eta: [f32; 2]) -> [f32; 2] {
        if from.z == 0.0 || to.z == 0.0 {
            return [0.0; 2];
        }
        let [mut value, mut pdf] = Self::facet(from, to, eta).map_or([0.0; 2], |facet| {
            [self.single_value(from, to, &facet), self.single_pdf(from, to, &facet, eta[1])]
        });
        if !(value.is_finite() && pdf.is_finite()) {
            [value, pdf] = [0.0; 2];
        }
        if let Some(lobe) = Lobe::new(self.normals, eta) {
            let share = lobe.share(from.z);
            value += lobe.symmetric_value(from.z, to.z);
            pdf = (1.0 - share) * pdf + share * lobe.pdf(from.z, to.z);
        }
        [value, pdf]
    }

    /// Draws a direction by single scattering.
    fn sample_single(
        self,
        from: Vec3,
        [eta_from, eta_to]: [f32; 2],
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<Vec3> {
        let side = Vec3::new(1.0, 1.0, from.z.signum());
        let above = from * side;
        let normal = self.normals.sample_visible(above, u)?;
        let cos_from = above.dot(normal).clamp(0.0, 1.0);
        let reflects = u_lobe < refraction(cos_from, eta_from, eta_to).reflectance;
        Some(scattered(above, normal, [eta_from, eta_to], reflects)? * side)
    }
}

/// Whether the surface passes light straight, from either side.
pub(crate) fn is_matched([eta_from, eta_to]: [f32; 2]) -> bool {
    (eta_from - eta_to).abs() < MATCHED * eta_from.min(eta_to)
}

impl Bsdf for RoughDielectric {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let eta @ [_, eta_camera] = indices(towards_light, interface);
        if is_matched(eta) {
            return Spectrum::ZERO;
        }
        let [value, _] = self.value_and_pdf(towards_light, towards_camera, eta);
        let passes = towards_light.z * towards_camera.z < 0.0;
        Spectrum::splat(value * compression(passes, eta_camera))
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        let eta = indices(from, interface);
        if is_matched(eta) { 0.0 } else { self.value_and_pdf(from, to, eta)[1] }
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        let eta @ [eta_from, eta_to] = indices(from, interface);
        if is_matched(eta) {
            return Some(BsdfSample {
                to: -from,
                weight: Spectrum::ONE,
                pdf: 1.0,
                pdf_reverse: 1.0,
                delta: true,
            });
        }
        let lobe = Lobe::new(self.normals, eta);
        let share = lobe.as_ref().map_or(0.0, |lobe| lobe.share(from.z));
        let to = match lobe {
            Some(lobe) if u_lobe < share => lobe.sample(from, u_lobe / share, u),
            _ => self.sample_single(from, eta, (u_lobe - share) / (1.0 - share), u)?,
        };
        let [value, pdf] = self.value_and_pdf(from, to, eta);
        if pdf <= 0.0 {
            return None;
        }
        let eta_camera = if walk == Walk::Camera { eta_from } else { eta_to };
        let weight = value * compression(from.z * to.z < 0.0, eta_camera) * to.z.abs() / pdf;
        weight.is_finite().then(|| BsdfSample {
            to,
            weight: Spectrum::splat(weight),
            pdf,
            pdf_reverse: self.pdf(to, from, interface),
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        true
    }
}

/// Factor of radiance that passes the surface to the side of the camera, or stays on its side.
fn compression(passes: bool, eta_camera: f32) -> f32 {
    if passes { eta_camera * eta_camera } else { 1.0 }
}
