//! The smooth surface of a transparent body.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::fresnel::refraction;
use super::local::{indices, mirrored};

/// Reflection and refraction by Fresnel's equations, chosen by the share of each. The indices come from the
/// bodies on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dielectric;

impl Bsdf for Dielectric {
    fn eval(&self, _: Vec3, _: Vec3, _: Interface) -> Spectrum {
        Spectrum::ZERO
    }

    fn pdf(&self, _: Vec3, _: Vec3, _: Interface) -> f32 {
        0.0
    }

    fn sample(
        &self,
        from: Vec3,
        walk: Walk,
        interface: Interface,
        u_lobe: f32,
        _: [f32; 2],
    ) -> Option<BsdfSample> {
        if from.z == 0.0 {
            return None;
        }
        let [eta_from, eta_to] = indices(from, interface);
        let refraction = refraction(from.z.abs(), eta_from, eta_to);
        // Fresnel's shares are the same for the reversed path, so both densities are.
        if u_lobe < refraction.reflectance {
            let pdf = refraction.reflectance;
            return Some(BsdfSample {
                to: mirrored(from),
                weight: Spectrum::ONE,
                pdf,
                pdf_reverse: pdf,
                delta: true,
            });
        }
        let ratio = eta_from / eta_to;
        let to = Vec3::new(-ratio * from.x, -ratio * from.y, refraction.cos_transmitted.copysign(-from.z));
        let weight = match walk {
            Walk::Light => 1.0,
            // Radiance is compressed with the square of the index (`docs/theory.md`, section 1.6).
            Walk::Camera => ratio * ratio,
        };
        let pdf = 1.0 - refraction.reflectance;
        (pdf > 0.0 && to.z != 0.0).then(|| BsdfSample {
            to: to.normalize(),
            weight: Spectrum::splat(weight),
            pdf,
            pdf_reverse: pdf,
            delta: true,
        })
    }

    fn is_connectible(&self) -> bool {
        false
    }
}
