//! Light sub-paths: they leave vertices, photon beams, and splats of light tracing.

use glam::Vec3;
use upbp_accel::{Segment, offset_origin};
use upbp_media::{EdgeDensity, Medium, MediumId, MediumStack, Spectrum};

use super::context::{Context, Scratch};
use super::passage::{Passage, Span};
use super::site::Site;
use super::visibility::{Target, clear_edge, ray_origin};
use crate::counters::Counters;
use crate::mis::{BeamExtent, Edge, End, Pending, Tip};
use crate::observer::{Joint, LightEnd, ObservedSample, ObservedVertex, Observer};
use crate::random::{Stream, StreamKind};
use crate::scene::{Camera, Emitter, EmitterId, EmitterKind, EmitterPoint, Scene, Walk};
use crate::technique::Technique;
use crate::world::World;

/// A vertex of a light sub-path where camera sub-paths can be connected or merged.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex<B> {
    /// Where it is.
    pub position: Vec3,
    /// Direction to the vertex before, towards the light.
    pub towards_light: Vec3,
    /// Flux over density on arrival, before scattering (`docs/theory.md`, section 1.5).
    pub throughput: Spectrum,
    /// What the weights need.
    pub tip: Tip,
    /// Edges from the light.
    pub depth: u32,
    /// Index of the sub-path.
    pub path: u32,
    /// How it scatters.
    pub site: Site<B>,
}

/// What connects the first vertex of an edge with a vertex somewhere on it, for the weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeSource {
    /// The edge starts at an emitter: next event estimation makes the same edge.
    Emitter {
        /// The emitter.
        emitter: EmitterId,
        /// The point on it.
        point: EmitterPoint,
        /// `L_0` without the choice of the emitter.
        pdf_position: f32,
    },
    /// The edge starts at a vertex that scatters.
    Vertex,
}

impl EdgeSource {
    /// The number of samples that connect the edge's start to `position` (section 4.2).
    pub(crate) fn connections<S: Scene>(
        &self,
        context: &Context<'_, S>,
        direction: Vec3,
        position: Vec3,
    ) -> f64 {
        let mis = &context.plan.mis;
        match self {
            Self::Vertex => mis.connect,
            Self::Emitter { emitter, point, pdf_position } => {
                let world = context.world;
                let pdf = world.scene.emitters()[emitter.0 as usize].pdf_incident(
                    &world.bounds,
                    point,
                    direction,
                    position,
                    *pdf_position,
                );
                mis.nee * f64::from(pdf) / f64::from(*pdf_position)
            }
        }
    }
}

/// The light that a sub-path carries through one medium along one edge.
#[derive(Clone, Copy, Debug)]
pub struct PhotonBeam {
    /// Where it runs; distances from the edge's first vertex.
    pub segment: Segment,
    /// The medium.
    pub medium: MediumId,
    /// What the edge has accumulated up to the segment's start.
    pub before: EdgeDensity,
    /// What the weights need of the edge's first vertex.
    pub pending: Pending,
    /// Where the edge starts.
    pub source: EdgeSource,
    /// Flux over density at the edge's first vertex, after scattering.
    pub throughput: Spectrum,
    /// Whether the edge starts at an infinite emitter: distances from there do not count in densities.
    pub from_infinity: bool,
    /// Edges from the light to a vertex on the beam.
    pub depth: u32,
    /// Index of the sub-path.
    pub path: u32,
}

/// A contribution of light tracing to some pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Column and row on the film.
    pub pixel: [u32; 2],
    /// Radiance, weighted.
    pub value: Spectrum,
}

/// What a number of light sub-paths leave.
#[derive(Clone, Debug)]
pub struct LightChunk<B> {
    /// Vertices, in the order of the paths.
    pub vertices: Vec<LightVertex<B>>,
    /// Photon beams, in the order of the paths.
    pub beams: Vec<PhotonBeam>,
    /// Splats, in the order of the paths.
    pub splats: Vec<Splat>,
    /// What was done.
    pub counters: Counters,
}

impl<B> Default for LightChunk<B> {
    fn default() -> Self {
        Self { vertices: Vec::new(), beams: Vec::new(), splats: Vec::new(), counters: Counters::default() }
    }
}

/// The walk's state between two vertices.
struct Flight {
    origin: Vec3,
    direction: Vec3,
    stack: MediumStack,
    pending: Pending,
    source: EdgeSource,
    throughput: Spectrum,
    infinite: bool,
}

