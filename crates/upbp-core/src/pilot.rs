//! A small run before the first iteration: it sets radii and counts.
//!
//! Whatever it finds is fixed before any sample of the image is drawn, so it introduces no bias; it has random streams of its
//! own, so it is the same for every run of a seed.

use std::sync::atomic::AtomicBool;

use glam::Vec3;
use rayon::prelude::*;
use upbp_accel::{SegmentTree, SplitParams};
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::{ObservedVertex, Observer};
use upbp_estimators::scene::Scene;
use upbp_estimators::walk::{Context, LightVertex, PhotonBeam, Scratch, Site, trace_camera_path};
use upbp_estimators::{
    Counters, Kernel, Kernels, LightMap, LookUps, PathLengths, Plan, PlanChoices, StreamKind, TechniqueSet,
    World,
};

use crate::emitters::pixel;
use crate::memory::LightCounts;
use crate::passes::{Lists, light_pass};
use crate::settings::CheckedSettings;

/// Light sub-paths of the pilot.
const LIGHT_PATHS: u32 = 8192;
/// Of them with beams.
const BEAM_PATHS: u32 = 1024;
/// Camera sub-paths.
const CAMERA_PATHS: u64 = 1024;
/// Queries of each kind that are measured.
const QUERIES: usize = 256;
/// Light vertices that distances are measured to: those of the first light sub-paths.
const NEIGHBOURS: usize = 16384;

/// What the pilot found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pilot {
    /// Connectible vertices per light sub-path.
    pub(crate) vertices_per_path: f64,
    /// Of them those on surfaces that are looked up,
    pub(crate) surface_per_path: f64,
    /// and those in media.
    pub(crate) medium_per_path: f64,
    /// Photon beams per light sub-path that leaves beams.
    pub(crate) beams_per_path: f64,
    /// Pieces that these are cut into for look-ups.
    pub(crate) pieces_per_path: f64,
    /// Typical distances to the nearest neighbours; `None` where there is nothing.
    pub(crate) surf: Option<Neighbours>,
    /// PP3D.
    pub(crate) pp3d: Option<Neighbours>,
    /// PB2D.
    pub(crate) pb2d: Option<Neighbours>,
    /// BP2D.
    pub(crate) bp2d: Option<Neighbours>,
    /// BB1D.
    pub(crate) bb1d: Option<Neighbours>,
}

/// How close the photons of the pilot are to a typical query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Neighbours {
    /// Median over queries of the distance to the `rank`-th nearest, scene units.
    distance: f64,
    rank: f64,
    /// Sub-paths that the photons came from.
    paths: f64,
    dimension: f64,
}

impl Neighbours {
    /// The number of sub-paths with which a query of some radius finds `count` photons on average.
    pub(crate) fn paths(&self, count: f64, radius: f64) -> f64 {
        count / self.rank * self.paths * (self.distance / radius).powf(self.dimension)
    }

    /// The radius within which a query finds `count` photons on average, if `paths` sub-paths are traced.
    pub(crate) fn radius(&self, count: f64, paths: f64) -> f32 {
        (self.distance * (count / self.rank * self.paths / paths).powf(1.0 / self.dimension)) as f32
    }
}

