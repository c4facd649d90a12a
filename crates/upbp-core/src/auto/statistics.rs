//! Statistics of light and camera sub-paths, from which radii, counts and memory follow.

use glam::{Vec2, Vec3};
use upbp_accel::{PointTree, Ray, Segment, SegmentTree, SplitParams};
use upbp_estimators::mis::{BeamExtent, ByTechnique, Heuristic};
use upbp_estimators::observer::{NoObserver, ObservedVertex, Observer};
use upbp_estimators::path::{Context, Interaction, LightChunk, LightVertex};
use upbp_estimators::scene::{BoundingSphere, Camera, CameraRay, Scene};
use upbp_estimators::trace::trace_light_path;
use upbp_estimators::{
    Counters, IterationChoices, IterationPlan, Kernel, Kernels, LightMap, MergePeriods, NO_LIMIT,
    PathLengths, PerMerge, PreparedScene, RadiusField, StreamKind, Technique, TechniqueSet,
};
use upbp_media::Lanes;

use super::full_plan::Inputs;
use super::memory_limit::Room;
use super::parallel_walks::{PIECE, PilotRun, camera_path, in_pieces, pixel};
use super::photon_distances::{Nearest, Neighbours, median};
use super::pixel_footprint::{self, FAR};
use super::roulette::usual_roulette;
use super::thinned::Thinned;
use crate::deadline::{Allowance, Clock, FIRST_RUN, Halt};
use crate::error::RenderError;

/// Light sub-paths of a quick look.
pub(crate) const FEW_LIGHT_PATHS: u32 = 1024;
/// Light sub-paths at most.
pub(crate) const LIGHT_PATHS: u32 = 8192;
/// Light vertices that are enough: sub-paths are added until there are about as many.
const ENOUGH_VERTICES: f64 = 24_576.0;
/// Light vertices at most, if there is room for so many: fewer sub-paths than a few, if theirs are more.
const MOST_VERTICES: u64 = 1_000_000;
/// Light sub-paths for each one that leaves beams.
pub(super) const PATHS_PER_BEAM_PATH: u32 = 8;
/// Camera sub-paths.
const CAMERA_PATHS: u32 = 1024;
/// Queries of each kind that are measured.
const QUERIES: usize = 96;
/// Queries of each kind that a piece of the work keeps, an even number.
const QUERIES_OF_PIECE: usize = 512;
/// Light vertices that distances are measured to: those of the first light sub-paths.
const NEIGHBOURS: usize = 16384;

/// Averages over light sub-paths, and typical distances between photons and queries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Statistics {
    /// Wall seconds per light sub-path, with all threads at work: for limits of time, which are kept by the
    /// clock.
    pub(crate) light_path_seconds: f64,
    /// Connectible vertices per light sub-path.
    pub(crate) vertices_per_path: f64,
    /// Photons on surfaces, per light sub-path; 0 if none is queried.
    pub(crate) surface_per_path: f64,
    /// Photons in media, per light sub-path; 0 if none is queried.
    pub(crate) medium_per_path: f64,
    /// Photon beams per light sub-path that leaves beams.
    pub(crate) beams_per_path: f64,
    /// Pieces of photon beams in the tree, per light sub-path that leaves beams.
    pub(crate) pieces_per_path: f64,
    /// Width of a pixel where camera sub-paths first meet what scatters in more than one direction, median in
    /// scene units; 0 where nothing does.
    pub(crate) footprint: f32,
    /// Largest coordinate of nearly all of these places, scene units.
    pub(crate) largest_coordinate: f32,
    /// The field that kernel radii follow.
    pub(crate) radius_field: RadiusField,
    /// Photons or beams around the queries of each technique; `None` where there is nothing.
    pub(crate) neighbours: PerMerge<Option<Neighbours>>,
}

impl Statistics {
    /// Photons or beams around the queries of a technique, if it merges and there are any.
    pub(crate) fn neighbours_of(&self, technique: Technique) -> Option<Neighbours> {
        *self.neighbours.get(technique)?
    }
}

