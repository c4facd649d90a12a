//! Light that a camera sub-path meets: emitters, environments, emitting media.

use upbp_media::{Lanes, Medium, Spectrum};

use crate::camera_output::Output;
use crate::mis::{Densities, Edge, Weight};
use crate::observer::{Completion, LightEnd, ObservedSample, Observer};
use crate::path::{CameraEdge, Context, EdgeTrace, MediumSpan};
use crate::random::Stream;
use crate::scene::{Bsdf, Emitter, EmitterPoint, Hit, HitDensities, Scene, Walk};
use crate::technique::Technique;

/// Emission of media along the whole ray to the next surface.
///
/// Where light sub-paths start in the volume the weight changes along the ray, and one point of each stretch
/// stands for all of it; elsewhere there is no other technique, and the integral is in closed form
/// (`docs/theory.md`, section 2.9).
pub(crate) fn emission_along<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &CameraEdge<O::Densities, L>,
    stream: &mut Stream,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    if plan.mis.hit == 0.0 || !plan.lengths.contains(edge.depth) {
        return;
    }
    let may_have_others = prepared.has_volume_emitters() && edge.depth > 1 && !edge.mis.is_alone();
    for span in &edge_trace.spans {
        let Some(medium) = span.medium_in(prepared.scene) else { continue };
        if !medium.emits() {
            continue;
        }
        let segment = edge_trace.segment(span, span.end);
        let is_emitter = |body| prepared.volume_emitter(body).is_some();
        if may_have_others && edge_trace.any_body_in(span, is_emitter) {
            if let Some(t) = medium.sample_emitted(&segment, stream.uniform()) {
                emission_at(context, edge_trace, span, medium, t, edge, out);
            }
        } else {
            let value = edge.throughput * span.before.transmittance * medium.emitted(&segment);
            record_hit(edge, Completion::Emission, Weight::alone(Technique::Hit), value, out);
        }
    }
}

/// Emission of a span's medium at the sampled distance `t`, for all of the span.
fn emission_at<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    span: &MediumSpan<L>,
    medium: &S::Medium,
    t: f32,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    let prepared = context.prepared;
    let pdf = medium.pdf_emitted(&edge_trace.segment(span, span.end), t);
    let density = edge_trace.density_to(prepared.scene, span, t);
    let direction = -edge_trace.ray.direction;
    let position = edge_trace.ray.at(t);
    let value = edge.throughput * density.transmittance * (medium.source(position) / pdf as f32);
    let point = EmitterPoint { position, normal: direction };
    let light = edge_trace.stack_in(span, t).top().and_then(|top| prepared.volume_emitter(top.body));
    let seen = light.and_then(|emitter| {
        let light = &prepared.scene.emitters()[emitter.0 as usize];
        Some((
            emitter,
            light.pdf_passage(&point),
            light.hit(prepared.emission_bounds(), &point, direction, edge.receiver)?,
        ))
    });
    let Some((emitter, passage, densities)) = seen else {
        record_hit(edge, Completion::Emission, Weight::alone(Technique::Hit), value, out);
        return;
    };
    let mis_edge = Edge {
        distance_squared: f64::from(t) * f64::from(t),
        cos_in: 1.0,
        forward: L::splat(f64::from(passage)),
        backward: edge.mis.start.backward(&density),
        pass_probability: density.pass_probability,
        ends_in_medium: false,
    };
    let end = LightEnd { emitter, point, direction };
    let weight = weight_of_hit(context, &end, &densities, &mis_edge, edge);
    record_hit(edge, Completion::Hit(end), weight, value, out);
}

fn record_hit<B: Bsdf, L: Lanes, O: Observer<B> + ?Sized>(
    edge: &CameraEdge<O::Densities, L>,
    completion: Completion<B>,
    weight: Weight<O::Densities>,
    value: Spectrum,
    out: &mut Output<'_, O>,
) {
    out.record(&ObservedSample {
        technique: Technique::Hit,
        camera_depth: edge.depth,
        completion,
        weight,
        value,
    });
}