/// Runs the pilot.
pub(crate) fn run<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
) -> Pilot {
    let nominal = 1e-3 * world.bounds.radius;
    let plan = Plan::new(
        world.scene,
        &PlanChoices {
            seed: settings.seed,
            iteration: 0,
            // Light tracing is of no use here.
            techniques: techniques.without([upbp_estimators::Technique::LightTracing].into_iter().collect()),
            light_paths: LIGHT_PATHS,
            beam_paths: BEAM_PATHS,
            connections: 1,
            next_events: 1,
            look_ups: LookUps::ALL,
            vertices_per_light_path: 1.0,
            lengths: PathLengths { min: settings.min_length, max: settings.max_length },
            roulette: settings.roulette,
            kernels: Kernels {
                surf: Kernel::disc(nominal),
                pp3d: Kernel::ball(nominal),
                pb2d: Kernel::parabolic_disc(nominal),
                bp2d: Kernel::parabolic_disc(nominal),
                bb1d: Kernel::parabolic_line(nominal),
            },
            heuristic: Heuristic::Balance,
            photon_beams: settings.photon_beams,
            query_beams: BeamExtent::Short,
        },
    );
    let context = Context { world, plan: &plan };
    let mut light = Lists::default();
    light_pass(
        &context,
        StreamKind::PilotLight,
        &LightCounts::default(),
        &mut light,
        &AtomicBool::new(false),
        |_| (),
    );
    let queries = camera_queries(world, &plan);
    let beam_paths = f64::from(plan.beam_paths);
    let paths = f64::from(plan.light_paths);
    let near = first_paths(&light.vertices, paths);
    let all_photons =
        |keep: fn(&Site<S::Bsdf>) -> bool| light.vertices.iter().filter(|v| keep(&v.site)).count() as f64;
    let (on_surfaces, in_media) =
        (|site: &Site<_>| matches!(site, Site::Surface(_)), |site: &Site<_>| matches!(site, Site::Medium(_)));
    let surface: Vec<_> = photons(near.0, on_surfaces);
    let medium: Vec<_> = photons(near.0, in_media);
    let around = |points: &[Vec3], photons: &[Vec3], paths, dimension| {
        neighbours(points, photons.len(), 8, paths, dimension, |query: &Vec3, i| query.distance(photons[i]))
    };
    let segments = light.beams.iter().map(|beam| (beam.segment, ())).collect();
    let pieces = SegmentTree::build(segments, SplitParams::default()).pieces();
    let looked_up = |on: bool, keep| if on { all_photons(keep) / paths } else { 0.0 };
    Pilot {
        vertices_per_path: light.vertices.len() as f64 / paths,
        surface_per_path: looked_up(plan.mis.surf > 0.0, on_surfaces),
        medium_per_path: looked_up(plan.stores_medium_photons(), in_media),
        pieces_per_path: pieces as f64 / beam_paths,
        beams_per_path: light.beams.len() as f64 / beam_paths,
        surf: around(&queries.surfaces, &surface, near.1, 2.0),
        pp3d: around(&queries.media, &medium, near.1, 3.0),
        pb2d: neighbours(&queries.edges, medium.len(), 8, near.1, 2.0, |edge, i| {
            edge.distance_to_point(medium[i])
        }),
        bp2d: neighbours(&queries.media, light.beams.len(), 8, beam_paths, 2.0, |point, i| {
            Edge::of_beam(&light.beams[i]).distance_to_point(*point)
        }),
        bb1d: neighbours(&queries.edges, light.beams.len(), 8, beam_paths, 1.0, |edge, i| {
            edge.distance_to_edge(&Edge::of_beam(&light.beams[i]))
        }),
    }
}

/// The vertices of the first light sub-paths, and how many sub-paths those are.
fn first_paths<B>(vertices: &[LightVertex<B>], paths: f64) -> (&[LightVertex<B>], f64) {
    match vertices.get(NEIGHBOURS) {
        None => (vertices, paths),
        Some(next) => (&vertices[..NEIGHBOURS], f64::from(next.path + 1)),
    }
}

fn photons<B>(vertices: &[LightVertex<B>], keep: impl Fn(&Site<B>) -> bool) -> Vec<Vec3> {
    vertices.iter().filter(|v| keep(&v.site)).map(|v| v.position).collect()
}

