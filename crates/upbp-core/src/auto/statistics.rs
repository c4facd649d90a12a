//! A small run before the first iteration: it sets radii and counts.
//!
//! Whatever it finds is fixed before any sample of the image is drawn, so it introduces no bias; it has random streams of its
//! own, so it is the same for every run of a seed.

use glam::Vec3;
use rayon::prelude::*;
use upbp_accel::{PointTree, Ray, SegmentTree, SplitParams};
use upbp_estimators::mis::{BeamExtent, Heuristic};
use upbp_estimators::observer::{DynObserver, ObservedVertex, Observer};
use upbp_estimators::path::{Context, LightVertex, Scratch, Site};
use upbp_estimators::scene::Scene;
use upbp_estimators::trace::trace_camera_path;
use upbp_estimators::{
    Counters, Kernel, Kernels, LightMap, LookUps, PathLengths, Plan, PlanChoices, StreamKind, Technique,
    TechniqueSet, World,
};

use crate::auto::choices::usual_roulette;
use crate::auto::emitters::pixel;
use crate::auto::memory::LightCounts;
use crate::auto::neighbours::{Nearest, Neighbours, median};
use crate::budget::Halt;
use crate::render::engine::Clock;
use crate::render::passes::{Lists, light_pass};
use crate::settings::CheckedSettings;

/// Light sub-paths of the pilot: of a first, quick one, and at most of the one that counts,
pub(crate) const LIGHT_PATHS: [u32; 2] = [1024, 8192];
/// which does with less if they have more than so many vertices.
const VERTICES: f64 = 24_576.0;
/// One of so many leaves beams.
const PATHS_PER_BEAM_PATH: u32 = 8;
/// Camera sub-paths.
const CAMERA_PATHS: u64 = 1024;
/// Of them in a piece of work.
const CHUNK: u64 = 64;
/// Queries of each kind that are measured.
const QUERIES: usize = 96;
/// Light vertices that distances are measured to: those of the first light sub-paths.
const NEIGHBOURS: usize = 16384;

/// What the pilot found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pilot {
    /// Wall seconds per light sub-path, with all threads at work: for limits of time, which are kept by the clock.
    pub(crate) light_path_seconds: f64,
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
    /// Width of a pixel where camera sub-paths first meet what scatters in more than one direction, median; 0 where nothing does.
    pub(crate) footprint: f32,
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

/// Runs a pilot with at most so many light sub-paths, or a part of them and of the camera sub-paths. `None` if it was halted.
pub(crate) fn run<S: Scene>(
    world: &World<'_, S>,
    settings: &CheckedSettings,
    techniques: TechniqueSet,
    most_light_paths: u32,
    part: f64,
    halt: &Halt<'_>,
) -> Option<Pilot> {
    let most_light_paths = (part * f64::from(most_light_paths)).ceil() as u32;
    let nominal = 1e-3 * world.bounds.radius;
    let plan_with = |light_paths| {
        let choices = PlanChoices {
            seed: settings.seed,
            iteration: 0,
            // Light tracing is of no use here.
            techniques: techniques.without([Technique::LightTracing].into_iter().collect()),
            light_paths,
            beam_paths: light_paths / PATHS_PER_BEAM_PATH,
            connections: 1.0,
            next_events: 1.0,
            look_ups: LookUps::ALL,
            vertices_per_light_path: 1.0,
            lengths: PathLengths { min: settings.min_length, max: settings.max_length },
            roulette: settings.roulette.unwrap_or(usual_roulette(techniques)),
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
        };
        Plan::new(world.scene, &choices)
    };
    let mut light = Lists::default();
    let few = most_light_paths.min(LIGHT_PATHS[0]);
    let mut plan = plan_with(few);
    let mut clock = Clock::start();
    trace_light(world, &plan, &mut light, halt)?;
    let enough = VERTICES / light.vertices.len().max(1) as f64 * f64::from(few);
    let light_paths = (enough as u32).min(most_light_paths);
    if light_paths > few {
        plan = plan_with(light_paths);
        clock.lap();
        trace_light(world, &plan, &mut light, halt)?;
    }
    let light_time = clock.lap();
    let mut queries = camera_queries(world, &plan, (part * CAMERA_PATHS as f64).ceil() as u64, halt)?;
    let beam_paths = f64::from(plan.beam_paths);
    let paths = f64::from(plan.light_paths);
    let near = first_paths(&light.vertices, paths);
    let all_photons =
        |keep: fn(&Site<S::Bsdf>) -> bool| light.vertices.iter().filter(|v| keep(&v.site)).count() as f64;
    let (on_surfaces, in_media) =
        (|site: &Site<_>| matches!(site, Site::Surface(_)), |site: &Site<_>| matches!(site, Site::Medium(_)));
    let (surface, medium) = (photons(near.0, on_surfaces), photons(near.0, in_media));
    // Split in any case: so memory is enough whether or not the beams of an iteration are.
    let beams = SegmentTree::build(
        light.beams.iter().map(|beam| (beam.segment, ())).collect(),
        SplitParams::default(),
    );
    let looked_up = |on: bool, keep| if on { all_photons(keep) / paths } else { 0.0 };
    let near = Nearest { paths: near.1, scale: world.bounds.radius };
    let near_beams = Nearest { paths: beam_paths, ..near };
    let wanted = |technique, found: &dyn Fn() -> Option<Neighbours>| {
        plan.techniques.has(technique).then(found).flatten()
    };
    Some(Pilot {
        light_path_seconds: light_time.as_secs_f64() / paths,
        vertices_per_path: light.vertices.len() as f64 / paths,
        footprint: median(&mut queries.footprints).unwrap_or(0.0),
        surface_per_path: looked_up(plan.looks_up(Technique::Surf), on_surfaces),
        medium_per_path: looked_up(plan.stores_medium_photons(), in_media),
        pieces_per_path: beams.pieces() as f64 / beam_paths,
        beams_per_path: light.beams.len() as f64 / beam_paths,
        surf: wanted(Technique::Surf, &|| {
            near.of(&queries.surfaces, surface.len(), 2.0, |point, radius, found| {
                surface.in_ball(*point, radius, |(), distance2| found(distance2.sqrt()));
            })
        }),
        pp3d: wanted(Technique::Pp3d, &|| {
            near.of(&queries.media, medium.len(), 3.0, |point, radius, found| {
                medium.in_ball(*point, radius, |(), distance2| found(distance2.sqrt()));
            })
        }),
        pb2d: wanted(Technique::Pb2d, &|| {
            near.of(&queries.edges, medium.len(), 2.0, |edge, radius, found| {
                medium.around_ray(edge, radius, |(), _, distance2| found(distance2.sqrt()));
            })
        }),
        bp2d: wanted(Technique::Bp2d, &|| {
            near_beams.of(&queries.media, light.beams.len(), 2.0, |point, radius, found| {
                beams.around_point(*point, radius, |(), _, distance2| found(distance2.sqrt()));
            })
        }),
        // Tells how many beams are enough, too.
        bb1d: near_beams.of(&queries.edges, light.beams.len(), 1.0, |edge, radius, found| {
            beams.around_ray(edge, radius, |(), approach| found(approach.distance));
        }),
    })
}

