//! Light sub-paths: they leave vertices, photon beams, and splats of light tracing.

use upbp_accel::{Ray, Segment, offset_origin};
use upbp_media::{Lanes, Medium, MediumStack};

use crate::counters::Counters;
use crate::mis::{BeamExtent, Densities, Edge, EdgeMis, EdgeStart};
use crate::observer::{LightEnd, ObservedVertex, Observer};
use crate::path::{
    Arrival, Arrived, Context, EdgeSource, EdgeTrace, LightChunk, LightEdge, LightVertex, MIN_COSINE,
    MediumSpan, PhotonBeam, Scratch, WalkState, arrive, depart, ray_origin,
};
use crate::prepared_scene::PreparedScene;
use crate::random::{Stream, StreamKind};
use crate::scene::{Emitter, EmitterKind, PathEnd, Scene, Walk};
use crate::technique::Technique;
use crate::techniques::light_tracing;

/// A light sub-path that starts.
struct Emitted<D: Densities, L: Lanes> {
    ray: Ray,
    /// The bodies around the ray's origin.
    stack: MediumStack,
    edge: LightEdge<D, L>,
    state: WalkState<L>,
}

/// Traces light sub-path `index`.
pub fn trace_light_path<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    kind: StreamKind,
    index: u32,
    scratch: &mut Scratch<S::Bsdf, L>,
    out: &mut LightChunk<S::Bsdf, O::Densities, L>,
    observer: &mut O,
) {
    let Context { prepared, plan } = *context;
    let stream = plan.stream(kind, u64::from(index));
    let Some(emitted) = emit(context, index, stream, &mut out.counters, observer) else { return };
    let Emitted { mut ray, mut stack, mut edge, mut state } = emitted;
    let scene = prepared.scene;
    // Paths 0..N_B leave beams: all paths are alike, so the first ones are as good as any.
    let leaves_beams = index < plan.beam_paths && plan.stores_beams();
    let long_beams = leaves_beams && plan.mis.photon_beams == BeamExtent::Long;

    // The shortest completion adds one edge, by light tracing or a merge on the camera's first edge.
    for depth in 1..plan.lengths.max {
        out.counters.light_edges += 1;
        let edge_trace = &mut scratch.edge_trace;
        let extent = context.extent(long_beams, &state, &stack);
        edge_trace.trace(scene, &ray, &stack, extent, &mut state);
        out.counters.boundary_conflicts += edge_trace.take_conflicts();
        if leaves_beams {
            store_beams(context, edge_trace, &edge, index, out);
        }

        let arrival = match arrive(scene, edge_trace) {
            Arrival::Vertex(arrival) => arrival,
            Arrival::Escaped | Arrival::Absorbed => return,
            Arrival::Lost => {
                out.counters.lost_walks += 1;
                return;
            }
        };
        let Arrived { position, distance, density, interaction, sides } = arrival;
        let in_medium = interaction.in_medium();
        let t = density.forward(in_medium).mean(&edge.mis.shares);
        let throughput = edge.throughput * density.transmittance / t as f32;
        if !(t > 0.0) || throughput.is_black() || out.counters.overflows(throughput) {
            return;
        }
        let from = -ray.direction;
        let connectible = interaction.is_connectible();
        let mis_edge = Edge::new(
            &density,
            if edge.from_infinity { f64::INFINITY } else { f64::from(distance) },
            interaction.cosine(from),
            edge.mis.start,
            in_medium,
        );
        let connections = if connectible {
            edge.source.connections(context, ray.direction, position)
        } else {
            O::Densities::ZERO
        };
        let mis = edge.mis.arrive(&plan.mis, Walk::Light, &mis_edge, connections);
        let scale = plan.radius_scale(position, in_medium);
        let vertex = LightVertex {
            position,
            towards_light: from,
            throughput,
            mis,
            scale,
            depth,
            path: index,
            interaction,
        };
        if connectible {
            if plan.mis.light_tracing > 0.0
                && plan.lengths.contains(depth + 1)
                && !context.hides_from_both(&sides, PathEnd::Lens)
            {
                let (stream, crossings) = (&mut state.stream, &mut scratch.crossings);
                light_tracing(context, &vertex, &sides, stream, crossings, out, observer);
                observer.call(Technique::LightTracing, 0);
            }
            if plan.stores_vertices() {
                out.vertices.push(vertex);
                out.counters.light_vertices += 1;
            }
        }

        let Some(scattered) = interaction.scatter(scene, position, from, &mis.shares, &mut state) else {
            return;
        };
        observer.light_vertex(
            index,
            &ObservedVertex {
                depth,
                position,
                interaction,
                delta: scattered.delta,
                albedo: scattered.albedo,
            },
        );
        ray = Ray::new(ray_origin(&interaction, position, scattered.direction), scattered.direction);
        stack.clone_from(sides.towards(scattered.transmitted));
        edge = LightEdge {
            throughput: throughput * scattered.weight,
            mis: depart(context, &mis, &interaction, scale, &scattered),
            source: EdgeSource::Vertex,
            from_infinity: false,
            depth: depth + 1,
        };
    }
}