/// Median over the queries of the distance to the `rank`-th nearest of `count` elements, by looking at all of them.
fn neighbours<Q: Sync>(
    queries: &[Q],
    count: usize,
    rank: usize,
    paths: f64,
    dimension: f64,
    distance: impl Fn(&Q, usize) -> f32 + Sync,
) -> Option<Neighbours> {
    // Enough elements that the rank-th is still near.
    let rank = rank.min(count / 4).max(1);
    if queries.is_empty() || count == 0 {
        return None;
    }
    let mut nearest: Vec<f32> = queries
        .par_iter()
        .filter_map(|query| {
            let mut all: Vec<f32> = (0..count).map(|i| distance(query, i)).collect();
            let (_, value, _) = all.select_nth_unstable_by(rank - 1, f32::total_cmp);
            (value.is_finite() && *value > 0.0).then_some(*value)
        })
        .collect();
    if nearest.is_empty() {
        return None;
    }
    let middle = nearest.len() / 2;
    let (_, median, _) = nearest.select_nth_unstable_by(middle, f32::total_cmp);
    Some(Neighbours { distance: f64::from(*median), rank: rank as f64, paths, dimension })
}

/// Where camera sub-paths look.
#[derive(Default)]
struct Queries {
    surfaces: Vec<Vec3>,
    media: Vec<Vec3>,
    edges: Vec<Edge>,
    last: Vec3,
}

impl<B> Observer<B> for Queries {
    type Densities = f64;

    fn camera_end(&mut self, lens: Vec3, _: Vec3, _: f32) {
        self.last = lens;
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        match vertex.site {
            Site::Surface(_) if !vertex.delta => self.surfaces.push(vertex.position),
            Site::Surface(_) => {}
            Site::Medium(_) => self.media.push(vertex.position),
        }
        let between = vertex.position - self.last;
        let length = between.length();
        if length > 0.0 && length.is_finite() {
            self.edges.push(Edge { origin: self.last, direction: between / length, length });
        }
        self.last = vertex.position;
    }
}

fn camera_queries<S: Scene>(world: &World<'_, S>, plan: &Plan) -> Queries {
    use upbp_estimators::scene::Camera;
    let crop = world.scene.camera().crop();
    let context = Context { world, plan };
    let map = LightMap::empty();
    let mut queries = Queries::default();
    let mut scratch = Scratch::default();
    let mut counters = Counters::default();
    for index in 0..CAMERA_PATHS {
        trace_camera_path(
            &context,
            &map,
            StreamKind::PilotCamera,
            pixel(crop, index),
            index,
            &mut scratch,
            &mut counters,
            &mut queries,
        );
    }
    thin(&mut queries.surfaces);
    thin(&mut queries.media);
    thin(&mut queries.edges);
    queries
}

/// Keeps `QUERIES` elements, evenly.
fn thin<T>(elements: &mut Vec<T>) {
    let step = elements.len().div_ceil(QUERIES).max(1);
    let mut index = 0;
    elements.retain(|_| {
        index += 1;
        (index - 1) % step == 0
    });
}

/// A straight piece of a sub-path.
#[derive(Clone, Copy)]
struct Edge {
    origin: Vec3,
    direction: Vec3,
    length: f32,
}

impl Edge {
    fn of_beam(beam: &PhotonBeam) -> Self {
        let segment = &beam.segment;
        Self {
            origin: segment.origin + segment.start * segment.direction,
            direction: segment.direction,
            length: segment.end - segment.start,
        }
    }

    /// Distance of a point whose foot lies on the edge, else infinite.
    fn distance_to_point(&self, point: Vec3) -> f32 {
        let offset = point - self.origin;
        let t = offset.dot(self.direction);
        if (0.0..self.length).contains(&t) { (offset - t * self.direction).length() } else { f32::INFINITY }
    }

    /// Distance of another edge if the closest points lie on both, else infinite.
    fn distance_to_edge(&self, other: &Self) -> f32 {
        let ray = upbp_accel::Ray {
            origin: self.origin,
            direction: self.direction,
            t_min: 0.0,
            t_max: self.length,
        };
        let segment = upbp_accel::Segment {
            origin: other.origin,
            direction: other.direction,
            start: 0.0,
            end: other.length,
        };
        upbp_accel::closest_approach(&ray, &segment, f32::MAX).map_or(f32::INFINITY, |a| a.distance)
    }
}
