//! Seconds of one iteration, and of one weight.
//!
//! `iteration/SCENE/SET` is one iteration of a shipped scene at 64 x 64 pixels, as it follows on the first
//! ones. Radii shrink on the way, which changes little. `weight/recursion/K` is what a merge and a connection
//! pay for their weights on a path of K edges: the arrival of both walks at their last vertex and the sum
//! there. It must not depend on K, unlike `weight/enumeration/K`, the same weights by the definition.

use std::f64::consts::PI;
use std::hint::black_box;
use std::path::Path as FilePath;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use upbp_core::{MediumId, Settings, TechniqueSet};
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, Strategy, VertexKind};
use upbp_estimators::mis::{
    BeamExtent, DistanceDensity, Edge, EdgeMis, EdgeStart, Heuristic, MergeKind, MisPlan, VertexMis,
    VolumeMerge, VolumeMerges, Weight,
};
use upbp_estimators::scene::Walk;
use upbp_scene::ReadyScene;
use upbp_scene::description::Count;

/// Pixels per side.
const SIZE: u32 = 64;

/// Numbers of edges.
const LENGTHS: [usize; 2] = [4, 40];

fn iteration(criterion: &mut Criterion) {
    let folder = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let side = Count::new(SIZE).expect("a positive number");
    let mut group = criterion.benchmark_group("iteration");
    for name in ["cornell_media", "glass_and_null"] {
        let scene = ReadyScene::load_with(folder.join(format!("{name}.ron")), |description| {
            description.film.width = side;
            description.film.height = side;
            description.film.crop = None;
        })
        .expect("a shipped scene");
        let bpt = Settings { techniques: "bpt".parse().expect("a set"), ..Settings::default() };
        let everything = Settings { techniques: TechniqueSet::STANDARD.into(), ..Settings::default() };
        let auto = Settings { deterministic: true, ..Settings::default() };
        for (set, settings) in [("auto", auto), ("everything", everything), ("bpt", bpt)] {
            let settings = settings.validate().expect("valid settings");
            let mut renderer = scene.renderer(settings).expect("a scene that can be rendered");
            group.bench_function(BenchmarkId::new(name, set), |bencher| {
                bencher.iter(|| assert!(renderer.iterate()));
            });
        }
    }
    group.finish();
}

/// A path through fog and between walls by turns; densities differ from vertex to vertex.
fn path(length: usize) -> Path {
    let vary = |i: usize, phase: f64| (0.7 * i as f64 + phase).sin().mul_add(0.4, 1.0);
    let vertices = (0..=length).map(|i| {
        let end = i == 0 || i == length;
        let in_medium = !end && i % 2 == 0;
        let cosine = |phase| if in_medium || i == length { 1.0 } else { 0.5 * vary(i, phase) };
        PathVertex {
            kind: match (end, in_medium) {
                (true, _) => VertexKind::End,
                (_, true) => VertexKind::Medium(MediumId(0)),
                _ => VertexKind::Surface,
            },
            rho_light: 0.1 * vary(i, 0.3),
            rho_camera: if i == length { 900.0 } else { 0.1 * vary(i, 1.1) },
            cos_light: cosine(0.5),
            cos_camera: cosine(1.7),
            sin_theta: if in_medium { 0.6 * vary(i, 2.3) } else { 0.0 },
            scale: 1.0,
        }
    });
    let vertices: Vec<PathVertex> = vertices.collect();
    let edges = (0..length).map(|i| {
        let distance = vary(i, 0.9);
        let pass_probability = (-0.5 * distance).exp();
        let stop = |vertex| if in_medium(vertex) { 0.5 * pass_probability } else { pass_probability };
        PathEdge { distance, t_light: stop(&vertices[i + 1]), t_camera: stop(&vertices[i]), pass_probability }
    });
    let edges = edges.collect();
    Path { vertices, edges, pdf_position: 0.5, pdf_incident: 0.4, hittable: true }
}

