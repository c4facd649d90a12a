//! Light that a camera sub-path meets: emitters, environments, emitting media.

use glam::Vec3;
use upbp_media::{Medium, Spectrum};

use crate::film_sample::Output;
use crate::mis::{Densities, Edge, Weight};
use crate::observer::{Completion, LightEnd, ObservedSample, Observer};
use crate::path::Context;
use crate::path::{CameraEdge, EdgeTrace};
use crate::scene::{Emitter, EmitterId, EmitterPoint, Hit, Scene, Walk};
use crate::technique::Technique;

/// Emission of media along the whole ray to the next surface, integrated in closed form.
///
/// No other technique starts a path in a medium, so the weight is one.
pub(crate) fn emission_along<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf>,
    edge: &CameraEdge<O::Densities>,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    if plan.mis.hit == 0.0 || !plan.lengths.contain(edge.depth) {
        return;
    }
    for span in &edge_trace.spans {
        let Some(medium) = span.medium else { continue };
        let medium = &prepared.scene.media()[medium.0 as usize];
        if medium.emits() {
            let emitted = medium.emitted(&edge_trace.segment(span, span.end));
            let value = edge.throughput * span.before.transmittance * emitted;
            let weight = Weight::<O::Densities>::alone(Technique::Hit);
            out.record(&ObservedSample {
                technique: Technique::Hit,
                camera_depth: edge.depth,
                completion: Completion::Emission,
                weight,
                value,
            });
        }
    }
}

/// The camera sub-path has hit a surface that may shine.
#[expect(clippy::too_many_arguments, reason = "the state of one hit, used here only")]
pub(crate) fn emitter_hit<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    hit: &Hit<S::Bsdf>,
    direction: Vec3,
    receiver: Vec3,
    mis_edge: &Edge,
    throughput: Spectrum,
    edge: &CameraEdge<O::Densities>,
    out: &mut Output<'_, O>,
) {
    if let Some(emitter) = hit.emitter {
        let point = EmitterPoint { position: hit.position, normal: hit.geometric_normal };
        shine(context, emitter, &point, -direction, receiver, mis_edge, throughput, edge, out);
    }
}

/// The camera sub-path has left the scene.
pub(crate) fn environment<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf>,
    edge: &CameraEdge<O::Densities>,
    out: &mut Output<'_, O>,
) {
    let prepared = context.prepared;
    if prepared.environments().is_empty() {
        return;
    }
    let density = edge_trace.density(prepared.scene);
    let throughput = edge.throughput * density.transmittance / density.pass_probability as f32;
    if throughput.is_black() || !throughput.is_finite() {
        return;
    }
    let mis_edge = Edge::new(&density, f64::INFINITY, 1.0, edge.mis.in_medium, false);
    let away = prepared.bounds.centre + edge_trace.direction * (2.0 * prepared.bounds.radius);
    let point = EmitterPoint { position: away, normal: -edge_trace.direction };
    for &emitter in prepared.environments() {
        shine(
            context,
            emitter,
            &point,
            -edge_trace.direction,
            edge_trace.origin,
            &mis_edge,
            throughput,
            edge,
            out,
        );
    }
}

/// An emitter's light at the end of a camera sub-path.
#[expect(clippy::too_many_arguments, reason = "the state of one hit, used here only")]
fn shine<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    emitter: EmitterId,
    point: &EmitterPoint,
    direction: Vec3,
    receiver: Vec3,
    mis_edge: &Edge,
    throughput: Spectrum,
    edge: &CameraEdge<O::Densities>,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    let mis = &plan.mis;
    if mis.hit == 0.0 || !plan.lengths.contain(edge.depth) {
        return;
    }
    let Some(light) = prepared.scene.emitters().get(emitter.0 as usize) else { return };
    let Some(densities) = light.hit(prepared.emission_bounds(), point, direction, receiver) else { return };
    let weight = if edge.depth == 1 {
        // Nothing else makes a path of one edge.
        Weight::alone(Technique::Hit)
    } else {
        // On arrival at a light the vertex before is connected by next event estimation.
        let vertex_mis =
            edge.mis.arrive(mis, Walk::Camera, mis_edge, O::Densities::of(Technique::Nee, mis.pow(mis.nee)));
        mis.hit_weight(
            &vertex_mis,
            f64::from(prepared.next_event_probability(receiver, emitter)) * f64::from(densities.pdf_incident),
            f64::from(prepared.emission_probability(emitter)) * f64::from(densities.pdf_position),
            f64::from(
                densities.pdf_direction * prepared.emission_factor(emitter, point, direction, receiver),
            ),
        )
    };
    let value = throughput * densities.radiance;
    out.record(&ObservedSample {
        technique: Technique::Hit,
        camera_depth: edge.depth,
        completion: Completion::Hit(LightEnd { emitter, point: *point, direction }),
        weight,
        value,
    });
}
