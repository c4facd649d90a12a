//! Connections of a camera vertex to light vertices drawn from all.
//!
//! Drawing `M` of the `N_V` stored vertices instead of walking along one light sub-path keeps the cost of a
//! camera vertex constant, however long light sub-paths are (`docs/theory.md`, section 6.9).

use upbp_media::Lanes;

use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::observer::{Completion, ObservedSample, Observer};
use crate::path::{
    CameraVertex, Context, Interaction, LightVertex, MediumInterface, Target, clear_edge, ray_origin,
};
use crate::random::Stream;
use crate::scene::{Crossing, Scene, Walk};
use crate::technique::Technique;

/// Connects `vertex` to as many light vertices as the plan says.
pub(crate) fn connections<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    sides: &MediumInterface<'_>,
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    if plan.connections == 0.0 || map.vertices.is_empty() {
        return;
    }
    let factor = map.vertices.len() as f64 / (f64::from(plan.connections) * f64::from(plan.light_paths));
    for _ in 0..stream.round(plan.connections) {
        let light = &map.vertices[stream.index(map.vertices.len())];
        if plan.lengths.contains(vertex.depth + light.depth + 1) {
            connect(context, vertex, sides, light, factor, crossings, out);
            out.observer.call(Technique::Connect, 0);
        }
    }
}

fn connect<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    sides: &MediumInterface<'_>,
    light: &LightVertex<S::Bsdf, O::Densities, L>,
    factor: f64,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    let (scene, mis) = (prepared.scene, &plan.mis);
    let between = light.position - vertex.position;
    let distance = between.length();
    let direction = between / distance;
    if !direction.is_finite() {
        return;
    }
    let Some(camera_side) = vertex.evaluate(context, direction) else {
        return;
    };
    let Some(light_side) = light.evaluate(context, -direction) else {
        return;
    };
    // Each end by itself: in media both throughputs hold 1/σ, and their product alone may leave the range of
    // single precision where the whole does not.
    let ends = (vertex.throughput * camera_side.value) * (light.throughput * light_side.value);
    if ends.is_black() {
        return;
    }
    out.counters.shadow_rays += 1;
    let crosses = vertex.interaction.crosses(vertex.towards_camera, direction);
    let stack = sides.towards(crosses);
    let origin = ray_origin(&vertex.interaction, vertex.position, direction);
    let target = match &light.interaction {
        Interaction::Surface(surface) => Target::Surface(light.position, surface.geometric_normal),
        Interaction::Medium(_) => Target::Medium(light.position),
    };
    let Some(density) = clear_edge::<_, L>(scene, stack, origin, &target, crossings) else { return };

    let (near, far) = (vertex.interaction.in_medium(), light.interaction.in_medium());
    let distance2 = f64::from(distance).powi(2);
    let passes = density.pass_probability;
    // Each walk, had it gone on instead of this connection.
    let (light_rho, light_shares) = light_side.rho_own.step(&light.mis.shares);
    let (camera_rho, camera_shares) = camera_side.rho_own.step(&vertex.mis.shares);
    let light_walk = mis.other_walk(Walk::Light, near, passes, density.backward(near), &light_shares);
    let camera_walk = mis.other_walk(Walk::Camera, far, passes, density.forward(far), &camera_shares);
    let camera_end = vertex.mis.end(
        mis,
        Walk::Camera,
        plan.merge_kind(&vertex.interaction, camera_side.sin_theta, vertex.scale),
        &light_walk,
        camera_side.rho_opposite,
        light_rho * camera_side.cos / distance2,
    );
    let light_end = light.mis.end(
        mis,
        Walk::Light,
        plan.merge_kind(&light.interaction, light_side.sin_theta, light.scale),
        &camera_walk,
        light_side.rho_opposite,
        camera_rho * light_side.cos / distance2,
    );
    let weight = mis.connect_weight(light_end, camera_end);
    let geometry = camera_side.cos * light_side.cos / distance2;
    let value = ends * density.transmittance * (geometry * factor) as f32;
    out.record(&ObservedSample {
        technique: Technique::Connect,
        camera_depth: vertex.depth,
        completion: Completion::Connect {
            path: light.path,
            light: (light.position, light.interaction, light.depth),
            camera: (vertex.position, vertex.interaction),
        },
        weight,
        value,
    });
}