/// The default techniques with radii of a hundredth.
fn plan() -> MisPlan {
    MisPlan {
        heuristic: Heuristic::Balance,
        hit: 1.0,
        nee: 1.0,
        connect: 1.0,
        light_tracing: 1e4,
        surf: 1e4 * PI * 1e-4,
        volume: vec![
            VolumeMerges {
                pp3d: 1e4 * 4.0 / 3.0 * PI * 1e-6,
                pb2d: 1e4 * 0.5 * PI * 1e-4,
                bp2d: 0.0,
                bb1d: 200.0 * 1e-2,
            }
            .map(|count| VolumeMerge { count, ..VolumeMerge::NONE }),
        ],
        photon_beams: BeamExtent::Short,
        query_beams: BeamExtent::Long,
        lanes: [0.0; 3],
    }
}

fn in_medium(vertex: &PathVertex) -> bool {
    matches!(vertex.kind, VertexKind::Medium(_))
}

fn kind(vertex: &PathVertex) -> MergeKind {
    match vertex.kind {
        VertexKind::Surface => MergeKind::Surface { scale: vertex.scale },
        VertexKind::Medium(medium) => {
            MergeKind::Medium { medium, sin_theta: vertex.sin_theta, scale: vertex.scale }
        }
        VertexKind::End | VertexKind::Volume | VertexKind::Delta => MergeKind::None,
    }
}

/// Two sub-paths of one path, as they are before their last edges.
struct Ends<'a> {
    plan: &'a MisPlan,
    path: &'a Path,
    /// The vertex in fog in the middle, where they merge; a connection joins it to the one before.
    middle: usize,
    /// The light sub-path at `middle − 1` and at `middle − 2`.
    light: [EdgeMis; 2],
    /// The camera sub-path at `middle + 1`.
    camera: EdgeMis,
}

impl<'a> Ends<'a> {
    fn new(plan: &'a MisPlan, path: &'a Path) -> Self {
        let (length, v) = (path.length(), &path.vertices);
        let middle = length / 2;
        let mut edge_mis = EdgeMis::at_light(
            plan,
            EdgeStart::Surface,
            f64::from(u8::from(path.hittable)),
            v[0].cos_camera,
            path.pdf_position,
            v[0].rho_light,
        );
        let mut light = [edge_mis; 2];
        for (i, vertex) in v.iter().enumerate().take(middle).skip(1) {
            let vertex_mis = Self::arrive(plan, path, Walk::Light, &edge_mis, i);
            let before = vertex_mis.before(plan, vertex.rho_camera, &());
            edge_mis = Self::scatter(vertex, &vertex_mis, before, vertex.rho_light, vertex.cos_camera);
            light = [edge_mis, light[0]];
        }
        let mut camera = EdgeMis::at_camera(plan, v[length].rho_camera);
        for i in (middle + 1..length).rev() {
            let vertex_mis = Self::arrive(plan, path, Walk::Camera, &camera, i);
            let before = vertex_mis.before(plan, v[i].rho_light, &());
            camera = Self::scatter(&v[i], &vertex_mis, before, v[i].rho_camera, v[i].cos_light);
        }
        Self { plan, path, middle, light, camera }
    }

    fn scatter(vertex: &PathVertex, vertex_mis: &VertexMis, before: f64, rho: f64, cos_out: f64) -> EdgeMis {
        EdgeMis {
            before,
            rho,
            cos_out,
            kind: kind(vertex),
            distance_factor: vertex_mis.distance_factor,
            shares: (),
            connectible: true,
            start: if in_medium(vertex) { EdgeStart::Medium } else { EdgeStart::Surface },
        }
    }

