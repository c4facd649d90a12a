//! Camera sub-paths: one per pixel sample, with every technique that ends on them.

use glam::Vec2;
use upbp_accel::Ray;
use upbp_media::{Lanes, Spectrum};

use super::first_seen::FirstSeen;
use crate::camera_output::{CameraWalk, Output};
use crate::counters::Counters;
use crate::light_map::LightMap;
use crate::mis::{BeamExtent, Densities, Edge, EdgeMis};
use crate::observer::{ObservedVertex, Observer};
use crate::path::{
    Arrival, CameraEdge, CameraVertex, Context, Scratch, WalkState, arrive, depart, ray_origin,
};
use crate::random::Stream;
use crate::scene::{Camera, Scene, Walk};
use crate::technique::{Layer, Technique};
use crate::techniques;

/// Traces the camera sub-path of one sample of a pixel, with random numbers from `stream`.
pub fn trace_camera_path<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    mut stream: Stream,
    pixel: [u32; 2],
    scratch: &mut Scratch<S::Bsdf, L>,
    counters: &mut Counters,
    observer: &mut O,
) -> CameraWalk {
    let Context { prepared, plan } = *context;
    let scene = prepared.scene;
    let mut layers = [Spectrum::ZERO; Layer::COUNT];
    let mut first_seen = FirstSeen::new(plan.features);
    let [dx, dy] = stream.pair();
    let film = Vec2::new(pixel[0] as f32 + dx, pixel[1] as f32 + dy);
    let Some(camera_ray) = scene.camera().ray(film, stream.pair()) else { return first_seen.finish(layers) };
    let mut ray = Ray::new(camera_ray.origin, camera_ray.direction);
    if !(ray.origin.is_finite() && ray.direction.is_finite()) {
        counters.lost_walks += 1;
        return first_seen.finish(layers);
    }
    observer.camera_end(film, &camera_ray);
    let mut out = Output { film, layers: &mut layers, counters, observer };

    let own = plan.techniques_at(pixel);
    let emission = plan.mis.hit > 0.0 && prepared.has_emitting_media();
    let queries_beams = |technique| own.has(technique) && plan.merges_by(technique);
    let query_beams = queries_beams(Technique::Pb2d) || queries_beams(Technique::Bb1d);
    let needs_all = emission || query_beams && plan.mis.query_beams == BeamExtent::Long;

    let mut stack = prepared.stack_at_camera(ray.origin);
    let mut edge = CameraEdge {
        receiver: ray.origin,
        throughput: Spectrum::ONE,
        mis: EdgeMis::at_camera(&plan.mis, f64::from(camera_ray.pdf)),
        connections: O::Densities::of(Technique::LightTracing, plan.mis.pow(plan.mis.light_tracing)),
        depth: 1,
    };
    let mut state = WalkState::new(context, Walk::Camera, stream);
    let Scratch { edge_trace, crossings } = scratch;
    for depth in 1..=plan.lengths.max {
        out.counters.camera_edges += 1;
        let extent = context.extent(needs_all, &state, &stack);
        edge_trace.trace(scene, &ray, &stack, extent, &mut state);
        out.counters.boundary_conflicts += edge_trace.take_conflicts();
        if depth == 1 {
            techniques::next_events_at_lens::<_, L, O>(context, &mut state.stream, crossings, &mut out);
        }
        if emission {
            techniques::emission_along(context, edge_trace, &edge, &mut state.stream, &mut out);
        }
        techniques::merge_along_edge(context, map, own, edge_trace, &edge, &mut out);

        let arrived = match arrive(scene, edge_trace) {
            Arrival::Vertex(arrived) => arrived,
            Arrival::Escaped => {
                techniques::environment(context, edge_trace, &edge, &mut out);
                first_seen.escape();
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
        if !(t > 0.0) || throughput.is_black() || out.counters.overflows(throughput) {
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
        techniques::hit(context, edge_trace, &mis_edge, throughput, &edge, &mut out);
        first_seen.arrive(scene, &arrived, from, throughput, out.layers[Layer::Bpt as usize]);
        let is_connectible = arrived.interaction.is_connectible();
        if depth == plan.lengths.max {
            out.counters.cut_walks += u64::from(is_connectible);
            break;
        }

        let connections = if is_connectible { edge.connections } else { O::Densities::ZERO };
        let vertex = CameraVertex {
            position: arrived.position,
            towards_camera: from,
            throughput,
            mis: edge.mis.arrive(&plan.mis, Walk::Camera, &mis_edge, connections),
            scale: plan.radius_scale(arrived.position, in_medium),
            depth,
            interaction: arrived.interaction,
        };
        let sides = arrived.sides;
        if is_connectible {
            techniques::next_events(context, &vertex, &sides, &mut state.stream, crossings, &mut out);
            techniques::connections(context, map, &vertex, &sides, &mut state.stream, crossings, &mut out);
            techniques::merge_at_vertex(context, map, own, &vertex, &mut out);
        }

        let CameraVertex { position, interaction, mis, scale, .. } = vertex;
        let Some(scattered) = interaction.scatter(scene, position, from, &mis.shares, &mut state) else {
            break;
        };
        let (delta, albedo) = (scattered.delta, scattered.albedo);
        out.observer.camera_vertex(&ObservedVertex { depth, position, interaction, delta, albedo });
        ray = Ray::new(ray_origin(&interaction, position, scattered.direction), scattered.direction);
        stack.clone_from(sides.towards(scattered.transmitted));
        edge = CameraEdge {
            receiver: position,
            throughput: throughput * scattered.weight,
            mis: depart(context, &mis, &interaction, scale, &scattered),
            connections: plan.mis.connections(),
            depth: depth + 1,
        };
    }
    first_seen.finish(layers)
}
