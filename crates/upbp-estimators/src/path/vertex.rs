//! Vertices and edges of sub-paths: those that light sub-paths leave, and those where camera sub-paths meet
//! them.

use glam::Vec3;
use upbp_accel::Segment;
use upbp_media::{EdgeDensity, Lanes, MediumId, RaySegment, Spectrum};

use super::context::Context;
use super::edge::{EdgeTrace, MediumSpan};
use super::interaction::{Evaluation, Interaction};
use crate::counters::Counters;
use crate::mis::{BeamExtent, Densities, Edge, EdgeMis, VertexMis};
use crate::scene::{Bsdf, Emitter, EmitterId, EmitterPoint, Scene, Walk};
use crate::technique::Technique;

/// A vertex of a light sub-path where camera sub-paths can be connected or merged.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex<B, D: Densities = f64, L: Lanes = f64> {
    /// Position, scene units.
    pub position: Vec3,
    /// Direction to the vertex before, towards the light.
    pub towards_light: Vec3,
    /// Flux over density on arrival, before scattering (`docs/theory.md`, section 1.5).
    pub throughput: Spectrum,
    /// Densities for the weights.
    pub mis: VertexMis<D, L>,
    /// Kernel radii there, relative to those of the plan.
    pub scale: f32,
    /// Edges from the light.
    pub depth: u32,
    /// Index of the sub-path.
    pub path: u32,
    /// Scattering at the vertex.
    pub interaction: Interaction<B>,
}

impl<B: Bsdf, D: Densities, L: Lanes> LightVertex<B, D, L> {
    /// The scattering of the light sub-path towards `to`; `None` if nothing is scattered there.
    #[inline]
    pub(crate) fn evaluate<S: Scene<Bsdf = B>>(
        &self,
        context: &Context<'_, S>,
        to: Vec3,
    ) -> Option<Evaluation<L>> {
        let (scene, roulette) = (context.prepared.scene, context.plan.roulette);
        self.interaction.evaluate(scene, roulette, Walk::Light, self.position, self.towards_light, to)
    }
}

/// The start of an edge, as far as weights depend on it.
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
    /// The number of samples that connect the edge's start to `position`, as the heuristic takes it (section
    /// 4.2).
    pub(crate) fn connections<S: Scene, D: Densities>(
        &self,
        context: &Context<'_, S>,
        direction: Vec3,
        position: Vec3,
    ) -> D {
        let mis = &context.plan.mis;
        match self {
            Self::Vertex => mis.connections(),
            Self::Emitter { emitter, point, pdf_position } => {
                let prepared = context.prepared;
                let pdf = prepared.scene.emitters()[emitter.0 as usize].pdf_incident(
                    prepared.emission_bounds(),
                    point,
                    direction,
                    position,
                    *pdf_position,
                );
                let choice = f64::from(prepared.next_event_probability(position, *emitter))
                    / f64::from(prepared.emission_probability(*emitter));
                let count = mis.nee * choice * f64::from(pdf) / f64::from(*pdf_position);
                D::of(Technique::Nee, mis.pow(count))
            }
        }
    }
}

/// An edge of a light sub-path.
pub(crate) struct LightEdge<D: Densities, L: Lanes> {
    /// Flux over density at the edge's first vertex, after scattering.
    pub(crate) throughput: Spectrum,
    /// Densities for the weights, at the first vertex.
    pub(crate) mis: EdgeMis<D, L>,
    /// The start of the edge.
    pub(crate) source: EdgeSource,
    /// Whether the edge starts at an infinite emitter: distances from there do not count in densities.
    pub(crate) from_infinity: bool,
    /// Edges from the light to a vertex on this edge.
    pub(crate) depth: u32,
}

