//! Look-ups of photon points and photon beams, and the build of their trees.
//!
//! Names are `question/structure/elements/spread/hits`, as in `ball/tree/100k/uniform/10`; the radius is such that a
//! query has that many hits on average. `cargo bench --bench lookups -- ray/tree/1m` runs a part. Throughput is
//! in queries, or in elements for a build. Brute force is there for the smallest number of elements only, and has to
//! find as many hits as the tree.

use std::cell::LazyCell;
use std::f32::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use upbp_accel::{PointTree, Ray, Segment, SegmentTree, SplitParams, closest_approach};
use upbp_estimators::{Stream, StreamKind};

/// Elements in the structure; the first number is also searched one by one.
const ELEMENTS: [(usize, &str); 3] = [(10_000, "10k"), (100_000, "100k"), (1_000_000, "1m")];

/// Mean hits of a query.
const HITS: [u32; 3] = [1, 10, 100];

/// Queries of a batch.
const QUERIES: usize = 256;

/// Queries of a batch that looks at all elements.
const BRUTE_QUERIES: usize = 16;

/// Where all light comes from in [`Spread::FromOnePoint`].
const LAMP: Vec3 = Vec3::new(0.1, 0.9, 0.05);

/// Where it ends in [`Spread::Clustered`].
const FOCUS: Vec3 = Vec3::new(0.3, -0.2, 0.1);

/// How elements lie in the cube `[−1, 1]³`.
#[derive(Clone, Copy)]
enum Spread {
    /// Everywhere alike: fog after many scatterings.
    Uniform,
    /// Around one place, denser towards its middle: a caustic.
    Clustered,
    /// On straight lines from one point: the first flight from a small lamp.
    FromOnePoint,
}

impl Spread {
    const ALL: [Self; 3] = [Self::Uniform, Self::Clustered, Self::FromOnePoint];

    const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Clustered => "clustered",
            Self::FromOnePoint => "one-point",
        }
    }

    fn point(self, random: &mut Stream) -> Vec3 {
        match self {
            Self::Uniform => cube(random),
            Self::Clustered => FOCUS + cube(random) * (0.5 * random.uniform().powi(4)),
            Self::FromOnePoint => {
                let direction = direction(random);
                // A mean free path of a quarter of the cube's width.
                let flight = -0.5 * (1.0 - random.uniform()).ln();
                LAMP + direction * flight.min(exit(LAMP, direction))
            }
        }
    }

    fn segment(self, random: &mut Stream) -> Segment {
        let direction = direction(random);
        let through = |origin: Vec3, end: f32| Segment { origin, direction, start: 0.0, end };
        match self {
            Self::Uniform => {
                let origin = cube(random);
                through(origin, exit(origin, direction))
            }
            Self::Clustered => through(self.point(random) - 0.1 * direction, 0.2),
            Self::FromOnePoint => through(LAMP, exit(LAMP, direction)),
        }
    }

    /// A ray through the cube that passes where elements are.
    fn ray(self, random: &mut Stream) -> Ray {
        let origin = cube(random);
        let direction = (self.point(random) - origin).normalize_or(Vec3::Z);
        Ray::new(origin, direction).with_range(0.0, exit(origin, direction))
    }
}

fn cube(random: &mut Stream) -> Vec3 {
    let ([x, y], z) = (random.pair(), random.uniform());
    Vec3::new(x, y, z) * 2.0 - 1.0
}

fn direction(random: &mut Stream) -> Vec3 {
    let [u, v] = random.pair();
    let z = 1.0 - 2.0 * u;
    let across = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    Vec3::new(across * cos, across * sin, z)
}

/// The distance from a point of the cube to its surface, a little more than zero.
fn exit(origin: Vec3, direction: Vec3) -> f32 {
    ((direction.signum() - origin) / direction).min_element().max(1e-3)
}

/// Numbers of its own for elements and for queries.
fn stream(kind: StreamKind, count: usize) -> Stream {
    Stream::new(1, 0, kind, count as u64)
}

fn points(count: usize, spread: Spread) -> Vec<(Vec3, u32)> {
    let mut random = stream(StreamKind::Light, count);
    (0..count as u32).map(|i| (spread.point(&mut random), i)).collect()
}

fn segments(count: usize, spread: Spread) -> Vec<(Segment, u32)> {
    let mut random = stream(StreamKind::Light, count);
    (0..count as u32).map(|i| (spread.segment(&mut random), i)).collect()
}

fn rays(count: usize, spread: Spread) -> Vec<Ray> {
    let mut random = stream(StreamKind::Camera, count);
    (0..QUERIES).map(|_| spread.ray(&mut random)).collect()
}

fn centres(count: usize, spread: Spread) -> Vec<Vec3> {
    let mut random = stream(StreamKind::Camera, count);
    (0..QUERIES).map(|_| spread.point(&mut random)).collect()
}

/// One kind of look-up: elements `E` in a tree `T`, asked with `Q`. Both ways to ask return the number of hits.
struct Question<E, T, Q> {
    name: &'static str,
    elements: fn(usize, Spread) -> Vec<E>,
    build: fn(Vec<E>) -> T,
    queries: fn(usize, Spread) -> Vec<Q>,
    tree: fn(&T, &Q, f32) -> usize,
    brute: fn(&[E], &Q, f32) -> usize,
}

