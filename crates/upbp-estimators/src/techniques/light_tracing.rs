//! Light tracing: a light vertex and the lens (`docs/theory.md`, section 2.8).

use upbp_media::Lanes;

use crate::observer::{Completion, ObservedSample, Observer};
use crate::path::{Context, LightChunk, LightVertex, MediumInterface, Splat, Target, clear_edge, ray_origin};
use crate::random::Stream;
use crate::scene::{Camera, Crossing, PathEnd, Scene, Walk};
use crate::technique::Technique;

/// Connects a light vertex to the camera; `sides` are the bodies around it.
pub(crate) fn light_tracing<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    vertex: &LightVertex<S::Bsdf, O::Densities, L>,
    sides: &MediumInterface<'_>,
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut LightChunk<S::Bsdf, O::Densities, L>,
    observer: &mut O,
) {
    let Context { prepared, plan } = *context;
    let scene = prepared.scene;
    let camera = scene.camera();
    let Some(view) = camera.connect(vertex.position, stream.pair()) else { return };
    let crop = camera.crop();
    let pixel = |place: f32, start: u32, size: u32| {
        // A conversion of what is below zero, or no number, would be zero.
        let pixel = (place >= 0.0).then_some(place as u32)?;
        (start..start + size).contains(&pixel).then_some(pixel)
    };
    let (Some(column), Some(row)) =
        (pixel(view.film.x, crop.x, crop.width), pixel(view.film.y, crop.y, crop.height))
    else {
        return;
    };
    let between = view.lens - vertex.position;
    let distance = between.length();
    let direction = between / distance;
    let stack = sides.towards(vertex.interaction.crosses(vertex.towards_light, direction));
    if context.hides(stack, PathEnd::Lens) {
        return;
    }
    let Some(scattering) = vertex.evaluate(context, direction) else {
        return;
    };
    out.counters.shadow_rays += 1;
    let origin = ray_origin(&vertex.interaction, vertex.position, direction);
    let target = Target::Pinpoint(view.lens);
    let Some(density) = clear_edge::<_, L>(scene, stack, origin, &target, crossings) else { return };
    let in_medium = vertex.interaction.in_medium();
    let distance2 = f64::from(distance) * f64::from(distance);
    let ray_pdf = f64::from(view.pdf) * scattering.cos / distance2;
    let mis = &plan.mis;
    let (passes, stops) = (density.pass_probability, density.backward(in_medium));
    let camera_walk = mis.other_walk(Walk::Camera, in_medium, passes, stops, &L::prior(&mis.lanes));
    let interaction = plan.merge_kind(&vertex.interaction, scattering.sin_theta, vertex.scale);
    let end = vertex.mis.end(mis, Walk::Light, interaction, &camera_walk, scattering.rho_opposite, ray_pdf);
    let weight = mis.light_tracing_weight(end);
    let value = vertex.throughput
        * scattering.value
        * density.transmittance
        * (ray_pdf / f64::from(plan.light_paths)) as f32;
    if let Some(value_weighted) = out.counters.accept(Technique::LightTracing, value, weight.value()) {
        out.splats.push(Splat { pixel: [column, row], value: value_weighted });
        observer.sample(&ObservedSample {
            technique: Technique::LightTracing,
            camera_depth: 0,
            completion: Completion::LightTracing {
                path: vertex.path,
                light: (vertex.position, vertex.interaction, vertex.depth),
                lens: view.lens,
                pdf: view.pdf,
            },
            weight,
            value,
        });
    }
}
