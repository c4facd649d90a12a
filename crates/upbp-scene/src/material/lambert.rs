//! A matt surface: equal radiance in all directions, on the side that is lit.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::local::{continuation_by_albedo, cosine_pdf, sample_cosine};

/// Lambert's law: `f = reflectance / π`. Both sides reflect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Albedo, per channel in `[0, 1]`.
    pub reflectance: Spectrum,
}

impl Bsdf for Lambert {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, _: Interface) -> Spectrum {
        if towards_light.z * towards_camera.z > 0.0 { self.reflectance * FRAC_1_PI } else { Spectrum::ZERO }
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        if self.reflectance.is_black() { 0.0 } else { cosine_pdf(from, to) }
    }

    fn sample(&self, from: Vec3, _: Walk, _: Interface, _: f32, u: [f32; 2]) -> Option<BsdfSample> {
        if self.reflectance.is_black() || from.z == 0.0 {
            return None;
        }
        let to = sample_cosine(from, u);
        Some(BsdfSample {
            to,
            weight: self.reflectance,
            pdf: cosine_pdf(from, to),
            pdf_reverse: cosine_pdf(to, from),
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        !self.reflectance.is_black()
    }

    fn continuation(&self, _: Vec3) -> f32 {
        continuation_by_albedo(self.reflectance)
    }

    fn albedo(&self, _: Vec3) -> Spectrum {
        self.reflectance
    }
}