/// Traces light sub-path `index`.
pub fn trace_light_path<S: Scene, O: Observer<S::Bsdf>>(
    context: &Context<'_, S>,
    kind: StreamKind,
    index: u32,
    scratch: &mut Scratch<S::Bsdf>,
    out: &mut LightChunk<S::Bsdf>,
    observer: &mut O,
) {
    let Context { world, plan } = *context;
    let mut stream = Stream::new(plan.seed, plan.iteration, kind, u64::from(index));
    let Some(mut flight) = emit(world, context, index, &mut stream, observer) else { return };
    let scene = world.scene;
    // Paths 0..N_B leave beams: all paths are alike, so the first ones are as good as any.
    let leaves_beams = index < plan.beam_paths && plan.stores_beams();

    // The shortest completion adds one edge, by light tracing or a merge on the camera's first edge.
    for depth in 1..plan.lengths.max {
        out.counters.light_edges += 1;
        let passage = &mut scratch.passage;
        passage.trace(scene, flight.origin, flight.direction, &flight.stack);
        out.counters.boundary_conflicts += passage.take_conflicts();
        let stop = sample_stop(scene, passage, &mut stream);
        if leaves_beams {
            store_beams(context, passage, stop, &flight, depth, index, out);
        }

        let arrival = match arrive(scene, passage, stop) {
            Arrival::Vertex(arrival) => arrival,
            Arrival::Escaped | Arrival::Absorbed => return,
            Arrival::Lost => {
                out.counters.lost_walks += 1;
                return;
            }
        };
        let Arrived { position, distance, density, site, stack, behind } = arrival;
        let in_medium = site.in_medium();
        let t = density.forward(in_medium);
        let throughput = flight.throughput * density.transmittance / t as f32;
        if !(t > 0.0) || throughput.is_black() || !throughput.is_finite() {
            return;
        }
        let from = -flight.direction;
        let connectible = site.is_connectible();
        let edge = Edge::new(
            &density,
            if flight.infinite { f64::INFINITY } else { f64::from(distance) },
            site.cosine(from),
            flight.pending.in_medium,
            in_medium,
        );
        let connections =
            if connectible { flight.source.connections(context, flight.direction, position) } else { 0.0 };
        let tip = flight.pending.arrive(&plan.mis, Walk::Light, &edge, connections);
        let vertex = LightVertex { position, towards_light: from, throughput, tip, depth, path: index, site };
        if connectible {
            if plan.mis.light_tracing > 0.0 && plan.lengths.contain(depth + 1) {
                splat(context, &vertex, &stack, &behind, &mut stream, &mut scratch.crossings, out, observer);
            }
            if plan.stores_vertices() {
                out.vertices.push(vertex);
                out.counters.light_vertices += 1;
            }
        }

        let Some(scattered) = site.scatter(scene, plan.roulette, Walk::Light, position, from, &mut stream)
        else {
            return;
        };
        observer.light_vertex(index, &ObservedVertex { depth, position, site, delta: scattered.delta });
        flight = Flight {
            origin: ray_origin(&site, position, scattered.direction),
            direction: scattered.direction,
            stack: if scattered.transmitted { behind } else { stack },
            pending: pend(context, &tip, &site, &scattered),
            source: EdgeSource::Vertex,
            throughput: throughput * scattered.weight,
            infinite: false,
        };
    }
}

/// What the weights of the next vertex need of one that has scattered.
pub(super) fn pend<S: Scene>(
    context: &Context<'_, S>,
    tip: &Tip,
    site: &Site<S::Bsdf>,
    scattered: &super::Scattered,
) -> Pending {
    let smooth = if scattered.delta { Tip { connect: 0.0, ..*tip } } else { *tip };
    Pending {
        before: smooth.before(&context.plan.mis, scattered.rho_opposite),
        rho: scattered.rho_own,
        cos_out: scattered.cos,
        site: if scattered.delta {
            crate::mis::MergeSite::None
        } else {
            site.merge_site(scattered.sin_theta)
        },
        c: tip.c,
        connectible: !scattered.delta,
        in_medium: site.in_medium(),
    }
}

