//! Look-ups of photon points and photon beams, and the build of their trees.
//!
//! Names are `question/structure/elements/spread/hits`, as in `ball/tree/100k/uniform/10`; the radius is such
//! that a query has that many hits on average. `cargo bench --bench lookups -- ray/tree/1m` runs a part.
//! Throughput is in queries, or in elements for a build. Brute force is there for the smallest number of
//! elements only, and has to find as many hits as the tree; the other structures may differ by what their
//! boxes lose to rounding.

mod alternatives;

use std::cell::LazyCell;
use std::f32::consts::TAU;
use std::hint::black_box;
use std::time::{Duration, Instant};

use alternatives::{BeamGrid, Binary, KdTree, PointGrid, Wide};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use upbp_accel::{PointTree, Ray, Segment, SegmentTree, SplitParams, closest_approach};
use upbp_estimators::{Stream, StreamKind};

/// Elements in the structure; the first number is also searched one by one.
const ELEMENTS: [(usize, &str); 3] = [(10_000, "10k"), (100_000, "100k"), (1_000_000, "1m")];

/// Mean hits of a query.
const HITS: [u32; 3] = [1, 10, 100];

/// Queries from which the radius is found.
const TRIALS: usize = 256;

/// Queries of a batch that looks at all elements.
const BRUTE_QUERIES: usize = 16;

/// The lamp of [`Spread::FromOnePoint`].
const LAMP: Vec3 = Vec3::new(0.1, 0.9, 0.05);

/// The middle of the caustic in [`Spread::Clustered`].
const FOCUS: Vec3 = Vec3::new(0.3, -0.2, 0.1);

/// Distribution of the elements in the cube `[−1, 1]³`.
#[derive(Clone, Copy)]
enum Spread {
    /// Everywhere alike: fog after many scatterings.
    Uniform,
    /// Around one place, denser towards its middle, which is of finite size: a caustic.
    Clustered,
    /// On straight lines from one point: the first flight from a small lamp.
    FromOnePoint,
    /// On the sides of a box: photons on surfaces.
    Sides,
    /// All the same: a laser. For builds only; a query finds all or nothing.
    Coincident,
}

impl Spread {
    const QUERIED: [Self; 4] = [Self::Uniform, Self::Clustered, Self::FromOnePoint, Self::Sides];
    const BUILT: [Self; 5] =
        [Self::Uniform, Self::Clustered, Self::FromOnePoint, Self::Sides, Self::Coincident];

