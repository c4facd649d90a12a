//! Look-ups around a camera vertex: surface merging, PP3D, BP2D (`docs/theory.md`, sections 2.2, 2.3, 2.5).

use upbp_media::{Medium, MediumId};

use super::beams::beam_tip;
use crate::film_sample::Output;
use crate::light_map::LightMap;
use crate::mis::{Densities, Weight};
use crate::observer::{Joint, ObservedSample, Observer};
use crate::path::{Context, LightVertex, QueryVertex, Site, SurfaceSite};
use crate::scene::{Scene, Walk};
use crate::technique::Technique;

/// Photons whose surface faces away by more than this do not lie on the query's surface: cosine of the angle between
/// the two normals.
const MIN_NORMAL_COSINE: f32 = 0.7;

/// Photons farther than this from the tangent plane, relative to the kernel's radius, lie on another surface.
const MAX_PLANE_DISTANCE: f32 = 0.3;

/// The merges at `vertex`.
pub(crate) fn at_point<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities>,
    vertex: &QueryVertex<S::Bsdf, O::Densities>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    match &vertex.site {
        Site::Surface(surface) => {
            if plan.looks_up(Technique::Surf) {
                let kernel = &plan.kernels.surf;
                out.observer.turns_to(Some(Technique::Surf));
                map.surface.in_ball(vertex.position, kernel.radius(), |index, distance2| {
                    let photon = &map.vertices[index as usize];
                    if lies_on(surface, vertex, photon, kernel.radius()) {
                        merge_point(context, vertex, photon, distance2, Technique::Surf, out);
                    }
                });
                out.observer.turns_to(None);
            }
        }
        Site::Medium(medium) => {
            let merges = plan.mis.merges_in(*medium);
            if merges.pp3d > 0.0 && plan.due.has(Technique::Pp3d) {
                out.observer.turns_to(Some(Technique::Pp3d));
                map.medium.in_ball(vertex.position, plan.kernels.pp3d.radius(), |index, distance2| {
                    let photon = &map.vertices[index as usize];
                    if matches!(photon.site, Site::Medium(other) if other == *medium) {
                        merge_point(context, vertex, photon, distance2, Technique::Pp3d, out);
                    }
                });
            }
            if merges.bp2d > 0.0 && plan.due.has(Technique::Bp2d) {
                out.observer.turns_to(Some(Technique::Bp2d));
                beams_around(context, map, vertex, *medium, out);
            }
            out.observer.turns_to(None);
        }
    }
}

/// Keeps light from leaking around edges and through thin walls. What it cuts off the kernel vanishes with the radius.
fn lies_on<B, D>(
    surface: &SurfaceSite<B>,
    vertex: &QueryVertex<B, D>,
    photon: &LightVertex<B, D>,
    radius: f32,
) -> bool {
    let Site::Surface(other) = &photon.site else { return false };
    let normal = surface.geometric_normal;
    normal.dot(other.geometric_normal) > MIN_NORMAL_COSINE
        && (photon.position - vertex.position).dot(normal).abs() < MAX_PLANE_DISTANCE * radius
}

/// Merges a photon with the query point: surface merging and PP3D differ in kernel and factor only.
fn merge_point<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    vertex: &QueryVertex<S::Bsdf, O::Densities>,
    photon: &LightVertex<S::Bsdf, O::Densities>,
    distance2: f32,
    technique: Technique,
    out: &mut Output<'_, O>,
) {
    let Context { world, plan } = *context;
    let mis = &plan.mis;
    if !plan.lengths.contain(vertex.depth + photon.depth) {
        return;
    }
    let Some(scattering) = vertex.site.evaluate(
        world.scene,
        plan.roulette,
        Walk::Camera,
        vertex.position,
        vertex.towards_camera,
        photon.towards_light,
    ) else {
        return;
    };
    let (kernel, factor, merges) = match &vertex.site {
        Site::Surface(_) => {
            let factor = mis.surface_factor();
            (&plan.kernels.surf, factor, O::Densities::of(technique, factor))
        }
        Site::Medium(medium) => {
            let factors = mis.volume_factors(
                *medium,
                photon.tip.distance_factor,
                vertex.tip.distance_factor,
                scattering.sin_theta,
            );
            (&plan.kernels.pp3d, factors.pp3d, factors.sum())
        }
    };
    let weight = Weight::of_merge(
        factor,
        merges,
        photon.tip.before(mis, scattering.rho_own),
        vertex.tip.before(mis, scattering.rho_opposite),
    );
    let value = vertex.throughput
        * photon.throughput
        * scattering.value
        * (kernel.value(distance2) * plan.per_photon(technique));
    if out.add(technique, value, &weight) {
        out.observer.sample(&ObservedSample {
            technique,
            camera_depth: vertex.depth,
            joint: Joint::Merge {
                path: photon.path,
                light: (photon.position, photon.depth),
                camera: (vertex.position, vertex.site),
            },
            weight,
            value,
        });
    }
}

/// BP2D: photon beams around the query point, in its medium.
fn beams_around<S: Scene, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities>,
    vertex: &QueryVertex<S::Bsdf, O::Densities>,
    medium_id: MediumId,
    out: &mut Output<'_, O>,
) {
    let Context { world, plan } = *context;
    let (scene, mis) = (world.scene, &plan.mis);
    let kernel = &plan.kernels.bp2d;
    map.beam_tree.around_point(vertex.position, kernel.radius(), |index, t, distance2| {
        let beam = &map.beams[index as usize];
        if beam.medium != medium_id || !plan.lengths.contain(vertex.depth + beam.depth) {
            return;
        }
        let towards_light = -beam.segment.direction;
        let medium = &scene.media()[medium_id.0 as usize];
        let phase = medium.phase().eval(beam.segment.direction, vertex.towards_camera);
        let survival = if plan.roulette.is_on() { medium.continuation(vertex.position) } else { 1.0 };
        let rho = f64::from(phase) * f64::from(survival);
        let sin = f64::from(towards_light.cross(vertex.towards_camera).length()).min(1.0);
        let Some((tip, light)) = beam_tip(context, beam, t) else { return };
        let factors = mis.volume_factors(medium_id, tip.distance_factor, vertex.tip.distance_factor, sin);
        let weight =
            Weight::of_merge(factors.bp2d, factors.sum(), tip.before(mis, rho), vertex.tip.before(mis, rho));
        let value = vertex.throughput
            * light
            * medium.sigma_s(vertex.position)
            * (phase * kernel.value(distance2) * plan.per_photon(Technique::Bp2d));
        if out.add(Technique::Bp2d, value, &weight) {
            out.observer.sample(&ObservedSample {
                technique: Technique::Bp2d,
                camera_depth: vertex.depth,
                joint: Joint::Merge {
                    path: beam.path,
                    light: (beam.segment.origin + beam.segment.direction * t, beam.depth),
                    camera: (vertex.position, vertex.site),
                },
                weight,
                value,
            });
        }
    });
}
