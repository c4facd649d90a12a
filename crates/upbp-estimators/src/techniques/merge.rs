//! Merges of a light vertex and a camera vertex within a kernel: weight and value, the same for all five.
//!
//! On a beam the vertex lies somewhere along it, not at the distance that a walk sampled: density and weight
//! are those of the point where the beams come closest (`docs/theory.md`, sections 2.2 to 2.6 and 4.4).

use upbp_media::Lanes;

use crate::camera_output::Output;
use crate::mis::{Densities, DistanceDensity, Weight};
use crate::observer::{Completion, ObservedSample, Observer};
use crate::path::{CameraVertex, Context, Interaction, LightVertex};
use crate::scene::Scene;
use crate::technique::Technique;

/// Merges two vertices; `kernel` is the kernel's value between them, for beams per sine of the angle.
pub(super) fn merge<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    technique: Technique,
    light: &LightVertex<S::Bsdf, O::Densities, L>,
    camera: &CameraVertex<S::Bsdf, O::Densities, L>,
    kernel: f32,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    let mis = &plan.mis;
    let Some(scattering) = camera.evaluate(context, light.towards_light) else {
        return;
    };
    // The merge takes place at the camera vertex: its radii are those of all techniques there.
    let scale = f64::from(camera.scale);
    let per_photon = kernel * plan.per_photon(technique);
    // Not the product of two throughputs, which may exceed single precision where the whole does not.
    let mut value = (camera.throughput * scattering.value) * (light.throughput * per_photon);
    let (factor, merges) = match camera.interaction {
        Interaction::Surface(_) => {
            // The value is corrected by the cosine of the camera vertex's facet, but photons are as dense as
            // that of their own facet says, which may be another one of a mesh.
            value *= (scattering.cos / light.interaction.cosine(light.towards_light)) as f32;
            let factor = mis.surface_factor(scale);
            (factor, O::Densities::of(technique, factor))
        }
        Interaction::Medium(medium) => {
            let [own, other] =
                [light.mis.distance_factor, camera.mis.distance_factor].map(DistanceDensity::at_stop);
            let factors = mis.volume_factors(medium, own, other, scattering.sin_theta, scale);
            (factors.get(technique).copied().unwrap_or_default(), factors.sum())
        }
    };
    let before_light = light.mis.before(mis, scattering.rho_own, &camera.mis.shares);
    let before_camera = camera.mis.before(mis, scattering.rho_opposite, &light.mis.shares);
    out.record(&ObservedSample {
        technique,
        camera_depth: camera.depth,
        completion: Completion::Merge {
            path: light.path,
            light: (light.position, light.depth),
            camera: (camera.position, camera.interaction),
        },
        weight: Weight::of_merge(factor, merges, before_light, before_camera),
        value,
    });
}