/// Measures sub-paths in the lanes `L` with at most `light_paths` light sub-paths; with fewer, and fewer
/// camera sub-paths, if there is no time.
///
/// # Errors
/// [`RenderError::Cancelled`].
pub(super) fn measure<S: Scene, L: Lanes>(
    scene: &PreparedScene<'_, S>,
    inputs: Inputs<'_>,
    light_paths: u32,
    room: &Room,
    allowance: &Allowance<'_>,
) -> Result<Statistics, RenderError> {
    let Inputs { settings, techniques, .. } = inputs;
    let use_nothing = [Technique::Hit, Technique::Nee, Technique::LightTracing].into_iter().collect();
    let only_light_tracing = techniques.without(use_nothing).is_empty();
    if only_light_tracing && !(allowance.is_limited() && techniques.has(Technique::LightTracing)) {
        return Ok(Statistics::default());
    }
    let run = |part: f64, halt: &Halt<'_>| {
        let light_paths = (part * f64::from(light_paths)).ceil() as u32;
        let camera_paths = (part * f64::from(CAMERA_PATHS)).ceil() as u32;
        let plan = |paths| nominal_plan(scene, inputs, paths);
        let most_vertices = room.items::<LightVertex<S::Bsdf, f64, L>>().min(MOST_VERTICES);
        let light = TracedPaths::trace::<_, L>(scene, plan, light_paths, most_vertices as f64, halt)?;
        let plan = plan(light.paths);
        let queries = Queries::trace::<_, L>(&Context { prepared: scene, plan: &plan }, camera_paths, halt)?
            .within(&scene.bounds_with_camera());
        let field = if settings.radii.are_auto(techniques) {
            pixel_footprint::field(scene.scene.camera(), queries.first.iter().map(|seen| seen.place))
        } else {
            RadiusField::Uniform
        };
        Some(light.statistics(&plan, field, &queries, scene.bounds.radius))
    };
    allowance.largest(FIRST_RUN, run).ok_or(RenderError::Cancelled)
}

/// A plan whose light sub-paths and camera sub-paths go where those of iterations do. Its radii are of no
/// importance.
fn nominal_plan<S: Scene>(
    scene: &PreparedScene<'_, S>,
    Inputs { settings, techniques, lanes }: Inputs<'_>,
    light_paths: u32,
) -> IterationPlan {
    let nominal = 1e-3 * scene.bounds.radius;
    let choices = IterationChoices {
        seed: settings.seed,
        iteration: PilotRun::Statistics.iteration(),
        techniques: techniques.without(TechniqueSet::only(Technique::LightTracing)),
        light_paths,
        beam_paths: (light_paths / PATHS_PER_BEAM_PATH).max(1),
        connections: 1.0,
        next_events: 1.0,
        camera_factor: 1.0,
        periods: MergePeriods::ONE,
        vertices_per_light_path: 1.0,
        lengths: PathLengths { min: settings.min_length, max: settings.max_length },
        roulette: settings.roulette.unwrap_or(usual_roulette(techniques)),
        kernels: Kernels::from_fn(|technique| Kernel::of(technique, nominal)),
        radius_field: RadiusField::Uniform,
        mean_free_paths: NO_LIMIT,
        heuristic: Heuristic::Balance,
        photon_beams: settings.photon_beams,
        query_beams: BeamExtent::Short,
        lanes,
        features: false,
    };
    IterationPlan::new(scene.scene, &choices)
}

/// A light vertex, as far as distances depend on it.
struct Photon {
    position: Vec3,
    path: u32,
    in_medium: bool,
}

/// Light sub-paths with the places of all that they store. Without the types of scenes, so that what follows
/// from them is compiled once.
struct TracedPaths {
    paths: u32,
    photons: Vec<Photon>,
    beams: Vec<Segment>,
    /// Wall seconds per light sub-path.
    seconds: f64,
}

