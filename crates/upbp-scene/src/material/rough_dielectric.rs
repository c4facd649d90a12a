//! The rough surface of a transparent body: small smooth interfaces with Trowbridge-Reitz normals.
//!
//! Source: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, equations 20
//! and 21. Equation 21 compresses radiance: `f(l, c) / η_c² = f(c, l) / η_l²`.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

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
    fn facet(from: Vec3, to: Vec3, interface: Interface) -> Option<Facet> {
        if from.z == 0.0 || to.z == 0.0 {
            return None;
        }
        let (eta_from, eta_to) = indices(from, interface);
        if is_matched(eta_from, eta_to) {
            return None;
        }
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

    /// Value on the way from `from` to `to`, without the index that compresses radiance.
    fn symmetric_value(self, from: Vec3, to: Vec3, facet: &Facet) -> f32 {
        let spread = self.normals.density(facet.normal) * self.normals.shadowing_masking(from, to)
            / (from.z * to.z).abs();
        if facet.reflects {
            0.25 * facet.reflectance * spread
        } else {
            let cosines = (from.dot(facet.normal) * to.dot(facet.normal)).abs();
            (1.0 - facet.reflectance) * spread * cosines / facet.denominator
        }
    }
}

fn is_matched(eta_from: f32, eta_to: f32) -> bool {
    (eta_from - eta_to).abs() < MATCHED * eta_to
}

impl Bsdf for RoughDielectric {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let Some(facet) = Self::facet(towards_light, towards_camera, interface) else {
            return Spectrum::ZERO;
        };
        let value = self.symmetric_value(towards_light, towards_camera, &facet);
        let (eta_camera, _) = indices(towards_camera, interface);
        let compression = if facet.reflects { 1.0 } else { eta_camera * eta_camera };
        let value = value * compression;
        Spectrum::splat(if value.is_finite() { value } else { 0.0 })
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        let Some(facet) = Self::facet(from, to, interface) else {
            return 0.0;
        };
        let (_, eta_to) = indices(from, interface);
        let visible = self.normals.visible_density(from, facet.normal);
        let cos_to = to.dot(facet.normal).abs();
        let pdf = if facet.reflects {
            facet.reflectance * visible / (4.0 * cos_to)
        } else {
            (1.0 - facet.reflectance) * visible * eta_to * eta_to * cos_to / facet.denominator
        };
        if pdf.is_finite() { pdf } else { 0.0 }
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
        let (eta_from, eta_to) = indices(from, interface);
        if is_matched(eta_from, eta_to) {
            return Some(BsdfSample {
                to: -from,
                weight: Spectrum::ONE,
                pdf: 1.0,
                pdf_reverse: 1.0,
                delta: true,
            });
        }
        let side = Vec3::new(1.0, 1.0, from.z.signum());
        let above = from * side;
        let normal = self.normals.sample_visible(above, u)?;
        let cos_from = above.dot(normal).clamp(0.0, 1.0);
        let refraction = refraction(cos_from, eta_from, eta_to);
        let reflects = u_lobe < refraction.reflectance;
        let local = if reflects {
            2.0 * cos_from * normal - above
        } else {
            let ratio = eta_from / eta_to;
            (ratio * cos_from - refraction.cos_transmitted) * normal - ratio * above
        };
        let to = local.try_normalize()? * side;
        if (to.z * from.z > 0.0) != reflects {
            return None;
        }
        let pdf = self.pdf(from, to, interface);
        if pdf <= 0.0 {
            return None;
        }
        let compression = match walk {
            Walk::Camera if !reflects => (eta_from / eta_to).powi(2),
            _ => 1.0,
        };
        let unmasked = self.normals.shadowing_masking(from, to) / self.normals.masking(from);
        Some(BsdfSample {
            to,
            weight: Spectrum::splat(compression * unmasked),
            pdf,
            pdf_reverse: self.pdf(to, from, interface),
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        true
    }
}