/// The light that a sub-path carries through one medium along one edge.
#[derive(Clone, Copy, Debug)]
pub struct PhotonBeam<D: Densities = f64, L: Lanes = f64> {
    /// The segment in space; distances from the edge's first vertex.
    pub segment: Segment,
    /// The medium.
    pub medium: MediumId,
    /// Densities of the edge up to the segment's start.
    pub before: EdgeDensity<L>,
    /// Densities for the weights, at the edge's first vertex.
    pub mis: EdgeMis<D, L>,
    /// The start of the edge.
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

impl<D: Densities, L: Lanes> PhotonBeam<D, L> {
    /// The vertex at distance `t` along the beam; `None` where no walk can stop.
    pub(crate) fn vertex_at<S: Scene>(
        &self,
        context: &Context<'_, S>,
        t: f32,
    ) -> Option<LightVertex<S::Bsdf, D, L>> {
        let Context { prepared, plan } = *context;
        let Segment { origin, direction, start, .. } = self.segment;
        let segment = RaySegment { origin, direction, start, end: t };
        let density =
            self.before.with(&L::segment(&prepared.scene.media()[self.medium.0 as usize], &segment));
        let distance = if self.from_infinity { f64::INFINITY } else { f64::from(t) };
        let edge = Edge::new(&density, distance, 1.0, self.mis.start, true);
        if !(edge.forward.mean(&self.mis.shares) > 0.0) {
            return None;
        }
        let position = origin + direction * t;
        let connections = self.source.connections(context, direction, position);
        Some(LightVertex {
            position,
            towards_light: -direction,
            throughput: self.throughput * transmitted(&density, plan.mis.photon_beams, &self.mis.shares),
            mis: self.mis.arrive(&plan.mis, Walk::Light, &edge, connections),
            scale: plan.radius_scale(position, true),
            depth: self.depth,
            path: self.path,
            interaction: Interaction::Medium(self.medium),
        })
    }
}

/// Throughput of a beam inside it: `T/R` of a short one, `T` of a long one.
fn transmitted<L: Lanes>(density: &EdgeDensity<L>, extent: BeamExtent, shares: &L::Shares) -> Spectrum {
    density.transmittance / extent.normalisation(density.pass_probability.mean(shares)) as f32
}

/// A vertex of a camera sub-path where light sub-paths can be connected or merged.
pub(crate) struct CameraVertex<B, D: Densities, L: Lanes> {
    pub(crate) position: Vec3,
    /// Direction to the vertex before, towards the camera.
    pub(crate) towards_camera: Vec3,
    /// Importance over density on arrival, before scattering.
    pub(crate) throughput: Spectrum,
    pub(crate) mis: VertexMis<D, L>,
    /// Kernel radii there, relative to those of the plan.
    pub(crate) scale: f32,
    /// Edges from the camera.
    pub(crate) depth: u32,
    pub(crate) interaction: Interaction<B>,
}

impl<B: Bsdf, D: Densities, L: Lanes> CameraVertex<B, D, L> {
    /// The scattering of the camera sub-path towards `to`; `None` if nothing is scattered there.
    #[inline]
    pub(crate) fn evaluate<S: Scene<Bsdf = B>>(
        &self,
        context: &Context<'_, S>,
        to: Vec3,
    ) -> Option<Evaluation<L>> {
        let (scene, roulette) = (context.prepared.scene, context.plan.roulette);
        self.interaction.evaluate(scene, roulette, Walk::Camera, self.position, self.towards_camera, to)
    }
}

/// An edge of a camera sub-path: a query beam through all its media.
pub(crate) struct CameraEdge<D: Densities, L: Lanes> {
    /// Position of the first vertex, for which next events choose lights: the ray may start off its surface.
    pub(crate) receiver: Vec3,
    /// Importance over density at the edge's first vertex, after scattering.
    pub(crate) throughput: Spectrum,
    /// Densities for the weights, at the first vertex.
    pub(crate) mis: EdgeMis<D, L>,
    /// Samples that connect the first vertex to one on this edge, as the heuristic takes them.
    pub(crate) connections: D,
    /// Edges from the camera to a vertex on this edge.
    pub(crate) depth: u32,
}

impl<D: Densities, L: Lanes> CameraEdge<D, L> {
    /// The vertex at distance `t` along the edge, in a medium, where kernel radii have some scale; `None`
    /// where no walk can stop.
    pub(crate) fn vertex_at<S: Scene>(
        &self,
        context: &Context<'_, S>,
        edge_trace: &EdgeTrace<S::Bsdf, L>,
        (span, medium): (&MediumSpan<L>, MediumId),
        (t, scale): (f32, f32),
    ) -> Option<CameraVertex<S::Bsdf, D, L>> {
        let Context { prepared, plan } = *context;
        let density = edge_trace.density_to(prepared.scene, span, t);
        let edge = Edge::new(&density, f64::from(t), 1.0, self.mis.start, true);
        (edge.forward.mean(&self.mis.shares) > 0.0).then(|| CameraVertex {
            position: edge_trace.ray.at(t),
            towards_camera: -edge_trace.ray.direction,
            throughput: self.throughput * transmitted(&density, plan.mis.query_beams, &self.mis.shares),
            mis: self.mis.arrive(&plan.mis, Walk::Camera, &edge, self.connections),
            scale,
            depth: self.depth,
            interaction: Interaction::Medium(medium),
        })
    }
}

/// A contribution of light tracing to some pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Column and row on the film.
    pub pixel: [u32; 2],
    /// Radiance, weighted.
    pub value: Spectrum,
}

/// Vertices, beams and splats of a number of light sub-paths.
#[derive(Clone, Debug)]
pub struct LightChunk<B, D: Densities = f64, L: Lanes = f64> {
    /// Vertices, in the order of the paths.
    pub vertices: Vec<LightVertex<B, D, L>>,
    /// Photon beams, in the order of the paths.
    pub beams: Vec<PhotonBeam<D, L>>,
    /// Splats, in the order of the paths.
    pub splats: Vec<Splat>,
    /// Counters of the walks.
    pub counters: Counters,
}

impl<B, D: Densities, L: Lanes> Default for LightChunk<B, D, L> {
    fn default() -> Self {
        Self { vertices: Vec::new(), beams: Vec::new(), splats: Vec::new(), counters: Counters::default() }
    }
}