impl TracedPaths {
    /// Traces one, then a few, then at most `most` if their vertices are not [enough](ENOUGH_VERTICES).
    fn trace<S: Scene, L: Lanes>(
        scene: &PreparedScene<'_, S>,
        plan: impl Fn(u32) -> IterationPlan,
        most: u32,
        most_vertices: f64,
        halt: &Halt<'_>,
    ) -> Option<Self> {
        let trace = |paths| {
            let mut clock = Clock::start();
            let plan = plan(paths);
            let context = Context { prepared: scene, plan: &plan };
            let pieces = in_pieces(paths, halt, |index, scratch, out: &mut LightChunk<_, f64, L>| {
                trace_light_path(&context, StreamKind::PilotLight, index, scratch, out, &mut NoObserver);
                true
            })?;
            let (mut photons, mut beams) = (Vec::new(), Vec::new());
            for out in pieces {
                photons.extend(out.vertices.iter().map(|vertex| Photon {
                    position: vertex.position,
                    path: vertex.path,
                    in_medium: matches!(vertex.interaction, Interaction::Medium(_)),
                }));
                beams.extend(out.beams.iter().map(|beam| beam.segment));
            }
            Some(Self { paths, photons, beams, seconds: clock.lap().as_secs_f64() / f64::from(paths) })
        };
        let mut found = trace(1)?;
        // Walks that hardly ever end would fill all memory.
        for (paths, vertices) in
            [(PIECE as u32, most_vertices), (FEW_LIGHT_PATHS, most_vertices), (LIGHT_PATHS, ENOUGH_VERTICES)]
        {
            // Where no technique uses vertices, beams alone are stored.
            let stored = found.photons.len().max(found.beams.len()).max(1);
            let enough = vertices.min(most_vertices) / stored as f64 * f64::from(found.paths);
            let paths = (enough as u32).min(paths).min(most);
            if paths > found.paths {
                found = trace(paths)?;
            }
        }
        Some(found)
    }

    fn statistics(
        &self,
        plan: &IterationPlan,
        field: RadiusField,
        queries: &Queries,
        scale: f32,
    ) -> Statistics {
        let (paths, beam_paths) = (f64::from(self.paths), f64::from(plan.beam_paths));
        let per_path = |queried: bool, in_medium: bool| {
            let count = self.photons.iter().filter(|photon| photon.in_medium == in_medium).count();
            if queried { count as f64 / paths } else { 0.0 }
        };
        let (near, near_paths) = first_paths(&self.photons, paths);
        let [surface, medium] = [false, true].map(|in_medium| tree(near, in_medium));
        // Split in any case: so memory is enough whether or not the beams of an iteration are.
        let segments = self.beams.iter().map(|segment| (*segment, 0)).collect();
        let beams = SegmentTree::build(segments, SplitParams::default());
        let near = Nearest { paths: near_paths, scale };
        let near_beams = Nearest { paths: beam_paths, scale };
        // Distances are divided by the radius field.
        let of = |technique, found: &dyn Fn() -> Option<Neighbours>| {
            plan.techniques.has(technique).then(found).flatten()
        };
        let around_points = |queries: &[Vec3], photons: &PointTree, dimension: f64| {
            near.of(queries, photons.len(), dimension, &|point, radius, found| {
                let scale = field.at(*point);
                photons.in_ball(*point, scale * radius, |_, distance2| found(distance2.sqrt() / scale));
            })
        };
        Statistics {
            light_path_seconds: self.seconds,
            vertices_per_path: self.photons.len() as f64 / paths,
            footprint: queries.footprint(),
            largest_coordinate: queries.largest_coordinate(),
            radius_field: field,
            surface_per_path: per_path(plan.merges_by(Technique::Surf), false),
            medium_per_path: per_path(plan.stores_medium_photons(), true),
            pieces_per_path: beams.pieces() as f64 / beam_paths,
            beams_per_path: self.beams.len() as f64 / beam_paths,
            neighbours: PerMerge {
                surf: of(Technique::Surf, &|| around_points(&queries.surfaces, &surface, 2.0)),
                pp3d: of(Technique::Pp3d, &|| around_points(&queries.media, &medium, 3.0)),
                pb2d: of(Technique::Pb2d, &|| {
                    near.of(&queries.edges, medium.len(), 2.0, &|edge, radius, found| {
                        medium.around_ray(
                            edge,
                            field.search_radius(radius, f32::INFINITY),
                            |_, t, distance2| {
                                found(distance2.sqrt() / field.at(edge.at(t)));
                            },
                        );
                    })
                }),
                bp2d: of(Technique::Bp2d, &|| {
                    near_beams.of(&queries.media, self.beams.len(), 2.0, &|point, radius, found| {
                        let scale = field.at(*point);
                        beams.around_point(*point, scale * radius, |_, _, distance2| {
                            found(distance2.sqrt() / scale);
                        });
                    })
                }),
                // Tells how many beams are enough, too.
                bb1d: near_beams.of(&queries.edges, self.beams.len(), 1.0, &|edge, radius, found| {
                    beams.around_ray(edge, field.search_radius(radius, f32::INFINITY), |_, approach| {
                        found(approach.distance / field.at(edge.at(approach.t_ray)));
                    });
                }),
            },
        }
    }
}