fn emit<S: Scene, O: Observer<S::Bsdf>>(
    world: &World<'_, S>,
    context: &Context<'_, S>,
    index: u32,
    stream: &mut Stream,
    observer: &mut O,
) -> Option<Flight> {
    let (emitter, probability) = world.choose_emitter(stream.uniform())?;
    let light = &world.scene.emitters()[emitter.0 as usize];
    let emission = light.sample_emission(&world.bounds, stream.pair(), stream.pair())?;
    let kind = light.kind();
    let cos = match kind {
        EmitterKind::Area => emission.point.normal.dot(emission.direction),
        EmitterKind::Point | EmitterKind::Directional | EmitterKind::Environment => 1.0,
    };
    let pdf_position = emission.pdf_position * probability;
    let density = pdf_position * emission.pdf_direction;
    let throughput = emission.radiance * (cos / density);
    if !(cos >= super::MIN_COSINE && density > 0.0) || throughput.is_black() || !throughput.is_finite() {
        return None;
    }
    observer.light_end(index, &LightEnd { emitter, point: emission.point, direction: emission.direction });
    let origin = match kind {
        EmitterKind::Area => {
            offset_origin(emission.point.position, emission.point.normal, emission.direction)
        }
        _ => emission.point.position,
    };
    let stack = if kind.is_infinite() {
        MediumStack::new(world.scene.outside())
    } else {
        world.scene.stack_at(origin)
    };
    Some(Flight {
        origin,
        direction: emission.direction,
        stack,
        pending: Pending::at_light(
            &context.plan.mis,
            kind.is_hittable(),
            f64::from(cos),
            f64::from(pdf_position),
            f64::from(emission.pdf_direction),
        ),
        source: EdgeSource::Emitter { emitter, point: emission.point, pdf_position: emission.pdf_position },
        throughput,
        infinite: kind.is_infinite(),
    })
}

/// Where a walk stops in a medium: the index of the span and the distance.
pub(super) fn sample_stop<S: Scene>(
    scene: &S,
    passage: &Passage<S::Bsdf>,
    stream: &mut Stream,
) -> Option<(usize, f32)> {
    for (i, span) in passage.spans.iter().enumerate() {
        let Some(medium) = span.medium else { continue };
        let medium = &scene.media()[medium.0 as usize];
        if !medium.scatters() {
            continue;
        }
        let [u_channel, u_distance] = stream.pair();
        if let Some(t) = medium.sample_distance(&passage.segment(span, span.end), u_channel, u_distance) {
            return Some((i, t));
        }
    }
    None
}

/// The end of an edge.
pub(super) struct Arrived<B> {
    pub(super) position: Vec3,
    pub(super) distance: f32,
    pub(super) density: EdgeDensity,
    pub(super) site: Site<B>,
    /// The bodies on the side that the walk comes from.
    pub(super) stack: MediumStack,
    /// The bodies on the other side of a surface.
    pub(super) behind: MediumStack,
}

#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack for a moment, and is nearly always the large one"
)]
pub(super) enum Arrival<B> {
    /// At a vertex.
    Vertex(Arrived<B>),
    /// To infinity.
    Escaped,
    /// Grazing a surface.
    Absorbed,
    /// To infinity, but still inside a body: the geometry is not closed.
    Lost,
}

pub(super) fn arrive<S: Scene>(
    scene: &S,
    passage: &Passage<S::Bsdf>,
    stop: Option<(usize, f32)>,
) -> Arrival<S::Bsdf> {
    if let Some((i, t)) = stop {
        let span = &passage.spans[i];
        let Some(medium) = span.medium else { return Arrival::Lost };
        let stack = passage.stack_in(span, t);
        let position = passage.origin + t * passage.direction;
        if !position.is_finite() {
            return Arrival::Lost;
        }
        return Arrival::Vertex(Arrived {
            position,
            distance: t,
            density: passage.density_to(scene, span, t),
            site: Site::Medium(medium),
            stack,
            behind: stack,
        });
    }
    let stack = *passage.stack_at_end();
    let Some(hit) = &passage.hit else {
        return if stack.is_empty() { Arrival::Escaped } else { Arrival::Lost };
    };
    let Some(bsdf) = hit.bsdf else { return Arrival::Lost };
    match Site::at_hit(hit, bsdf, passage.direction, &stack) {
        Some((site, behind)) => Arrival::Vertex(Arrived {
            position: hit.position,
            distance: hit.t,
            density: passage.density(scene),
            site,
            stack,
            behind,
        }),
        None => Arrival::Absorbed,
    }
}

