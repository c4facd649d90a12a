//! A perfectly smooth metal.

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::local::{continuation_by_albedo, mirrored};

/// Mirror reflection on both sides, the same at all angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Share of the light that is reflected, per channel in `[0, 1]`.
    pub reflectance: Spectrum,
}

impl Bsdf for Mirror {
    fn eval(&self, _: Vec3, _: Vec3, _: Interface) -> Spectrum {
        Spectrum::ZERO
    }

    fn pdf(&self, _: Vec3, _: Vec3, _: Interface) -> f32 {
        0.0
    }

    fn sample(&self, from: Vec3, _: Walk, _: Interface, _: f32, _: [f32; 2]) -> Option<BsdfSample> {
        if self.reflectance.is_black() || from.z == 0.0 {
            return None;
        }
        Some(BsdfSample {
            to: mirrored(from),
            weight: self.reflectance,
            pdf: 1.0,
            pdf_reverse: 1.0,
            delta: true,
        })
    }

    fn is_connectible(&self) -> bool {
        false
    }

    fn albedo(&self, _: Vec3) -> Spectrum {
        self.reflectance
    }

    fn continuation(&self, _: Vec3) -> f32 {
        continuation_by_albedo(self.reflectance)
    }
}
