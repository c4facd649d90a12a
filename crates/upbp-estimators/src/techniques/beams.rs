//! Look-ups along a camera edge, the query beam: PB2D and BB1D (`docs/theory.md`, sections 2.4 and 2.6).
//!
//! The vertex of a completed path lies somewhere on the beam, not at the distance that the walk sampled: density and
//! weight are evaluated for the foot point.

use glam::Vec3;
use upbp_accel::Ray;
use upbp_media::{EdgeDensity, Medium, MediumId, RaySegment, Spectrum};

use crate::film_sample::Output;
use crate::light_map::LightMap;
use crate::mis::{BeamExtent, Densities, Edge, Tip, Weight};
use crate::observer::{Joint, ObservedSample, Observer};
use crate::path::{Context, Passage, PhotonBeam, QueryEdge, Site, Span};
use crate::scene::{Scene, Walk};
use crate::technique::Technique;

/// The merges along an edge of the camera sub-path, through all its media. A short query beam ends where the walk stops.
pub(crate) fn along_beam<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities>,
    passage: &Passage<S::Bsdf>,
    edge: &QueryEdge<O::Densities>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    // The photon's side has at least one edge.
    if edge.depth + 1 > plan.lengths.max {
        return;
    }
    let stop = match plan.mis.query_beams {
        BeamExtent::Short => passage.stop,
        BeamExtent::Long => None,
    };
    for (i, span) in passage.spans.iter().enumerate() {
        let (end, last) = match stop {
            Some((at, t)) if at == i => (t, true),
            _ => (span.end, false),
        };
        if let Some(medium) = span.medium {
            let merges = plan.mis.merges_in(medium);
            let ray =
                Ray { origin: passage.origin, direction: passage.direction, t_min: span.start, t_max: end };
            let query = Query { context, passage, span, edge, medium };
            if merges.pb2d > 0.0 && plan.due.has(Technique::Pb2d) {
                out.observer.turns_to(Some(Technique::Pb2d));
                map.medium.around_ray(&ray, plan.kernels.pb2d.radius(), |index, t, distance2| {
                    query.merge_point(map, index, t, distance2, out);
                });
            }
            if merges.bb1d > 0.0 && plan.due.has(Technique::Bb1d) {
                out.observer.turns_to(Some(Technique::Bb1d));
                map.beam_tree.around_ray(&ray, plan.kernels.bb1d.radius(), |index, approach| {
                    query.merge_beam(&map.beams[index as usize], &approach, out);
                });
            }
        }
        out.observer.turns_to(None);
        if last {
            break;
        }
    }
}

/// The light that arrives at distance `t` along a photon beam and what the weights know there.
pub(crate) fn beam_tip<S: Scene, D: Densities>(
    context: &Context<'_, S>,
    beam: &PhotonBeam<D>,
    t: f32,
) -> Option<(Tip<D>, Spectrum)> {
    let Context { world, plan } = *context;
    let segment = RaySegment {
        origin: beam.segment.origin,
        direction: beam.segment.direction,
        start: beam.segment.start,
        end: t,
    };
    let density = beam.before.with(&world.scene.media()[beam.medium.0 as usize].segment(&segment));
    let distance = if beam.from_infinity { f64::INFINITY } else { f64::from(t) };
    let edge = Edge::new(&density, distance, 1.0, beam.pending.in_medium, true);
    if !(edge.forward > 0.0) {
        return None;
    }
    let position = beam.segment.origin + beam.segment.direction * t;
    let connections = beam.source.connections(context, beam.segment.direction, position);
    let tip = beam.pending.arrive(&plan.mis, Walk::Light, &edge, connections);
    Some((tip, beam.throughput * transmitted(&density, plan.mis.photon_beams)))
}

/// The throughput of a beam inside it: `T/R` of a short one, `T` of a long one.
fn transmitted(density: &EdgeDensity, extent: BeamExtent) -> Spectrum {
    density.transmittance / extent.normalisation(density.pass_probability) as f32
}

/// A query beam in one medium.
struct Query<'a, 'b, S: Scene, D> {
    context: &'a Context<'b, S>,
    passage: &'a Passage<S::Bsdf>,
    span: &'a Span,
    edge: &'a QueryEdge<D>,
    medium: MediumId,
}

/// The query beam's own end at a foot point.
struct Foot<D> {
    position: Vec3,
    tip: Tip<D>,
    throughput: Spectrum,
}