fn emit<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    index: u32,
    mut stream: Stream,
    counters: &mut Counters,
    observer: &mut O,
) -> Option<Emitted<O::Densities, L>> {
    let prepared = context.prepared;
    let (emitter, probability) = prepared.choose_emission(stream.uniform())?;
    let light = &prepared.scene.emitters()[emitter.0 as usize];
    let emission = prepared.sample_emission(emitter, [stream.pair(), stream.pair()])?;
    if !(emission.point.position.is_finite() && emission.direction.is_finite()) {
        counters.lost_walks += 1;
        return None;
    }
    let kind = light.kind();
    // With another probability a walk from infinity does not arrive. Those that do have not stopped on the
    // way.
    let mut state = WalkState::<L>::new(context, Walk::Light, stream);
    let is_infinite = kind.is_infinite();
    let passes = if is_infinite { prepared.passes_from_infinity::<L>().of_hero(state.hero) } else { 1.0 };
    if passes < 1.0 && f64::from(state.stream.uniform()) >= passes {
        return None;
    }
    let cos = match kind {
        EmitterKind::Area => emission.point.normal.dot(emission.direction),
        _ => 1.0,
    };
    let pdf_position = emission.pdf_position * probability;
    let density = pdf_position * emission.pdf_direction;
    let throughput = emission.radiance * (cos / density);
    if !(cos >= MIN_COSINE && density > 0.0) || throughput.is_black() || counters.overflows(throughput) {
        return None;
    }
    let origin = match kind {
        EmitterKind::Area => {
            offset_origin(emission.point.position, emission.point.normal, emission.direction)
        }
        // Ahead of a point, which may stand on a boundary.
        EmitterKind::Point => offset_origin(emission.point.position, emission.direction, emission.direction),
        _ => emission.point.position,
    };
    let stack = if is_infinite {
        MediumStack::new(prepared.scene.outside())
    } else {
        prepared.scene.stack_at(origin)
    };
    let hit = match kind {
        EmitterKind::Volume(body) => {
            // The point may be beside the body, or in another one that counts more.
            if stack.top().is_none_or(|top| top.body != body) {
                return None;
            }
            f64::from(light.pdf_passage(&emission.point))
        }
        _ => f64::from(u8::from(kind.is_hittable())),
    };
    observer.light_end(index, &LightEnd { emitter, point: emission.point, direction: emission.direction });
    let ray = Ray::new(origin, emission.direction);
    let ray = if is_infinite { near_scene(prepared.scene, &ray)? } else { ray };
    let edge = LightEdge {
        throughput,
        mis: EdgeMis::at_light(
            &context.plan.mis,
            if matches!(kind, EmitterKind::Volume(_)) { EdgeStart::Volume } else { EdgeStart::Surface },
            hit,
            f64::from(cos),
            f64::from(pdf_position),
            f64::from(emission.pdf_direction),
        ),
        source: EdgeSource::Emitter { emitter, point: emission.point, pdf_position: emission.pdf_position },
        from_infinity: is_infinite,
        depth: 1,
    };
    Some(Emitted { ray, stack, edge, state })
}

/// The ray from infinity whose origin is just before what it meets first; `None` if it meets nothing.
/// Distances from there have the digits of what is near, not those of a start as far away as the scene is
/// wide: both faces of a pane of glass would be at one, and places in media beside their bodies.
fn near_scene<S: Scene>(scene: &S, ray: &Ray) -> Option<Ray> {
    let first = scene.intersect(ray)?.t;
    let margin = 16.0 * f32::EPSILON * (first + ray.origin.abs().max_element());
    let along = f64::from((first - margin).max(0.0));
    let origin = (ray.origin.as_dvec3() + along * ray.direction.as_dvec3()).as_vec3();
    Some(Ray { origin, t_min: f32::NEG_INFINITY, ..*ray })
}

fn store_beams<S: Scene, D: Densities, L: Lanes>(
    context: &Context<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    edge: &LightEdge<D, L>,
    path: u32,
    out: &mut LightChunk<S::Bsdf, D, L>,
) {
    let Context { prepared, plan } = *context;
    for (span, end) in edge_trace.beam_spans(plan.mis.photon_beams) {
        let Some(medium) = span.medium else { continue };
        let merges = plan.mis.merges_in(medium);
        if !(merges.bb1d.is_on() || merges.bp2d.is_on()) {
            continue;
        }
        let Some(end) = beam_end(prepared, edge_trace, span, end) else { continue };
        out.counters.photon_beams += 1;
        out.beams.push(PhotonBeam {
            segment: Segment {
                origin: edge_trace.ray.origin,
                direction: edge_trace.ray.direction,
                start: span.start,
                end,
            },
            medium,
            before: span.before,
            mis: edge.mis,
            source: edge.source,
            throughput: edge.throughput,
            from_infinity: edge.from_infinity,
            depth: edge.depth,
            path,
        });
    }
}

/// Lengths that are tried for a beam without an end, each twice the one before.
const DOUBLINGS: usize = 64;
/// Part of the light at its start that may get farther than such a beam, in any channel: what single
/// precision does not tell.
const NEGLIGIBLE: f32 = 1e-7;

/// The end of a beam in the medium of `span` that runs to distance `end` there.
///
/// Where there is none, the beam ends where what is left in every channel is [negligible](NEGLIGIBLE), or is
/// not attenuated any further. So weights may take it to be without an end. A beam from infinity has none
/// left before the scene.
fn beam_end<S: Scene, L: Lanes>(
    prepared: &PreparedScene<'_, S>,
    edge_trace: &EdgeTrace<S::Bsdf, L>,
    span: &MediumSpan<L>,
    end: f32,
) -> Option<f32> {
    if end.is_finite() || !span.start.is_finite() {
        return (end > span.start && span.start.is_finite()).then_some(end);
    }
    let medium = span.medium_in(prepared.scene)?;
    let transmittance = |end| medium.segment(&edge_trace.segment(span, end)).transmittance;
    let left = transmittance(f32::INFINITY);
    let ends = std::iter::successors(Some(prepared.bounds.radius), |length| Some(2.0 * length))
        .map(|length| (span.start + length).min(f32::MAX));
    let is_enough = |end: &f32| {
        let there = transmittance(*end);
        (0..3).all(|c| there[c] <= left[c] + NEGLIGIBLE)
    };
    Some(ends.take(DOUBLINGS).find(is_enough).unwrap_or(f32::MAX))
}