    /// The arrival of a walk at vertex `i`.
    fn arrive(plan: &MisPlan, path: &Path, walk: Walk, edge_mis: &EdgeMis, i: usize) -> VertexMis {
        let vertex = &path.vertices[i];
        let (edge, cos_in, connections) = match walk {
            Walk::Light if i == 1 => {
                (&path.edges[0], vertex.cos_light, plan.nee * path.pdf_incident / path.pdf_position)
            }
            Walk::Light => (&path.edges[i - 1], vertex.cos_light, plan.connect),
            Walk::Camera if i + 1 == path.length() => (&path.edges[i], vertex.cos_camera, plan.light_tracing),
            Walk::Camera => (&path.edges[i], vertex.cos_camera, plan.connect),
        };
        let (forward, backward) = match walk {
            Walk::Light => (edge.t_light, edge.t_camera),
            Walk::Camera => (edge.t_camera, edge.t_light),
        };
        let edge = Edge {
            distance_squared: edge.distance * edge.distance,
            cos_in,
            forward,
            backward,
            pass_probability: edge.pass_probability,
            ends_in_medium: in_medium(vertex),
        };
        edge_mis.arrive(plan, walk, &edge, connections)
    }

    /// BB1D where the sub-paths meet.
    fn merge(&self) -> f64 {
        let Self { plan, path, middle, .. } = *self;
        let vertex = &path.vertices[middle];
        let light = Self::arrive(plan, path, Walk::Light, &self.light[0], middle);
        let camera = Self::arrive(plan, path, Walk::Camera, &self.camera, middle);
        let [own, other] = [light.distance_factor, camera.distance_factor].map(DistanceDensity::at_stop);
        let factors = plan.volume_factors(MediumId(0), own, other, vertex.sin_theta, vertex.scale);
        let (before_light, before_camera) =
            (light.before(plan, vertex.rho_camera, &()), camera.before(plan, vertex.rho_light, &()));
        Weight::of_merge(factors.bb1d, factors.sum::<f64>(), before_light, before_camera).value()
    }

    /// The connection of the vertex in fog to the wall before it.
    fn connect(&self) -> f64 {
        let Self { plan, path, middle, .. } = *self;
        let [a, b] = [&path.vertices[middle - 1], &path.vertices[middle]];
        let edge = &path.edges[middle - 1];
        let light = Self::arrive(plan, path, Walk::Light, &self.light[1], middle - 1);
        let camera = Self::arrive(plan, path, Walk::Camera, &self.camera, middle);
        let square = edge.distance * edge.distance;
        let other =
            |walk, vertex, t: f64| plan.other_walk(walk, in_medium(vertex), edge.pass_probability, t, &());
        let light_density = b.rho_camera * a.cos_camera / square;
        let camera_density = a.rho_light * b.cos_light / square;
        let by_camera = other(Walk::Camera, a, edge.t_camera);
        let by_light = other(Walk::Light, b, edge.t_light);
        let light_end = light.end(plan, Walk::Light, kind(a), &by_camera, a.rho_camera, light_density);
        let camera_end = camera.end(plan, Walk::Camera, kind(b), &by_light, b.rho_light, camera_density);
        plan.connect_weight(light_end, camera_end).value()
    }
}

fn weight(criterion: &mut Criterion) {
    let plan = plan();
    let mut group = criterion.benchmark_group("weight");
    for length in LENGTHS {
        let path = path(length);
        let ends = Ends::new(&plan, &path);
        for (found, strategy) in
            [(ends.merge(), Strategy::Bb1d(ends.middle)), (ends.connect(), Strategy::Connect(ends.middle))]
        {
            let expected = path.weight(&plan, strategy);
            assert!(
                found > 0.0 && (found / expected - 1.0).abs() < 1e-9,
                "{strategy:?}: {found}, {expected}"
            );
        }
        group.bench_function(BenchmarkId::new("recursion", length), |bencher| {
            bencher.iter(|| {
                let ends = black_box(&ends);
                (ends.merge(), ends.connect())
            });
        });
        group.bench_function(BenchmarkId::new("enumeration", length), |bencher| {
            bencher.iter(|| black_box(&path).weights(black_box(&plan)));
        });
    }
    group.finish();
}

/// Enough for a few per cent in less than a minute.
fn config() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
}

criterion_group! {
    name = benches;
    config = config();
    targets = iteration, weight
}
criterion_main!(benches);