impl<S: Scene, D: Densities> Query<'_, '_, S, D> {
    fn foot(&self, t: f32) -> Option<Foot<D>> {
        let Context { world, plan } = *self.context;
        let density = self.passage.density_to(world.scene, self.span, t);
        let edge = Edge::new(&density, f64::from(t), 1.0, self.edge.pending.in_medium, true);
        if !(edge.forward > 0.0) {
            return None;
        }
        let tip = self.edge.pending.arrive(&plan.mis, Walk::Camera, &edge, self.edge.connections);
        Some(Foot {
            position: self.passage.origin + self.passage.direction * t,
            tip,
            throughput: self.edge.throughput * transmitted(&density, plan.mis.query_beams),
        })
    }

    /// PB2D.
    fn merge_point<O: Observer<S::Bsdf, Densities = D> + ?Sized>(
        &self,
        map: &LightMap<S::Bsdf, O::Densities>,
        index: u32,
        t: f32,
        distance2: f32,
        out: &mut Output<'_, O>,
    ) {
        let plan = self.context.plan;
        let photon = &map.vertices[index as usize];
        let in_same_medium = matches!(photon.site, Site::Medium(medium) if medium == self.medium);
        if !in_same_medium || !plan.lengths.contain(self.edge.depth + photon.depth) {
            return;
        }
        let Some(foot) = self.foot(t) else { return };
        let kernel = plan.kernels.pb2d.value(distance2) * plan.per_photon(Technique::Pb2d);
        self.merge(
            &Incoming {
                technique: Technique::Pb2d,
                towards_light: photon.towards_light,
                tip: photon.tip,
                throughput: photon.throughput,
                position: photon.position,
                depth: photon.depth,
                path: photon.path,
            },
            &foot,
            kernel,
            out,
        );
    }

    /// BB1D.
    fn merge_beam<O: Observer<S::Bsdf, Densities = D> + ?Sized>(
        &self,
        beam: &PhotonBeam<D>,
        approach: &upbp_accel::ClosestApproach,
        out: &mut Output<'_, O>,
    ) {
        let plan = self.context.plan;
        if beam.medium != self.medium || !plan.lengths.contain(self.edge.depth + beam.depth) {
            return;
        }
        let Some((tip, throughput)) = beam_tip(self.context, beam, approach.t_segment) else { return };
        let Some(foot) = self.foot(approach.t_ray) else { return };
        let kernel = plan.kernels.bb1d.value(approach.distance * approach.distance)
            * plan.per_photon(Technique::Bb1d)
            / approach.sin_theta;
        self.merge(
            &Incoming {
                technique: Technique::Bb1d,
                towards_light: -beam.segment.direction,
                tip,
                throughput,
                position: beam.segment.origin + beam.segment.direction * approach.t_segment,
                depth: beam.depth,
                path: beam.path,
            },
            &foot,
            kernel,
            out,
        );
    }

    fn merge<O: Observer<S::Bsdf, Densities = D> + ?Sized>(
        &self,
        light: &Incoming<D>,
        foot: &Foot<D>,
        kernel: f32,
        out: &mut Output<'_, O>,
    ) {
        let Context { world, plan } = *self.context;
        let mis = &plan.mis;
        let medium = &world.scene.media()[self.medium.0 as usize];
        let towards_camera = -self.passage.direction;
        // Propagation of the light: along the photon's path, then towards the camera.
        let phase = medium.phase().eval(-light.towards_light, towards_camera);
        let survival = if plan.roulette.is_on() { medium.continuation(foot.position) } else { 1.0 };
        let rho = f64::from(phase) * f64::from(survival);
        let sin = f64::from(light.towards_light.cross(towards_camera).length()).min(1.0);
        let factors =
            mis.volume_factors(self.medium, light.tip.distance_factor, foot.tip.distance_factor, sin);
        let factor = match light.technique {
            Technique::Bb1d => factors.bb1d,
            _ => factors.pb2d,
        };
        let (before_light, before_camera) = (light.tip.before(mis, rho), foot.tip.before(mis, rho));
        let weight = Weight::of_merge(factor, factors.sum(), before_light, before_camera);
        let value = foot.throughput * light.throughput * medium.sigma_s(foot.position) * (phase * kernel);
        if out.add(light.technique, value, &weight) {
            out.observer.sample(&ObservedSample {
                technique: light.technique,
                camera_depth: self.edge.depth,
                joint: Joint::Merge {
                    path: light.path,
                    light: (light.position, light.depth),
                    camera: (foot.position, Site::Medium(self.medium)),
                },
                weight,
                value,
            });
        }
    }
}

/// The light's side of a merge on a query beam.
struct Incoming<D> {
    technique: Technique,
    towards_light: Vec3,
    tip: Tip<D>,
    throughput: Spectrum,
    position: Vec3,
    depth: u32,
    path: u32,
}
