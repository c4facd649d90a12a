//! Next event estimation: a camera vertex and a point chosen on a light (`docs/theory.md`, section 2.8).

use glam::Vec3;
use upbp_media::{BodyId, Lanes, MediumStack};

use crate::camera_output::Output;
use crate::observer::{Completion, LightEnd, ObservedSample, Observer};
use crate::path::{
    CameraVertex, Context, MIN_COSINE, MediumInterface, Target, clear_edge, cross_all, ray_origin,
};
use crate::random::Stream;
use crate::scene::{
    BoundingSphere, Crossing, Emitter, EmitterId, EmitterKind, Incident, PathEnd, Scene, Walk,
};
use crate::technique::Technique;

/// Connects `vertex` to as many points on lights as the plan says.
pub(crate) fn next_events<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    sides: &MediumInterface<'_>,
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    if plan.next_events == 0.0
        || !plan.lengths.contains(vertex.depth + 1)
        || context.hides_from_both(sides, PathEnd::Lights)
    {
        return;
    }
    for _ in 0..stream.round(plan.next_events) {
        let chosen = context.prepared.choose_next_event(vertex.position, stream.decide());
        let Some((emitter, probability)) = chosen else { return };
        if !context.hides_from_both(sides, PathEnd::Light(emitter)) {
            next_event(context, vertex, sides, (emitter, probability), stream, crossings, out);
            out.observer.call(Technique::Nee, 0);
        }
    }
}

fn next_event<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    sides: &MediumInterface<'_>,
    (emitter, probability): (EmitterId, f32),
    stream: &mut Stream,
    crossings: &mut Vec<Crossing>,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    let (scene, mis) = (prepared.scene, &plan.mis);
    let light = &scene.emitters()[emitter.0 as usize];
    let Some(Chosen { incident, cos_light }) =
        choose_point(light, prepared.emission_bounds(), vertex.position, stream)
    else {
        return;
    };
    let (kind, direction) = (light.kind(), incident.towards_light);
    let stack = sides.towards(vertex.interaction.crosses(vertex.towards_camera, direction));
    if context.hides(stack, PathEnd::Light(emitter)) {
        return;
    }
    let Some(scattering) = vertex.evaluate(context, direction) else {
        return;
    };
    out.counters.shadow_rays += 1;
    let origin = ray_origin(&vertex.interaction, vertex.position, direction);
    let target = match kind {
        EmitterKind::Area => Target::Surface(incident.point.position, incident.point.normal),
        EmitterKind::Point => Target::Pinpoint(incident.point.position),
        EmitterKind::Volume(_) => Target::Medium(incident.point.position),
        EmitterKind::Directional | EmitterKind::Environment => Target::Infinity(direction),
    };
    let Some(density) = clear_edge::<_, L>(scene, stack, origin, &target, crossings) else { return };
    if let EmitterKind::Volume(body) = kind
        && !is_in_body(stack.clone(), crossings, body)
    {
        return;
    }

    let in_medium = vertex.interaction.in_medium();
    let distance2 = if kind.is_infinite() { 1.0 } else { f64::from(incident.distance).powi(2) };
    let pdf = f64::from(probability) * f64::from(incident.pdf);
    let pdf_position = f64::from(prepared.emission_probability(emitter)) * f64::from(incident.pdf_position);
    let geometry = f64::from(cos_light) * scattering.cos / distance2;

    let (rho, shares) = scattering.rho_own.step(&vertex.mis.shares);
    let arrives = match kind {
        EmitterKind::Volume(_) => f64::from(light.pdf_passage(&incident.point)),
        _ if kind.is_hittable() => density.pass_probability.mean(&shares),
        _ => 0.0,
    };
    let hit_density = rho * f64::from(cos_light) / distance2 * arrives;
    let factor = prepared.emission_factor(emitter, &incident.point, -direction, vertex.position);
    let light_density = f64::from(incident.pdf_direction * factor) * scattering.cos / distance2;
    let (passes, stops) = (density.pass_probability, density.backward(in_medium));
    let light_walk = mis.other_walk(Walk::Light, in_medium, passes, stops, &L::prior(&mis.lanes));
    let end = vertex.mis.end(
        mis,
        Walk::Camera,
        plan.merge_kind(&vertex.interaction, scattering.sin_theta, vertex.scale),
        &light_walk,
        scattering.rho_opposite,
        pdf_position / pdf * light_density,
    );
    let weight = mis.nee_weight(pdf, hit_density, end);
    let value = vertex.throughput
        * scattering.value
        * density.transmittance
        * incident.radiance
        * (geometry / (pdf * f64::from(plan.next_events))) as f32;
    out.record(&ObservedSample {
        technique: Technique::Nee,
        camera_depth: vertex.depth,
        completion: Completion::Nee {
            light: LightEnd { emitter, point: incident.point, direction: -direction },
            camera: (vertex.position, vertex.interaction),
        },
        weight,
        value,
    });
}

/// A point on a light, as a receiver sees it.
struct Chosen {
    incident: Incident,
    /// Cosine at the light, 1 where it is no surface.
    cos_light: f32,
}

/// Chooses a point on a light, unless it sends nothing to the receiver.
fn choose_point<E: Emitter>(
    light: &E,
    bounds: &BoundingSphere,
    receiver: Vec3,
    stream: &mut Stream,
) -> Option<Chosen> {
    let incident = light.sample_incident(bounds, receiver, stream.pair())?;
    let cos_light = match light.kind() {
        EmitterKind::Area => -incident.point.normal.dot(incident.towards_light),
        _ => 1.0,
    };
    let shines = cos_light >= MIN_COSINE && incident.pdf > 0.0 && !incident.radiance.is_black();
    shines.then_some(Chosen { incident, cos_light })
}

/// Whether `body` counts at the end of an edge that starts in the bodies of `stack`.
fn is_in_body(mut stack: MediumStack, crossings: &[Crossing], body: BodyId) -> bool {
    cross_all(&mut stack, crossings);
    stack.top().is_some_and(|top| top.body == body)
}