fn trace_light<S: Scene>(
    world: &World<'_, S>,
    plan: &Plan,
    lists: &mut Lists<S::Bsdf>,
    halt: &Halt<'_>,
) -> Option<Counters> {
    let (context, expected) = (Context { world, plan }, LightCounts::default());
    light_pass(&context, StreamKind::PilotLight, &expected, lists, halt, |_| ())
}

/// The vertices of the first light sub-paths, and how many sub-paths those are.
fn first_paths<B>(vertices: &[LightVertex<B>], paths: f64) -> (&[LightVertex<B>], f64) {
    match vertices.get(NEIGHBOURS) {
        None => (vertices, paths),
        Some(next) => (&vertices[..NEIGHBOURS], f64::from(next.path + 1)),
    }
}

fn photons<B>(vertices: &[LightVertex<B>], keep: impl Fn(&Site<B>) -> bool) -> PointTree<()> {
    PointTree::build(vertices.iter().filter(|v| keep(&v.site)).map(|v| (v.position, ())).collect())
}

/// Where camera sub-paths look.
#[derive(Default)]
struct Queries {
    surfaces: Vec<Vec3>,
    media: Vec<Vec3>,
    edges: Vec<Ray>,
    /// Widths of pixels where sub-paths first scatter in more than one direction.
    footprints: Vec<f32>,
    last: Vec3,
    /// Length of the sub-path so far.
    travelled: f32,
    /// Width of a pixel per length, until a width is known.
    pixel: Option<f32>,
}

impl<B> Observer<B> for Queries {
    type Densities = f64;

    fn camera_end(&mut self, lens: Vec3, _: Vec3, pdf: f32) {
        self.last = lens;
        self.travelled = 0.0;
        self.pixel = Some(pdf.sqrt().recip());
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
            && let Some(width) = self.pixel.take().map(|pixel| pixel * self.travelled)
            && width.is_finite()
        {
            self.footprints.push(width);
        }
    }
}

fn camera_queries<S: Scene>(
    world: &World<'_, S>,
    plan: &Plan,
    paths: u64,
    halt: &Halt<'_>,
) -> Option<Queries> {
    use upbp_estimators::scene::Camera;
    let crop = world.scene.camera().crop();
    let context = Context { world, plan };
    let map = LightMap::empty();
    let pieces: Vec<Queries> = (0..paths.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(Scratch::default, |scratch, chunk| {
            let mut queries = Queries::default();
            for index in chunk * CHUNK..((chunk + 1) * CHUNK).min(paths) {
                if halt.now() {
                    return None;
                }
                let (kind, pixel) = (StreamKind::PilotCamera, pixel(crop, index));
                let counters = &mut Counters::default();
                let observer: &mut DynObserver<'_, S::Bsdf> = &mut queries;
                trace_camera_path(&context, &map, kind, pixel, index, scratch, counters, observer);
            }
            Some(queries)
        })
        .collect::<Option<_>>()?;
    let mut queries = Queries::default();
    for piece in pieces {
        queries.surfaces.extend(piece.surfaces);
        queries.media.extend(piece.media);
        queries.edges.extend(piece.edges);
        queries.footprints.extend(piece.footprints);
    }
    thin(&mut queries.surfaces);
    thin(&mut queries.media);
    thin(&mut queries.edges);
    Some(queries)
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
