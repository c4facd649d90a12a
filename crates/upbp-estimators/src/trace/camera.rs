//! Camera sub-paths: one per pixel sample, with every technique that ends on them.

use glam::Vec2;
use upbp_accel::Ray;
use upbp_media::{Lanes, Spectrum};

use crate::counters::Counters;
use crate::features::Features;
use crate::film_sample::{CameraWalk, Output};
use crate::light_map::LightMap;
use crate::mis::{BeamExtent, Densities, Edge, EdgeMis};
use crate::observer::{LightEnd, ObservedVertex, Observer};
use crate::path::{
    Arrival, Arrived, CameraEdge, CameraVertex, Context, Interaction, Scratch, WalkState, arrive, depart,
    ray_origin,
};
use crate::random::{Stream, StreamKind};
use crate::scene::{Camera, EmitterPoint, Hit, Scene, Walk};
use crate::technique::{Layer, Technique};
use crate::techniques;

/// Traces the camera sub-path of one sample of a pixel. `index` addresses its random numbers.
#[expect(clippy::too_many_arguments, reason = "one call per sample, with the state of the pass")]
pub fn trace_camera_path<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    kind: StreamKind,
    pixel: [u32; 2],
    index: u64,
    scratch: &mut Scratch<S::Bsdf, L>,
    counters: &mut Counters,
    observer: &mut O,
) -> CameraWalk {
    let mut walk =
        CameraWalk { layers: [Spectrum::ZERO; Layer::COUNT], seen: Spectrum::ZERO, features: Features::NONE };
    let mut scattered_before = false;
    let Context { prepared, plan } = *context;
    let scene = prepared.scene;
    let mut stream = Stream::new(plan.seed, plan.iteration, kind, index);
    let [dx, dy] = stream.pair();
    let film = Vec2::new(pixel[0] as f32 + dx, pixel[1] as f32 + dy);
    let Some(camera_ray) = scene.camera().ray(film, stream.pair()) else { return walk };
    let mut ray = Ray::new(camera_ray.origin, camera_ray.direction);
    if !(ray.origin.is_finite() && ray.direction.is_finite()) {
        counters.lost_walks += 1;
        return walk;
    }
    observer.camera_end(film, &camera_ray);
    let mut out = Output { film, layers: &mut walk.layers, counters, observer };
    let emission = plan.mis.hit > 0.0 && prepared.has_emitting_media();
    let own = plan.techniques_at(pixel);
    let [pb2d, bb1d] = [Technique::Pb2d, Technique::Bb1d].map(|one| own.has(one) && plan.merges_by(one));
    let query_beams = pb2d || bb1d;
    let is_long = query_beams && plan.mis.query_beams == BeamExtent::Long;
    let needs_all = is_long || emission;
    let mut stack = prepared.stack_at_camera(ray.origin);
    let mut edge = CameraEdge {
        throughput: Spectrum::ONE,
        mis: EdgeMis::at_camera(&plan.mis, f64::from(camera_ray.pdf)),
        connections: O::Densities::of(Technique::LightTracing, plan.mis.pow(plan.mis.light_tracing)),
        depth: 1,
    };

    let mut travelled = 0.0;
    let mut state = WalkState::new(context, Walk::Camera, stream);
    for depth in 1..=plan.lengths.max {
        out.counters.camera_edges += 1;
        let extent = context.extent(needs_all, &state, &stack);
        scratch.edge_trace.trace(scene, &ray, &stack, extent, &mut state);
        out.counters.boundary_conflicts += scratch.edge_trace.take_conflicts();
        if depth == 1 {
            let crossings = &mut scratch.crossings;
            techniques::next_events_at_lens::<_, L, O>(context, &mut state.stream, crossings, &mut out);
        }
        let edge_trace = &scratch.edge_trace;
        if emission {
            techniques::emission_along(context, edge_trace, &edge, &mut state.stream, &mut out);
        }
        if pb2d {
            techniques::pb2d(context, map, edge_trace, &edge, &mut out);
        }
        if bb1d {
            techniques::bb1d(context, map, edge_trace, &edge, &mut out);
        }

        let arrived = match arrive(scene, edge_trace) {
            Arrival::Vertex(arrived) => arrived,
            Arrival::Escaped => {
                techniques::environment(context, edge_trace, &edge, &mut out);
                if !scattered_before {
                    walk.features = Features::NONE;
                }
                break;
            }
            Arrival::Absorbed => break,
            Arrival::Lost => {
                out.counters.lost_walks += 1;
                break;
            }
        };
        let in_medium = arrived.interaction.in_medium();
        let t = arrived.density.forward(in_medium).mean(&edge.mis.shares);
        let throughput = edge.throughput * arrived.density.transmittance / t as f32;
        if !(t > 0.0) || throughput.is_black() || !throughput.is_finite() {
            break;
        }
        let from = -ray.direction;
        let mis_edge = Edge::new(
            &arrived.density,
            f64::from(arrived.distance),
            arrived.interaction.cosine(from),
            edge.mis.start,
            in_medium,
        );
        if !in_medium
            && let Some(Hit { emitter: Some(emitter), position, geometric_normal, .. }) = edge_trace.hit
        {
            let point = EmitterPoint { position, normal: geometric_normal };
            let end = LightEnd { emitter, point, direction: from };
            techniques::shine(context, &end, ray.origin, &mis_edge, throughput, &edge, &mut out);
        }
        if plan.features && !scattered_before {
            let Arrived { interaction, position, distance, .. } = &arrived;
            travelled += distance;
            let features = Features::at(scene, interaction, *position, from, throughput, travelled);
            // Not a mirror: roulette may end the walk there. What is black is seen.
            if interaction.is_connectible() || features.albedo.is_black() {
                walk.features = features;
            }
        }
        if depth == plan.lengths.max {
            out.counters.cut_walks += u64::from(arrived.interaction.is_connectible());
            break;
        }
        let (connectible, sides) = (arrived.interaction.is_connectible(), arrived.sides);
        let mis = edge.mis.arrive(
            &plan.mis,
            Walk::Camera,
            &mis_edge,
            if connectible { edge.connections } else { O::Densities::ZERO },
        );
        let vertex = CameraVertex {
            position: arrived.position,
            towards_camera: from,
            throughput,
            mis,
            scale: plan.radius_scale(arrived.position, in_medium),
            depth,
            interaction: arrived.interaction,
        };
        if connectible {
            if !scattered_before {
                walk.seen = out.layers[Layer::Bpt as usize];
                scattered_before = true;
            }
            let (stream, crossings) = (&mut state.stream, &mut scratch.crossings);
            techniques::next_events(context, &vertex, &sides, stream, crossings, &mut out);
            techniques::connections(context, map, &vertex, &sides, stream, crossings, &mut out);
            match &vertex.interaction {
                Interaction::Surface(surface) if own.has(Technique::Surf) => {
                    techniques::surf(context, map, &vertex, surface, &mut out);
                }
                Interaction::Surface(_) => {}
                Interaction::Medium(medium) => {
                    if own.has(Technique::Pp3d) {
                        techniques::pp3d(context, map, &vertex, *medium, &mut out);
                    }
                    if own.has(Technique::Bp2d) {
                        techniques::bp2d(context, map, &vertex, *medium, &mut out);
                    }
                }
            }
        }

        let shares = &vertex.mis.shares;
        let Some(scattered) = vertex.interaction.scatter(scene, vertex.position, from, shares, &mut state)
        else {
            break;
        };
        out.observer.camera_vertex(&ObservedVertex {
            depth,
            position: vertex.position,
            interaction: vertex.interaction,
            delta: scattered.delta,
            albedo: scattered.albedo,
        });
        let origin = ray_origin(&vertex.interaction, vertex.position, scattered.direction);
        ray = Ray::new(origin, scattered.direction);
        stack.clone_from(sides.towards(scattered.transmitted));
        edge = CameraEdge {
            throughput: throughput * scattered.weight,
            mis: depart(context, &vertex.mis, &vertex.interaction, vertex.scale, &scattered),
            connections: plan.mis.connections(),
            depth: depth + 1,
        };
    }
    if !scattered_before {
        walk.seen = walk.layers[Layer::Bpt as usize];
    }
    if plan.features {
        walk.features = walk.features.with_light(walk.seen);
    }
    walk
}