fn store_beams<S: Scene>(
    context: &Context<'_, S>,
    passage: &Passage<S::Bsdf>,
    stop: Option<(usize, f32)>,
    flight: &Flight,
    depth: u32,
    path: u32,
    out: &mut LightChunk<S::Bsdf>,
) {
    let Context { world, plan } = *context;
    let short = plan.mis.photon_beams == BeamExtent::Short;
    for (i, span) in passage.spans.iter().enumerate() {
        if let Some(end) = beam_end(world, passage, span, if short { stop } else { None }, i)
            && let Some(medium) = span.medium
        {
            let merges = plan.mis.merges_in(medium);
            if merges.bb1d > 0.0 || merges.bp2d > 0.0 {
                out.counters.photon_beams += 1;
                out.beams.push(PhotonBeam {
                    segment: Segment {
                        origin: passage.origin,
                        direction: passage.direction,
                        start: span.start,
                        end,
                    },
                    medium,
                    before: span.before,
                    pending: flight.pending,
                    source: flight.source,
                    throughput: flight.throughput,
                    from_infinity: flight.infinite,
                    depth,
                    path,
                });
            }
        }
        if short && stop.is_some_and(|(last, _)| last == i) {
            break;
        }
    }
}

/// The end of a beam in `span`. A long beam in an infinite medium ends where nothing but the medium is left.
fn beam_end<S: Scene>(
    world: &World<'_, S>,
    passage: &Passage<S::Bsdf>,
    span: &Span,
    stop: Option<(usize, f32)>,
    index: usize,
) -> Option<f32> {
    let end = match stop {
        Some((last, t)) if last == index => t,
        _ => span.end,
    };
    if end.is_finite() {
        return (end > span.start).then_some(end);
    }
    let reach = (passage.origin - world.bounds.centre).length() + 4.0 * world.bounds.radius;
    Some(span.start + reach)
}

#[expect(clippy::too_many_arguments, reason = "the state of one vertex, used here only")]
fn splat<S: Scene, O: Observer<S::Bsdf>>(
    context: &Context<'_, S>,
    vertex: &LightVertex<S::Bsdf>,
    stack: &MediumStack,
    behind: &MediumStack,
    stream: &mut Stream,
    crossings: &mut Vec<crate::scene::Crossing>,
    out: &mut LightChunk<S::Bsdf>,
    observer: &mut O,
) {
    let Context { world, plan } = *context;
    let scene = world.scene;
    let camera = scene.camera();
    let Some(view) = camera.connect(vertex.position, stream.pair()) else { return };
    let pixel = [view.film.x.floor() as u32, view.film.y.floor() as u32];
    let crop = camera.crop();
    let inside = |p: u32, start: u32, size: u32| p >= start && p - start < size;
    if !inside(pixel[0], crop.x, crop.width) || !inside(pixel[1], crop.y, crop.height) {
        return;
    }
    let between = view.lens - vertex.position;
    let distance = between.length();
    let direction = between / distance;
    let Some(scattering) = vertex.site.evaluate(
        scene,
        plan.roulette,
        Walk::Light,
        vertex.position,
        vertex.towards_light,
        direction,
    ) else {
        return;
    };
    if scattering.value.is_black() {
        return;
    }
    out.counters.shadow_rays += 1;
    let crosses = vertex.site.crosses(vertex.towards_light, direction);
    let origin = ray_origin(&vertex.site, vertex.position, direction);
    let target = Target { direction, distance, surface: None };
    let Some(density) = clear_edge(scene, if crosses { behind } else { stack }, origin, &target, crossings)
    else {
        return;
    };
    let in_medium = vertex.site.in_medium();
    let distance2 = f64::from(distance) * f64::from(distance);
    // C_{k-1}: the density of this vertex as the camera would sample it.
    let ray_pdf = f64::from(view.pdf) * scattering.cos / distance2;
    let light_density = ray_pdf * density.backward(in_medium);
    let c_camera = if in_medium {
        plan.mis.distance_factor(Walk::Camera, density.reach, density.backward(true))
    } else {
        0.0
    };
    let end = End {
        merges: plan.mis.merge_sum(
            vertex.site.merge_site(scattering.sin_theta),
            Walk::Light,
            vertex.tip.c,
            c_camera,
        ),
        before: vertex.tip.before(&plan.mis, scattering.rho_opposite),
    };
    let weight = plan.mis.light_tracing_weight(end, light_density);
    let value = vertex.throughput
        * scattering.value
        * density.transmittance
        * (ray_pdf / f64::from(plan.light_paths)) as f32;
    if let Some(value_weighted) = out.counters.accept(Technique::LightTracing, value, weight) {
        out.splats.push(Splat { pixel, value: value_weighted });
        observer.sample(&ObservedSample {
            technique: Technique::LightTracing,
            camera_depth: 0,
            joint: Joint::LightTracing {
                path: vertex.path,
                light: (vertex.position, vertex.site, vertex.depth),
                lens: view.lens,
                pdf: view.pdf,
            },
            weight,
            value,
        });
    }
}
