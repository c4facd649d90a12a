//! The rough surface of a transparent body: small smooth interfaces with Trowbridge-Reitz normals, and the
//! light that they send to [each other](super::energy_compensation).
//!
//! Source: Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, equations 20
//! and 21. Equation 21 compresses radiance: `f(l, c) / η_c² = f(c, l) / η_l²`.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfEvaluation, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::dielectric::Dielectric;
use super::energy_compensation::{Lobe, LobeParts};
use super::facet::scattered;
use super::fresnel::refraction;
use super::local::indices;
use super::trowbridge_reitz::TrowbridgeReitz;

/// Relative difference of indices below which the surface is taken to be smooth: it bends light by less than
/// any roughness would spread it, and the normal that would refract between two given directions has no
/// digits left.
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

/// Scattering between two directions.
#[derive(Clone, Copy)]
struct Scattering {
    /// Value without the index that compresses radiance.
    value: f32,
    /// Density of the second direction after arriving from the first.
    pdf: f32,
    /// Density of the first direction after arriving from the second.
    pdf_reverse: f32,
}

impl Scattering {
    const NONE: Self = Self { value: 0.0, pdf: 0.0, pdf_reverse: 0.0 };
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

    /// Single scattering between two directions.
    fn single(self, from: Vec3, to: Vec3, eta @ [eta_from, eta_to]: [f32; 2]) -> Option<Scattering> {
        let facet = Self::facet(from, to, eta)?;
        let visibility = self.normals.visibility(from, to);
        let density = self.normals.density(facet.normal);
        let (spread, eta2) = if facet.reflects {
            (0.25 * facet.reflectance * density, [1.0; 2])
        } else {
            let cosines = (from.dot(facet.normal) * to.dot(facet.normal)).abs();
            let spread = (1.0 - facet.reflectance) * density * cosines / facet.denominator;
            (spread, [eta_to * eta_to, eta_from * eta_from])
        };
        let found = Scattering {
            value: spread * visibility.both,
            pdf: spread * visibility.from * eta2[0],
            pdf_reverse: spread * visibility.to * eta2[1],
        };
        (found.value.is_finite() && found.pdf.is_finite() && found.pdf_reverse.is_finite()).then_some(found)
    }

    /// All scattering between two directions, with the lobe of these indices; none at the horizon.
    fn scattering(self, from: Vec3, to: Vec3, eta: [f32; 2], lobe: Option<&Lobe>) -> Scattering {
        if from.z == 0.0 || to.z == 0.0 {
            return Scattering::NONE;
        }
        let single = self.single(from, to, eta).unwrap_or(Scattering::NONE);
        let Some(lobe) = lobe else { return single };
        let LobeParts { value, shares: [share, share_reverse], pdfs } = lobe.between(from.z, to.z);
        Scattering {
            value: single.value + value,
            pdf: (1.0 - share) * single.pdf + share * pdfs[0],
            pdf_reverse: (1.0 - share_reverse) * single.pdf_reverse + share_reverse * pdfs[1],
        }
    }

    /// All scattering between two directions; `None` where the surface is smooth.
    fn between(self, from: Vec3, to: Vec3, eta: [f32; 2]) -> Option<Scattering> {
        (!is_matched(eta)).then(|| self.scattering(from, to, eta, Lobe::new(self.normals, eta).as_ref()))
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

/// Whether the surface is as good as smooth, from either side.
pub(crate) fn is_matched([eta_from, eta_to]: [f32; 2]) -> bool {
    (eta_from - eta_to).abs() < MATCHED * eta_from.min(eta_to)
}

impl Bsdf for RoughDielectric {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, interface: Interface) -> Spectrum {
        let eta @ [_, eta_camera] = indices(towards_light, interface);
        let passes = towards_light.z * towards_camera.z < 0.0;
        let found = self.between(towards_light, towards_camera, eta);
        Spectrum::splat(found.map_or(0.0, |found| found.value * compression(passes, eta_camera)))
    }

    fn pdf(&self, from: Vec3, to: Vec3, interface: Interface) -> f32 {
        self.between(from, to, indices(from, interface)).map_or(0.0, |found| found.pdf)
    }

    fn evaluate(&self, from: Vec3, to: Vec3, walk: Walk, interface: Interface) -> Option<BsdfEvaluation> {
        let eta @ [eta_from, eta_to] = indices(from, interface);
        let Scattering { value, pdf, pdf_reverse } = self.between(from, to, eta)?;
        let eta_camera = if walk == Walk::Camera { eta_from } else { eta_to };
        (value > 0.0).then(|| BsdfEvaluation {
            value: Spectrum::splat(value * compression(from.z * to.z < 0.0, eta_camera)),
            pdf,
            pdf_reverse,
            continuation: 1.0,
            continuation_reverse: 1.0,
        })
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
            return Dielectric.sample(from, walk, interface, u_lobe, u);
        }
        let lobe = Lobe::new(self.normals, eta);
        let share = lobe.as_ref().map_or(0.0, |lobe| lobe.share(from.z));
        let to = match &lobe {
            Some(lobe) if u_lobe < share => lobe.sample(from, u_lobe / share, u),
            _ => self.sample_single(from, eta, (u_lobe - share) / (1.0 - share), u)?,
        };
        let Scattering { value, pdf, pdf_reverse } = self.scattering(from, to, eta, lobe.as_ref());
        if pdf <= 0.0 {
            return None;
        }
        let eta_camera = if walk == Walk::Camera { eta_from } else { eta_to };
        let weight = value * compression(from.z * to.z < 0.0, eta_camera) * to.z.abs() / pdf;
        weight.is_finite().then(|| BsdfSample {
            to,
            weight: Spectrum::splat(weight),
            pdf,
            pdf_reverse,
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