    const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Clustered => "clustered",
            Self::FromOnePoint => "one-point",
            Self::Sides => "sides",
            Self::Coincident => "coincident",
        }
    }

    fn point(self, random: &mut Stream) -> Vec3 {
        match self {
            Self::Uniform => cube(random),
            Self::Clustered => FOCUS + cube(random) * (0.5 * random.uniform().powi(4).max(1e-3)),
            Self::FromOnePoint => {
                let direction = direction(random);
                // A mean free path of a quarter of the cube's width.
                let flight = -0.5 * (1.0 - random.uniform()).ln();
                LAMP + direction * flight.min(exit(LAMP, direction))
            }
            Self::Sides => {
                let mut point = cube(random);
                let axis = point.abs().max_position();
                point[axis] = point[axis].signum();
                point
            }
            Self::Coincident => FOCUS,
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
            // From one side to another.
            Self::Sides => {
                let origin = self.point(random);
                let direction = (cube(random) - origin).normalize_or(Vec3::X);
                Segment { direction, ..through(origin, exit(origin * 0.999, direction)) }
            }
            Self::Coincident => Segment { direction: Vec3::X, ..through(FOCUS, 0.5) },
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

fn rays<const N: usize>(count: usize, spread: Spread) -> Vec<Ray> {
    let mut random = stream(StreamKind::Camera, count);
    (0..N).map(|_| spread.ray(&mut random)).collect()
}

fn centres(count: usize, spread: Spread) -> Vec<Vec3> {
    let mut random = stream(StreamKind::Camera, count);
    (0..4096).map(|_| spread.point(&mut random)).collect()
}

/// Another structure over the elements, for one radius: counts the hits of a query.
type Other<E, Q> = for<'a> fn(&'a [E], f32) -> Box<dyn Fn(&Q) -> usize + 'a>;

/// One kind of look-up: elements `E` in a tree `T`, asked with `Q`. Every way to ask returns the number of
/// hits.
struct Question<E, T, Q> {
    name: &'static str,
    elements: fn(usize, Spread) -> Vec<E>,
    build: fn(Vec<E>) -> T,
    queries: fn(usize, Spread) -> Vec<Q>,
    tree: fn(&T, &Q, f32) -> usize,
    brute: fn(&[E], &Q, f32) -> usize,
    others: Vec<(&'static str, Other<E, Q>)>,
}

impl<E: Clone, T, Q> Question<E, T, Q> {
    fn bench(&self, criterion: &mut Criterion) {
        let mut group = criterion.benchmark_group(self.name);
        for (elements, size) in ELEMENTS {
            for spread in Spread::QUERIED {
                // Prepared by the first benchmark that is not filtered out.
                let list = LazyCell::new(|| (self.elements)(elements, spread));
                let tree = LazyCell::new(|| (self.build)(list.clone()));
                let queries = LazyCell::new(|| (self.queries)(elements, spread));
                for hits in HITS {
                    let radius = LazyCell::new(|| {
                        radius_for(f64::from(hits), |r| self.count(&tree, &queries[..TRIALS], r))
                    });
                    let id = |name: &str| BenchmarkId::new(format!("{name}/{size}/{}", spread.name()), hits);
                    group.bench_function(id("tree"), |bencher| {
                        eprintln!("radius {:.3e}, {} queries", *radius, queries.len());
                        bencher.iter(|| self.count(&tree, &queries, black_box(*radius)));
                    });
                    for (name, other) in &self.others {
                        let other = LazyCell::new(|| other(&list, *radius));
                        group.bench_function(id(name), |bencher| {
                            let ask: &dyn Fn(&Q) -> usize = &**other;
                            let all = || queries.iter().map(ask).sum::<usize>();
                            let (found, expected) = (all(), self.count(&tree, &queries, *radius));
                            assert!(found.abs_diff(expected) * 100 <= expected, "{name}: {found} {expected}");
                            bencher.iter(all);
                        });
                    }
                    if elements != ELEMENTS[0].0 {
                        continue;
                    }
                    let some = LazyCell::new(|| &queries[..BRUTE_QUERIES]);
                    group.bench_function(id("brute"), |bencher| {
                        let all = |r| some.iter().map(|q| (self.brute)(&list, q, r)).sum::<usize>();
                        assert_eq!(all(*radius), self.count(&tree, &some, *radius), "{}", self.name);
                        // For as many queries as the others, so that times compare.
                        let times = (queries.len() / BRUTE_QUERIES) as u32;
                        bencher.iter_custom(|iterations| {
                            let start = Instant::now();
                            for _ in 0..iterations {
                                black_box(all(black_box(*radius)));
                            }
                            start.elapsed() * times
                        });
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
///
/// # Panics
/// If there are more hits at any radius.
fn radius_for(hits: f64, count: impl Fn(f32) -> usize) -> f32 {
    let (mut low, mut high) = (1e-8_f32, 2.0_f32);
    for _ in 0..20 {
        let middle = (low * high).sqrt();
        if count(middle) as f64 > hits * TRIALS as f64 {
            high = middle;
        } else {
            low = middle;
        }
    }
    assert!(low > 1e-8, "more than {hits} hits at any radius");
    high
}

/// The least that a visitor does: it uses the payload.
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
        others: vec![
            ("kiddo", |points, radius| {
                let tree = KdTree::build(&points.iter().map(|(p, _)| p.to_array()).collect::<Vec<_>>());
                Box::new(move |centre| {
                    let mut count = 0;
                    tree.in_ball(*centre, radius, |payload, _| visited(&mut count, payload));
                    count
                })
            }),
            ("grid", |points, radius| {
                let grid = PointGrid::build(points, radius);
                Box::new(move |centre| {
                    let mut count = 0;
                    grid.in_ball(*centre, radius, |payload, _| visited(&mut count, payload));
                    count
                })
            }),
        ],
    };
    question.bench(criterion);
}

fn is_around(ray: &Ray, point: Vec3, radius: f32) -> bool {
    let offset = point - ray.origin;
    let t = offset.dot(ray.direction);
    let across = offset - t * ray.direction;
    across.length_squared() < radius * radius && t >= ray.t_min && t < ray.t_max
}

/// Points around a ray: PB2D.
fn ray(criterion: &mut Criterion) {
    let question = Question {
        name: "ray",
        elements: points,
        build: PointTree::build,
        queries: rays::<1024>,
        tree: |tree, ray, radius| {
            let mut count = 0;
            tree.around_ray(ray, radius, |payload, _, _| visited(&mut count, payload));
            count
        },
        brute: |points, ray, radius| points.iter().filter(|(p, _)| is_around(ray, *p, radius)).count(),
        others: vec![
            ("bvh2", |points, radius| {
                let tree = Binary::build(points, radius, |(p, _)| (*p, *p));
                Box::new(move |ray| {
                    let mut count = 0;
                    tree.candidates(ray, |i| count += usize::from(is_around(ray, points[i].0, radius)));
                    count
                })
            }),
            ("cwbvh", |points, radius| {
                let tree = Wide::build(points, radius, |(p, _)| (*p, *p));
                Box::new(move |ray| {
                    let mut count = 0;
                    tree.candidates(ray, |i| count += usize::from(is_around(ray, points[i].0, radius)));
                    count
                })
            }),
        ],
    };
    question.bench(criterion);
}

fn ends(segment: &Segment) -> (Vec3, Vec3) {
    let (a, b) = (segment.at(segment.start), segment.at(segment.end));
    (a.min(b), a.max(b))
}

/// The tree of beams, with the splits that the renderer chooses for thin kernels.
fn beam_tree(segments: Vec<(Segment, u32)>) -> SegmentTree {
    let split = SplitParams::choose(&segments, 1e-3);
    SegmentTree::build(segments, split)
}

fn beam_grid(segments: &[(Segment, u32)], radius: f32, resolution: f32) -> Box<dyn Fn(&Ray) -> usize + '_> {
    let grid = BeamGrid::build(segments, radius, resolution);
    Box::new(move |ray| {
        let mut count = 0;
        grid.around_ray(segments, ray, radius, |payload, _| visited(&mut count, payload));
        count
    })
}

/// Segments around a ray: BB1D.
fn beam(criterion: &mut Criterion) {
    let question = Question {
        name: "beam",
        elements: segments,
        build: beam_tree,
        queries: rays::<256>,
        tree: |tree, ray, radius| {
            let mut count = 0;
            tree.around_ray(ray, radius, |payload, _| visited(&mut count, payload));
            count
        },
        brute: |segments, ray, radius| {
            segments.iter().filter(|(s, _)| closest_approach(ray, s, radius).is_some()).count()
        },
        others: vec![
            ("whole-bvh2", |segments, radius| {
                let tree = Binary::build(segments, radius, |(s, _)| ends(s));
                Box::new(move |ray| {
                    let mut count = 0;
                    tree.candidates(ray, |i| {
                        count += usize::from(closest_approach(ray, &segments[i].0, radius).is_some());
                    });
                    count
                })
            }),
            ("whole-tree", |segments, radius| {
                let tree = SegmentTree::build(segments.to_vec(), SplitParams::WHOLE);
                Box::new(move |ray| {
                    let mut count = 0;
                    tree.around_ray(ray, radius, |payload, _| visited(&mut count, payload));
                    count
                })
            }),
            ("grid32", |segments, radius| beam_grid(segments, radius, 32.0)),
            ("grid64", |segments, radius| beam_grid(segments, radius, 64.0)),
            ("grid128", |segments, radius| beam_grid(segments, radius, 128.0)),
        ],
    };
    question.bench(criterion);
}

fn build(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build");
    for (elements, size) in ELEMENTS {
        group.throughput(Throughput::Elements(elements as u64));
        for spread in Spread::BUILT {
            let list = LazyCell::new(|| points(elements, spread));
            let id = |name: &str| BenchmarkId::new(format!("{name}/{size}"), spread.name());
            group.bench_function(id("points/tree"), |bencher| {
                bencher.iter_batched(|| list.clone(), PointTree::build, BatchSize::PerIteration);
            });
            // The others degenerate, in time or in depth.
            if !matches!(spread, Spread::Coincident) {
                let bare = LazyCell::new(|| list.iter().map(|(p, _)| p.to_array()).collect::<Vec<_>>());
                group.bench_function(id("points/kiddo"), |bencher| bencher.iter(|| KdTree::build(&bare)));
                group.bench_function(id("points/bvh2"), |bencher| {
                    bencher.iter(|| Binary::build(&list, 1e-3, |(p, _)| (*p, *p)));
                });
            }
            let list = LazyCell::new(|| segments(elements, spread));
            group.bench_function(id("segments/tree"), |bencher| {
                bencher.iter_batched(|| list.clone(), beam_tree, BatchSize::PerIteration);
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