impl<E, T, Q> Question<E, T, Q> {
    fn bench(&self, criterion: &mut Criterion) {
        let mut group = criterion.benchmark_group(self.name);
        for (elements, size) in ELEMENTS {
            for spread in Spread::ALL {
                // Prepared by the first benchmark that is not filtered out.
                let tree = LazyCell::new(|| (self.build)((self.elements)(elements, spread)));
                let queries = LazyCell::new(|| (self.queries)(elements, spread));
                for hits in HITS {
                    let radius =
                        LazyCell::new(|| radius_for(f64::from(hits), |r| self.count(&tree, &queries, r)));
                    group.throughput(Throughput::Elements(QUERIES as u64));
                    let id = BenchmarkId::new(format!("tree/{size}/{}", spread.name()), hits);
                    group.bench_function(id, |bencher| {
                        bencher.iter(|| self.count(&tree, &queries, black_box(*radius)));
                    });
                    if elements != ELEMENTS[0].0 {
                        continue;
                    }
                    let list = LazyCell::new(|| (self.elements)(elements, spread));
                    let some = &queries[..BRUTE_QUERIES];
                    group.throughput(Throughput::Elements(BRUTE_QUERIES as u64));
                    let id = BenchmarkId::new(format!("brute/{size}/{}", spread.name()), hits);
                    group.bench_function(id, |bencher| {
                        let all = |r| some.iter().map(|q| (self.brute)(&list, q, r)).sum::<usize>();
                        assert_eq!(all(*radius), self.count(&tree, some, *radius), "{}", self.name);
                        bencher.iter(|| all(black_box(*radius)));
                    });
                }
            }
        }
        group.finish();
    }

    fn count(&self, tree: &T, queries: &[Q], radius: f32) -> usize {
        queries.iter().map(|query| (self.tree)(tree, query, radius)).sum()
    }
}

/// The radius at which all queries together have `hits` hits each on average, by bisection of its logarithm.
fn radius_for(hits: f64, count: impl Fn(f32) -> usize) -> f32 {
    let (mut low, mut high) = (1e-6_f32, 2.0_f32);
    for _ in 0..16 {
        let middle = (low * high).sqrt();
        if count(middle) as f64 > hits * QUERIES as f64 {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// What a visitor does at the least: it uses the payload.
fn visited(count: &mut usize, payload: u32) {
    *count += 1;
    black_box(payload);
}

/// Points in a ball: SURF and PP3D.
fn ball(criterion: &mut Criterion) {
    let question = Question {
        name: "ball",
        elements: points,
        build: PointTree::build,
        queries: centres,
        tree: |tree, centre, radius| {
            let mut count = 0;
            tree.in_ball(*centre, radius, |payload, _| visited(&mut count, payload));
            count
        },
        brute: |points, centre, radius| {
            points.iter().filter(|(p, _)| (*p - *centre).length_squared() < radius * radius).count()
        },
    };
    question.bench(criterion);
}

/// Points around a ray: PB2D.
fn ray(criterion: &mut Criterion) {
    let question = Question {
        name: "ray",
        elements: points,
        build: PointTree::build,
        queries: rays,
        tree: |tree, ray, radius| {
            let mut count = 0;
            tree.around_ray(ray, radius, |payload, _, _| visited(&mut count, payload));
            count
        },
        brute: |points, ray, radius| {
            let inside = |point: Vec3| {
                let offset = point - ray.origin;
                let t = offset.dot(ray.direction);
                let across = offset - t * ray.direction;
                across.length_squared() < radius * radius && t >= ray.t_min && t < ray.t_max
            };
            points.iter().filter(|(p, _)| inside(*p)).count()
        },
    };
    question.bench(criterion);
}

/// Segments around a ray: BB1D.
fn beam(criterion: &mut Criterion) {
    let question = Question {
        name: "beam",
        elements: segments,
        build: |segments| SegmentTree::build(segments, SplitParams::default()),
        queries: rays,
        tree: |tree, ray, radius| {
            let mut count = 0;
            tree.around_ray(ray, radius, |payload, _| visited(&mut count, payload));
            count
        },
        brute: |segments, ray, radius| {
            segments.iter().filter(|(s, _)| closest_approach(ray, s, radius).is_some()).count()
        },
    };
    question.bench(criterion);
}

fn build(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build");
    for (elements, size) in ELEMENTS {
        group.throughput(Throughput::Elements(elements as u64));
        for spread in Spread::ALL {
            let list = LazyCell::new(|| points(elements, spread));
            group.bench_function(BenchmarkId::new(format!("points/{size}"), spread.name()), |bencher| {
                bencher.iter_batched(|| list.clone(), PointTree::build, BatchSize::PerIteration);
            });
            let list = LazyCell::new(|| segments(elements, spread));
            group.bench_function(BenchmarkId::new(format!("segments/{size}"), spread.name()), |bencher| {
                let build = |list| SegmentTree::build(list, SplitParams::default());
                bencher.iter_batched(|| list.clone(), build, BatchSize::PerIteration);
            });
        }
    }
    group.finish();
}

/// Enough for a few per cent; all of it takes some minutes.
fn config() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
}

criterion_group! {
    name = lookups;
    config = config();
    targets = ball, ray, beam, build
}
criterion_main!(lookups);
