//! A matt surface with a glossy lobe around the mirror direction.
//!
//! The normalised and reciprocal form: `f = k_d/π + k_s (n+2)/(2π) cosⁿ α`, α the angle to the mirror
//! direction. Source: Lafortune and Willems, "Using the Modified Phong Reflectance Model for Physically Based
//! Rendering", Report CW 197, KU Leuven, 1994.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;
use upbp_estimators::scene::{Bsdf, BsdfSample, Interface, Walk};
use upbp_media::Spectrum;

use super::local::{continuation_by_albedo, cosine_pdf, mirrored, sample_cosine};
use crate::sampling::to_world;

/// The modified Phong model. Both sides reflect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// Albedo of the matt part.
    pub diffuse: Spectrum,
    /// Albedo of the lobe at normal incidence; at most `1 − diffuse` in every channel.
    pub specular: Spectrum,
    /// Exponent `n` of the lobe, from 0 to about 1e8.
    pub exponent: f32,
}

impl Phong {
    /// Probability of the matt part: its share of the albedo.
    fn diffuse_share(&self) -> f32 {
        let (diffuse, specular) = (self.diffuse.max_component(), self.specular.max_component());
        if diffuse + specular > 0.0 { diffuse / (diffuse + specular) } else { 0.0 }
    }

    fn is_black(&self) -> bool {
        self.diffuse.is_black() && self.specular.is_black()
    }

    /// `cosⁿ α` between `to` and the mirror direction of `from`; zero on the far side, for n = 0 as well.
    fn lobe(&self, from: Vec3, to: Vec3) -> f32 {
        // The difference tells small angles, whose cosines are rounded to 1.
        let one_minus_cos = 0.5 * (mirrored(from) - to).length_squared();
        if one_minus_cos < 1.0 { (self.exponent * f32::ln_1p(-one_minus_cos)).exp() } else { 0.0 }
    }
}

impl Bsdf for Phong {
    fn eval(&self, towards_light: Vec3, towards_camera: Vec3, _: Interface) -> Spectrum {
        if towards_light.z * towards_camera.z <= 0.0 {
            return Spectrum::ZERO;
        }
        let lobe = (self.exponent + 2.0) / TAU * self.lobe(towards_light, towards_camera);
        self.diffuse * FRAC_1_PI + self.specular * lobe
    }

    fn pdf(&self, from: Vec3, to: Vec3, _: Interface) -> f32 {
        if from.z * to.z <= 0.0 || self.is_black() {
            return 0.0;
        }
        let diffuse_share = self.diffuse_share();
        let lobe = (self.exponent + 1.0) / TAU * self.lobe(from, to);
        diffuse_share * cosine_pdf(from, to) + (1.0 - diffuse_share) * lobe
    }

    fn sample(
        &self,
        from: Vec3,
        _: Walk,
        interface: Interface,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        if self.is_black() || from.z == 0.0 {
            return None;
        }
        let to = if u_lobe < self.diffuse_share() {
            sample_cosine(from, u)
        } else {
            // Density (n+1)/(2π) cosⁿ α: cos α = (1−u)^(1/(n+1)). `exp_m1` keeps the sine of a narrow lobe.
            let one_minus_cos = -f32::exp_m1(f32::ln_1p(-u[0]) / (self.exponent + 1.0));
            let sin_alpha = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
            let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
            let local = Vec3::new(sin_alpha * cos_phi, sin_alpha * sin_phi, 1.0 - one_minus_cos);
            to_world(mirrored(from), local)
        };
        let pdf = self.pdf(from, to, interface);
        // A lobe that dips below the surface loses that part.
        if pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        Some(BsdfSample {
            to,
            weight: self.eval(to, from, interface) * (to.z.abs() / pdf),
            pdf,
            pdf_reverse: self.pdf(to, from, interface),
            delta: false,
        })
    }

    fn is_connectible(&self) -> bool {
        !self.is_black()
    }

    fn continuation(&self, _: Vec3) -> f32 {
        continuation_by_albedo(self.diffuse + self.specular)
    }

    fn albedo(&self, _: Vec3) -> Spectrum {
        self.diffuse + self.specular
    }
}