/// The photons of the first light sub-paths, and how many sub-paths those are.
fn first_paths(photons: &[Photon], paths: f64) -> (&[Photon], f64) {
    match photons.get(NEIGHBOURS) {
        None => (photons, paths),
        Some(next) => (&photons[..NEIGHBOURS], f64::from(next.path + 1)),
    }
}

/// The photons in media, or those on surfaces.
fn tree(photons: &[Photon], in_medium: bool) -> PointTree {
    let chosen = photons.iter().filter(|photon| photon.in_medium == in_medium);
    PointTree::build(chosen.map(|photon| (photon.position, 0)).collect())
}

/// Queries that camera sub-paths make.
#[derive(Default)]
struct Queries {
    surfaces: Vec<Vec3>,
    media: Vec<Vec3>,
    edges: Vec<Ray>,
    /// The first vertex of each sub-path that scatters in more than one direction.
    first: Vec<FirstVertex>,
}

/// A vertex that a pixel sees.
struct FirstVertex {
    place: Vec3,
    /// Width of the pixel there, scene units.
    footprint: f32,
}

/// Writes down the queries of a piece of the work.
#[derive(Default)]
struct QueryRecorder {
    surfaces: Thinned<Vec3, QUERIES_OF_PIECE>,
    media: Thinned<Vec3, QUERIES_OF_PIECE>,
    edges: Thinned<Ray, QUERIES_OF_PIECE>,
    first: Vec<FirstVertex>,
    last: Vec3,
    /// Length of the sub-path so far.
    travelled: f32,
    /// Width of a pixel per length, until a width is known.
    pixel: Option<f32>,
    /// Whether the edge at hand, or one before, is in a medium that scatters.
    in_medium: bool,
    /// Whether an edge of the sub-path in such a medium has been met.
    has_edge: bool,
    /// Whether a vertex of it in a medium has been met.
    has_medium: bool,
}

impl<B> Observer<B> for QueryRecorder {
    type Densities = ByTechnique;

    fn camera_end(&mut self, _: Vec2, ray: &CameraRay) {
        self.last = ray.origin;
        self.travelled = 0.0;
        self.pixel = Some(ray.pdf.sqrt().recip());
        self.in_medium = false;
        self.has_edge = false;
        self.has_medium = false;
    }

    fn call(&mut self, technique: Technique, _: u32) {
        self.in_medium |= matches!(technique, Technique::Pb2d | Technique::Bb1d);
    }

