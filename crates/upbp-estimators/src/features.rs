//! Auxiliary features of a pixel, for denoisers and compositing: what the camera sees first.
//!
//! The first vertex with a smooth lobe counts, on a surface or in a medium: behind perfect mirrors and
//! through smooth glass, while rough glass and rough metal are such vertices themselves.
//! Intel's Open Image Denoise takes albedos in `[0, 1]`, and normals of any length in `[-1, 1]`.

use glam::Vec3;
use upbp_media::{Medium, Spectrum};

use crate::path::Interaction;
use crate::scene::{Bsdf, Scene};

/// Albedo, normal and distance of what one camera sub-path sees first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Share of light that is scattered, as it is tinted by perfect mirrors and smooth glass on the way, with
    /// light that is emitted there or by the environment; in `[0, 1]`.
    pub albedo: Spectrum,
    /// Shading normal in world space, on the side that is seen; zero in a medium and where nothing is.
    pub normal: Vec3,
    /// Length of the way from the lens, in scene units; `None` where nothing is.
    pub distance: Option<f32>,
}

impl Features {
    /// Features of a sub-path that sees nothing.
    pub const NONE: Self = Self { albedo: Spectrum::ZERO, normal: Vec3::ZERO, distance: None };

    /// Features of a vertex to which a sub-path comes from `from`, after `distance`.
    pub(crate) fn at<S: Scene>(
        scene: &S,
        interaction: &Interaction<S::Bsdf>,
        position: Vec3,
        from: Vec3,
        throughput: Spectrum,
        distance: f32,
    ) -> Self {
        let (tint, albedo, normal) = match interaction {
            Interaction::Surface(surface) => {
                let albedo = surface.bsdf.albedo(surface.local(from));
                (throughput, albedo, surface.shading_normal * surface.shading_normal.dot(from).signum())
            }
            Interaction::Medium(medium) => {
                let medium = &scene.media()[medium.0 as usize];
                let sigma_t = medium.sigma_t(position);
                // Throughput is per length there: transmittance over the density of stops.
                (throughput * sigma_t, medium.sigma_s(position) / sigma_t, Vec3::ZERO)
            }
        };
        Self { albedo: bounded(tint) * bounded(albedo), normal, distance: Some(distance) }
    }

    /// With the light that is seen before anything scatters.
    pub(crate) fn with_light(self, seen: Spectrum) -> Self {
        Self { albedo: bounded(self.albedo + seen), ..self }
    }
}

/// In `[0, 1]`, and zero for what is not a number.
fn bounded(spectrum: Spectrum) -> Spectrum {
    spectrum.map(|value| if value > 0.0 { value.min(1.0) } else { 0.0 })
}