/// The weight of a camera sub-path that ends on a light by `mis_edge`.
fn weight_of_hit<S: Scene, D: Densities, L: Lanes>(
    context: &Context<'_, S>,
    end: &LightEnd,
    densities: &HitDensities,
    mis_edge: &Edge<L>,
    edge: &CameraEdge<D, L>,
) -> Weight<D> {
    let Context { prepared, plan } = *context;
    let mis = &plan.mis;
    let (LightEnd { emitter, point, direction }, receiver) = (*end, edge.receiver);
    // On arrival at a light the vertex before is connected by next event estimation.
    let vertex_mis = edge.mis.arrive(mis, Walk::Camera, mis_edge, D::of(Technique::Nee, mis.pow(mis.nee)));
    mis.hit_weight(
        &vertex_mis,
        f64::from(prepared.next_event_probability(receiver, emitter)) * f64::from(densities.pdf_incident),
        f64::from(prepared.emission_probability(emitter)) * f64::from(densities.pdf_position),
        f64::from(densities.pdf_direction * prepared.emission_factor(emitter, &point, direction, receiver)),
    )
}

/// The camera sub-path has left the scene.
pub(crate) fn environment<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    let prepared = context.prepared;
    if prepared.environments().is_empty() {
        return;
    }
    let density = edge_trace.density(prepared.scene);
    let throughput =
        edge.throughput * density.transmittance / density.pass_probability.mean(&edge.mis.shares) as f32;
    if throughput.is_black() || out.counters.overflows(throughput) {
        return;
    }
    let mis_edge = Edge::new(&density, f64::INFINITY, 1.0, edge.mis.start, false);
    let direction = edge_trace.ray.direction;
    let away = prepared.bounds.centre + direction * (2.0 * prepared.bounds.radius);
    let point = EmitterPoint { position: away, normal: -direction };
    for &emitter in prepared.environments() {
        let end = LightEnd { emitter, point, direction: -direction };
        shine(context, &end, &mis_edge, throughput, edge, out);
    }
}

/// The camera sub-path has come to a surface, which may be that of an emitter.
pub(crate) fn hit<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    mis_edge: &Edge<L>,
    throughput: Spectrum,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    // A walk that stops in a medium may know of the surface behind it.
    if edge_trace.stop.is_none()
        && let Some(Hit { emitter: Some(emitter), position, geometric_normal, .. }) = edge_trace.hit
    {
        let point = EmitterPoint { position, normal: geometric_normal };
        let end = LightEnd { emitter, point, direction: -edge_trace.ray.direction };
        shine(context, &end, mis_edge, throughput, edge, out);
    }
}

/// An emitter's light at the `end` of a camera sub-path, which gets there by `mis_edge`.
fn shine<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    end: &LightEnd,
    mis_edge: &Edge<L>,
    throughput: Spectrum,
    edge: &CameraEdge<O::Densities, L>,
    out: &mut Output<'_, O>,
) {
    let Context { prepared, plan } = *context;
    if plan.mis.hit == 0.0 || !plan.lengths.contains(edge.depth) {
        return;
    }
    let LightEnd { emitter, point, direction } = *end;
    let Some(light) = prepared.scene.emitters().get(emitter.0 as usize) else { return };
    let densities = light.hit(prepared.emission_bounds(), &point, direction, edge.receiver);
    let Some(densities) = densities else { return };
    let weight = if edge.depth == 1 {
        let pdf_ray = edge.mis.rho * mis_edge.cos_in / mis_edge.distance_squared;
        let passes = mis_edge.pass_probability.mean(&edge.mis.shares);
        match prepared.connect_through_lens(emitter, &point, out.film) {
            Some((_, pdf)) => plan.mis.direct_hit_weight(pdf, pdf_ray * passes),
            None => Weight::alone(Technique::Hit),
        }
    } else {
        weight_of_hit(context, end, &densities, mis_edge, edge)
    };
    record_hit(edge, Completion::Hit(*end), weight, throughput * densities.radiance, out);
}