    fn camera_vertex(&mut self, vertex: &ObservedVertex<B>) {
        match vertex.interaction {
            Interaction::Surface(_) if !vertex.delta => self.surfaces.push(vertex.position),
            Interaction::Medium(_) if !self.has_medium => {
                self.has_medium = true;
                self.media.push(vertex.position);
            }
            Interaction::Surface(_) | Interaction::Medium(_) => {}
        }
        let between = vertex.position - self.last;
        let length = between.length();
        if self.in_medium && !self.has_edge && length > 0.0 && length.is_finite() {
            self.has_edge = true;
            self.edges.push(Ray {
                origin: self.last,
                direction: between / length,
                t_min: 0.0,
                t_max: length,
            });
        }
        self.last = vertex.position;
        self.travelled += length;
        if !vertex.delta
            && let Some(footprint) = self.pixel.take().map(|pixel| pixel * self.travelled)
            && footprint.is_finite()
        {
            self.first.push(FirstVertex { place: vertex.position, footprint });
        }
    }
}

impl Queries {
    /// The queries of camera sub-paths all over the picture.
    fn trace<S: Scene, L: Lanes>(context: &Context<'_, S>, paths: u32, halt: &Halt<'_>) -> Option<Self> {
        let crop = context.prepared.scene.camera().crop();
        let map = LightMap::<_, _, L>::empty();
        let pieces = in_pieces(paths, halt, |index, scratch, recorder: &mut QueryRecorder| {
            let (index, counters) = (u64::from(index), &mut Counters::default());
            camera_path(context, &map, pixel(crop, index), index, scratch, counters, recorder);
            true
        })?;
        let mut queries = Self::default();
        let (mut surfaces, mut media, mut edges) = (Vec::new(), Vec::new(), Vec::new());
        for piece in pieces {
            surfaces.push(piece.surfaces);
            media.push(piece.media);
            edges.push(piece.edges);
            queries.first.extend(piece.first);
        }
        queries.surfaces = Thinned::joined(surfaces);
        queries.media = Thinned::joined(media);
        queries.edges = Thinned::joined(edges);
        Some(queries)
    }

    /// The queries within a sphere, at most [`QUERIES`] of each kind; all of a kind of which there are none.
    ///
    /// Walks get far out in a medium around the scene, where photons are rare and nothing needs any: radii
    /// that suit them would blur the scene.
    fn within(self, BoundingSphere { centre, radius }: &BoundingSphere) -> Self {
        let is_within = |place: Vec3| place.distance(*centre) <= *radius;
        Self {
            surfaces: measured(those(self.surfaces, |place| is_within(*place))),
            media: measured(those(self.media, |place| is_within(*place))),
            edges: measured(those(self.edges, |edge| {
                is_within(edge.origin) || is_within(edge.at(edge.t_max))
            })),
            first: those(self.first, |seen| is_within(seen.place)),
        }
    }

    /// The median width of a pixel.
    fn footprint(&self) -> f32 {
        median(&mut self.first.iter().map(|seen| seen.footprint).collect::<Vec<_>>()).unwrap_or(0.0)
    }

    /// The largest coordinate of all that is seen but the [farthest](FAR).
    fn largest_coordinate(&self) -> f32 {
        let mut largest: Vec<f32> = self.first.iter().map(|seen| seen.place.abs().max_element()).collect();
        largest.sort_unstable_by(f32::total_cmp);
        let last = largest.len().saturating_sub(1);
        largest.get(((1.0 - FAR) * last as f32) as usize).copied().unwrap_or(0.0)
    }
}

/// The elements that `are_wanted`, or all if none is.
fn those<T>(mut all: Vec<T>, are_wanted: impl Fn(&T) -> bool) -> Vec<T> {
    if all.iter().any(&are_wanted) {
        all.retain(are_wanted);
    }
    all
}

/// At most [`QUERIES`] elements, evenly.
fn measured<T>(all: Vec<T>) -> Vec<T> {
    let step = all.len().div_ceil(QUERIES).max(1);
    all.into_iter().step_by(step).collect()
}
